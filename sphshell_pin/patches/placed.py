"""Recorded patches as seen from a body: from its shell, or from its sphere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array, Longs, Mask
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.scene.scene import Scene


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
