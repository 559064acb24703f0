"""Vertices that elements share without an edge: the potential does not jump there."""

import numpy as np
import pytest

from sphshell_pin import Shell
from sphshell_pin.study.report.surfaces import wavy_sheet
from tests import meshes
from tests.contact.helpers import energy
from tests.contact.walks import jumps, paths
from tests.shell.surfaces import surface_file

BOWTIE = np.array([[0, 0, 0], [-4, -3, 0], [-4, 3, 0], [1, -2, 2], [1, 2, 2.0]])
STEP = 0.02
# Vertices of the file whose elements cross nothing nearby that they are not connected to there.
CRASH = "manifold_openscad-nonmanifold-crash.obj"
CLEAR = (112, 193, 342, 344, 349, 354, 439, 503, 514, 516, 581, 617)


def torn(vertices, elements, share: float) -> Shell:
    """Without a share of the elements, at random."""
    return Shell(vertices, elements[np.random.default_rng(1).random(len(elements)) > share])


def torn_file(name: str, radius: float) -> tuple[Shell, float]:
    shell = Shell.from_file(surface_file(name), unit="m")
    return torn(shell.vertices / shell.size, shell.triangles, 0.05), radius


def bowtie() -> tuple[Shell, float]:
    return Shell(BOWTIE, [[0, 2, 1], [0, 3, 4]]), 1.3


def checkerboard() -> tuple[Shell, float]:
    """Convex pieces, two or three at every inner vertex, in many loops."""
    rng = np.random.default_rng(2)
    vertices, triangles = meshes.grid_plate(10, 10, 1.0)
    vertices[:, 2] = rng.uniform(-0.05, 0.05, len(vertices))
    middle = vertices[triangles].mean(axis=1)
    cell = np.floor((middle[:, :2] - vertices[:, :2].min(axis=0)) / 0.1)
    _, first = np.unique(cell, axis=0, return_index=True)
    black = cell[first].sum(axis=1) % 2 == 0
    return Shell(vertices, triangles[first[black]]), 0.13


SURFACES = {
    "bowtie": bowtie,
    "checkerboard": checkerboard,
    "blade": lambda: torn_file("bladex_upper.stl", 0.05),
    "knot": lambda: torn_file("trimesh_quadknot.obj", 0.03),
    **{
        f"torn {share:.0%}": lambda s=share: (torn(*wavy_sheet(24, 1.0), s), 0.1)
        for share in (0.02, 0.05, 0.1, 0.2)
    },
}
# "facets" counts two minima on the sides of a concave edge: only convex pieces have no jumps.
CONVEX = ("bowtie", "checkerboard")
CASES = [(name, "smooth") for name in SURFACES] + [(name, "facets") for name in CONVEX]


@pytest.mark.parametrize(("name", "method"), CASES)
def test_potential_does_not_jump(name: str, method: str) -> None:
    shell, radius = SURFACES[name]()
    assert shell.health.pinched_vertices > 0
    for path in paths(shell, 12, 200, radius, STEP):
        assert jumps(shell, method, path, radius) == []


@pytest.mark.parametrize("vertex", CLEAR)
def test_potential_does_not_jump_at_the_vertices_of_a_file(vertex: int) -> None:
    whole = Shell.from_file(surface_file(CRASH), unit="m")
    around = whole.triangles[(whole.triangles == vertex).any(axis=1)]
    vertices = whole.vertices - whole.vertices[vertex]
    sides = np.linalg.norm(vertices[around], axis=2)
    radius = 0.5 * float(sides[sides > 0].min())
    star = Shell(vertices, around, clean=False)
    assert star.health.pinched_vertices == 1
    for path in paths(star, 10, 100, radius, STEP, vertex):
        near = path - path[50] + radius * np.random.default_rng(vertex).uniform(-0.5, 0.5, 3)
        assert jumps(star, "smooth", near, radius) == []


@pytest.mark.parametrize("method", ["smooth", "facets"])
def test_two_triangles(method: str) -> None:
    """Both closest points count, and the vertex between them counts off."""
    shell, radius = bowtie()
    for x in (-1.02, -1.0, -0.98):
        center = np.array([x, 0.0, 0.5])
        near = [0.5, np.linalg.norm(center - max(x + 1, 0) / 5 * np.array([1, 0, 2]))]
        depths = radius - np.array([*near, np.linalg.norm(center)])
        right = depths[:2] @ depths[:2] ** 1.5 - depths[2] ** 2.5
        found = shell.contacts(center, radius, method=method)
        assert energy(found) == pytest.approx(right / 2.5, rel=1e-12)
    # Straight over the vertex, on the side to which both bend: once.
    over = shell.contacts([0.5, 0.0, -0.2], radius, method=method)
    assert over.weight.tolist() == [1]


def test_the_health_counts_them() -> None:
    shell, _ = bowtie()
    assert (shell.health.pinched_vertices, shell.health.pinched_at) == (1, (0.0, 0.0, 0.0))
    (problem,) = shell.health.problems
    assert problem.startswith("1 vertex at which elements meet that share no edge there (pinched)")
    assert shell.transformed(2.0).health.pinched_vertices == 1
    # Two closed tetrahedra, tip to tip: no border at the vertex that they share.
    spikes = [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]]
    both = [*spikes, *([v and v + 3 for v in e] for e in spikes)]
    base = np.array([[1, 0, 1], [-0.5, 0.9, 1], [-0.5, -0.9, 1.0]])
    assert Shell(np.r_[[[0, 0, 0]], base, -base], both).health.pinched_vertices == 1
    assert checkerboard()[0].health.pinched_vertices == 41
    # What an edge of three elements joins is not pinched.
    fin = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0]]
    shell = Shell(fin, [[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    assert (shell.health.non_manifold_edges, shell.health.pinched_vertices) == (1, 0)
    # Counted after the cleaning: these two become one vertex.
    apart = np.r_[BOWTIE, [[1e-9, 0, 0]]]
    assert Shell(apart, [[0, 2, 1], [5, 3, 4]]).health.pinched_vertices == 1
