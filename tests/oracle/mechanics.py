"""Forces of one contact on two rigid bodies, written with plain vectors in the world."""

from collections.abc import Callable

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Vector = NDArray[np.float64]


def point_velocity(motion: pin.Motion, point: Vector) -> Vector:
    """Velocity at `point` of a body whose spatial velocity at the world's origin is `motion`."""
    return np.asarray(motion.linear + np.cross(motion.angular, point))


def force_on_i(
    point: Vector,
    normal: Vector,
    depth: float,
    motion_i: pin.Motion,
    motion_j: pin.Motion,
    *,
    normal_force: Callable[[float, float], float],
    coefficient: Callable[[float], float] | None = None,
) -> Vector:
    """Force [N] on body i at `point`; `normal` points from j to i."""
    relative = point_velocity(motion_i, point) - point_velocity(motion_j, point)
    gap_rate = float(normal @ relative)
    size = normal_force(depth, gap_rate)
    force = size * normal
    slip = relative - gap_rate * normal
    speed = float(np.linalg.norm(slip))
    if coefficient is not None and speed > 0:
        force = force - size * coefficient(speed) * slip / speed
    return np.asarray(force)


def world_motion(model: pin.Model, data: pin.Data, joint: int) -> pin.Motion:
    """Spatial velocity of `joint`'s body, world axes, at the world's origin."""
    if joint == 0:
        return pin.Motion.Zero()
    return data.oMi[joint].act(data.v[joint])


def total_momentum(model: pin.Model, q: Vector, v: Vector) -> pin.Force:
    """Linear and angular momentum of the whole system about the world's origin."""
    data = model.createData()
    pin.forwardKinematics(model, data, q, v)
    total = pin.Force.Zero()
    for joint in range(1, model.njoints):
        total += data.oMi[joint].act(model.inertias[joint] * data.v[joint])
    return total
