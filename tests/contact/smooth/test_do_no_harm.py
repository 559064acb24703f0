"""Curved elements are never worse than flat ones: creases stay, and what is round stays round."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from sphshell_pin import Shell
from sphshell_pin.shell.raw import random_places
from tests import meshes
from tests.contact.helpers import directions
from tests.contact.smooth import parts
from tests.contact.smooth.surfaces import SURFACES, mean_edge

COUNT = 50  # of each family


@pytest.mark.parametrize("averaged", [False, True])
@pytest.mark.parametrize("make", [parts.random_turned, parts.random_extruded])
def test_random_parts(make, averaged: bool) -> None:
    """Kinks of 3 to 29 degrees between stretches of 0.2 to 20 radii. A few polygons may turn as
    evenly as a sampled curve does. The normals of a file bear witness no more than the elements."""
    some = [make(seed) for seed in range(COUNT)]
    normals = [parts.averaged_normals(p.vertices, p.elements) if averaged else None for p in some]
    worse = [seed for seed in range(COUNT) if some[seed].is_worse_than_flat(normals[seed])]
    assert len(worse) <= 0.02 * COUNT, worse


def fillet_part(chords: int, turn: float, wall: float, rows: int) -> parts.Part:
    rng = np.random.default_rng(chords)
    part = parts.extruded(parts.fillet(chords, turn, wall), 3.0, rows, rng)
    exact = parts.distance_to_fillet(part.places[:, :2], turn, wall)
    return parts.Part(part.vertices, part.elements, part.places, exact)


@pytest.mark.parametrize("wall", [3.0, 20.0])
@pytest.mark.parametrize("rows", [1, 3])
def test_fillets(wall: float, rows: int) -> None:
    """Never worse than flat; from five chords on, far better."""
    for chords, degrees in ((2, 50), (3, 80), (4, 90), (5, 90), (6, 90), (8, 90)):
        curved, flat = fillet_part(chords, np.radians(degrees), wall, rows).errors()
        assert curved <= flat * (1 + 1e-9), (chords, curved, flat)
        if chords >= 5:
            assert curved <= 0.65 * flat, (chords, curved, flat)


@pytest.mark.parametrize("wall", [3.0, 20.0])
@pytest.mark.parametrize("rows", [1, 3])
def test_chamfers_stay_flat(wall: float, rows: int) -> None:
    for degrees in (10, 30, 50):
        section = parts.fillet(1, np.radians(degrees), wall)
        part = parts.extruded(section, 3.0, rows, np.random.default_rng(degrees))
        assert part.errors()[0] <= 1e-12


def solids():
    for size in ((0.1, 0.1, 0.4), (1, 1, 1), (0.01, 1, 1)):
        yield f"box {size}", np.array(np.meshgrid(*[(0, s) for s in size])).reshape(3, -1).T * 1.0
    for n in (3, 4, 5, 6, 8, 12):
        angle = 2 * np.pi * np.arange(n) / n
        ring = np.stack([np.cos(angle), np.sin(angle)], 1)
        yield f"prism {n}", np.concatenate([np.c_[ring, np.full(n, z)] for z in (0.0, 3.0)])
    for n in (10, 24, 60):
        rng = np.random.default_rng(n)
        yield f"solid {n}", rng.normal(size=(n, 3))


@pytest.mark.parametrize(("name", "points"), list(solids()), ids=[name for name, _ in solids()])
def test_smooth_shaded_solids(name: str, points) -> None:
    """Normals that were averaged over the edges are set aside, and the report counts them."""
    hull = trimesh.convex.convex_hull(points)
    vertices, elements = np.array(hull.vertices), np.array(hull.faces)
    shell = Shell(vertices, elements, normals=parts.averaged_normals(vertices, elements))
    size = np.linalg.norm(np.ptp(vertices, axis=0))
    rng = np.random.default_rng(0)
    low, high = vertices.min(axis=0) - 0.3 * size, vertices.max(axis=0) + 0.3 * size
    places = rng.uniform(low, high, (1000, 3))
    found = (shell.closest_points(places, method=m) for m in ("smooth", "facets"))
    curved, flat = (np.abs(one.distances) for one in found)
    assert np.abs(curved - flat).max() <= 1e-3 * size
    assert shell.core_for("smooth").normals_set_aside.any()


@pytest.mark.parametrize("radii", [(0.002, 0.01), (0.01, 0.04)])
def test_propeller(radii: tuple[float, float]) -> None:
    """Blades on a shaft with a cone, few long triangles: whatever lies a twentieth of its radius or
    more inside the flat elements touches the curved ones."""
    shell = Shell.from_file(Path(__file__).parents[2] / "data" / "propeller.stl", unit="mm")
    rng, count = np.random.default_rng(0), 2000
    which, on_flat = random_places(shell.vertices[shell.triangles], count, rng)
    radius = np.exp(rng.uniform(*np.log(radii), count))
    away = (1 - rng.uniform(0.05, 0.2, count)) * radius
    depth, _ = shell.contacts_batch(on_flat + away[:, None] * shell.triangle_normals[which], radius)
    assert (depth > 0).all()


@pytest.mark.parametrize("level", [0, 1, 2])
def test_coarse_spheres_with_good_normals_stay_curved(level: int) -> None:
    """From twenty elements on."""
    vertices, elements = meshes.icosphere(level, 1.0)
    shell = Shell(vertices, elements, normals=vertices)
    assert not shell.core_for("smooth").normals_set_aside.any()
    rng = np.random.default_rng(0)
    places = 1.3 * directions(rng, 500)
    off = np.abs(shell.closest_points(places).distances - 0.3).max()
    assert off <= (0.03, 1.5e-3, 1e-4)[level]


def test_noise_above_the_curvature_stays_flat() -> None:
    """Where the joints turn by noise, elements stay flat; where by curvature, they bend."""
    vertices, elements, normals = SURFACES["dome"].mesh(0.3)
    side = mean_edge(vertices, elements)
    noise = np.random.default_rng(0).normal(size=len(vertices))[:, None] * normals
    curved = []
    for share in (0.002, 0.05):
        core = Shell(vertices + share * side * noise, elements).core_for("smooth")
        curved.append(np.mean(core.bending == 0))
    assert curved[0] >= 0.99
    assert curved[1] <= 0.1


@pytest.mark.parametrize("columns", [16, 40])
def test_normals_estimated_on_spheres_are_exact(columns: int) -> None:
    """From elements of longitude and latitude alone, however narrow near the poles."""
    polar = np.linspace(0.05, np.pi - 0.05, columns)
    vertices, elements = meshes.revolved(np.stack([np.sin(polar), -np.cos(polar)], 1), columns)
    found = Shell(vertices, elements).core_for("smooth").corner_normals
    assert np.abs(found - vertices[elements]).max() <= 1e-9
