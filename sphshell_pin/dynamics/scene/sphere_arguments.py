"""Arguments of Scene.add_contact and add_contacts: spheres or a plane, and what they touch."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import coal
import pinocchio as pin

from sphshell_pin.base.checks import check_name, check_placement, check_type
from sphshell_pin.contact import FoundationLaw, Friction, NormalLaw, Plane, Sphere
from sphshell_pin.dynamics.scene.models import find_frame, frame_on_joint, unit_warning
from sphshell_pin.dynamics.scene.pairs import ContactPair
from sphshell_pin.dynamics.scene.sides import PlaneSide, ShellSide, Side, SphereSide
from sphshell_pin.errors import InvalidParameter, SetupWarning, UnitWarning
from sphshell_pin.shell import Shell

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene.scene import Scene


def add_pairs(
    scene: Scene, geometry_model: pin.GeometryModel, law: NormalLaw, friction: Friction | None
) -> None:
    """Add a contact to `scene` for every collision pair of a sphere and something else."""
    check_type(
        "geometry_model", geometry_model, pin.GeometryModel, "must be a pinocchio.GeometryModel"
    )
    objects = geometry_model.geometryObjects
    shells: dict[int, Shell] = {}
    for pair in geometry_model.collisionPairs:
        first, second = pair.first, pair.second
        if not isinstance(objects[first].geometry, coal.Sphere):
            first, second = second, first
        ball, other = objects[first], objects[second]
        if not isinstance(ball.geometry, coal.Sphere):
            continue
        sphere, name = _sphere_of(scene.model, ball), f"{ball.name}-{other.name}"
        if isinstance(other.geometry, coal.Sphere):
            scene.add_contact(
                sphere, _sphere_of(scene.model, other), law=law, friction=friction, name=name
            )
            continue
        if second not in shells:
            shells[second] = Shell.from_geometry(other)
        frame_j, on_j = _frame_of(scene.model, other.parentJoint)
        scene.add_contact(
            sphere=sphere,
            shell=shells[second],
            frame=frame_j,
            placement=on_j.actInv(other.placement),
            law=law,
            friction=friction,
            name=name,
        )
    if not scene.pairs:
        raise InvalidParameter(
            "geometry_model",
            f"{len(geometry_model.collisionPairs)} collision pairs",
            "must have at least one pair of a sphere and another shape (addCollisionPair)",
        )


def _sphere_of(model: pin.Model, ball: pin.GeometryObject) -> Sphere:
    frame, on_joint = _frame_of(model, ball.parentJoint)
    x, y, z = on_joint.actInv(ball.placement.translation).tolist()
    return Sphere(ball.geometry.radius, frame, (x, y, z))


def _frame_of(model: pin.Model, joint: int) -> tuple[str, pin.SE3]:
    """Return the name of a frame on `joint`, and its placement in the joint."""
    name = frame_on_joint(model, joint)
    if name is None:
        raise InvalidParameter(
            "model", model.names[joint], "is a joint without a frame: call model.addJointFrame"
        )
    return name, pin.SE3(model.frames[find_frame(model, name)].placement)


# Returns the joint of a frame and its placement there, by the name of the frame.
Locate = Callable[[str], tuple[int, pin.SE3]]


def sides_of(
    locate: Locate,
    sphere: Sphere | Plane,
    shell: Shell | Sphere,
    frame: str,
    placement: pin.SE3 | None,
    method: str | None,
) -> tuple[Side, Side]:
    """Check the arguments of Scene.add_contact; return the sides of the pair."""
    if isinstance(sphere, Plane):
        check_type("shell", shell, Shell, "must be a Shell beside a Plane (of a ball: a sphere)")
        side_i: Side = PlaneSide(sphere.frame, *locate(sphere.frame), sphere)
    else:
        check_type("sphere", sphere, Sphere, "must be a Sphere(radius, frame) or a Plane(frame)")
        side_i = SphereSide(sphere.frame, *locate(sphere.frame), sphere)
    if isinstance(shell, Sphere):
        why = "must not be given where shell is a Sphere"
        if frame != "universe":
            raise InvalidParameter("frame", frame, f"{why}: that names its own frame")
        if placement is not None:
            raise InvalidParameter("placement", placement, f"{why}: that has its own offset")
        if method is not None:
            raise InvalidParameter("method", method, f"{why}: their contact has a closed form")
        return side_i, SphereSide(shell.frame, *locate(shell.frame), shell)
    check_type("shell", shell, Shell, "must be a Shell (of a file: Shell.from_file) or a Sphere")
    placement, method = check_placement("placement", placement), method or "smooth"
    return side_i, ShellSide(frame, *locate(frame), shell, placement, method)


def default_group(shell: Shell | Sphere) -> str:
    """Return what the contacts of several spheres with `shell` are called."""
    return shell.frame if isinstance(shell, Sphere) else shell.name


def named(spheres: Iterable[Sphere], name: str) -> Iterator[tuple[Sphere, str]]:
    """Yield each of `spheres`, which are one at least, with the name of its pair."""
    check_name("name", name)
    wanted = "must be spheres, one at least: Sphere(radius, frame)"
    if isinstance(spheres, Sphere) or not isinstance(spheres, Iterable):
        raise InvalidParameter("spheres", spheres, wanted)
    every = list(spheres)
    for k, one in enumerate(every):
        check_type(f"spheres[{k}]", one, Sphere, "must be a Sphere(radius, frame)")
    if not every:
        raise InvalidParameter("spheres", every, wanted)
    counts = Counter(one.frame for one in every)
    seen: Counter[str] = Counter()
    for one in every:
        called = f"{name}/{one.frame}"
        yield one, called if counts[one.frame] == 1 else f"{called}-{seen[one.frame]}"
        seen[one.frame] += 1


def corner_warning(pair: ContactPair) -> str | None:
    """Say so where a flat face may lie on a plane, with a law that acts at its lowest corner."""
    if not isinstance(pair.side_i, PlaneSide) or isinstance(pair.law, FoundationLaw):
        return None
    shell = pair.shells[0].shell
    if not shell.core_for("smooth").has_other_flats:
        return None
    return (
        f"contact '{pair.name}': shell '{shell.name}' has a flat face with a notch or rounded "
        f"borders, which with {type(pair.law).__name__} stands on one point at a time and rattles: "
        "take a FoundationLaw, for which the face is one contact"
    )


def warn_of_size(model: pin.Model, pair: ContactPair) -> None:
    """Warn of a suspiciously large sphere or shell, and of faces that stand on corners."""
    corners = corner_warning(pair)
    if corners:
        warnings.warn(corners, SetupWarning, stacklevel=3)
    for on_sphere, on_shell in pair.sphere_on_shell:
        shell = on_shell.shell
        if suspicion := unit_warning(model, on_sphere.radius, shell.size):
            text = f"contact '{pair.name}', shell '{shell.name}': {suspicion}"
            warnings.warn(text, UnitWarning, stacklevel=3)
