"""Contact pairs from the collision pairs of a Pinocchio geometry model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import coal
import pinocchio as pin

from sphshell_pin.base.checks import check_type
from sphshell_pin.contact import Friction, NormalLaw, Sphere
from sphshell_pin.dynamics.scene.models import find_frame, frame_on_joint
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.shell import Shell

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene.scene import Scene


def add_pairs(
    scene: Scene,
    geometry_model: pin.GeometryModel,
    law: NormalLaw | None,
    friction: Friction | None,
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
