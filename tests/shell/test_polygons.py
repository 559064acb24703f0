"""Quads stay whole if planar and convex; everything larger is cut without loss."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphshell_pin.shell import clean

from .surfaces import areas, by_place, expect, star


def total(surface):
    return np.linalg.norm(areas(surface), axis=1).sum()


def ring(points):
    return np.column_stack([points, np.zeros(len(points))])


@pytest.mark.parametrize(("lift", "split"), [(1e-11, False), (1e-9, True), (0.1, True)])
def test_warped_quads_are_split_and_reported(lift, split):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, lift], [0, 1, 0]])
    surface = clean(points, [[0, 1, 2, 3]])
    expect(surface.health, quads=1 - split, warped_quads=int(split))
    assert (surface.source_element == 0).all()
    if split:
        assert surface.health.largest_warp == pytest.approx(lift / 4, rel=0.05)
        expect(surface.health, "not planar")


def test_concave_quads_are_split_through_the_reflex_corner():
    points = ring(np.array([[0.0, 0], [2, 0], [0.5, 0.5], [0, 2]]))
    for turn in range(4):
        surface = clean(points, [np.roll([0, 1, 2, 3], turn)])
        assert surface.health.concave_quads == 1
        assert total(surface) == pytest.approx(1.0)
        assert (areas(surface)[:, 2] > 0).all()


@given(st.permutations(range(4)), st.booleans(), st.floats(0.1, 5.0), st.floats(0.1, 1.0))
@settings(max_examples=40, deadline=None)
def test_the_diagonal_does_not_depend_on_numbering(numbers, turned, width, slant):
    points = ring(np.array([[0.0, 0], [width, 0], [width + slant, 1], [slant, 1]]))
    cycle = [0, 1, 2, 3][:: -1 if turned else 1]
    place = np.argsort(numbers)
    one = clean(points, [[0, 1, 2, 3]])
    two = clean(points[numbers], [[int(place[k]) for k in cycle]])
    triangles = [sorted(sorted(map(tuple, s.vertices[t])) for t in s.triangles) for s in (one, two)]
    assert triangles[0] == triangles[1]


def test_a_hole_reached_by_a_bridge_stays_a_hole():
    outer = [[0.0, 0], [3, 0], [3, 3], [0, 3]]
    inner = [[1.0, 1], [1, 2], [2, 2], [2, 1]]
    surface = clean(ring(np.array(outer + inner)), [[0, 1, 2, 3, 0, 4, 5, 6, 7, 4]])
    assert total(surface) == pytest.approx(8.0)
    expect(surface.health, boundary_loops=2, tangled_polygons=0)
    assert (areas(surface)[:, 2] > 0).all()


@given(st.integers(5, 40), st.integers(0, 2**32 - 1), st.integers(0, 39))
@settings(max_examples=40, deadline=None)
def test_star_polygons_are_covered_exactly(corners, seed, turn):
    rng = np.random.default_rng(seed)
    flat = star(corners, rng)
    area = 0.5 * np.sum(flat[:, 0] * np.roll(flat[:, 1], -1) - flat[:, 1] * np.roll(flat[:, 0], -1))
    basis, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    points = flat @ basis[:2]
    one = clean(points, [list(range(corners))])
    figures = {"elements": corners - 2, "vertices": corners, "boundary_edges": corners}
    expect(one.health, tangled_polygons=0, **figures)
    assert total(one) == pytest.approx(area, rel=1e-12)
    two = clean(points, [np.roll(np.arange(corners), turn).tolist()])
    assert by_place(one, wound=False) == by_place(two, wound=False)


def test_outlines_that_cross_themselves_are_reported():
    points = ring(np.array([[0.0, 0], [2, 0], [0, 1], [2, 1], [1, 2.0]]))
    expect(clean(points, [[0, 1, 2, 3, 4]]).health, "crosses itself", tangled_polygons=1)
