"""Winding is made consistent, closed surfaces face outward, and cavities inward."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sphshell_pin.shell import clean

from . import surfaces
from .surfaces import CUBE, CUBE_QUADS, expect, joined, plate


@given(st.lists(st.booleans(), min_size=6, max_size=6))
@settings(max_examples=30, deadline=None)
def test_any_winding_of_a_cube_ends_outward(turned):
    quads = [q[::-1] if flip else q for q, flip in zip(CUBE_QUADS, turned, strict=True)]
    surface = clean(CUBE, quads)
    assert surfaces.signed_volume(surface) == pytest.approx(1.0)
    flipped, reversed_ = sum(turned), int(all(turned))
    expect(surface.health, flipped_elements=flipped, reversed_components=reversed_, volume=1.0)


def test_an_open_sheet_keeps_the_winding_of_most_of_its_area():
    vertices, quads = plate(3)
    quads[4] = quads[4][::-1]
    surface = clean(vertices, quads)
    assert (surfaces.areas(surface)[:, 2] > 0).all()
    assert surface.health.flipped_elements == 1
    surface = clean(vertices, quads[:, ::-1])
    assert (surfaces.areas(surface)[:, 2] < 0).all()
    assert surface.health.ok


def test_nested_components_alternate():
    inner = (0.2 * CUBE + 0.4, CUBE_QUADS)
    middle = (0.6 * CUBE + 0.2, CUBE_QUADS)
    beside = (CUBE + np.array([3.0, 0, 0]), CUBE_QUADS)
    surface = clean(*joined((CUBE, CUBE_QUADS), inner, middle, beside))
    volume = 1 - 0.6**3 + 0.2**3 + 1
    assert surfaces.signed_volume(surface) == pytest.approx(volume)
    expect(surface.health, "cavity", cavities=1, closed_components=4, volume=volume)


def test_two_cubes_with_a_common_edge_are_both_closed():
    cubes = joined((CUBE, CUBE_QUADS), (CUBE + np.array([1.0, 1.0, 0.0]), CUBE_QUADS))
    figures = {"closed_components": 2, "non_manifold_edges": 1, "is_closed": True, "volume": 2.0}
    expect(clean(*cubes).health, "non-manifold", **figures)


def moebius(n=24):
    turn = 2 * np.pi * np.arange(n) / n
    out = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n)])
    half = np.cos(turn / 2)[:, None] * out + np.sin(turn / 2)[:, None] * [0, 0, 1]
    strips = [[k, k + 1, n + k + 1, n + k] for k in range(n - 1)] + [[n - 1, n, 0, 2 * n - 1]]
    return np.concatenate([out + 0.3 * half, out - 0.3 * half]), strips


def test_a_moebius_strip_is_reported():
    expect(clean(*moebius()).health, "Moebius", one_sided_components=1, ok=False, boundary_loops=1)


def test_a_missing_half_of_a_face_is_a_hole():
    health = clean(CUBE, [*CUBE_QUADS[:5], [1, 5, 7]]).health
    figures = {"holes": 1, "hole_edges": 3, "largest_hole_area": 0.5, "is_closed": False}
    expect(health, "wrong number of corners", **figures)


def test_a_sheet_is_no_hole():
    for n in (1, 7):
        health = clean(*plate(n)).health
        expect(health, ok=True, holes=0, boundary_loops=1, boundary_edges=4 * n)


@given(st.randoms(use_true_random=False), st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_the_outcome_does_not_depend_on_any_order(random, seed):
    rng = np.random.default_rng(seed)
    # Faces of a coarse voxel set: T-free but with non-manifold edges, duplicates and both windings.
    cells = np.argwhere(rng.integers(0, 2, (2, 2, 2)))
    parts = [(CUBE + cell, [q for q in CUBE_QUADS if rng.random() < 0.9]) for cell in cells]
    parts = [part for part in parts if part[1]]
    if not parts:
        return
    vertices, polygons = joined(*parts)
    order = random.sample(range(len(polygons)), len(polygons))
    numbers = random.sample(range(len(vertices)), len(vertices))
    place = np.argsort(numbers)
    turned = [np.roll(place[polygons[k]], random.randrange(4)).tolist() for k in order]
    one, two = clean(vertices, polygons), clean(vertices[numbers], turned)
    assert surfaces.by_place(one, wound=False) == surfaces.by_place(two, wound=False)
    names = "welded_vertices duplicate_elements edges boundary_edges non_manifold_edges "
    names += "components closed_components volume holes"
    expect(one.health, **{name: getattr(two.health, name) for name in names.split()})


def test_normals_follow_the_winding():
    vertices, triangles = surfaces.tetrahedron()
    flat = surfaces.areas(clean(vertices, triangles))
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    corner = np.repeat(flat[:, None, :], 3, axis=1)
    corner[2] *= -1.0
    surface = clean(vertices, np.concatenate([triangles[:2], triangles[2:, ::-1]]), corner)
    expect(surface.health, flipped_elements=2, turned_normals=3, opposing_normals=0)
    own = surfaces.areas(surface) / np.linalg.norm(surfaces.areas(surface), axis=1, keepdims=True)
    assert surface.normals == pytest.approx(np.repeat(own[:, None, :], 3, axis=1))


def test_bad_normals_are_mended_and_reported():
    normals = np.array([[[0, 0, 1e-200], [0, 0, 0], [np.nan, 0, 1], [0.96, 0, 0.28]]])
    surface = clean(*plate(1), normals)
    figures = {"rescaled_normals": 1, "missing_normals": 2, "opposing_normals": 0}
    angle = np.arccos(0.28)
    expect(surface.health, "zero or not finite", largest_normal_angle=angle, **figures)
    assert np.linalg.norm(surface.normals, axis=2) == pytest.approx(1.0)


def test_a_normal_that_opposes_its_element_alone_is_a_problem():
    normals = np.array([[[0, 0, 1.0], [0, 0, 1], [0, 0, 1], [0, 0.6, -0.8]]])
    health = clean(*plate(1), normals).health
    expect(health, "90 degrees", turned_normals=0, opposing_normals=1)
