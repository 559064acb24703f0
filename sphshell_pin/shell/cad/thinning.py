"""Fewer nodes where OpenCASCADE lays them much closer one way than the other without need."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sphshell_pin.shell.cad.flipping import spans_of, uprightness
from sphshell_pin.shell.raw import Floats, Longs, Mask

SHORT = 0.4
"""A node goes if another is nearer than this share of the longest side around it."""

MOST_LONGER = 1.5
"""What new sides may be longer than those around, squared; and so for turns of the surface."""

MOST_PASSES = 16
"""Of rounds in which nodes go that have no triangle in common."""

MOST_TILT = 0.5
"""Cosine of the angle by which a triangle may tilt when its node moves, or be off its normals."""


def thinned(
    points: Floats,
    normals: Floats,
    parameters: Callable[[Longs], Floats],
    triangles: Longs,
    fixed: Mask,
) -> Longs:
    """Return the triangles (k, 3) left when nodes of needles have joined their nearest neighbours.

    Round the pole of a ball OpenCASCADE lays as many nodes on small circles as on large ones. On a
    cylinder needles are as they should be: so no side may become much longer, and the surface may
    turn along none much more, than along those around it.

    points, normals : (n, 3), normals zero where there is none; parameters : those (k, 3, 2) of the
    corners of triangles; triangles : (t, 3); fixed : (n,) nodes that stay
    """
    rows = triangles
    rng = np.random.default_rng(0)
    for _ in range(MOST_PASSES):
        into, length = _nearest(points, normals, rows, fixed)
        allowed = _allowed(points, normals, parameters, rows, into, length)
        # Alike lengths are told apart at random, or nodes of a row would go one by one.
        order = np.lexsort((rng.random(len(points)), np.round(4 * np.log2(length))))
        rank = np.full(len(points), len(points))
        rank[order] = np.arange(len(points))
        rank[~allowed] = len(points)
        least = rank[rows].min(axis=1)
        first = np.full(len(points), len(points))
        np.minimum.at(first, rows.ravel(), np.repeat(least, 3))
        goes = allowed & (first == rank)
        if not goes.any():
            break
        rows = np.where(goes[rows], into[rows], rows)
        rows = rows[(rows != np.roll(rows, 1, axis=1)).all(axis=1)]
    return rows


def _nearest(points: Floats, normals: Floats, rows: Longs, fixed: Mask) -> tuple[Longs, Floats]:
    """Return the node (n,) each may join, -1 if none, and how far it is, infinite if none."""
    start = np.concatenate([rows.ravel(), np.roll(rows, -1, axis=1).ravel()])
    end = np.concatenate([np.roll(rows, -1, axis=1).ravel(), rows.ravel()])
    usable = ~fixed[start] & normals[end].any(axis=1)
    start, end = start[usable], end[usable]
    away = np.linalg.norm(points[end] - points[start], axis=1)
    order = np.lexsort((end, away))[::-1]
    into, length = np.full(len(points), -1), np.full(len(points), np.inf)
    into[start[order]], length[start[order]] = end[order], away[order]
    return into, length


def _allowed(
    points: Floats,
    normals: Floats,
    parameters: Callable[[Longs], Floats],
    rows: Longs,
    into: Longs,
    length: Floats,
) -> Mask:
    """Which nodes (n,) may go."""
    count = len(points)
    allowed: Mask = np.asarray(into >= 0, np.bool_)
    longest, turn, shape = _measures(points, normals, rows)

    def around(values: Floats) -> Floats:
        largest = np.zeros(count)
        np.maximum.at(largest, rows.ravel(), np.repeat(values, 3))
        return largest

    longest, turn, shape = around(longest), around(turn), around(shape)
    allowed &= length**2 < SHORT**2 * longest
    gone = np.zeros(count, np.int64)
    for k in range(3):
        own = np.flatnonzero(allowed[rows[:, k]])
        node = rows[own, k]
        joined = (rows[own] == into[node][:, None]).any(axis=1)
        np.add.at(gone, node[joined], 1)
        own, node = own[~joined], node[~joined]
        moved = rows[own].copy()
        moved[:, k] = into[node]
        before, after = (spans_of(points[table]) for table in (rows[own], moved))
        sizes = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
        fine = np.einsum("ij,ij->i", before, after) > MOST_TILT * sizes
        least = np.minimum(uprightness(normals, rows[own], before), MOST_TILT)
        fine &= uprightness(normals, moved, after) >= least
        at = parameters(moved)
        one, two = at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]
        fine &= one[:, 0] * two[:, 1] > one[:, 1] * two[:, 0]
        new = _measures(points, normals, moved)
        fine &= (new[0] <= MOST_LONGER * longest[node]) & (new[2] <= shape[node])
        fine &= new[1] <= MOST_LONGER * turn[node] + np.finfo(float).eps
        allowed[node[~fine]] = False
    return np.asarray(allowed & (gone == 2), np.bool_)


def _measures(points: Floats, normals: Floats, rows: Longs) -> tuple[Floats, Floats, Floats]:
    """Longest side squared, largest turn of the normal along one, thinness (t,) of triangles."""
    corners, upright = points[rows], normals[rows]
    sides = np.roll(corners, -1, axis=1) - corners
    longest = np.einsum("tkx,tkx->tk", sides, sides).max(axis=1)
    # Twice 1 - cosine, without its loss of digits; nothing where a normal is missing.
    turns = np.roll(upright, -1, axis=1) - upright
    known = upright.any(axis=2) & np.roll(upright, -1, axis=1).any(axis=2)
    turn = np.where(known, np.einsum("tkx,tkx->tk", turns, turns), 0.0).max(axis=1)
    area = np.linalg.norm(spans_of(corners), axis=1)
    return longest, turn, longest / np.maximum(area, 1e-12 * longest + np.finfo(float).tiny)
