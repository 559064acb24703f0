"""Lists of polygons that the cleaning passes on from step to step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array, Ints, Longs, Mask
from sphshell_pin.shell.raw import RawSurface, offsets_of

FLAT_AREA = 1e-12
"""A triangle of at most this share of its longest edge squared has no area."""

EQUAL_SHAPE = 1e-9
"""Shapes (2 area / longest edge^2) nearer than this count as equal."""


@dataclass(frozen=True)
class EdgeTable:
    """Edges of polygons, in ascending order of their ends.

    Attributes
    ----------
    slot_edge : (c,) edge from each corner to the next; -1 where both are one vertex
    ends : (E, 2) vertices, the lower one first
    users : (E,) how many corners have the edge
    """

    slot_edge: Ints
    ends: Ints
    users: Ints


@dataclass(frozen=True)
class Polygons:
    """Polygons with what each came from: every step makes a new list.

    Attributes
    ----------
    offsets : (m + 1,) where the corners of each polygon start
    corners : (c,) vertex of every corner
    source : (m,) index of the polygon in the input
    normal_row : (c,) row in the table of corner normals, or None if there are none
    """

    offsets: Longs
    corners: Ints
    source: Ints
    normal_row: Longs | None

    @classmethod
    def from_raw(cls, raw: RawSurface) -> Polygons:
        """All polygons of the input."""
        rows = None if raw.normals is None else np.arange(len(raw.corners))
        return cls(raw.offsets, raw.corners, np.arange(raw.num_polygons, dtype=np.int32), rows)

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @cached_property
    def counts(self) -> Longs:
        """(m,) number of corners."""
        return np.diff(self.offsets)

    @cached_property
    def only_triangles(self) -> bool:
        """True if all have three corners: `corners` is a table of triangles then."""
        return len(self.corners) == 3 * len(self) and bool((self.counts == 3).all())

    @cached_property
    def edges(self) -> EdgeTable:
        """Edges of all polygons."""
        count = int(self.corners.max()) + 1
        return EdgeTable(*_core.mend_edges(self.offsets, self.corners, count))

    @cached_property
    def polygon_of_slot(self) -> Ints:
        """(c,) which polygon a corner belongs to."""
        return np.repeat(np.arange(len(self), dtype=np.int32), self.counts)

    @cached_property
    def next_slot(self) -> Longs:
        """(c,) slot of the following corner of the same polygon."""
        following = np.arange(1, len(self.corners) + 1)
        following[self.offsets[1:] - 1] = self.offsets[:-1]
        return following

    def with_corners(self, corners: Ints) -> Polygons:
        """Return the same polygons over other vertices."""
        return Polygons(self.offsets, np.ascontiguousarray(corners), self.source, self.normal_row)

    def renumbered(self, place: Ints) -> Polygons:
        """Return the same polygons and edges, vertex v called place[v].

        The edges ascend only if `place` keeps the order.
        """
        polygons = self.with_corners(place[self.corners])
        if "edges" in self.__dict__:  # found already: cached_property keeps them there
            edges = self.edges
            known = EdgeTable(edges.slot_edge, place[edges.ends], edges.users)
            polygons.__dict__["edges"] = known
        return polygons

    def take(self, polygons: Longs) -> Polygons:
        """Return the polygons named, in that order."""
        counts = self.counts[polygons]
        offsets = offsets_of(counts)
        slots = np.repeat(self.offsets[polygons] - offsets[:-1], counts) + np.arange(offsets[-1])
        return self._gather(slots, offsets, self.source[polygons])

    def keep(self, mask: Mask) -> Polygons:
        """Return the polygons where `mask` holds."""
        return self if mask.all() else self.take(np.flatnonzero(mask))

    def drop_slots(self, mask: Mask) -> Polygons:
        """Without the corners where `mask` holds; polygons may be left with too few."""
        gone = np.bincount(self.polygon_of_slot[mask], minlength=len(self))
        return self._gather(np.flatnonzero(~mask), offsets_of(self.counts - gone), self.source)

    def insert(self, slots: Longs, vertices: Ints, normal_rows: Longs | None) -> Polygons:
        """With `vertices` put behind `slots`; several at one slot keep their order."""
        more = np.bincount(self.polygon_of_slot[slots], minlength=len(self))
        offsets = offsets_of(self.counts + more)
        rows = None
        if self.normal_row is not None and normal_rows is not None:
            rows = np.insert(self.normal_row, slots + 1, normal_rows)
        return Polygons(offsets, np.insert(self.corners, slots + 1, vertices), self.source, rows)

    def reverse(self, mask: Mask) -> Polygons:
        """With the winding turned where `mask` holds; the first corner stays first."""
        if not mask.any():
            return self
        starts = np.repeat(self.offsets[:-1], self.counts)
        place = np.arange(len(self.corners)) - starts
        size = np.repeat(self.counts, self.counts)
        turned = np.where(np.repeat(mask, self.counts), starts + (size - place) % size, -1)
        slots = np.where(turned < 0, np.arange(len(self.corners)), turned)
        return self._gather(slots, self.offsets, self.source)

    def replace_by_triangles(self, mask: Mask, slots: Longs, polygon: Ints) -> Polygons:
        """With the polygons where `mask` holds replaced by triangles, in their places.

        slots : (t, 3) corner slots of this list; polygon : (t,) the polygon each comes from.
        """
        kept = np.flatnonzero(~mask)
        order = np.argsort(np.concatenate([kept, polygon]), kind="stable")
        counts = np.concatenate([self.counts[kept], np.full(len(slots), 3)])
        source = np.concatenate([self.source[kept], self.source[polygon]])
        kept_slots = np.flatnonzero(~np.repeat(mask, self.counts))
        slots = np.concatenate([kept_slots, slots.ravel()])
        joined = self._gather(slots, offsets_of(counts), source)
        return joined.take(order)

    def _gather(self, slots: Longs, offsets: Longs, source: Ints) -> Polygons:
        rows = None if self.normal_row is None else self.normal_row[slots]
        return Polygons(offsets, self.corners[slots], source, rows)


def without_area(polygons: Polygons, vertices: Array) -> Mask:
    """(m,) which polygons have no area at all: their corners lie on one line, or in one point."""
    shapes = _core.mend_shapes(polygons.offsets, polygons.corners, vertices)
    flat: Mask = shapes <= 2.0 * FLAT_AREA
    larger = np.flatnonzero(shapes < 0.0)
    if larger.size:
        few = polygons.take(larger)
        starts = few.offsets[:-1]
        spokes = vertices[few.corners] - np.repeat(
            vertices[few.corners[starts]], few.counts, axis=0
        )
        length = _squares(spokes)
        longest = np.maximum.reduceat(length, starts)
        # The first corner as far away as any: the line from the first corner to it must hold all.
        far = np.flatnonzero(length == np.repeat(longest, few.counts))
        _, first = np.unique(few.polygon_of_slot[far], return_index=True)
        line = np.repeat(spokes[far[first]], few.counts, axis=0)
        off = np.maximum.reduceat(np.sqrt(_squares(np.cross(spokes, line))), starts)
        flat[larger] = off <= 2.0 * FLAT_AREA * longest
    return flat


@dataclass(frozen=True)
class Quads:
    """Shape of four-sided polygons, each array (q,)."""

    warp: Array  # farthest corner from the mean plane [m]
    convex: Mask  # in the mean plane; a flat corner is allowed
    other_diagonal: Mask  # split between corners 1 and 3 instead of 0 and 2


def examine_quads(corners: Array) -> Quads:
    """Judge four-sided polygons.

    corners : (q, 4, 3) [m]. The diagonal gives the better-shaped pair of triangles; among equals
    it is the one at the corner that comes first by x, y, z. So it does not depend on which corner
    is listed first, nor on the winding.
    """
    p = [corners[:, k] for k in range(4)]
    normal = np.cross(p[2] - p[0], p[3] - p[1])
    length = np.sqrt(_squares(normal))
    normal /= np.where(length > 0.0, length, 1.0)[:, None]
    height = np.einsum("qkx,qx->qk", corners - corners.mean(axis=1, keepdims=True), normal)

    def shape(i: int, j: int, k: int) -> Array:
        ab, ac, bc = p[j] - p[i], p[k] - p[i], p[k] - p[j]
        longest = np.maximum(np.maximum(_squares(ab), _squares(ac)), _squares(bc))
        signed = np.einsum("qx,qx->q", np.cross(ab, ac), normal)
        return np.asarray(signed / np.where(longest > 0.0, longest, 1.0), np.float64)

    ears = np.stack([shape(3, 0, 1), shape(0, 1, 2), shape(1, 2, 3), shape(2, 3, 0)])
    first = np.minimum(ears[1], ears[3])
    second = np.minimum(ears[0], ears[2])
    order = np.lexsort(np.moveaxis(corners, 2, 0)[::-1], axis=-1)
    place = np.isin(order[:, 0], (1, 3))
    equal = np.abs(first - second) <= EQUAL_SHAPE
    other = np.where(equal, place, second > first)
    convex = (ears >= -2.0 * FLAT_AREA).all(axis=0)
    convex &= np.where(other, second, first) > 2.0 * FLAT_AREA
    return Quads(np.abs(height).max(axis=1), convex, other)


def _squares(vectors: Array) -> Array:
    return np.asarray(np.einsum("...x,...x->...", vectors, vectors), np.float64)
