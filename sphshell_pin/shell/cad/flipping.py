"""Better shaped triangles on the same nodes: long thin ones bend badly when they are curved."""

from __future__ import annotations

import numpy as np

from sphshell_pin.shell.cad.face_surface import dot
from sphshell_pin.shell.raw import Floats, Longs, Mask

MOST_PASSES = 12
"""Of flips; what is left after them is next to nothing."""

MOST_TILT = 0.5
"""Cosine of the angle between a flipped triangle and the two it comes from, or its normals."""

GAIN = 1e-3
"""Flips must bring more than that: on a grid of rectangles both diagonals are as good."""

MOST_TURNED = 1.2
"""What the surface may turn more along the new side than along the old one, squared."""

FLAT = 1e-12
"""Triangles of less area than this share of their longest side squared have no angles."""


def flipped(
    points: Floats, normals: Floats, parameters: Floats, triangles: Longs
) -> tuple[Longs, Mask]:
    """Flip the sides inside a face until opposite angles add up to less than 180 degrees.

    points, normals : (n, 3), normals zero where there is none; parameters : (t, 3, 2), of the
    corners; triangles : (t, 3), anticlockwise in them

    Returns
    -------
    triangles, and which of them (t,) were changed
    """
    rows, at = triangles.copy(), parameters.copy()
    changed = np.zeros(len(rows), np.bool_)
    active = np.ones(len(points), np.bool_)
    for _ in range(MOST_PASSES):
        first, i, second, j = _hinges(rows)
        alive = active[rows[first]].any(axis=1) | active[rows[second]].any(axis=1)
        first, i, second, j = first[alive], i[alive], second[alive], j[alive]
        gain = _gain(points, normals, rows, at, first, i, second, j)
        chosen = _apart(gain, first, second, len(rows))
        if not len(chosen):
            break
        first, i, second, j = first[chosen], i[chosen], second[chosen], j[chosen]
        for table in (rows, at):
            a, b, c = (table[first, (i + k) % 3] for k in range(3))
            d = table[second, (j + 2) % 3]
            table[first] = np.stack([a, d, c], axis=1)
            table[second] = np.stack([d, b, c], axis=1)
        changed[first] = changed[second] = True
        active[:] = False
        active[rows[first]] = active[rows[second]] = True
    return rows, changed


def _hinges(rows: Longs) -> tuple[Longs, Longs, Longs, Longs]:
    """Two triangles at each side inside: rows (h,), and which of their sides it is."""
    ends = np.sort(np.stack([rows, np.roll(rows, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    key = ends[:, 0] * (rows.max(initial=0) + 1) + ends[:, 1]
    order = np.argsort(key, kind="stable")
    sorted_ = key[order]
    same = np.flatnonzero(sorted_[1:] == sorted_[:-1])
    one, other = order[same], order[same + 1]
    return one // 3, one % 3, other // 3, other % 3


def _gain(
    points: Floats,
    normals: Floats,
    rows: Longs,
    at: Floats,
    first: Longs,
    i: Longs,
    second: Longs,
    j: Longs,
) -> Floats:
    """How much flips (h,) would bring, 0 where they may not be."""
    a, b, c = (rows[first, (i + k) % 3] for k in range(3))
    d = rows[second, (j + 2) % 3]
    old = [np.stack(corners, axis=1) for corners in ((a, b, c), (b, a, d))]
    new = [np.stack(corners, axis=1) for corners in ((a, d, c), (d, b, c))]
    spans = [spans_of(points[corners]) for corners in (*old, *new)]
    areas = [np.linalg.norm(span, axis=1) for span in spans]
    sides = [points[end] - points[start] for start, end in ((a, b), (a, c), (a, d), (b, c), (b, d))]
    longest = np.max([dot(side, side) for side in sides], axis=0)
    good = np.min(areas, axis=0) > FLAT * longest
    areas = [np.where(good, area, 1.0) for area in areas]
    # Cotangents of the angles opposite the side: below zero together, beyond 180 degrees.
    cotangents = dot(sides[1], sides[3]) / areas[0] + dot(sides[2], sides[4]) / areas[1]
    mean = spans[0] + spans[1]
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), np.finfo(float).tiny)
    for span, area in zip(spans[2:], areas[2:], strict=True):
        good &= dot(span, mean) > MOST_TILT * area
    before, after = (
        np.min([uprightness(normals, *pair) for pair in zip(rows_, spans_, strict=True)], axis=0)
        for rows_, spans_ in ((old, spans[:2]), (new, spans[2:]))
    )
    good &= after >= np.minimum(before, MOST_TILT)
    # Where the surface bends one way only, thin triangles along it are as they should be.
    turns = [normals[start] - normals[end] for start, end in ((a, b), (c, d))]
    known = normals[np.stack([a, b, c, d])].any(axis=2).all(axis=0)
    good &= ~known | (dot(turns[1], turns[1]) <= MOST_TURNED * dot(turns[0], turns[0]))
    pa, pb, pc = (at[first, (i + k) % 3] for k in range(3))
    pd = at[second, (j + 2) % 3]
    good &= (_turn(pa, pd, pc) > 0.0) & (_turn(pd, pb, pc) > 0.0)
    return np.where(good & (cotangents < -GAIN), -cotangents, 0.0)


def _apart(gain: Floats, first: Longs, second: Longs, count: int) -> Longs:
    """Rows of the flips that gain the most around them: no two of them share a triangle."""
    best = np.zeros(count)
    np.maximum.at(best, first, gain)
    np.maximum.at(best, second, gain)
    rows = np.flatnonzero((gain > 0.0) & (gain == best[first]) & (gain == best[second]))
    _, once = np.unique(first[rows], return_index=True)
    rows = rows[once]
    _, once = np.unique(second[rows], return_index=True)
    rows = rows[once]
    # Where gains are equal, a triangle may still be in two: as first of one, second of the other.
    used = np.bincount(np.concatenate([first[rows], second[rows]]), minlength=count)
    rows = rows[(used[first[rows]] == 1) & (used[second[rows]] == 1)]
    return np.asarray(rows, np.int64)


def _turn(a: Floats, b: Floats, c: Floats) -> Floats:
    one, two = b - a, c - a
    return np.asarray(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])


def spans_of(corners: Floats) -> Floats:
    """Twice the area vectors (t, 3) of triangles (t, 3, 3)."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def uprightness(normals: Floats, rows: Longs, spans: Floats) -> Floats:
    """Smallest cosine (t,) between a triangle and the normals of its corners; 1 where none is."""
    upright = normals[rows]
    length = np.maximum(np.linalg.norm(spans, axis=1), np.finfo(float).tiny)
    along = np.einsum("tkx,tx->tk", upright, spans) / length[:, None]
    return np.asarray(np.where(upright.any(axis=2), along, 1.0).min(axis=1))
