"""A touch to the last bit: whatever round-off decides, the side is right and the depth tiny."""

import numpy as np
import pytest

from sphshell_pin import Shell
from tests.shell.surfaces import tetrahedron

ULP = np.finfo(float).eps
CENTRE = np.array([0.0018106635814484975, 0.00477644869516463, 0.0063902217497468425])


@pytest.mark.parametrize("size", [0.5, 3.0])
def test_first_touch_of_an_edge_is_no_push_from_behind(size: float) -> None:
    """Outside of an edge or vertex may be behind the plane of one of its elements."""
    vertices, elements = tetrahedron(size, at=(-0.1, -0.2, -0.15))[:2]
    shell = Shell(vertices, elements, side="outside")
    rng = np.random.default_rng(7)
    middle = shell.vertices.mean(axis=0)
    ends = shell.vertices[shell.edge_vertices]
    touched = 0
    for _ in range(2000):
        a, b = ends[rng.integers(len(ends))]
        foot = a + rng.choice([0.0, rng.uniform()]) * (b - a)
        # Outward of all elements that meet there: away from the body's middle, across the edge.
        away = foot - middle + 0.1 * size * rng.normal(size=3)
        if 0.0 < np.linalg.norm(foot - a) < np.linalg.norm(b - a):
            along = (b - a) / np.linalg.norm(b - a)
            away -= (away @ along) * along
        away /= np.linalg.norm(away)
        centre = foot + away
        nearest = shell.closest_points(centre[None], method="facets")
        if np.linalg.norm(nearest.points[0] - foot) > 1e-9:
            continue
        for k in range(-2, 3):
            found = shell.contacts(centre, float(1.0 + k * ULP))
            touched += len(found.depth)
            assert (found.depth < 1e-14).all()
            assert (found.normal @ away > 1.0 - 1e-9).all()
    assert touched > 1000


def test_a_touch_whose_edge_misses_it_by_round_off() -> None:
    """Here the edge is one unit in the last place too far, and an element beside it is not: it may
    touch or not, but not from behind."""
    radius = 0.007161000064252406
    vertices, elements = tetrahedron(0.5, at=(-0.125, -0.125, -0.125))[:2]
    shell = Shell(vertices * radius, elements, side="outside")
    found = shell.contacts(CENTRE, radius)
    assert (found.normal @ CENTRE > 0).all()
    assert (found.depth < 1e-15).all()
    assert len(found.depth) <= 1
