"""A sphere is swept over smooth joints: its force does not jump."""

from itertools import product

import numpy as np
import pytest

from tests.contact.smooth.surfaces import SURFACES, shell_of
from tests.contact.smooth.sweeps import DEPTHS, UP, about, assert_continuous, segment
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


SMOOTH = ("bowl", "dome", "torus inside", "wavy above", "wavy below")
SOME = {("bowl", True), ("torus inside", False), ("wavy above", False)}


@pytest.mark.parametrize(
    ("name", "exact"), mostly_studies(product(SMOOTH, (True, False)), SOME.__contains__)
)
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
