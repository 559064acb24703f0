"""Welding merges by distance alone; what has no area or stands twice goes, and is counted."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphshell_pin import _core
from sphshell_pin.errors import InvalidShell
from sphshell_pin.shell import clean

from .surfaces import CUBE, CUBE_QUADS, areas, by_place, joined, plate, tetrahedron


def test_soup_becomes_one_surface():
    vertices, quads = plate(6)
    surface = clean(vertices[quads].reshape(-1, 3), np.arange(4 * len(quads)).reshape(-1, 4))
    assert len(surface.vertices) == 49
    assert surface.health.welded_vertices == 4 * 36 - 49
    assert surface.health.boundary_edges == 24
    assert "merged" in surface.health.repairs[0]


@pytest.mark.parametrize(("factor", "merged"), [(0.99, True), (1.01, False)])
def test_tolerance_is_a_share_of_the_box(factor, merged):
    vertices, quads = plate(2)
    vertices = vertices * 3.0
    tolerance = 1e-7 * np.linalg.norm([3.0, 3.0])
    shift = np.array([0.0, 0.0, factor * tolerance])
    both, polygons = joined((vertices, quads), (vertices + shift + [0, 3.0, 0], quads))
    surface = clean(both, polygons)
    # The box is longer now: the same distance against the new diagonal.
    assert surface.health.weld_tolerance == pytest.approx(1e-7 * np.linalg.norm([3.0, 6.0]))
    assert surface.health.welded_vertices == 3
    gap = np.array([0.0, 3.0, factor * surface.health.weld_tolerance])
    apart, polygons = joined((vertices, quads), (vertices + gap, quads))
    assert (clean(apart, polygons).health.welded_vertices == 3) == merged


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.sampled_from([0.5, 1.0, 3.0, 100.0]))
def test_grid_finds_what_all_pairs_find(seed, count, spread):
    rng = np.random.default_rng(seed)
    tolerance = 1e-3
    centers = rng.uniform(0, 1, (4, 3))
    points = centers[rng.integers(0, 4, count)] + rng.normal(size=(count, 3)) * spread * tolerance
    points[rng.random(count) < 0.2] = points[0]
    near = np.linalg.norm(points[:, None] - points[None], axis=2) <= tolerance
    group = np.arange(count)
    for _ in range(count):
        group = np.where(near, group[None], count).min(axis=1)
    found, distance = _core.mend_weld(points, tolerance)
    assert found.tolist() == group.tolist()
    assert distance == pytest.approx(np.linalg.norm(points - points[group], axis=1).max())


def test_first_position_is_kept_exactly():
    points = np.array([[0.1, 0.2, 0.3], [1, 0, 0], [0, 1, 0], [0.1, 0.2, 0.3 + 1e-8], [1, 1, 0]])
    surface = clean(points, [[0, 1, 2], [3, 1, 4]])
    assert surface.health.welded_vertices == 1
    assert surface.health.weld_distance == pytest.approx(1e-8, rel=1e-6)
    assert (surface.vertices == points[0]).all(axis=1).any()


@pytest.mark.parametrize("offset", [0.0, 1e-12, 1e3])
def test_a_box_far_from_the_origin_is_welded_alike(offset):
    vertices, quads = plate(3)
    soup = vertices[quads].reshape(-1, 3) + offset
    assert clean(soup, np.arange(36).reshape(-1, 4)).health.vertices == 16


def test_unused_vertices_do_not_widen_the_box():
    vertices, triangles = tetrahedron()
    far = np.concatenate([vertices, [[1e6, 0, 0], [1e6, 1, 0]]])
    health = clean(far, triangles).health
    assert health.unused_vertices == 2
    assert health.size == pytest.approx(np.sqrt(3.0))
    assert health.vertices + health.unused_vertices + health.welded_vertices == len(far)


def test_elements_without_area_are_dropped_and_counted():
    vertices, triangles = tetrahedron()
    vertices = np.concatenate([vertices, [[2.0, 0, 0], [3.0, 0, 0], [0.5, 0.0, 0.0]]])
    more = np.concatenate([triangles, [[0, 1, 4], [1, 1, 2], [4, 5, 0]]])
    surface = clean(vertices, more)
    assert surface.health.degenerate_elements == 3
    assert surface.health.elements == 4
    assert surface.source_element.tolist() == [0, 1, 2, 3]
    assert surface.health.is_closed


@pytest.mark.parametrize(("height", "kept"), [(1.1e-12, True), (0.9e-12, False), (0.0, False)])
def test_limit_of_area_is_against_the_longest_edge(height, kept):
    # area = height / 2 for a base of 1, limit 1e-12: the height must exceed 2e-12.
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 2 * height, 0], [0.3, 1.0, 0], [0.9, 1, 0]])
    surface = clean(points, [[0, 1, 2], [0, 1, 3], [1, 4, 3]])
    assert (0 in surface.source_element) == kept
    assert surface.health.degenerate_elements == (0 if kept else 1)


def test_duplicates_of_both_windings_are_dropped():
    extra = [[3, 2, 0, 1], [2, 3, 1, 0], [0, 4, 5, 1]]
    health = clean(CUBE, CUBE_QUADS + extra).health
    assert health.duplicate_elements == 3
    assert health.opposite_duplicates == 1
    assert health.elements == 6
    assert health.degenerate_elements == 0
    assert health.is_closed


def test_repeated_corners_make_smaller_elements():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1e-9, 0]])
    surface = clean(points, [[0, 1, 1, 2], [0, 2, 3, 4]])
    assert by_place(surface) == by_place(clean(points[:4], [[0, 1, 2], [0, 2, 3]]))


def test_spikes_are_cut_off():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 2, 0]])
    surface = clean(points, [[0, 1, 2, 4, 2, 3]])
    assert np.linalg.norm(areas(surface), axis=1).sum() == pytest.approx(1.0)
    assert surface.health.unused_vertices == 1


def test_nothing_left_is_an_error():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]])
    with pytest.raises(InvalidShell, match="no element is left"):
        clean(points, [[0, 1, 2], [1, 2, 3]])
    with pytest.raises(InvalidShell, match="one place"):
        clean(np.ones((3, 3)), [[0, 1, 2]])
