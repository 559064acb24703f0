"""Welding merges by distance alone; what has no area or stands twice goes, and is counted."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphshell_pin import _core
from sphshell_pin.errors import InvalidShell
from sphshell_pin.shell import clean

from .surfaces import CUBE, CUBE_QUADS, areas, by_place, expect, joined, plate, tetrahedron


@pytest.mark.parametrize(("factor", "merged"), [(0.99, True), (1.01, False)])
def test_tolerance_is_a_share_of_the_box(factor, merged):
    vertices, quads = plate(2)
    vertices = vertices * 3.0
    tolerance = 1e-7 * np.linalg.norm([3.0, 6.0])
    apart = vertices + [0.0, 3.0, factor * tolerance]
    health = clean(*joined((vertices, quads), (apart, quads))).health
    expect(health, weld_tolerance=tolerance, welded_vertices=3 * merged)


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


def test_unused_vertices_do_not_widen_the_box():
    vertices, triangles = tetrahedron()
    far = np.concatenate([vertices, [[1e6, 0, 0], [1e6, 1, 0]]])
    expect(clean(far, triangles).health, unused_vertices=2, vertices=4, size=np.sqrt(3.0))


def test_elements_without_area_are_dropped_and_counted():
    vertices, triangles = tetrahedron()
    vertices = np.concatenate([vertices, [[2.0, 0, 0], [3.0, 0, 0], [0.5, 0.0, 0.0]]])
    surface = clean(vertices, np.concatenate([triangles, [[0, 1, 4], [1, 1, 2], [4, 5, 0]]]))
    expect(surface.health, degenerate_elements=3, elements=4, is_closed=True)
    assert surface.source_element.tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize(("height", "kept"), [(1.1e-12, True), (0.9e-12, False), (0.0, False)])
def test_limit_of_area_is_against_the_longest_edge(height, kept):
    # area = height / 2 for a base of 1, limit 1e-12: the height must exceed 2e-12.
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 2 * height, 0], [0.3, 1.0, 0], [0.9, 1, 0]])
    surface = clean(points, [[0, 1, 2], [0, 1, 3], [1, 4, 3]])
    assert (0 in surface.source_element) == kept
    assert surface.health.degenerate_elements == (0 if kept else 1)


def test_duplicates_of_both_windings_are_dropped():
    health = clean(CUBE, [*CUBE_QUADS, [3, 2, 0, 1], [2, 3, 1, 0], [0, 4, 5, 1]]).health
    expect(health, duplicate_elements=3, opposite_duplicates=1, elements=6, is_closed=True)


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


@pytest.mark.parametrize("offset", [0.0, 1e-12, 1e3])
def test_soup_becomes_one_surface_wherever_it_is(offset):
    vertices, quads = plate(6)
    soup = vertices[quads].reshape(-1, 3) + offset
    health = clean(soup, np.arange(4 * len(quads)).reshape(-1, 4)).health
    expect(health, "merged", vertices=49, welded_vertices=4 * 36 - 49, boundary_edges=24)
