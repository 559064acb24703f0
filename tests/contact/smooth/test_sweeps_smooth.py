"""A sphere is swept over smooth joints: its force does not jump."""

from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest

from tests.contact.helpers import force_sum
from tests.contact.smooth.surfaces import SURFACES, shell_of
from tests.contact.smooth.sweeps import DEPTHS, UP, about, assert_continuous, borders, segment
from tests.contact.smooth.test_potential import query
from tests.studies import mostly_studies


def rolled(name: str, depth: float, count: int, length: float, nodes: int, seed: int = 0):
    """Paths over a smooth surface: of constant depth, but on the wavy sheet of constant height."""
    rng = np.random.default_rng(1000 + seed)
    for center, normal in zip(*SURFACES[name].probes(count, depth, seed), strict=True):
        if "wavy" in name:
            along = np.cross(normal, rng.normal(size=3))
            yield segment(center, center + length * along / np.linalg.norm(along), nodes)
        else:
            axis = UP if "torus" in name else np.cross(center, rng.normal(size=3))
            axis = axis / np.linalg.norm(axis)
            reach = length / np.linalg.norm(np.cross(axis, center))
            yield about(axis, center, np.linspace(0, reach, nodes))


@cache
def joints(name: str, exact: bool, h: float, step: float):
    """Changes of the force over a step across smooth joints, relative to the force: as they are,
    and without those over such a step before the joint and behind it."""
    shell = shell_of(name, h, exact)
    found = []
    for path in rolled(name, 0.04, 14, h, 4, seed=1):
        for start, end in pairwise(path):
            for before, after in borders(shell, start, end, step):
                move = step * (after - before) / np.linalg.norm(after - before)
                places = [(before + after) / 2 + s * move for s in (-1.5, -0.5, 0.5, 1.5)]
                force = np.array([force_sum(query(shell, place)) for place in places])
                change = np.diff(force, axis=0)
                jump = change[1] - (change[0] + change[2]) / 2
                size = np.linalg.norm(force[1])
                found.append((np.linalg.norm(change[1]) / size, np.linalg.norm(jump) / size))
    assert len(found) > 20
    return np.array(found)


SMOOTH = ("bowl", "dome", "torus inside", "wavy above", "wavy below")
SOME = {("bowl", True), ("torus inside", False), ("wavy above", False)}
every_surface = pytest.mark.parametrize(
    ("name", "exact"), mostly_studies(product(SMOOTH, (True, False)), SOME.__contains__)
)


@every_surface
def test_steps_across_smooth_joints(name: str, exact: bool) -> None:
    """Over steps of 1e-5 the force changes by hundred thousandths; what it turns by at a joint
    falls with refinement."""
    change, jump = joints(name, exact, 0.3, 1e-5).T
    assert change.max() <= 6e-5
    assert change.mean() <= 2e-5
    assert jump.max() <= 3e-5
    assert jump.mean() <= 7e-6
    turns = [joints(name, exact, h, 1e-3)[:, 1] for h in (0.6, 0.3, 0.15)]
    assert turns[1].max() <= 1.5e-3
    assert turns[1].mean() <= 3e-4
    assert turns[1].mean() <= turns[0].mean() / 2
    assert turns[2].mean() <= turns[0].mean() / 4


@every_surface
def test_smooth_joints(name: str, exact: bool) -> None:
    for h, count in ((0.6, 6), (0.3, 6), (0.15, 2)):
        for depth in DEPTHS:
            shell = shell_of(name, h, exact)
            assert_continuous(shell, rolled(name, depth, count, 0.7 * h, 4), depth, 2)


@pytest.mark.parametrize("name", ["bowl", "dome"])
def test_along_mesh_lines(name: str) -> None:
    """From vertex to vertex the centre is over edges all the way, to round-off."""
    shell = shell_of(name, 0.6)
    side = SURFACES[name].sign
    rng = np.random.default_rng(4)
    for depth in DEPTHS:
        radius = 4.0 + side * (1 - depth)
        lines = shell.vertices[rng.choice(shell.edge_vertices, 4)] * (radius / 4.0)
        paths = [a + np.linspace(-0.3, 1.3, 7)[:, None] * (b - a) for a, b in lines]
        paths = [p * (radius / np.linalg.norm(p, axis=1)[:, None]) for p in paths]
        assert_continuous(shell, paths, depth)
