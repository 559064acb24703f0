"""Meshes of the public cases."""

import struct
from collections.abc import Callable

import numpy as np


def block(low: tuple[float, ...], high: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices (8, 3) and triangles (12, 3) of a box, wound outwards."""
    vertices = np.array(
        [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    )
    squares = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return vertices, np.array([t for a, b, c, d in squares for t in ((a, b, c), (a, c, d))])


def terrain(
    count: int, half: float, height: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and triangles of a height field on a square of side 2 half [m]."""
    ticks = np.linspace(-half, half, count)
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    number = np.arange(count * count).reshape(count, count)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return np.stack((x, y, height(x, y)), axis=-1).reshape(-1, 3), triangles


TETRAHEDRON = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.3]], np.float32)
SIDES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))


def binary_stl(header: bytes, after: bytes = b"") -> bytes:
    """Return a binary STL file of a tetrahedron."""
    facets = (struct.pack("<12fH", 0, 0, 0, *TETRAHEDRON[list(side)].ravel(), 0) for side in SIDES)
    return header.ljust(80) + struct.pack("<I", len(SIDES)) + b"".join(facets) + after
