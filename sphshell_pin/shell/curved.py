"""Curved elements as fine triangles: what the method "smooth" touches, for pictures."""

import numpy as np

from sphshell_pin.base.arrays import Array, Ints, Longs
from sphshell_pin.shell.base import ShellBase


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
    inner = np.stack([*sides, 6 * u * v * w])
    core = shell.core_for("smooth")
    corners, lifts = core.vertices[core.triangles[rows]], core.control_point_offsets[rows]
    points = np.einsum("kc,tcx->tkx", weights, corners) + np.einsum("bk,tbx->tkx", inner, lifts)
    return np.asarray(points)


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
