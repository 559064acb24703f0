"""The surface and the sphere positions of the speed measurements."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

AMPLITUDE, WAVE_X, WAVE_Y = 0.03, 9.0, 7.0


def height(x: Array, y: Array) -> Array:
    """Height of a wavy sheet [m]."""
    return AMPLITUDE * np.sin(WAVE_X * x) * np.cos(WAVE_Y * y)


def wavy_sheet(cells: int, size: float) -> tuple[Array, NDArray[np.int32]]:
    """Return vertices and 2 * cells^2 triangles of a square sheet of side `size` [m]."""
    x = np.linspace(-size / 2, size / 2, cells + 1)
    grid_x, grid_y = np.meshgrid(x, x, indexing="ij")
    vertices = np.c_[grid_x.ravel(), grid_y.ravel(), height(grid_x, grid_y).ravel()]
    i = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = i[:-1, :-1].ravel(), i[1:, :-1].ravel(), i[1:, 1:].ravel(), i[:-1, 1:].ravel()
    return vertices, np.concatenate([np.c_[a, b, c], np.c_[a, c, d]]).astype(np.int32)


def touching_centres(count: int, size: float, radius: float, depth: float) -> Array:
    """Return random centres (count, 3) of spheres at about `depth` in the sheet."""
    xy = np.random.default_rng(0).uniform(-0.45 * size, 0.45 * size, (count, 2))
    x, y = xy.T
    slope_x = AMPLITUDE * WAVE_X * np.cos(WAVE_X * x) * np.cos(WAVE_Y * y)
    slope_y = -AMPLITUDE * WAVE_Y * np.sin(WAVE_X * x) * np.sin(WAVE_Y * y)
    normal = np.c_[-slope_x, -slope_y, np.ones(count)]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return np.c_[xy, height(x, y)] + normal * (radius - depth)
