"""Vertices on the open edges of other elements become corners there: no crack stays open."""

from itertools import pairwise

import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphshell_pin.shell import Shell, clean

from .surfaces import areas, expect


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
