"""How far the curved elements of the method "smooth" stand off the flat ones, and which are flat.

A curved element takes its shape from normals alone. Where these say more than the elements round it
bear out, as averaged normals on a box do, it leaves the surface that was meant.
"""

from __future__ import annotations

import numpy as np

from sphshell_pin.shell.base import ShellBase
from sphshell_pin.shell.curved import points_on
from sphshell_pin.shell.health import LARGE_OF_HEIGHT, CurvatureReport, Place
from sphshell_pin.shell.raw import Bytes, Floats, Longs

CURVED = 0
FLAT_BECAUSE = (
    "curved",
    "no side of them bends: nothing around them turns",
    "straightened: their neighbours do not bear witness to a bend",
    "kept straight: curved ones would leave the exact CAD face",
)
"""What the codes of `_core.Shell.bending` mean, and one more."""

OFF_FACE = 3

LARGE_OF_LENGTH = 0.05
"""It must also be that share of its longest side off: along a bend, a needle rightly stands off by
more than its own height."""

COARSE, FINE = 6, 30
"""Pieces into which sides are cut to find the triangle with the largest distance, and its place."""

AT_ONCE = 5_000
"""Triangles measured at a time: it bounds the memory."""


def curvature_report(shell: ShellBase) -> CurvatureReport:
    """Measure the curved elements of `shell`; it makes them if nothing has touched them yet."""
    # A point is a mean of the control points: none is farther off than the farthest of them.
    bound = np.linalg.norm(shell.core_for("smooth").lifts, axis=2).max(axis=1)
    worst, largest, at = _largest_distance(shell, bound)
    height, longest = _heights(shell)
    code = _bending(shell)
    curved = int((code == CURVED).sum())
    reasons = [
        (FLAT_BECAUSE[one], int((code == one).sum())) for one in np.unique(code) if one != CURVED
    ]
    aside, aside_at = _set_aside(shell)
    return CurvatureReport(
        elements=shell.num_elements,
        curved=curved,
        flat_because=tuple(reasons),
        largest=largest,
        at=None if largest == 0.0 else _place(at),
        of_size=largest / shell.size,
        of_height=largest / float(height[worst]),
        large=_count_large(shell, bound, height, longest),
        normals_set_aside=aside,
        set_aside_at=aside_at,
    )


def distances_at(shell: ShellBase, divisions: int) -> Floats:
    """Distances (t, k) [m] of points of the curved elements from the flat ones.

    The points are those of `curved_mesh` with as many divisions.
    """
    chosen = np.arange(len(shell.triangles))
    parts = [
        _off_flat(shell, rows, divisions)[0]
        for rows in np.split(chosen, range(AT_ONCE, len(chosen), AT_ONCE))
    ]
    return np.concatenate(parts)


def _largest_distance(shell: ShellBase, bound: Floats) -> tuple[int, float, Floats]:
    """Return the triangle with the largest distance, that distance [m], and its place (3,).

    bound : (t,) no triangle is farther off than that [m]
    """
    order = np.argsort(-bound, kind="stable")
    largest, worst = 0.0, 0
    for start in range(0, len(order), AT_ONCE):
        rows = order[start : start + AT_ONCE]
        if bound[rows[0]] <= largest:
            break
        found = _off_flat(shell, rows, COARSE)[0].max(axis=1)
        if found.max() > largest:
            largest, worst = float(found.max()), int(rows[np.argmax(found)])
    if largest == 0.0:
        return worst, 0.0, shell.vertices[shell.triangles[worst, 0]]
    found, points = _off_flat(shell, np.array([worst]), FINE)
    highest = int(np.argmax(found[0]))
    return worst, float(found[0, highest]), points[0, highest]


def _count_large(shell: ShellBase, bound: Floats, height: Floats, longest: Floats) -> int:
    """Count elements with a triangle that is far off for its own size."""
    limit = np.maximum(LARGE_OF_HEIGHT * height, LARGE_OF_LENGTH * longest)
    rows = np.flatnonzero(bound > limit)
    large = [
        some[_off_flat(shell, some, COARSE)[0].max(axis=1) > limit[some]]
        for some in np.split(rows, range(AT_ONCE, len(rows), AT_ONCE))
    ]
    return len(np.unique(shell.triangle_element[np.concatenate(large)]))


def _off_flat(shell: ShellBase, rows: Longs, divisions: int) -> tuple[Floats, Floats]:
    """Distances (n, k) of k points of curved triangles `rows` from the flat ones; the points."""
    points = points_on(shell, rows, divisions)
    corners = shell.vertices[shell.triangles[rows]]
    return _to_triangles(points, corners), points


def _to_triangles(points: Floats, corners: Floats) -> Floats:
    """Distances (n, k) of points (n, k, 3) from triangles (n, 3, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal /= np.where(length > 0.0, length, 1.0)
    nearest = np.full(points.shape[:2], np.inf)
    inside = np.broadcast_to(length > 0.0, points.shape[:2]).copy()
    for k in range(3):
        start, way = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
        offset = points - start[:, None]
        square = np.maximum(np.einsum("nx,nx->n", way, way), np.finfo(float).tiny)
        along = np.clip(np.einsum("nkx,nx->nk", offset, way) / square[:, None], 0.0, 1.0)
        away = np.linalg.norm(offset - along[:, :, None] * way[:, None], axis=2)
        nearest = np.minimum(nearest, away)
        inside &= np.einsum("nkx,nx->nk", offset, np.cross(normal, way)) >= 0.0
    upright = np.abs(np.einsum("nkx,nx->nk", points - corners[:, :1], normal))
    return np.asarray(np.where(inside, np.minimum(upright, nearest), nearest))


def _heights(shell: ShellBase) -> tuple[Floats, Floats]:
    """Smallest height (t,) and longest side (t,) of each triangle [m]."""
    corners = shell.vertices[shell.triangles]
    sides = np.roll(corners, -1, axis=1) - corners
    longest = np.linalg.norm(sides, axis=2).max(axis=1)
    return np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / longest, longest


def _bending(shell: ShellBase) -> Bytes:
    """Return for each element (m,) whether it is curved, or why it is flat, as FLAT_BECAUSE."""
    core = shell.core_for("smooth")
    codes = core.bending
    if shell.straight is not None:
        codes = np.where((codes != CURVED) & shell.straight.any(axis=1), np.uint8(OFF_FACE), codes)
    # Curved if any triangle of it is; else the most telling reason.
    lowest = np.full(shell.num_elements, 255, np.uint8)
    highest = np.zeros(shell.num_elements, np.uint8)
    np.minimum.at(lowest, shell.triangle_element, codes)
    np.maximum.at(highest, shell.triangle_element, codes)
    return np.where(lowest == CURVED, lowest, highest)


def _set_aside(shell: ShellBase) -> tuple[int, Place | None]:
    """How many given normals the elements contradict, and where one of them is."""
    corners = np.flatnonzero(shell.core_for("smooth").normals_set_aside)
    if shell.normals is None or not len(corners):
        return 0, None
    return len(corners), _place(shell.vertices[shell.triangles.ravel()[corners[0]]])


def _place(point: Floats) -> Place:
    x, y, z = point.tolist()
    return x, y, z
