"""What must not matter does not: numbering, winding, copies, pose, scale, diagonals, splits."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
import trimesh

from tests import meshes
from tests.contact.helpers import difference, force_sum, positions, shell_of
from tests.contact.smooth.surfaces import SURFACES, given

FLAT = {
    "plate": meshes.random_plate(60, seed=1),
    "v groove": meshes.v_groove(0.5, cells=3),
    "cube": meshes.cube(),
    "icosphere": meshes.icosphere(1),
    "bowl": meshes.bowl(5),
    "crumpled": meshes.crumpled(5, seed=2),
    "fan": meshes.fan(5, seed=1),
    "soup": meshes.soup(30, seed=3),
}
CURVED = ("bowl", "dome", "torus inside", "wavy above", "cylinder outside")
CASES = [*FLAT, *(f"smooth {one}{e}" for one in CURVED for e in ("", ", estimated"))]
RADIUS, DEPTH = 0.25, 0.04


@dataclass(frozen=True)
class Case:
    """A mesh, and spheres near it whose contacts do not hang on rounding; what they may differ by,
    relative to the radius, and their forces, relative to that of depth one."""

    mesh: tuple
    centers: np.ndarray
    method: str
    radius: float
    error: float
    force: float

    def find(self, shell, center, scale: float = 1.0):
        return shell.contacts(center, self.radius * scale, method=self.method)


@cache
def case(name: str) -> Case:
    rng = np.random.default_rng(11)
    if name in FLAT:
        centers = np.array([*positions(*FLAT[name], RADIUS, 60, seed=7, heights=(0.3, 0.9))])
        centers += rng.uniform(-1e-3, 1e-3, centers.shape)
        return Case((*FLAT[name], None), centers, "facets", RADIUS, 1e-12, 1e-11)
    surface, _, estimated = name.removeprefix("smooth ").partition(", ")
    vertices, elements, normals = SURFACES[surface].mesh(0.6)
    centers = SURFACES[surface].probes(40, DEPTH, seed=2)[0]
    centers = centers + rng.uniform(-5e-3, 5e-3, centers.shape)
    mesh = (vertices, elements, None if estimated else normals)
    return Case(mesh, centers, "smooth", 1.0, 1e-9, 1e-9 * DEPTH**1.5)


def of(normals, change):
    return None if normals is None else change(normals)


def shuffled(vertices, elements, normals, seed=0):
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(vertices))
    place = np.argsort(order)
    turned = [np.roll(place[e], rng.integers(3)) for e in rng.permutation(elements)]
    return vertices[order], np.array(turned, dtype=np.int32), of(normals, lambda n: n[order])


def some_turned_over(vertices, elements, normals):
    flip = np.random.default_rng(1).random((len(elements), 1)) < 0.4
    return vertices, np.where(flip, elements[:, ::-1], elements).astype(np.int32), normals


def duplicated(vertices, elements, normals):
    again = elements[::2] + len(vertices)
    joined = np.concatenate([elements, again, elements[::3]])
    return np.concatenate([vertices, vertices]), joined, of(normals, lambda n: np.r_[n, n])


def unwelded(vertices, elements, normals):
    flat = np.arange(elements.size, dtype=np.int32).reshape(-1, 3)
    corners = vertices[elements].reshape(-1, 3)
    return corners, flat, of(normals, lambda n: n[elements].reshape(-1, 3))


def normals_at_corners(vertices, elements, normals):
    return vertices, elements, of(normals, lambda n: n[elements])


CHANGES = [shuffled, some_turned_over, duplicated, unwelded, normals_at_corners]


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("name", CASES)
def test_same_surface_given_otherwise(name: str, change) -> None:
    one = case(name)
    shells = [given(mesh) for mesh in (one.mesh, change(*one.mesh))]
    for center in one.centers:
        a, b = (one.find(shell, center) for shell in shells)
        assert len(a) >= (one.method == "smooth")
        assert difference(a, b, one.radius) <= one.error, center.tolist()
        size = np.linalg.norm(force_sum(a))
        assert np.linalg.norm(force_sum(a) - force_sum(b)) <= max(one.error, 1e-9 * size)


@pytest.mark.parametrize("name", CASES)
def test_rigid_motion(name: str) -> None:
    one, rotation, shift = case(name), meshes.random_rotation(4), np.array([0.4, -0.7, 0.2])
    vertices, elements, normals = one.mesh
    turned = of(normals, lambda n: n @ rotation.T)
    there = given((vertices @ rotation.T + shift, elements, turned))
    here = given(one.mesh)
    for center in one.centers:
        a, b = one.find(here, center), one.find(there, rotation @ center + shift)
        assert len(a) == len(b) >= (one.method == "smooth")
        assert np.sort(a.depth) == pytest.approx(np.sort(b.depth), abs=2 * one.error)
        assert force_sum(b) == pytest.approx(rotation @ force_sum(a), abs=one.force)


@pytest.mark.parametrize("scale", [1e-6, 25.4, 1e6])
@pytest.mark.parametrize("name", CASES)
def test_scale(name: str, scale: float) -> None:
    one = case(name)
    vertices, *rest = one.mesh
    here, there = given(one.mesh), given((vertices * scale, *rest))
    for center in one.centers[::2]:
        a, b = one.find(here, center), one.find(there, center * scale, scale)
        assert len(a) == len(b)
        assert np.sort(b.depth) / scale == pytest.approx(np.sort(a.depth), abs=one.error)
        assert force_sum(b) / scale**1.5 == pytest.approx(force_sum(a), abs=one.force)


@pytest.mark.parametrize("name", ["plate", "v groove", "cube", "icosphere", "bowl", "crumpled"])
def test_split_elements(name: str) -> None:
    """Split triangles are coplanar only to rounding: same contacts, same force to 1e-9."""
    one = case(name)
    shells = shell_of(FLAT[name]), shell_of(trimesh.remesh.subdivide(*FLAT[name]))
    for center in one.centers:
        first, second = (one.find(shell, center) for shell in shells)
        assert len(first) == len(second), center.tolist()
        assert force_sum(first) == pytest.approx(force_sum(second), rel=1e-9, abs=1e-12)


def test_other_diagonals_and_quads() -> None:
    vertices, quads = meshes.cube(quads=True)
    one = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    other = np.concatenate([quads[:, [0, 1, 3]], quads[:, [1, 2, 3]]])
    mixed = np.concatenate([np.c_[one[[0, 6]], [-1, -1]], quads[1:]])
    shells = [shell_of((vertices, e)) for e in (quads, one, other, mixed)]
    for center in positions(vertices, quads, RADIUS, 150, seed=3, heights=(0.3, 0.9)):
        sets = [s.contacts(center, RADIUS, method="facets") for s in shells]
        for other_set in sets[1:]:
            assert difference(sets[0], other_set, RADIUS) <= 1e-12, center.tolist()
