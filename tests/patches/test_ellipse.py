"""Integrals of Hertz's pressure against sums over fine grids, and what must be exact."""

import numpy as np
import pytest

from sphshell_pin.patches.placed import load_in_polygons, pressure


def summed(polygon, n=1500):
    """The load in a convex polygon, by the midpoint rule."""
    at = (np.arange(n) + 0.5) / n * 2 - 1
    u = np.stack(np.meshgrid(at, at), axis=-1)
    inside = np.ones((n, n), dtype=bool)
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        inside &= (b - a)[0] * (u[..., 1] - a[1]) - (b - a)[1] * (u[..., 0] - a[0]) >= 0
    return (pressure(u) * inside).sum() * (2 / n) ** 2 / (2 * np.pi / 3)


@pytest.mark.parametrize("seed", range(4))
def test_loads_in_triangles(seed):
    corners = np.random.default_rng(seed).normal(size=(3, 2))
    side, other = corners[1] - corners[0], corners[2] - corners[0]
    if side[0] * other[1] - side[1] * other[0] < 0:
        corners = corners[::-1]
    assert load_in_polygons(corners) == pytest.approx(summed(corners), abs=1e-4)
    assert load_in_polygons(corners[::-1]) == pytest.approx(-load_in_polygons(corners), abs=1e-15)


def test_sectors_and_the_whole():
    square = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
    assert load_in_polygons(square) == pytest.approx(1.0, abs=1e-15)
    quarter = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    assert load_in_polygons(quarter) == pytest.approx(0.25, abs=1e-15)
    assert load_in_polygons(quarter + 3.0) == pytest.approx(0.0, abs=1e-15)


def test_cells_of_any_grid_add_up():
    rng = np.random.default_rng(1)
    x = np.concatenate([[-1.5], np.sort(rng.uniform(-1, 1, 11)), [1.5]])
    y = np.concatenate([[-1.5], np.sort(rng.uniform(-1, 1, 6)), [1.5]])
    corner = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    cells = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=2)
    loads = load_in_polygons(cells)
    assert loads.min() > -1e-15
    assert loads.sum() == pytest.approx(1.0, abs=1e-14)
