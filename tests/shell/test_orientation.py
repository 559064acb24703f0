"""Winding is made consistent, closed surfaces face outward, and cavities inward."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphshell_pin.shell import clean

from .surfaces import CUBE, CUBE_QUADS, areas, by_place, joined, plate, signed_volume, tetrahedron


@given(st.lists(st.booleans(), min_size=6, max_size=6))
@settings(max_examples=30, deadline=None)
def test_any_winding_of_a_cube_ends_outward(turned):
    quads = [q[::-1] if flip else q for q, flip in zip(CUBE_QUADS, turned, strict=True)]
    surface = clean(CUBE, quads)
    assert signed_volume(surface) == pytest.approx(1.0)
    assert surface.health.flipped_elements == sum(turned)
    assert surface.health.reversed_components == int(all(turned))
    assert surface.health.volume == pytest.approx(1.0)


def test_an_open_sheet_keeps_the_winding_of_most_of_its_area():
    vertices, quads = plate(3)
    quads[4] = quads[4][::-1]
    surface = clean(vertices, quads)
    assert (areas(surface)[:, 2] > 0).all()
    assert surface.health.flipped_elements == 1
    surface = clean(vertices, quads[:, ::-1])
    assert (areas(surface)[:, 2] < 0).all()
    assert surface.health.ok


def test_nested_components_alternate():
    inner = (0.2 * CUBE + 0.4, CUBE_QUADS)
    middle = (0.6 * CUBE + 0.2, CUBE_QUADS)
    beside = (CUBE + np.array([3.0, 0, 0]), CUBE_QUADS)
    surface = clean(*joined((CUBE, CUBE_QUADS), inner, middle, beside))
    health = surface.health
    assert health.cavities == 1
    assert health.closed_components == 4
    assert signed_volume(surface) == pytest.approx(1 - 0.6**3 + 0.2**3 + 1)
    assert health.volume == pytest.approx(signed_volume(surface))
    assert any("cavity" in sentence for sentence in health.repairs)


def test_two_cubes_with_a_common_edge_are_both_closed():
    surface = clean(*joined((CUBE, CUBE_QUADS), (CUBE + np.array([1.0, 1.0, 0.0]), CUBE_QUADS)))
    health = surface.health
    assert health.closed_components == 2
    assert health.non_manifold_edges == 1
    assert health.is_closed
    assert health.volume == pytest.approx(2.0)
    assert any("non-manifold" in sentence for sentence in health.problems)


def moebius(n=24):
    turn = 2 * np.pi * np.arange(n) / n
    half = np.column_stack(
        [np.cos(turn / 2) * np.cos(turn), np.cos(turn / 2) * np.sin(turn), np.sin(turn / 2)]
    )
    middle = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n)])
    points = np.concatenate([middle + 0.3 * half, middle - 0.3 * half])
    strips = [[k, k + 1, n + k + 1, n + k] for k in range(n - 1)] + [[n - 1, n, 0, 2 * n - 1]]
    return points, strips


def test_a_moebius_strip_is_reported():
    health = clean(*moebius()).health
    assert health.one_sided_components == 1
    assert not health.ok
    assert any("Moebius" in sentence for sentence in health.problems)
    assert health.boundary_loops == 1


def test_a_missing_half_of_a_face_is_a_hole():
    health = clean(CUBE, [*CUBE_QUADS[:5], [1, 5, 7]]).health
    assert not health.is_closed
    assert (health.holes, health.hole_edges) == (1, 3)
    assert health.largest_hole_area == pytest.approx(0.5)
    assert any("wrong number of corners" in sentence for sentence in health.problems)


def test_a_sheet_is_no_hole():
    for n in (1, 2, 7):
        health = clean(*plate(n)).health
        assert health.ok
        assert (health.holes, health.boundary_loops, health.boundary_edges) == (0, 1, 4 * n)


@given(st.randoms(use_true_random=False), st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_the_outcome_does_not_depend_on_any_order(random, seed):
    rng = np.random.default_rng(seed)
    # Faces of a coarse voxel set: T-free but with non-manifold edges, duplicates and both windings.
    cells = rng.integers(0, 2, (2, 2, 2))
    parts = [
        (CUBE + np.array(cell), [q for q in CUBE_QUADS if rng.random() < 0.9])
        for cell in np.argwhere(cells)
    ]
    parts = [part for part in parts if part[1]]
    if not parts:
        return
    vertices, polygons = joined(*parts)
    order = random.sample(range(len(polygons)), len(polygons))
    numbers = random.sample(range(len(vertices)), len(vertices))
    place = np.argsort(numbers)
    turned = []
    for k in order:
        row = [int(place[v]) for v in polygons[k]]
        start = random.randrange(len(row))
        turned.append(row[start:] + row[:start])
    one, two = clean(vertices, polygons), clean(vertices[numbers], turned)
    assert by_place(one, wound=False) == by_place(two, wound=False)
    for name in (
        "welded_vertices",
        "duplicate_elements",
        "edges",
        "boundary_edges",
        "non_manifold_edges",
        "components",
        "closed_components",
        "volume",
        "holes",
    ):
        assert getattr(one.health, name) == pytest.approx(getattr(two.health, name)), name


def test_normals_follow_the_winding():
    vertices, triangles = tetrahedron()
    flat = areas(clean(vertices, triangles))
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    corner = np.repeat(flat[:, None, :], 3, axis=1)
    corner[2] *= -1.0
    surface = clean(vertices, np.concatenate([triangles[:2], triangles[2:, ::-1]]), corner)
    health = surface.health
    assert health.flipped_elements == 2
    assert health.turned_normals == 3
    assert health.opposing_normals == 0
    own = areas(surface) / np.linalg.norm(areas(surface), axis=1, keepdims=True)
    assert surface.normals == pytest.approx(np.repeat(own[:, None, :], 3, axis=1))


def test_bad_normals_are_mended_and_reported():
    vertices, quads = plate(1)
    normals = np.array([[[0, 0, 2.0], [0, 0, 0], [np.nan, 0, 1], [0.6, 0, 0.8]]])
    surface = clean(vertices, quads, normals)
    health = surface.health
    assert (health.rescaled_normals, health.missing_normals) == (1, 2)
    assert np.linalg.norm(surface.normals, axis=2) == pytest.approx(1.0)
    assert health.largest_normal_angle == pytest.approx(np.arccos(0.8))
    assert "zero or not finite" in " ".join(health.repairs)


def test_a_normal_that_opposes_its_element_alone_is_a_problem():
    vertices, quads = plate(1)
    normals = np.array([[[0, 0, 1.0], [0, 0, 1], [0, 0, 1], [0, 0.6, -0.8]]])
    health = clean(vertices, quads, normals).health
    assert (health.turned_normals, health.opposing_normals) == (0, 1)
    assert any("90 degrees" in sentence for sentence in health.problems)


def test_tiny_normals_are_directions_all_the_same():
    vertices, quads = plate(1)
    surface = clean(vertices, quads, np.full((4, 3), [0.0, 0.0, 1e-200]))
    assert surface.health.missing_normals == 0
    assert surface.normals[..., 2] == pytest.approx(1.0)
