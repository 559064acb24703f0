"""Sample points on a shell, fine where contacts passed, and how to find those near a place."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.arrays import Array
from sphshell_pin.errors import InvalidParameter

if TYPE_CHECKING:
    from sphshell_pin.shell.shell import Shell

Longs = NDArray[np.int64]

_MOST_SAMPLES = 3_000_000
_BLOCK = 4_000_000  # distances at once
_SMALL = 0.25  # size of a triangle that counts as a point, over the reach


@dataclass(frozen=True)
class Samples:
    """Small pieces of a shell: `corners` (k, 4, 3) [m] on the surface that spheres touch.

    `triangle` (k,) is the shell's triangle of each; `points` (k, 3) [m] are their centers,
    `normals` (k, 3), `areas` (k,) [m^2]. Of three-sided ones two corners are the same.
    """

    corners: Array
    triangle: Longs
    points: Array = field(init=False)
    normals: Array = field(init=False)
    areas: Array = field(init=False)

    def __post_init__(self) -> None:
        """Compute the centers, normals and areas: of the two triangles of each."""
        corners = self.corners
        halves = np.stack([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]], axis=1)
        cross = np.cross(
            halves[:, :, 1] - halves[:, :, 0], halves[:, :, 2] - halves[:, :, 0], axis=2
        )
        areas = 0.5 * np.linalg.norm(cross, axis=2)
        whole = np.maximum(areas.sum(axis=1), 1e-300)
        normals = cross.sum(axis=1)
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        points = np.einsum("kt,ktx->kx", areas / whole[:, None], halves.mean(axis=2))
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "normals", normals)
        object.__setattr__(self, "areas", areas.sum(axis=1))


def divide(shell: Shell, places: Array, reach: float, resolution: float, curved: bool) -> Samples:
    """Divide the triangles of `shell` that are within `reach` [m] of `places` (n, 3) [m].

    Each is halved across its longer pair of opposite sides until no side is longer than
    `resolution` [m], a triangle as a piece of which one side is a point; so long slivers become
    short ones. `curved`: on the elements of the method "smooth".

    Raises InvalidParameter for a resolution that needs too many pieces.
    """
    surface = _Surface(shell, curved)
    # Of strokes that leave the shell only what is near it counts, with the cells of the grid there.
    beyond = 3.0 * reach + surface.bulge
    places = places[((places >= shell.box[0] - beyond) & (places <= shell.box[1] + beyond)).all(1)]
    if not len(places):
        return Samples(np.zeros((0, 4, 3)), np.zeros(0, dtype=np.int64))
    around_places = _Around(places, reach)
    coarse = around_places.coarse
    owner = np.arange(len(shell.triangles))
    weights = np.eye(3)[surface.as_pieces()]
    done_owner, done_corners = [owner[:0]], [np.zeros((0, 4, 3))]
    while len(owner):
        corners = surface.at(owner, weights)
        # A curved triangle may leave the box of its corners by as much as its parent does the flat.
        middle = corners.mean(axis=1)
        around = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1) + surface.bulge
        near = np.empty(len(owner), dtype=bool)
        small = around <= _SMALL * reach
        near[small] = around_places.holds(middle[small])
        large = np.flatnonzero(~small)
        each = max(1, _BLOCK // max(1, len(coarse)))
        for first in range(0, len(large), each):
            some = large[first : first + each]
            apart = np.linalg.norm(middle[some, None] - coarse[None], axis=2)
            # A place is within the diagonal of its cell of the one that stands for it.
            near[some] = apart.min(axis=1) <= around[some] + (1.0 + 0.5 * np.sqrt(3.0)) * reach
        owner, weights, corners = owner[near], weights[near], corners[near]
        sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        pairs = np.maximum(sides[:, :2], sides[:, 2:])
        fine = pairs.max(axis=1) <= resolution
        done_owner.append(owner[fine])
        done_corners.append(corners[fine])
        owner, weights = _halved(owner[~fine], weights[~fine], np.argmax(pairs[~fine], axis=1))
        # How many there will be, once they are small beside what they are cut from.
        least = pairs[~fine].prod(axis=1).sum() / resolution**2 if small.all() else len(owner)
        if least + sum(map(len, done_owner)) > _MOST_SAMPLES:
            raise InvalidParameter(
                "resolution",
                resolution,
                f"needs more than {_MOST_SAMPLES} pieces of shell '{shell.name}': take a "
                "larger one [m]",
            )
    return Samples(np.concatenate(done_corners), np.concatenate(done_owner))


def _halved(owner: Longs, weights: Array, longer: Longs) -> tuple[Longs, Array]:
    """Halve pieces across their sides `longer` (k,) and `longer` + 2; side s follows corner s."""
    turn = (longer[:, None] + np.arange(4)) % 4
    a, b, c, d = np.moveaxis(np.take_along_axis(weights, turn[:, :, None], axis=1), 1, 0)
    m, n = 0.5 * (a + b), 0.5 * (c + d)
    both = np.concatenate((np.stack((a, m, n, d), axis=1), np.stack((m, b, c, n), axis=1)))
    return np.concatenate((owner, owner)), both


class _Surface:
    """Points of a shell's triangles at barycentric weights, flat or curved."""

    def __init__(self, shell: Shell, curved: bool) -> None:
        core = shell.core_for("smooth" if curved else "facets")
        self._corners = np.asarray(core.vertices, dtype=float)[np.asarray(core.triangles)]
        self._offsets: Array | None = None
        self.bulge = 0.0
        if curved:
            offsets = np.asarray(core.control_point_offsets)
            if offsets.any():
                self._offsets = offsets
                self.bulge = float(np.linalg.norm(offsets, axis=2).max())

    def as_pieces(self) -> Longs:
        """Return the corners (t, 4) of the triangles as pieces.

        The one opposite the shortest side is there twice: so needles are cut across.
        """
        sides = np.linalg.norm(self._corners - np.roll(self._corners, -1, axis=1), axis=2)
        first = (np.argmin(sides, axis=1) + 2) % 3
        return np.asarray((first[:, None] + np.array([0, 0, 1, 2])) % 3, dtype=np.int64)

    def at(self, owner: Longs, weights: Array) -> Array:
        """Return the corners (k, 4, 3) at `weights` (k, 4, 3) of the triangles `owner` (k,)."""
        points = np.einsum("kpc,kcx->kpx", weights, self._corners[owner])
        if self._offsets is not None:
            w, u, v = np.moveaxis(weights, 2, 0)
            sides = [3 * a * b * c for a, b in ((w, u), (u, v), (v, w)) for c in (a, b)]
            inner = np.stack([*sides, 6 * u * v * w], axis=2)
            points = points + np.einsum("kpb,kbx->kpx", inner, self._offsets[owner])
        return np.asarray(points)


class _Around:
    """Cells of a cubic grid within `reach` [m] of points (n, 3); `coarse` has one point a cell."""

    def __init__(self, points: Array, reach: float) -> None:
        self._size = 0.5 * reach
        cells, first = np.unique(self._cell(points), axis=0, return_index=True)
        self.coarse = points[first]
        # Of two cells so far apart no two points are within the reach and a small triangle.
        shifts = np.array(list(np.ndindex(7, 7, 7))) - 3
        apart = np.maximum(np.abs(shifts) - 1, 0)
        shifts = shifts[(apart * apart).sum(axis=1) <= (2.0 * (1.0 + _SMALL)) ** 2]
        self._low = cells.min(axis=0) - 3
        self._count = cells.max(axis=0) + 4 - self._low
        keys = [np.unique(self._key(cells + shift)) for shift in shifts]
        self._keys = np.unique(np.concatenate(keys))

    def _cell(self, points: Array) -> Longs:
        return np.asarray(np.floor(points / self._size), dtype=np.int64)

    def _key(self, cells: Longs) -> Longs:
        i, j, k = np.moveaxis(cells - self._low, -1, 0)
        return np.asarray((i * self._count[1] + j) * self._count[2] + k)

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Whether each of `points` (k, 3) is in one of the cells."""
        cells = self._cell(points)
        inside = ((cells >= self._low) & (cells < self._low + self._count)).all(axis=1)
        found = np.zeros(len(points), dtype=bool)
        found[inside] = np.isin(self._key(cells[inside]), self._keys)
        return found


class Grid:
    """Points (n, 3) in the cells of a cubic grid, to find those near a place."""

    def __init__(self, points: Array, size: float) -> None:
        self._size = size
        self._low = points.min(axis=0, initial=np.inf) if len(points) else np.zeros(3)
        cells = self._cell(points)
        self._count = cells.max(axis=0, initial=0) + 1
        keys = self._key(cells)
        self._order = np.argsort(keys, kind="stable")
        self._keys = keys[self._order]

    def _cell(self, points: Array) -> Longs:
        return np.asarray(np.floor((points - self._low) / self._size), dtype=np.int64)

    def _key(self, cells: Longs) -> Longs:
        return (
            np.asarray((cells[..., 0] * self._count[1] + cells[..., 1]) * self._count[2])
            + (cells[..., 2])
        )

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
