"""The fast query meets the brute-force definition on random, structured and nasty surfaces."""

from functools import partial
from itertools import product

import numpy as np
import pytest

from tests import meshes
from tests.contact.helpers import heights, positions, shell_of
from tests.oracle import contacts as oracle
from tests.oracle.geometry import closest_on_triangles, corners_of, norm

EPS = float(np.finfo(float).eps)

# name -> (mesh, radii to try)
SURFACES = {
    "quads": (meshes.grid_plate(3, 3, quads=True), (0.2, 1.5)),
    "random plate": (meshes.random_plate(60, seed=1), (0.1, 0.4)),
    "l plate": (meshes.l_plate(2), (0.2, 0.8)),
    "v groove": (meshes.v_groove(0.5, cells=2), (0.2, 1.2)),
    "flat v groove": (meshes.v_groove(1e-3, cells=2), (0.3, 1.0)),
    "ridge": (meshes.v_groove(-0.5, cells=2), (0.2, 1.2)),
    "cube": (meshes.cube(), (0.3, 1.2)),
    "cube of quads": (meshes.cube(quads=True), (0.3, 1.2)),
    "icosahedron": (meshes.icosphere(0), (0.4, 1.2)),
    "icosphere": (meshes.icosphere(2), (0.2, 0.95)),
    "bowl": (meshes.bowl(6), (0.3, 1.5)),
    "crumpled": (meshes.crumpled(5, seed=2), (0.15, 0.5)),
    "needles": (meshes.needles(24, 1e4), (0.05, 0.6)),
    "fan": (meshes.fan(5, seed=1), (0.2, 0.6)),
    "soup": (meshes.soup(40, seed=0), (0.2, 0.5)),
    "sparse soup": (meshes.soup(12, seed=5, spread=0.3), (0.4, 1.5)),
    "dense soup": (meshes.soup(120, seed=7, spread=0.2), (0.15,)),
}


def listed(vertices, elements) -> meshes.Mesh:
    return np.array(vertices, dtype=float), np.array(elements, dtype=np.int32)


# Two triangles on the same side of their edge are coplanar, but no planar face.
for share, other in product((0.3, 0.999, 1.0, 1.5), ((0, 1, 3), (1, 0, 3))):
    sheet = listed([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, share, 0)], [(0, 1, 2), other])
    SURFACES[f"sheet folded flat, {share}, {other}"] = (sheet, (0.2, 1.0))
# A wall without vertices of the floor that it stands on is not felt from below.
FLOOR = [(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)]
WALL = [(-0.2, 0.05, 0), (0.2, 0.05, 0), (0.2, 0.05, 0.3), (-0.2, 0.05, 0.3)]
HALVES = [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)]
SURFACES["wall on a floor"] = (listed(FLOOR + WALL, HALVES), (0.1, 0.4))
# The rim of an element that lies inside another one is no rim of the surface.
INNER = [(-1, -1, 0), (1, -1, 0), (0, 1, 0), (-0.2, -0.4, 0), (0.3, -0.5, 0), (0.1, 0.1, 0)]
SURFACES["one inside another"] = (listed(INNER, [(0, 1, 2), (3, 4, 5)]), (0.1, 0.5))

CLOSED = ("cube", "cube of quads", "icosahedron")
SETS = [(name, method, "both") for name in SURFACES for method in ("facets", "elements")]
SETS += [(name, "facets", side) for name in CLOSED for side in ("outside", "inside")]


@pytest.mark.parametrize("count", [12, pytest.param(60, marks=pytest.mark.study)])
@pytest.mark.parametrize(("name", "method", "side"), SETS)
def test_same_set(name: str, method: str, side: str, count: int) -> None:
    """Same set to 1e-12 of the size; a needle's plane is known to eps / height only."""
    (vertices, elements), radii = SURFACES[name]
    shell = shell_of((vertices, elements), side=side)
    corners, owner = corners_of(vertices, elements)
    find = partial(oracle.facets, side=side) if method == "facets" else oracle.elements
    height = heights(vertices, elements[:, :3]).min()
    touched = 0
    count = count if method == "facets" else count // 3
    for radius in radii:
        for center in positions(vertices, elements, radius, count, seed=len(name)):
            expected = find(center, radius, corners, owner)
            found = shell.contacts(center, radius, method=method)
            size = oracle.size_of(center, radius, corners)
            tolerance = 1e-12 * size + 8 * EPS * size**2 / height
            if side != "both":
                if abs(shell.closest_points(center[None], method="facets").distances[0]) < 1e-9:
                    continue  # on the surface the side is undecided
                if len(expected) == 1 and expected[0].depth > radius:
                    # Behind the surface, any of several faces may be the nearest.
                    assert found.depth == pytest.approx([expected[0].depth], abs=tolerance)
                    continue
            why = oracle.mismatch(found, expected, tolerance)
            assert not why, f"{name}, radius {radius}, center {center.tolist()}: {why}"
            close = [t for t in expected if t.depth < 0.99 * radius]
            if len(close) == len(expected) > 0:
                assert oracle.normal_error(found, expected) <= 1e2 * tolerance / radius
            touched += len(found)
    assert touched > count


@pytest.mark.parametrize("name", ["cube", "icosphere", "crumpled", "soup", "fan", "needles"])
def test_closest_points(name: str) -> None:
    """The distance of `closest_points` is the smallest over all triangles."""
    vertices, elements = SURFACES[name][0]
    shell = shell_of((vertices, elements))
    corners, _ = corners_of(vertices, elements)
    points = np.array(list(positions(vertices, elements, 0.8, 50, seed=1)))
    closest = shell.closest_points(points, method="facets")
    for k, point in enumerate(points):
        distance = float(norm(point - closest_on_triangles(point, corners)).min())
        assert abs(abs(closest.distances[k]) - distance) <= 1e-12
        assert abs(np.linalg.norm(point - closest.points[k]) - distance) <= 1e-12
        assert abs(np.linalg.norm(closest.normals[k]) - 1.0) <= 1e-14


@pytest.mark.parametrize("height", [1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7])
def test_nearly_flat_is_not_flat(height: float) -> None:
    """Coplanar to rounding is one plane, but a real bump, however low, is met to 1e-12."""
    vertices, elements = meshes.crumpled(6, seed=1, height=height)
    shell = shell_of((vertices, elements))
    corners, _ = corners_of(vertices, elements)
    for x, y in np.random.default_rng(0).uniform(-0.5, 0.5, (40, 2)):
        center = np.array([x, y, 0.9])
        found = shell.contacts(center, 1.0, method="facets")
        nearest = float(norm(center - closest_on_triangles(center, corners)).min())
        assert abs(found.depth.max() - (1.0 - nearest)) <= 1e-12
