"""Welding merges by distance alone; what has no area or stands twice goes, and is counted.

Vertices on the open edges of other elements become corners there: no crack stays open.
"""

from itertools import pairwise

import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphshell_pin import _core
from sphshell_pin.errors import InvalidShell
from sphshell_pin.shell import Shell, clean

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


def halves(cuts, gap=0.0):
    """Return a plate whose left half is one quad and whose right half is cut at heights `cuts`."""
    heights = [0.0, *cuts, 1.0]
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    quads = [[0, 1, 2, 3]]
    for low, high in pairwise(heights):
        k = len(points)
        points += [[1 + gap, low, 0], [2, low, 0], [2, high, 0], [1 + gap, high, 0]]
        quads.append([k, k + 1, k + 2, k + 3])
    return np.array(points, float), quads


@pytest.mark.parametrize("gap", [0.0, 1e-8, -1e-8])
@pytest.mark.parametrize("cuts", [[0.5], [0.3, 0.6], [0.1, 0.11, 0.5, 0.9]])
def test_a_coarse_side_meets_a_fine_one(cuts, gap):
    surface = clean(*halves(cuts, gap))
    figures = {"boundary_loops": 1, "non_manifold_edges": 0, "euler_number": 1}
    expect(surface.health, "T-junctions", t_junctions=len(cuts), **figures)
    assert np.linalg.norm(areas(surface), axis=1).sum() == pytest.approx(2.0, rel=1e-6)
    assert (areas(surface)[:, 2] > 0.0).all()
    assert surface.source_element.min() == 0


def test_one_inserted_corner_keeps_the_element_whole():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0.5, 0.5, 0]])
    surface = clean(points, [[0, 1, 2], [1, 3, 4], [3, 2, 4]])
    expect(surface.health, t_junctions=1, quads=1)
    assert surface.source_element.tolist() == [0, 1, 2]


def test_no_vertex_is_taken_beyond_the_tolerance():
    assert clean(*halves([0.5], gap=1e-5)).health.t_junctions == 0


def test_dropping_a_filler_opens_a_crack_that_is_closed_again():
    # A zero-area triangle on the edge between a coarse and a fine side.
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 0, 0], [0.5, 1, 0], [0.5, -1, 0]])
    health = clean(points, [[0, 1, 2], [0, 2, 4][::-1], [2, 1, 4][::-1], [0, 1, 3]]).health
    expect(health, degenerate_elements=1, t_junctions=1, boundary_edges=4, components=1)


def test_corner_normals_are_interpolated():
    points, quads = halves([0.25])
    left, right = np.array([0.0, 0.6, 0.8]), np.array([0.0, -0.6, 0.8])
    normals = np.where(points[:, 1:2] < 0.5, left, right)
    surface = clean(points, quads, normals)
    at = np.argwhere(np.isclose(surface.vertices[surface.triangles], [1, 0.25, 0]).all(axis=2))
    own = [k for k in at if surface.source_element[surface.triangle_element[k[0]]] == 0]
    wanted = left + 0.25 * (right - left)
    for triangle, corner in own:
        assert surface.normals[triangle, corner] == pytest.approx(wanted / np.linalg.norm(wanted))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.05, 0.95), st.booleans())
def test_a_ball_refined_here_and_there_is_closed(seed, share, turn):
    rng = np.random.default_rng(seed)
    ball = Shell.from_geometry(coal.Sphere(1.0), segments=16)
    vertices, triangles = list(ball.vertices), []
    for triangle in ball.triangles:
        a, b, c = triangle
        if rng.random() < share:
            p = ball.vertices[triangle]
            k = len(vertices)
            vertices += list((p + np.roll(p, -1, axis=0)) / 2)
            triangles += [[a, k, k + 2], [k, b, k + 1], [k + 2, k + 1, c], [k, k + 1, k + 2]]
        else:
            triangles.append([a, b, c])
    basis = np.linalg.qr(rng.normal(size=(3, 3)))[0] if turn else np.eye(3)
    health = clean(np.array(vertices) @ basis, triangles).health
    expect(health, is_closed=True, euler_number=2, non_manifold_edges=0, area=ball.health.area)
    assert health.volume == pytest.approx(ball.health.volume, rel=1e-9)
