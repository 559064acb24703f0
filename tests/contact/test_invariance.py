"""What must not matter does not: numbering, winding, duplicates, pose, scale, diagonals, splits."""

from __future__ import annotations

import numpy as np
import pytest

from tests import meshes
from tests.contact.helpers import difference, force_sum, positions, shell_of

SURFACES = {
    "plate": meshes.random_plate(60, seed=1),
    "v groove": meshes.v_groove(0.5, cells=3),
    "cube": meshes.cube(),
    "icosphere": meshes.icosphere(1),
    "bowl": meshes.bowl(5),
    "crumpled": meshes.crumpled(5, seed=2),
    "fan": meshes.fan(5, seed=1),
    "soup": meshes.soup(30, seed=3),
}
RADIUS = 0.25


def probes(mesh, count=60):
    """Positions near the surface whose contacts do not hang on rounding."""
    rng = np.random.default_rng(11)
    for center in positions(*mesh, RADIUS, count, seed=7, heights=(0.3, 0.9)):
        yield center + rng.uniform(-1e-3, 1e-3, 3)


def shuffled(mesh, seed=0):
    vertices, triangles = mesh
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(vertices))
    place = np.argsort(order)
    turned = [np.roll(place[t], rng.integers(3)) for t in rng.permutation(triangles)]
    return vertices[order], np.array(turned, dtype=np.int32)


def flipped(mesh, seed=1):
    vertices, triangles = mesh
    flip = np.random.default_rng(seed).random((len(triangles), 1)) < 0.5
    return vertices, np.where(flip, triangles[:, ::-1], triangles).astype(np.int32)


def duplicated(mesh):
    vertices, triangles = mesh
    again = triangles[::2] + len(vertices)
    return np.concatenate([vertices, vertices]), np.concatenate([triangles, again, triangles[::3]])


def unwelded(mesh):
    vertices, triangles = mesh
    return vertices[triangles].reshape(-1, 3), np.arange(triangles.size).reshape(-1, 3)


@pytest.mark.parametrize("change", [shuffled, flipped, duplicated, unwelded])
@pytest.mark.parametrize("name", SURFACES)
def test_bookkeeping(name: str, change) -> None:
    mesh = SURFACES[name]
    a, b = shell_of(mesh), shell_of(change(mesh))
    for center in probes(mesh):
        first, second = (s.contacts(center, RADIUS, method="facets") for s in (a, b))
        assert difference(first, second, RADIUS) <= 1e-12, center.tolist()


@pytest.mark.parametrize("name", SURFACES)
def test_rigid_motion(name: str) -> None:
    vertices, triangles = SURFACES[name]
    rotation, shift = meshes.random_rotation(4), np.array([0.4, -0.7, 0.2])
    a, b = shell_of((vertices, triangles)), shell_of((vertices @ rotation.T + shift, triangles))
    for center in probes((vertices, triangles)):
        first = a.contacts(center, RADIUS, method="facets")
        second = b.contacts(rotation @ center + shift, RADIUS, method="facets")
        assert len(first) == len(second)
        assert np.sort(first.depth) == pytest.approx(np.sort(second.depth), abs=2e-12)
        turned = rotation @ force_sum(first)
        assert force_sum(second) == pytest.approx(turned, abs=1e-11)


@pytest.mark.parametrize("scale", [1e-3, 25.4, 1e4])
@pytest.mark.parametrize("name", SURFACES)
def test_scale(name: str, scale: float) -> None:
    vertices, triangles = SURFACES[name]
    a, b = shell_of((vertices, triangles)), shell_of((vertices * scale, triangles))
    for center in probes((vertices, triangles), 30):
        first = a.contacts(center, RADIUS, method="facets")
        second = b.contacts(center * scale, RADIUS * scale, method="facets")
        assert len(first) == len(second)
        assert np.sort(second.depth) / scale == pytest.approx(np.sort(first.depth), abs=1e-12)
        assert force_sum(second, 1.0) / scale == pytest.approx(force_sum(first, 1.0), abs=1e-11)


def subdivided(mesh):
    """Every triangle in four, by the middles of its sides."""
    vertices, triangles = mesh
    points, middles, finer = list(vertices), {}, []
    for a, b, c in triangles:
        m = []
        for i, j in ((a, b), (b, c), (c, a)):
            key = (min(i, j), max(i, j))
            if key not in middles:
                middles[key] = len(points)
                points.append(0.5 * (vertices[i] + vertices[j]))
            m.append(middles[key])
        finer += [(a, m[0], m[2]), (b, m[1], m[0]), (c, m[2], m[1]), tuple(m)]
    return np.array(points), np.array(finer, dtype=np.int32)


@pytest.mark.parametrize("name", ["plate", "v groove", "cube", "icosphere", "bowl", "crumpled"])
def test_split_elements(name: str) -> None:
    """Split triangles are coplanar only to rounding: same contacts, same force to 1e-9."""
    mesh = SURFACES[name]
    a, b = shell_of(mesh), shell_of(subdivided(mesh))
    for center in probes(mesh):
        first, second = (s.contacts(center, RADIUS, method="facets") for s in (a, b))
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


def test_t_junctions() -> None:
    """A side met by two halves is the same edge: nothing extra over it, nothing missing."""
    vertices = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0], [2, 0.3, 0.0]], dtype=float
    )
    whole = np.array([[0, 1, 2], [0, 2, 3]])
    split = np.array([[0, 1, 2], [0, 4, 3], [4, 2, 3]])
    a, b = shell_of((vertices[:4], whole)), shell_of((vertices[:5], split))
    for x, y in np.random.default_rng(0).uniform(-0.05, 1.05, (400, 2)):
        spots = [(x, y), (x, x), (0.5, 0.5)]
        for px, py in spots:
            center = [px, py, 0.19]
            first, second = (s.contacts(center, 0.2, method="facets") for s in (a, b))
            assert difference(first, second, 0.2) <= 1e-12, center


def test_order_of_elements_never_changes_the_force() -> None:
    """On the borders themselves the set may hang on rounding, but not on the numbering."""
    mesh = SURFACES["plate"]
    shells = [shell_of(shuffled(mesh, seed)) for seed in range(4)]
    for center in positions(*mesh, RADIUS, 150, seed=9, heights=(0.3, 0.9)):
        forces = [force_sum(s.contacts(center, RADIUS, method="facets")) for s in shells]
        assert np.ptp(forces, axis=0).max() <= 1e-12, center.tolist()
