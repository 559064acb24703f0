"""Sample points on a shell, fine where contacts passed, and how to find those near a place."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.errors import InvalidParameter

if TYPE_CHECKING:
    from sphshell_pin.shell.shell import Shell

Array = NDArray[np.float64]
Longs = NDArray[np.int64]

_MOST_SAMPLES = 3_000_000
_BLOCK = 4_000_000  # distances at once


@dataclass(frozen=True)
class Samples:
    """Small triangles of a shell: `corners` (k, 3, 3) [m] on the surface that spheres touch.

    `triangle` (k,) is the shell's triangle of each; `points` (k, 3) [m] are their middles,
    `normals` (k, 3), `areas` (k,) [m^2].
    """

    corners: Array
    triangle: Longs
    points: Array = field(init=False)
    normals: Array = field(init=False)
    areas: Array = field(init=False)

    def __post_init__(self) -> None:
        """Compute the middles, normals and areas."""
        c = self.corners
        cross = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
        size = np.linalg.norm(cross, axis=1)
        object.__setattr__(self, "points", c.mean(axis=1))
        object.__setattr__(self, "normals", cross / np.maximum(size, 1e-300)[:, None])
        object.__setattr__(self, "areas", 0.5 * size)


def divide(shell: Shell, places: Array, reach: float, resolution: float, curved: bool) -> Samples:
    """Divide the triangles of `shell` that are within `reach` [m] of `places` (n, 3) [m].

    Each is halved at its longest side until no side is longer than `resolution` [m]; `curved`: on
    the elements of the method "smooth". Raises InvalidParameter for a resolution that needs too
    many.
    """
    surface = _Surface(shell, curved)
    grid = Grid(places, 2.0 * reach)
    coarse = places[np.unique(grid.order_of_cells, return_index=True)[1]]
    owner = np.arange(len(shell.triangles))
    weights = np.tile(np.eye(3), (len(owner), 1, 1))
    done_owner, done_corners = [owner[:0]], [np.zeros((0, 3, 3))]
    while len(owner):
        corners = surface.at(owner, weights)
        # A curved triangle may leave the box of its corners by as much as its parent does the flat.
        middle = corners.mean(axis=1)
        around = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1) + surface.bulge
        near = np.empty(len(owner), dtype=bool)
        small = around <= reach
        near[small] = grid.has_neighbors(middle[small])
        large = np.flatnonzero(~small)
        each = max(1, _BLOCK // max(1, len(coarse)))
        for first in range(0, len(large), each):
            some = large[first : first + each]
            apart = np.linalg.norm(middle[some, None] - coarse[None], axis=2)
            # A place is within the diagonal of its cell of the one that stands for it.
            near[some] = apart.min(axis=1) <= around[some] + (1.0 + 2.0 * np.sqrt(3.0)) * reach
        owner, weights, corners = owner[near], weights[near], corners[near]
        sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        fine = sides.max(axis=1) <= resolution
        done_owner.append(owner[fine])
        done_corners.append(corners[fine])
        owner, weights = _halved(owner[~fine], weights[~fine], sides[~fine])
        if len(owner) + sum(map(len, done_owner)) > _MOST_SAMPLES:
            raise InvalidParameter(
                "resolution",
                resolution,
                f"needs more than {_MOST_SAMPLES} triangles on shell '{shell.name}': take a "
                "larger one [m]",
            )
    return Samples(np.concatenate(done_corners), np.concatenate(done_owner))


def _halved(owner: Longs, weights: Array, sides: Array) -> tuple[Longs, Array]:
    """Halve triangles at their longest side, which is from corner k to k + 1."""
    longest = np.argmax(sides, axis=1)
    turn = (longest[:, None] + np.arange(3)) % 3
    a, b, c = np.moveaxis(np.take_along_axis(weights, turn[:, :, None], axis=1), 1, 0)
    middle = 0.5 * (a + b)
    both = np.concatenate((np.stack((a, middle, c), axis=1), np.stack((middle, b, c), axis=1)))
    return np.concatenate((owner, owner)), both


class _Surface:
    """Points of a shell's triangles at barycentric weights, flat or curved."""

    def __init__(self, shell: Shell, curved: bool) -> None:
        self._corners = np.asarray(shell.vertices, dtype=float)[np.asarray(shell.triangles)]
        self._offsets: Array | None = None
        self.bulge = 0.0
        if curved:
            offsets = np.asarray(shell.core_for("smooth").control_point_offsets)
            if offsets.any():
                self._offsets = offsets
                self.bulge = float(np.linalg.norm(offsets, axis=2).max())

    def at(self, owner: Longs, weights: Array) -> Array:
        """Return the corners (k, 3, 3) at `weights` (k, 3, 3) of the triangles `owner` (k,)."""
        points = np.einsum("kpc,kcx->kpx", weights, self._corners[owner])
        if self._offsets is not None:
            w, u, v = np.moveaxis(weights, 2, 0)
            sides = [3 * a * b * c for a, b in ((w, u), (u, v), (v, w)) for c in (a, b)]
            inner = np.stack([*sides, 6 * u * v * w], axis=2)
            points = points + np.einsum("kpb,kbx->kpx", inner, self._offsets[owner])
        return np.asarray(points)


class Grid:
    """Points (n, 3) in the cells of a cubic grid, to find those near a place."""

    def __init__(self, points: Array, size: float) -> None:
        self._size = size
        self._low = points.min(axis=0, initial=np.inf) if len(points) else np.zeros(3)
        cells = self._cell(points)
        self._count = cells.max(axis=0, initial=0) + 1
        self.order_of_cells = self._key(cells)
        self._order = np.argsort(self.order_of_cells, kind="stable")
        self._keys = self.order_of_cells[self._order]

    def _cell(self, points: Array) -> Longs:
        return np.asarray(np.floor((points - self._low) / self._size), dtype=np.int64)

    def _key(self, cells: Longs) -> Longs:
        return (
            np.asarray((cells[..., 0] * self._count[1] + cells[..., 1]) * self._count[2])
            + (cells[..., 2])
        )

    def has_neighbors(self, points: Array) -> NDArray[np.bool_]:
        """Whether there is a point in the cell of each of `points` (k, 3) or in one beside it."""
        found = np.zeros(len(points), dtype=bool)
        cells = self._cell(points)
        known = np.unique(self._keys)
        for shift in np.ndindex(3, 3, 3):
            beside = cells + np.array(shift) - 1
            inside = ((beside >= 0) & (beside < self._count)).all(axis=1)
            found[inside] |= np.isin(self._key(beside[inside]), known)
        return found

    def within(self, low: Array, high: Array) -> Longs:
        """Return the indices of the points in the cells of the box from `low` to `high` (3,)."""
        first = np.maximum(self._cell(low), 0)
        last = np.minimum(self._cell(high), self._count - 1)
        if (first > last).any():
            return np.zeros(0, dtype=np.int64)
        i, j = np.meshgrid(
            np.arange(first[0], last[0] + 1), np.arange(first[1], last[1] + 1), indexing="ij"
        )
        row = (i.ravel() * self._count[1] + j.ravel()) * self._count[2]
        begin = np.searchsorted(self._keys, row + first[2])
        end = np.searchsorted(self._keys, row + last[2], side="right")
        return np.concatenate([self._order[a:b] for a, b in zip(begin, end, strict=True)])
