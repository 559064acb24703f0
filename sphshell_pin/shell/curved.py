"""Curved elements as fine triangles: what the method "smooth" touches, for pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from sphshell_pin.shell.raw import Floats, Ints
    from sphshell_pin.shell.shell import Shell


def curved_mesh(shell: Shell, divisions: int = 4) -> tuple[Floats, Ints, Ints]:
    """Divide every triangle of `shell`, curved as the method "smooth" has it.

    Each side is cut into `divisions` pieces. Returns points (t * k, 3) [m], triangles
    (t * divisions^2, 3) and the triangle (t * divisions^2,) of the shell each belongs to; points
    are not shared between triangles of the shell.
    """
    n = divisions
    lifts = shell.core_for("smooth").lifts
    corners = shell.vertices[shell.triangles]
    grid = [(i, j) for i in range(n + 1) for j in range(n + 1 - i)]
    number = {place: k for k, place in enumerate(grid)}
    u, v = (np.array(grid) / n).T
    w = 1 - u - v
    weights = np.stack([w, u, v])
    # Bernstein's polynomials of the control points that are lifted off the flat triangle.
    sides = [3 * a * b * c for a, b in ((w, u), (u, v), (v, w)) for c in (a, b)]
    inner = np.stack([*sides, 6 * u * v * w])
    points = np.einsum("ck,tcx->tkx", weights, corners) + np.einsum("bk,tbx->tkx", inner, lifts)
    small = [(number[i, j], number[i + 1, j], number[i, j + 1]) for i, j in grid if i + j < n]
    small += [
        (number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]) for i, j in grid if i + j < n - 1
    ]
    count = len(corners)
    triangles = np.arange(count)[:, None, None] * len(grid) + np.array(small)
    owner = np.repeat(np.arange(count), len(small)).astype(np.int32)
    return points.reshape(-1, 3), triangles.reshape(-1, 3).astype(np.int32), owner
