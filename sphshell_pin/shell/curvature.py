"""How far the curved elements of the method "smooth" stand off the flat ones, and which are flat.

The shape of a curved element follows from normals alone. Where these contradict the elements around
it, as averaged normals on a box do, it leaves the surface that was meant.
"""

import numpy as np

from sphshell_pin.base.arrays import Array, Bytes, Ints, Longs, Mask
from sphshell_pin.shell.base import ShellBase
from sphshell_pin.shell.faces import ambiguous_band, described, distances_from, not_exact
from sphshell_pin.shell.health import LARGE_OF_TURNS, CurvatureReport, Place
from sphshell_pin.shell.raw import area_vectors, in_use


def points_on(shell: ShellBase, rows: Longs, divisions: int) -> Array:
    """Points (n, k, 3) [m] of n triangles of `shell`, curved as the method "smooth" has them.

    The k points of each are those of a grid that cuts each side into `divisions` pieces: corner 0
    first, then by steps toward corner 2, by steps toward corner 1.
    """
    u, v = (np.array(_grid(divisions)) / divisions).T
    return points_at(shell, rows, np.stack([1 - u - v, u, v], axis=1))


def points_at(shell: ShellBase, rows: Longs, weights: Array) -> Array:
    """Points (n, k, 3) [m] of n curved triangles at barycentric weights (k, 3)."""
    w, u, v = weights.T
    # Bernstein's polynomials of the control points, with their offsets from the flat triangle.
    sides = [3 * a * b * c for a, b in ((w, u), (u, v), (v, w)) for c in (a, b)]
    shares = np.stack([w, u, v, *sides, 6 * u * v * w])
    core = shell.core_for("smooth")
    corners, lifts = core.vertices[core.triangles[rows]], core.control_point_offsets[rows]
    return np.asarray(shares.T @ np.concatenate([corners, lifts], axis=1))


def curved_mesh(shell: ShellBase, divisions: int = 4) -> tuple[Array, Ints, Ints]:
    """Divide every triangle of `shell`, curved as the method "smooth" has it.

    Each side is cut into `divisions` pieces. Returns points (t * k, 3) [m], triangles
    (t * divisions^2, 3) and the triangle (t * divisions^2,) of the shell each belongs to; points
    are not shared between triangles of the shell.
    """
    n, count = divisions, len(shell.triangles)
    grid = _grid(n)
    number = {place: k for k, place in enumerate(grid)}
    points = points_on(shell, np.arange(count), n)
    small = [(number[i, j], number[i + 1, j], number[i, j + 1]) for i, j in grid if i + j < n]
    small += [
        (number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]) for i, j in grid if i + j < n - 1
    ]
    triangles = np.arange(count)[:, None, None] * len(grid) + np.array(small)
    owner = np.repeat(np.arange(count), len(small)).astype(np.int32)
    return points.reshape(-1, 3), triangles.reshape(-1, 3).astype(np.int32), owner


def _grid(divisions: int) -> list[tuple[int, int]]:
    """Return the steps along u and v of the points of a grid on a triangle."""
    return [(i, j) for i in range(divisions + 1) for j in range(divisions + 1 - i)]


CURVED, OFF_FACE = 0, 3
FLAT_BECAUSE = {
    1: "no side of them bends: nothing around them turns",
    2: "straightened: their neighbors do not bend",
    OFF_FACE: "kept straight: curved ones would leave the exact CAD face",
}
"""What the codes of `_core.Shell.bending` mean where they are not CURVED, and one more."""

LEAST_OF_SIZE = 1e-6
"""A curved element is one to look at only if it is off its flat one by this share of the box."""

SAME_NORMAL = 1e-4
"""Normals that differ by less are one."""

LARGE_OF_LENGTH = 0.07
"""Beside creases and borders the turns do not show all that bends. There it must also be off by
this share of its longest side, as sides are that turn by 30 degrees, the most within a patch."""

COARSE, FINE = 6, 30
"""Pieces into which sides are cut to find the triangle with the largest distance, and its place."""

AT_ONCE = 5_000
"""Triangles measured at a time: it bounds the memory."""


def curvature_report(shell: ShellBase) -> CurvatureReport:
    """Measure the curved elements of `shell`; it makes them if no query has yet."""
    core = shell.core_for("smooth")
    # A point is a mean of the control points: none is farther off than the farthest of them.
    bound = np.linalg.norm(core.control_point_offsets, axis=2).max(axis=1)
    corners = shell.vertices[shell.triangles]
    sides = np.roll(corners, -1, axis=1) - corners
    longest = np.linalg.norm(sides, axis=2).max(axis=1)
    height = np.linalg.norm(area_vectors(corners), axis=1) / longest
    worst, largest, at = _largest_distance(shell, np.arange(len(bound)), bound)
    limit = _limits(shell, longest)
    rows = np.flatnonzero(bound > limit)
    large = rows[_distances(shell, rows, COARSE).max(axis=1, initial=0.0) > limit[rows]]
    _, most, most_at = _largest_distance(shell, large, bound)
    code = _bending(shell)
    aside = (
        np.flatnonzero(core.normals_set_aside) if shell.normals is not None else np.zeros(0, int)
    )
    first = None
    if len(aside):
        first = _place(shell.vertices[shell.triangles.ravel()[aside[0]]])
    return CurvatureReport(
        elements=shell.num_elements,
        curved=int((code == CURVED).sum()),
        flat_because=tuple(
            (why, int((code == k).sum())) for k, why in FLAT_BECAUSE.items() if (code == k).any()
        ),
        largest=largest,
        at=None if largest == 0.0 else _place(at),
        of_size=largest / shell.size,
        of_height=largest / float(height[worst]),
        large=len(np.unique(shell.triangle_element[large])),
        large_distance=most,
        large_at=_place(most_at) if most else None,
        normals_set_aside=len(aside),
        set_aside_at=first,
        share_set_aside=len(aside) / shell.triangles.size,
        faces=_faces_in_words(shell) if _has_faces(shell) else "",
        not_exact=_not_exact(shell, 0.5 * longest * height) if _has_faces(shell) else (),
    )


def _faces_in_words(shell: ShellBase) -> str:
    """Say which faces there are, and where one of them may have swallowed a flat."""
    of_element = np.full(shell.num_elements, -1)
    for k, face in enumerate(shell.faces):
        of_element[face.elements] = k
    of = of_element[shell.triangle_element]
    order = np.argsort(of, kind="stable")
    starts = np.searchsorted(of[order], np.arange(len(shell.faces) + 1))
    bands = [
        ambiguous_band(face, shell.vertices[shell.triangles[order[begin:end]]])
        for face, begin, end in zip(shell.faces, starts, starts[1:], strict=False)
    ]
    words = described(shell.faces, shell.num_elements)
    if places := [band for band in bands if band is not None]:
        at = "({:.4g}, {:.4g}, {:.4g}) m".format(*places[0])
        words += (
            f"; counted as round although wider than all other steps of its face, so it may be a "
            f"flat: {len(places)}, one at {at}"
        )
    return words


def _not_exact(shell: ShellBase, areas: Array) -> tuple[str, ...]:
    """Say which faces are not exact; `areas` (t,) [m^2]."""
    faces = shell.faces
    share, off = np.zeros(len(faces)), np.zeros(len(faces))
    of_element = np.full(shell.num_elements, -1)
    for k, face in enumerate(faces):
        of_element[face.curved] = k
    of = of_element[shell.triangle_element]
    order = np.argsort(of, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(of[order])) + 1):
        k = of[rows[0]]
        if k < 0:
            continue
        share[k] = areas[rows].sum() / areas.sum()
        for some in np.split(rows, range(AT_ONCE, len(rows), AT_ONCE)):
            points = points_on(shell, some, COARSE).reshape(-1, 3)
            off[k] = max(off[k], float(distances_from(faces[k], points).max()))
    return not_exact(faces, share, off)


def _distances(shell: ShellBase, rows: Longs, divisions: int) -> Array:
    """Distances (n, k) [m] of points of the curved triangles `rows` from the flat ones."""
    parts = np.split(rows, range(AT_ONCE, len(rows), AT_ONCE))
    return np.concatenate([_off_flat(shell, some, divisions)[0] for some in parts])


def _limits(shell: ShellBase, longest: Array) -> Array:
    """(t,) how far from its flat one each curved triangle may be [m]."""
    core = shell.core_for("smooth")
    triangles, normals = shell.triangles, core.corner_normals
    limit = np.maximum(LARGE_OF_TURNS * core.chord_errors, LEAST_OF_SIZE * shell.size)
    # Beside corners at which the normals differ not all turns were taken into account.
    one, turn = np.zeros_like(shell.vertices), np.zeros(len(shell.vertices))
    one[triangles] = normals
    differ = ~(np.linalg.norm(normals - one[triangles], axis=2) <= SAME_NORMAL)
    np.maximum.at(turn, shell.edge_vertices, np.abs(shell.edge_angle)[:, None])
    turned = turn[triangles].max(axis=1) * longest
    limit = np.where(_any_at(shell, triangles[differ]), np.maximum(limit, turned), limit)
    ends = _any_at(shell, shell.edge_vertices[shell.edge_class != 0])
    return np.where(ends, np.maximum(limit, LARGE_OF_LENGTH * longest), limit)


def _any_at(shell: ShellBase, vertices: Ints) -> Mask:
    """(t,) which triangles have one of `vertices`."""
    return np.asarray(in_use(vertices, len(shell.vertices))[shell.triangles].any(axis=1))


def _has_faces(shell: ShellBase) -> bool:
    return shell.finds_faces and shell.crease_angle > 0.0


def _largest_distance(shell: ShellBase, some: Longs, bound: Array) -> tuple[int, float, Array]:
    """Return the triangle of `some` with the largest distance, that [m], and its place (3,).

    bound : (t,) no triangle is farther off than that [m]
    """
    order = some[np.argsort(-bound[some], kind="stable")]
    largest, worst = 0.0, 0
    for rows in np.split(order, range(AT_ONCE, len(order), AT_ONCE)):
        if len(rows) == 0 or bound[rows[0]] <= largest:
            break
        found = _off_flat(shell, rows, COARSE)[0].max(axis=1)
        if found.max() > largest:
            largest, worst = float(found.max()), int(rows[np.argmax(found)])
    found, points = _off_flat(shell, np.array([worst]), FINE)
    highest = int(np.argmax(found[0]))
    return worst, float(found[0, highest]) if largest else 0.0, points[0, highest]


def _off_flat(shell: ShellBase, rows: Longs, divisions: int) -> tuple[Array, Array]:
    """Distances (n, k) of k points of curved triangles `rows` from the flat ones; the points."""
    points = points_on(shell, rows, divisions)
    corners = shell.vertices[shell.triangles[rows]]
    return _to_triangles(points, corners), points


def _to_triangles(points: Array, corners: Array) -> Array:
    """Distances (n, k) of points (n, k, 3) from triangles (n, 3, 3), which all have an area."""
    third, first = area_vectors(corners), corners[:, 1] - corners[:, 0]
    first, third = (one / np.linalg.norm(one, axis=1, keepdims=True) for one in (first, third))
    axes = np.stack([first, np.cross(third, first), third], axis=2)
    x, y, height = np.moveaxis((points - corners[:, :1]) @ axes, 2, 0)
    flat = (corners - corners[:, :1]) @ axes[:, :, :2]
    aside, inside = np.full(x.shape, np.inf), np.ones(x.shape, np.bool_)
    for k in range(3):
        u, v = flat[:, k, :, None].swapaxes(0, 1)
        across, up = (flat[:, (k + 1) % 3] - flat[:, k])[:, :, None].swapaxes(0, 1)
        u, v = x - u, y - v
        along = np.clip((u * across + v * up) / (across**2 + up**2), 0.0, 1.0)
        aside = np.minimum(aside, (u - along * across) ** 2 + (v - along * up) ** 2)
        inside &= across * v >= up * u
    return np.asarray(np.sqrt(height**2 + np.where(inside, 0.0, aside)))


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


def _place(point: Array) -> Place:
    x, y, z = point.tolist()
    return x, y, z
