"""Pressure of an elastic foundation: where the patch is no ellipse, but the overlap."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.arrays import Array
from sphshell_pin.patches.placed import Longs, PlacedPatches, patches_on, poses_along
from sphshell_pin.patches.sampling import Grid, divide

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.pairs import ContactPair
    from sphshell_pin.dynamics.scene.scene import Scene

_STEP = 0.2  # of a stroke: between two places at which the pressure is taken, over a half axis


def has_foundation(pair: ContactPair) -> bool:
    """Whether the pressure is that of an elastic foundation on a shell."""
    return pair.law.kind == "foundation" and pair.shell is not None and pair.sphere is not None


def foundation_loads(
    result: Result, scene: Scene, index: int, resolution: float
) -> Iterator[tuple[int, float, Array, Longs, Array]]:
    """Yield of each contact of pair `index` where it presses on the shell, and how hard.

    They are its row, its normal force [N], points (n, 3) in the shell's frame, the shell's triangle
    (n,) of each, and loads (n,) [N] that add up to the force: those on pieces of the shell no
    longer than `resolution` [m], or than an eighth of a half axis. There are none where the overlap
    is smaller than a piece. Damping is shared out as the elastic pressure is.
    """
    pair = scene.pairs[index]
    shell = pair.shell
    assert shell is not None
    patches = patches_on(result, scene, [index], pair.joint_j, pair.placement_j)
    overlap = overlap_of(result, scene, patches)
    if overlap is None:
        return
    reach = 2.0 * float(patches.half_axes.max())
    fine = min(resolution, float(np.median(patches.half_axes[:, 1])) / 8.0)
    samples = divide(shell, patches.points, reach + fine, fine, curved=pair.method == "smooth")
    grid = Grid(samples.points, reach)
    part = np.asarray(shell.element_patch)[np.asarray(shell.triangle_element)[samples.triangle]]
    for k, point in enumerate(patches.points):
        near = grid.within(point - reach, point + reach)
        near = near[part[near] == shell.element_patch[patches.element[k]]]
        loads = overlap.stroke(samples.points[near], k, k, reach, 1.0, 1.0) * samples.areas[near]
        pressed = loads > 0.0
        near, loads = near[pressed], loads[pressed]
        force = float(patches.force[k])
        if len(loads):
            loads *= force / loads.sum()
        yield int(patches.row[k]), force, samples.points[near], samples.triangle[near], loads


@dataclass(frozen=True)
class Overlap:
    """Spheres that overlap a shell: `centers` (k, 3) in its frame and `radii` (k,) [m].

    `holds` (k,): whether the patch is one of an elastic foundation; the others are nan.
    """

    centers: Array
    radii: Array
    holds: NDArray[np.bool_]

    def stroke(
        self, points: Array, i: int, j: int, half: float, first: float, last: float
    ) -> Array:
        """Pressure (n,) over some scale at `points` (n, 3), averaged over a stroke from i to j.

        The power of slip changes from `first` to `last` meanwhile. At a distance rho from the
        center the pressure is that of (R^2 - rho^2) / (2 rho). `half` is a half axis [m].
        """
        begin, end, radius = self.centers[i], self.centers[j], self.radii[i]
        steps = 1 + int(np.ceil(np.linalg.norm(end - begin) / (_STEP * half)))
        out = np.zeros(len(points))
        for share in (np.arange(steps) + 0.5) / steps:
            rho = np.linalg.norm(points - (begin + share * (end - begin)), axis=1)
            rho = np.maximum(rho, 1e-6 * radius)
            overlap = np.maximum(0.0, (radius * radius - rho * rho) / (2.0 * rho))
            out += (first + share * (last - first)) * overlap
        return out / steps


def overlap_of(result: Result, scene: Scene, patches: PlacedPatches) -> Overlap | None:
    """Return the spheres of `patches`, None where none of them is of an elastic foundation."""
    foundations = [k for k in np.unique(patches.pair).tolist() if has_foundation(scene.pairs[k])]
    if not foundations:
        return None
    centers, radii = np.full((len(patches.row), 3), np.nan), np.zeros(len(patches.row))
    for k in foundations:
        pair, own = scene.pairs[k], patches.pair == k
        rows = patches.row[own]
        turns, origins = poses_along(result, scene, rows, pair.joint_j, pair.placement_j)
        places = poses_along(result, scene, rows, pair.joint_i, pair.placement_i)[1]
        centers[own] = np.einsum("kij,ki->kj", turns, places - origins)
        radii[own] = pair.least_radius
    return Overlap(centers, radii, np.isin(patches.pair, foundations))
