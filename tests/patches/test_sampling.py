"""Pieces of a shell near contacts."""

import coal
import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.patches.foundation import divide
from tests.patches.scenes import plate


def test_pieces_cover_what_is_near_and_nothing_twice():
    shell = plate(0.05, 3)
    places = np.array([[0.0, 0.0, 0.0], [0.02, 0.01, 0.0]])
    samples = divide(shell, places, 5e-3, 5e-4, curved=False)
    assert samples.areas.max() <= 25e-8
    grid = np.round(samples.points / 1e-7).astype(np.int64)
    assert len(np.unique(grid, axis=0)) == len(grid)
    near = np.linalg.norm(samples.points - places[0], axis=1) < 5e-3
    assert samples.areas[near].sum() == pytest.approx(np.pi * 25e-6, rel=0.02)


def test_pieces_of_curved_elements_are_on_them():
    radius = 0.03
    ball = sp.Shell.from_geometry(coal.Sphere(radius), segments=16)
    top = np.array([[0.0, 0.0, radius]])
    curved, flat = (divide(ball, top, 5e-3, 5e-4, curved=one) for one in (True, False))
    away = [np.abs(np.linalg.norm(one.points, axis=1) - radius).max() for one in (curved, flat)]
    assert away[0] < 0.1 * away[1]
