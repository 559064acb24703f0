"""Where on its shell each pair touched, from a Result's contact log: for trails and figures."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from sphshell_pin.base.arrays import Array, Longs
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_parts import ContactLog, Patches
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.patches.placed import poses_along

LARGEST = 1e15  # beyond this, [m] or [N], nothing can be drawn


@dataclass(frozen=True, repr=False)
class ContactRows(ContactLog):
    """A contact log that can be drawn, ordered by row.

    `patches` (m,) are those of the contacts, None where they were not recorded.
    """

    patches: Patches | None = None

    @classmethod
    def of(cls, log: ContactLog, patches: Patches | None = None) -> ContactRows:
        """Take a Result's contact log, and its patches.

        The end of a run that diverged may hold numbers no picture can show: they are left out.
        """
        rows = cls(**{f.name: getattr(log, f.name) for f in fields(log)}, patches=patches)
        rows = rows.select(np.argsort(rows.row, kind="stable"))
        sound = np.abs(rows.normal_force) < LARGEST
        for vector in (rows.point_world, rows.normal_world, rows.friction_force_world):
            sound &= (np.abs(vector) < LARGEST).all(axis=1)
        return rows if sound.all() else rows.select(sound)

    def at(self, row: int) -> ContactRows:
        """Return the contacts of the recorded `row`."""
        return self.select(slice(*np.searchsorted(self.row, (row, row + 1))))


@dataclass(frozen=True)
class ContactPath:
    """The path of a pair's contact: `points` and `normals` (k, 3) [m] at recorded rows `row` (k,).

    They are in the shell's frame if `on_shell`, else in the world; `force` (k,) is the normal force
    [N]. `runs` are index arrays into them: within a run the contact neither ended nor jumped.
    """

    pair: int
    on_shell: bool
    row: Longs
    points: Array
    normals: Array
    force: Array
    runs: tuple[Longs, ...]


def contact_paths(result: Result, scene: Scene | None) -> list[ContactPath]:
    """Return the path of each pair that ever touched.

    Without `scene`, and for pairs without a shell, it is the path in the world. Of several contacts
    at one instant the hardest one marks the path.
    """
    contacts = ContactRows.of(result.contacts)
    paths = []
    for index in np.unique(contacts.pair):
        own = contacts.select(contacts.pair == index)
        order = np.lexsort((-own.normal_force, own.row))
        own = own.select(order[np.unique(own.row[order], return_index=True)[1]])
        pair = None if scene is None else scene.pairs[index]
        points, normals = own.point_world, own.normal_world
        on_shell = pair is not None and bool(pair.shells)
        if scene is not None and pair is not None and on_shell:
            turn, origin = poses_along(result, scene, own.row, pair.joint_j, pair.placement_j)
            points = np.einsum("kij,ki->kj", turn, points - origin)
            normals = np.einsum("kij,ki->kj", turn, normals)
        jump = np.zeros(max(0, len(points) - 1), dtype=bool)
        if pair is not None and pair.spheres:
            steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
            jump = steps > 0.5 * pair.spheres[0].radius
        breaks = np.flatnonzero((np.diff(own.row) > 1) | jump) + 1
        runs = tuple(np.split(np.arange(len(points)), breaks))
        paths.append(
            ContactPath(int(index), on_shell, own.row, points, normals, own.normal_force, runs)
        )
    return paths


def spaced(points: Array, step: float) -> Longs:
    """Return indices into `points` (k, 3) that thin them to one or two per `step` [m] of length."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate(([0.0], np.cumsum(steps)))
    first = np.unique(np.floor(along / step), return_index=True)[1]
    return np.unique(np.append(first, len(points) - 1)).astype(np.int64)
