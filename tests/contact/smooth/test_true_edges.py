"""Flat surfaces and true edges are exact: closed forms of cubes, sheets and tips, definitions."""

import numpy as np
import pytest

from sphshell_pin import Shell
from sphshell_pin.shell.contact_set import Feature
from tests import meshes
from tests.contact.helpers import energy, force_sum, positions, shell_of
from tests.oracle.pieces import potential_and_force
from tests.shell.surfaces import tetrahedron
from tests.studies import mostly_studies

RADIUS, DEPTH = 0.1, 0.004


def cone(facets: int, slope: float, rings: int = 1):
    """Open cone with its tip at the origin, falling by `slope` [rad], wound to the outside."""
    reach = np.linspace(0, 1, rings + 1)
    vertices, triangles = meshes.revolved(np.stack([reach, -reach * np.tan(slope)], 1), facets)
    return vertices, triangles[:, ::-1].copy()


@pytest.mark.parametrize("rings", [1, 4])
@pytest.mark.parametrize("slope", [0.4, 0.6, 1.0])
def test_cone_tip(slope: float, rings: int) -> None:
    """Over the tip the force is that of the tip, however many facets meet there."""
    rng = np.random.default_rng(0)
    widest = np.arctan(np.tan(slope) * np.cos(np.pi / 10))
    # Where the normals spread less than the crease angle, the tip is a rounded one.
    shells = [Shell(*cone(n, slope, rings)) for n in (10, 50, 500)]
    for _ in range(50):
        tilt, turn = rng.uniform(0, 0.95) * widest, rng.uniform(0, 2 * np.pi)
        normal = np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
        for shell in shells:
            contacts = shell.contacts((RADIUS - DEPTH) * normal, RADIUS)
            assert len(contacts) == 1
            force = force_sum(contacts) / DEPTH**1.5
            assert np.abs(force - normal).max() <= 1e-9
            assert contacts.feature[0] == Feature.VERTEX


POLYHEDRA = {
    "cube": (meshes.cube(), None),
    "sheet": (meshes.grid_plate(3, 5), None),
    "tetrahedron": (tetrahedron(0.9), None),
    "icosahedron": (meshes.icosphere(0), None),
    "l plate": (meshes.l_plate(3), None),
    "book": (meshes.fan(5, seed=1), 0.0),
    "crumpled": (meshes.crumpled(5, seed=2), 0.0),
    "icosphere": (meshes.icosphere(2), 0.0),
    "needles": (meshes.needles(aspect=100.0), 0.0),
    "groove": (meshes.v_groove(0.1, cells=3), 0.0),
    "ridge": (meshes.v_groove(-1.2, cells=3), None),
}


@pytest.mark.parametrize("radius", mostly_studies([0.1, 0.4], lambda radius: radius == 0.4))
@pytest.mark.parametrize("name", POLYHEDRA)
def test_pieces_of_polyhedra(name: str, radius: float) -> None:
    """With every edge a crease (or a crease angle of zero) potential and force are those of the
    definition, over faces, edges and vertices and where one takes over from another."""
    mesh, crease = POLYHEDRA[name]
    shell = shell_of(mesh, **({} if crease is None else {"crease_angle": crease}))
    rng = np.random.default_rng(0)
    seen = 0
    for center in positions(*mesh, radius, 60, seed=7):
        # At the surface itself a normal is not defined.
        if abs(shell.closest_points([center]).distances[0]) < 1e-3 * radius:
            continue
        found = shell.contacts(center, radius, method="smooth")
        exact, force = potential_and_force(shell.vertices, shell.triangles, center, radius)
        assert abs(energy(found) - exact) <= 3e-6 * exact + 1e-15 * radius**2.5, list(center)
        # Contacts that are nearly one are joined; opposite ones may cancel.
        size = np.linalg.norm(force) + 1e-2 * found.depth.max(initial=0) ** 1.5
        # Inside a ring of pieces two passes may be equally high: either may be the last.
        forces = [force]
        while np.linalg.norm(force_sum(found) - forces[-1]) > 2e-5 * size + 1e-14:
            assert len(forces) < 20, list(center)
            beside = center + 1e-9 * rng.normal(size=3)
            forces.append(potential_and_force(shell.vertices, shell.triangles, beside, radius)[1])
        seen += len(found) > 0
    assert seen > 20
