"""Recorded patches as seen from a body: from its shell, or from its sphere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array, Longs, Mask
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.scene.scene import Scene


def pressure(u: Array) -> Array:
    """Pressure over the peak (...) at the places u (..., 2)."""
    return np.asarray(np.sqrt(np.maximum(0.0, 1.0 - (u * u).sum(axis=-1))))


def load_in_polygons(corners: Array) -> Array:
    """Share of the load within polygons (..., k, 2), positive where they turn counterclockwise.

    Exact: with F(rho) the load within rho, the sum over the sides of the integral of
    (F / 2 pi) d(theta), by Green's theorem. A side that two polygons share counts in both with
    opposite signs, so that the loads of a grid add up to that of its outline.
    """
    after = np.roll(corners, -1, axis=-2)
    side = after - corners
    length = np.linalg.norm(side, axis=-1)
    along = side / np.where(length > 0.0, length, 1.0)[..., None]
    # The side is x = d n + t e with the signed distance d of its line and t from `t0` to `t1`.
    distance = corners[..., 0] * along[..., 1] - corners[..., 1] * along[..., 0]
    sign, d = np.where(distance < 0.0, -1.0, 1.0), np.abs(distance)
    t0 = (corners * along).sum(axis=-1)
    t1 = t0 + length
    # Outside the disc F is all of the load; inside it lacks (1 - rho^2)^(3/2) of it.
    turned = np.arctan2(t1, d) - np.arctan2(t0, d)
    half = np.sqrt(np.maximum(0.0, 1.0 - d * d))
    lacking = _lacking(np.clip(t1, -half, half), d, half) - _lacking(
        np.clip(t0, -half, half), d, half
    )
    return np.asarray((sign * (turned - np.where(half > 0.0, lacking, 0.0))).sum(axis=-1)) / (
        2.0 * np.pi
    )


def _lacking(t: Array, d: Array, half: Array) -> Array:
    """Integral from 0 to t of d (1 - rho^2)^(3/2) / rho^2, rho^2 = d^2 + t^2."""
    root = np.sqrt(np.maximum(0.0, half * half - t * t))
    angle = np.arcsin(np.clip(t / np.where(half > 0.0, half, 1.0), -1.0, 1.0))
    return np.asarray(
        np.arctan2(t, d * root) - d * angle - 0.5 * d * (t * root + half * half * angle)
    )


@dataclass(frozen=True)
class PlacedPatches:
    """Patches of k contacts in the frame of a body, in the order of the result's rows.

    `row`, `pair`, `contact_id` (k,) as in the contact log; `points`, `normals` (from the shell to
    the sphere) and `axes` (of the larger half axis) (k, 3); `half_axes` (k, 2) [m]; `force`, the
    normal force (k,) [N], negative at a saddle; `slip` (k,) [m/s]; `element` (k,) of the shell.
    """

    row: Longs
    pair: Longs
    contact_id: Longs
    points: Array
    normals: Array
    axes: Array
    half_axes: Array
    force: Array
    slip: Array
    element: Longs

    def select(self, chosen: Longs | Mask) -> PlacedPatches:
        """Return those that `chosen`, a mask or indices, picks."""
        return PlacedPatches(*(getattr(self, f.name)[chosen] for f in fields(self)))


def patches_on(
    result: Result, scene: Scene, pairs: Sequence[int], joint: int, placement: pin.SE3
) -> PlacedPatches:
    """Return the patches of `pairs` in the frame at `placement` in a joint.

    Contacts whose geometry is unknown are left out. Raises ResultError without patches.
    """
    log, patches = result.contacts, result.patches
    known = (patches["half_axes"][:, 1] > 0.0) & np.isfinite(log.point_world).all(axis=1)
    chosen = np.flatnonzero(np.isin(log.pair, pairs) & known)
    row = np.asarray(log.row[chosen], dtype=np.int64)
    rotations, origins = poses_along(result, scene, row, joint, placement)

    def turned(vectors: Array) -> Array:
        return np.asarray(np.einsum("kij,ki->kj", rotations, vectors))

    return PlacedPatches(
        row,
        np.asarray(log.pair[chosen], dtype=np.int64),
        np.asarray(log.contact_id[chosen], dtype=np.int64),
        turned(log.point_world[chosen] - origins),
        turned(log.normal_world[chosen]),
        turned(patches["axis_world"][chosen]),
        np.asarray(patches["half_axes"][chosen]),
        np.asarray(log.normal_force[chosen]),
        np.linalg.norm(log.slip_velocity_world[chosen], axis=1),
        np.asarray(log.element[chosen], dtype=np.int64),
    )


def poses_along(
    result: Result, scene: Scene, rows: Longs, joint: int, placement: pin.SE3
) -> tuple[Array, Array]:
    """Return rotations (k, 3, 3) and origins (k, 3) [m] of a frame in a joint at ascending rows."""
    model, data = scene.model, scene.model.createData()
    rotations, origins = np.empty((len(rows), 3, 3)), np.empty((len(rows), 3))
    pose: pin.SE3 | None = None
    for k, at in enumerate(rows):
        if pose is None or (joint != 0 and at != rows[k - 1]):
            pin.forwardKinematics(model, data, np.asarray(result.q[at], dtype=float))
            pose = data.oMi[joint] * placement
        rotations[k], origins[k] = pose.rotation, pose.translation
    return rotations, origins
