"""Parts of a scene from their tables: what acts in joints, and the spheres of contacts."""

import math
from pathlib import Path

import pinocchio as pin

from sphshell_pin.contact import Plane, Sphere
from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.dynamics.scene.joint_components import JointComponents, JointFriction, JointLimits
from sphshell_pin.dynamics.scene.models import find_frame, find_joint, joint_of
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import collision_spheres
from sphshell_pin.scenario.format import schema
from sphshell_pin.scenario.format.bodies import Assembly, blamed_on
from sphshell_pin.scenario.format.reading import item_key


def to_sphere(section: schema.SphereSection) -> Sphere:
    """Return the Sphere of a table."""
    x, y, z = section.offset
    return Sphere(section.radius, frame=section.frame, offset=(x, y, z))


def to_end(section: schema.SphereSection | schema.PlaneSection) -> Sphere | Plane:
    """Return the Sphere or the Plane of a table."""
    if isinstance(section, schema.SphereSection):
        return to_sphere(section)
    (x, y, z), (a, b, c) = section.offset, section.normal
    return Plane(section.frame, (x, y, z), (a, b, c))


def spheres_of(contact: schema.ContactSection, assembly: Assembly, carrier: str) -> list[Sphere]:
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
        own = joint_of(assembly.model, carrier)
        found = [one for one in known if joint_of(assembly.model, one.frame) != own]
        if not found:
            what = "no collision geometry of the robot is a sphere on another body than the shell"
            raise SphshellError(f"{what}: {how}")
        return found
    out = []
    for one in contact.spheres:
        if isinstance(one, schema.SphereSection):
            out.append(to_sphere(one))
            continue
        find_frame(assembly.model, one)
        on_frame = [sphere for sphere in known if sphere.frame == one]
        if not on_frame:
            raise SphshellError(f"frame '{one}' has no sphere in its collision geometry: {how}")
        out += on_frame
    return out


def joint_components(
    scenario: schema.Scenario, assembly: Assembly, path: Path
) -> JointComponents | None:
    """Return the components of all joints of `assembly`; None where none is asked for.

    Raises ScenarioError for a joint that does not exist, or that cannot have what its table says.
    """
    if not scenario.joint and not any(robot.joints for robot in scenario.robot):
        return None
    joints = JointComponents()
    for robot, loaded, prefix in zip(
        scenario.robot, assembly.loaded, assembly.prefixes, strict=True
    ):
        own = JointComponents.from_model(loaded.model, robot.joints)
        for kind in own.kinds():
            for name, value in getattr(own, kind).items():
                joints = joints.replaced(prefix + name, **{kind: value})
    for i, section in enumerate(scenario.joint):
        with blamed_on(path, item_key("joint", scenario.joint, i)):
            find_joint(assembly.model, section.name)
            joints = _with(joints, section, assembly.model, path.parent)
    return joints


def _with(
    joints: JointComponents, section: schema.JointSection, model: pin.Model, folder: Path
) -> JointComponents:
    changes: dict[str, object] = {
        kind: value
        for kind in ("damping", "armature", "effort", "speed")
        if (value := getattr(section, kind)) is not None
    }
    if section.friction is not None:
        changes["friction"] = JointFriction(
            section.friction, section.friction_stiffness, section.friction_damping
        )
    if any(one is not None for one in (section.lower, section.upper, section.stop)):
        changes["limits"] = _limits(joints, section, model, folder)
    return joints.replaced(section.name, **changes)


def _limits(
    joints: JointComponents, section: schema.JointSection, model: pin.Model, folder: Path
) -> JointLimits:
    name = section.name
    stated = joints.limits.get(name)
    if stated is None:
        stated = JointComponents.from_model(model, ["limits"]).limits.get(name)
    law: NormalLaw | None = None if stated is None else stated.law
    if section.stop is not None:
        law = section.stop._build(folder)
    if law is None:
        raise SphshellError(
            "needs the law of its stops, `stop = { type = ... }`: the robot's file states no "
            "range, from which a default would follow"
        )
    ends = (-math.inf, math.inf) if stated is None else (stated.lower, stated.upper)
    lower = ends[0] if section.lower is None else section.lower
    upper = ends[1] if section.upper is None else section.upper
    return JointLimits(lower, upper, law)
