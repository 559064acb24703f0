"""Forces of fingertips that hold a part: in their friction cones, in balance with its weight."""

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.scenario.drafting.vectors import tangents

# Sides of the pyramid that stands for a friction cone, inscribed in it.
_SIDES = 8
# Least share of each contact in all normal forces, relative to an even one.
_LEAST = 0.15
# Bisections of the coefficient of friction, and a residual that is none, as a part of all forces.
_HALVINGS, _BALANCED = 9, 1e-7


def least_friction(
    points: Array, normals: Array, wrench: Array, total: float, most: float
) -> tuple[float, Array] | None:
    """Return the least coefficient of friction that holds a part, and the forces (k, 3) [N] on it.

    At `points` (k, 3) [m] pushes act against the outward unit `normals` (k, 3), `total` [N] in all,
    each at least a part of an even share. They balance `wrench` (6,): what else acts on the part,
    force [N] and torque [N m] about the points' origin. None where `most` is not enough: force
    closure with pyramids inside the friction cones (Murray, Li, Sastry, A Mathematical Introduction
    to Robotic Manipulation, 1994, chapter 5).
    """
    forces = _forces(points, normals, wrench, total, most)
    if forces is None:
        return None
    low, high = 0.0, most
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        found = _forces(points, normals, wrench, total, middle)
        if found is None:
            low = middle
        else:
            high, forces = middle, found
    return high, forces


def _forces(points: Array, normals: Array, wrench: Array, total: float, mu: float) -> Array | None:
    """Return forces (k, 3) in the pyramids of `mu` that balance `wrench`; None if none do."""
    from scipy.optimize import nnls

    count = len(points)
    angles = 2 * np.pi * np.arange(_SIDES) / _SIDES
    edges = np.empty((count, _SIDES, 3))
    for k, normal in enumerate(normals):
        first, second = tangents(normal, np.zeros(3))
        edges[k] = -normal + mu * (
            np.outer(np.cos(angles), first) + np.outer(np.sin(angles), second)
        )
    middle = points.mean(axis=0)
    size = max(float(np.linalg.norm(points - middle, axis=1).max()), 1e-9)
    torques = np.cross((points - middle)[:, None], edges) / size
    wrenches = np.concatenate([edges, torques], axis=2).reshape(-1, 6).T
    # All normal forces are the total; each is its least share and more, by one more unknown.
    each = np.kron(np.eye(count), np.ones(_SIDES))
    matrix = np.block(
        [
            [wrenches, np.zeros((6, count))],
            [np.ones(count * _SIDES), np.zeros(count)],
            [each, -np.eye(count)],
        ]
    )
    about = wrench[3:] - np.cross(middle, wrench[:3])
    least = np.full(count, _LEAST * total / count)
    goal = np.concatenate([-wrench[:3], -about / size, [total], least])
    shares, residual = nnls(matrix, goal)
    if residual > _BALANCED * max(total, float(np.linalg.norm(wrench[:3]))):
        return None
    shares = shares[: count * _SIDES].reshape(count, _SIDES, 1)
    return np.asarray((shares * edges).sum(axis=1))
