"""The spheres, or the plane, of a contact, as a scenario states them."""

from sphshell_pin.contact import Plane, Sphere
from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import collision_spheres
from sphshell_pin.scenario.format.bodies import Assembly
from sphshell_pin.scenario.format.schema import ContactSection, PlaneSection, SphereSection


def to_sphere(section: SphereSection) -> Sphere:
    """Return the Sphere of a table."""
    x, y, z = section.offset
    return Sphere(section.radius, frame=section.frame, offset=(x, y, z))


def to_end(section: SphereSection | PlaneSection) -> Sphere | Plane:
    """Return the Sphere or the Plane of a table."""
    if isinstance(section, SphereSection):
        return to_sphere(section)
    (x, y, z), (a, b, c) = section.offset, section.normal
    return Plane(section.frame, (x, y, z), (a, b, c))


def spheres_of(contact: ContactSection, assembly: Assembly, carrier: str) -> list[Sphere]:
    """Return what the key `spheres` of a contact says, [] where it is not given.

    Of the collision geometry, spheres on the body of the frame `carrier`, which has the shell, are
    left out.

    Raises
    ------
    FrameNotFound
        The robots have no such frame.
    SphshellError
        The collision geometry of the robots, or of a frame that is named, has no spheres.
    """
    if contact.spheres is None:
        return []
    known = [
        Sphere(one.radius, prefix + one.frame, one.offset)
        for prefix, robot in zip(assembly.prefixes, assembly.loaded, strict=True)
        for one in collision_spheres(robot)
    ]
    how = "state each as { frame, radius, offset }"
    if contact.spheres == "collision":
        model = assembly.model

        def body(frame: str) -> int:
            return int(model.frames[find_frame(model, frame)].parentJoint)

        found = [one for one in known if body(one.frame) != body(carrier)]
        if not found:
            what = "no collision geometry of the robot is a sphere on another body than the shell"
            raise SphshellError(f"{what}: {how}")
        return found
    out = []
    for one in contact.spheres:
        if isinstance(one, SphereSection):
            out.append(to_sphere(one))
            continue
        find_frame(assembly.model, one)
        on_frame = [sphere for sphere in known if sphere.frame == one]
        if not on_frame:
            raise SphshellError(f"frame '{one}' has no sphere in its collision geometry: {how}")
        out += on_frame
    return out
