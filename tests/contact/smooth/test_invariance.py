"""What must not matter to smooth contacts: pose, scale, numbering, winding, copies, splits."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from sphshell_pin import Shell
from tests import meshes
from tests.contact.helpers import difference, force_sum
from tests.contact.smooth.surfaces import SURFACES, jittered_grid, mean_edge

NAMES = ("bowl", "dome", "torus inside", "wavy above", "cylinder outside")
H, DEPTH, COUNT = 0.6, 0.04, 40


@cache
def data(name: str):
    return SURFACES[name].mesh(H)


def probes(name: str):
    """Centres that touch, a little off those that would show ties."""
    centers, _ = SURFACES[name].probes(COUNT, DEPTH, seed=2)
    return centers + np.random.default_rng(2).uniform(-5e-3, 5e-3, centers.shape)


def same(shell, other, centers, moved=None, radius=1.0) -> None:
    for center, there in zip(centers, centers if moved is None else moved, strict=True):
        a = shell.contacts(center, radius, method="smooth")
        b = other.contacts(there, radius, method="smooth")
        assert len(a) >= 1
        assert difference(a, b, radius) <= 1e-9
        assert np.linalg.norm(force_sum(a) - force_sum(b)) <= 1e-9 * np.linalg.norm(force_sum(a))


def shuffled(vertices, elements, normals):
    rng = np.random.default_rng(0)
    order = rng.permutation(len(vertices))
    place = np.argsort(order)
    turned = [np.roll(place[e], rng.integers(3)) for e in rng.permutation(elements)]
    return vertices[order], np.array(turned, dtype=np.int32), normals[order]


def turned_over(vertices, elements, normals):
    flip = np.random.default_rng(1).random((len(elements), 1)) < 0.3
    return vertices, np.where(flip, elements[:, ::-1], elements).astype(np.int32), normals


def all_turned_over(vertices, elements, normals):
    return vertices, elements[:, ::-1].copy(), normals


def duplicated(vertices, elements, normals):
    again = elements[::2] + len(vertices)
    joined = np.concatenate([elements, again, elements[::3]])
    return np.concatenate([vertices, vertices]), joined, np.concatenate([normals, normals])


def unwelded(vertices, elements, normals):
    flat = np.arange(elements.size, dtype=np.int32).reshape(-1, 3)
    return vertices[elements].reshape(-1, 3), flat, normals[elements].reshape(-1, 3)


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("change", [shuffled, turned_over, all_turned_over, duplicated, unwelded])
@pytest.mark.parametrize("name", NAMES)
def test_same_surface_given_otherwise(name: str, change, exact: bool) -> None:
    given = data(name)
    changed = change(*given)
    shells = [Shell(v, e, normals=n if exact else None) for v, e, n in (given, changed)]
    same(*shells, probes(name))


@pytest.mark.parametrize("name", NAMES)
def test_corner_normals_are_vertex_normals(name: str) -> None:
    vertices, elements, normals = data(name)
    shells = [Shell(vertices, elements, normals=n) for n in (normals, normals[elements])]
    same(*shells, probes(name))


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("name", NAMES)
def test_rigid_motion(name: str, exact: bool) -> None:
    vertices, elements, normals = data(name)
    rotation, shift = meshes.random_rotation(3), np.array([3.0, -2.0, 1.0])
    here = Shell(vertices, elements, normals=normals if exact else None)
    there = Shell(
        vertices @ rotation.T + shift, elements, normals=normals @ rotation.T if exact else None
    )
    for center in probes(name):
        a = here.contacts(center, 1.0, method="smooth")
        b = there.contacts(rotation @ center + shift, 1.0, method="smooth")
        assert len(a) == len(b) >= 1
        assert np.abs(rotation @ force_sum(a) - force_sum(b)).max() <= 1e-9 * DEPTH**1.5


@pytest.mark.parametrize("scale", [1e-3, 1e3])
@pytest.mark.parametrize("name", NAMES)
def test_scale(name: str, scale: float) -> None:
    vertices, elements, normals = data(name)
    here = Shell(vertices, elements, normals=normals)
    there = Shell(scale * vertices, elements, normals=normals)
    for center in probes(name):
        a = force_sum(here.contacts(center, 1.0, method="smooth"))
        b = force_sum(there.contacts(scale * center, scale, method="smooth")) / scale**1.5
        assert np.abs(a - b).max() <= 1e-9 * DEPTH**1.5


# A floor that turns up into a wall by a quarter of a cylinder: flat elements beside curved ones.
ROUND, LONG, WIDE = 3.0, 4.0, 6.0


def fillet(seed: int = 0, h: float = 0.6):
    """Floor x < 0 and wall z > ROUND, both flat, joined by a round; the floor's and the wall's
    inner vertices, and all diagonals there, depend on the seed."""
    parts, count = [], 0
    columns = round(WIDE / h)
    flat, arc = round(LONG / h), round(ROUND * np.pi / 2 / h)
    for k, (rows, reach) in enumerate(((flat, LONG), (arc, np.pi / 2), (flat, LONG))):
        jitter = 1 if k == 1 else seed
        s, y, triangles = jittered_grid((0.0, reach), (0.0, WIDE), rows, columns, jitter)
        zero = np.zeros_like(s)
        if k == 0:
            point, normal = (s - LONG, y, zero), (zero, zero, zero + 1)
        elif k == 1:
            point = (ROUND * np.sin(s), y, ROUND * (1 - np.cos(s)))
            normal = (-np.sin(s), zero, np.cos(s))
        else:
            point, normal = (zero + ROUND, y, ROUND + s), (zero - 1, zero, zero)
        parts.append((np.stack(point, 1), triangles + count, np.stack(normal, 1)))
        count += len(s)
    return tuple(np.concatenate([part[i] for part in parts]) for i in range(3))


def split_flat(vertices, elements, normals):
    """Cut every flat element in three at a point within."""
    rng = np.random.default_rng(5)
    kept, added, more, count = [], [], [], len(vertices)
    for t in elements:
        if np.ptp(vertices[t, 2]) > 0 and np.ptp(vertices[t, 0]) > 0:
            kept.append(t)
            continue
        added.append(rng.dirichlet([2.0, 2.0, 2.0]) @ vertices[t])
        more.append(normals[t[0]])
        kept += [(t[k], t[(k + 1) % 3], count) for k in range(3)]
        count += 1
    return np.concatenate([vertices, added]), np.array(kept), np.concatenate([normals, more])


@pytest.mark.parametrize("change", ["other flat elements", "split flat elements"])
def test_flat_elements_beside_curved_ones(change: str) -> None:
    given = fillet()
    assert mean_edge(given[0], given[1]) < 1
    shell = Shell(given[0], given[1], normals=given[2])
    assert shell._binding.num_patches == 1
    changed = fillet(seed=7) if change.startswith("other") else split_flat(*given)
    other = Shell(changed[0], changed[1], normals=changed[2])
    rng = np.random.default_rng(6)
    s = rng.uniform(-2.5, 2.5 + ROUND * np.pi / 2, 200)
    turn = np.clip(s / ROUND, 0, np.pi / 2)
    normal = np.stack([-np.sin(turn), np.zeros_like(s), np.cos(turn)], axis=1)
    straight = np.stack(
        [np.minimum(s, 0), np.zeros_like(s), np.maximum(s - ROUND * np.pi / 2, 0)], axis=1
    )
    foot = np.stack(
        [ROUND * np.sin(turn), rng.uniform(1.5, WIDE - 1.5, s.size), ROUND * (1 - np.cos(turn))],
        axis=1,
    )
    centers = foot + straight + (1 - DEPTH) * normal
    for center, exact, at in zip(centers, normal, s, strict=True):
        a = shell.contacts(center, 1.0, method="smooth")
        b = other.contacts(center, 1.0, method="smooth")
        assert len(a) == len(b) == 1
        assert np.abs(force_sum(a) - force_sum(b)).max() <= 1e-9 * DEPTH**1.5
        # Over the flat parts the force is exact.
        if not 0 < at < ROUND * np.pi / 2:
            assert np.abs(force_sum(a) / DEPTH**1.5 - exact).max() <= 1e-12
