"""Contact pairs from the collision pairs of a Pinocchio geometry model."""

from __future__ import annotations

import coal
import pinocchio as pin

from sphshell_pin.contact import CoulombFriction, NormalLaw, Sphere
from sphshell_pin.dynamics.scene import Scene
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.shell import Shell


def add_pairs(
    scene: Scene,
    geometry_model: pin.GeometryModel,
    law: NormalLaw | None,
    friction: CoulombFriction | None,
) -> None:
    """Add a contact to `scene` for every collision pair of a sphere and something else."""
    objects = geometry_model.geometryObjects
    shells: dict[int, Shell] = {}
    for pair in geometry_model.collisionPairs:
        first, second = pair.first, pair.second
        if not isinstance(objects[first].geometry, coal.Sphere):
            first, second = second, first
        ball, other = objects[first], objects[second]
        if not isinstance(ball.geometry, coal.Sphere) or isinstance(other.geometry, coal.Sphere):
            continue
        if second not in shells:
            shells[second] = Shell.from_geometry(other)
        joint_i = scene.model.names[ball.parentJoint]
        # Geometry is placed in the joint's frame; the joint's own frame carries the joint's name.
        scene.add_contact(
            sphere=Sphere(ball.geometry.radius, joint_i, tuple(ball.placement.translation)),
            shell=shells[second],
            frame=scene.model.names[other.parentJoint],
            placement=other.placement,
            law=law,
            friction=friction,
            name=f"{ball.name}-{other.name}",
        )
    if not scene.pairs:
        raise InvalidParameter(
            "geometry_model",
            f"{len(geometry_model.collisionPairs)} collision pairs",
            "must have at least one pair of a sphere and another shape (addCollisionPair)",
        )
