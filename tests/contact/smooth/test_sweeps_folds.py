"""A sphere is swept over folds of flat sides and over smooth joints: its force does not jump."""

from functools import partial
from itertools import product

import numpy as np
import pytest

from sphshell_pin import Shell
from tests import meshes
from tests.contact.smooth import sweeps
from tests.contact.smooth.surfaces import SURFACES, shell_of
from tests.studies import mostly_studies

ANGLES = (1, 2, 5, 10, 16, 20, 30, 45, 60, 90, 120, 150, 170)
SIZE = 4.0


def fold(kind: str, angle: float, crease: float) -> Shell:
    """Fold of `angle` [deg] along y, of eight triangles; a groove or a ridge seen from +z."""
    vertices, triangles = meshes.v_groove(np.radians(angle / 2), size=SIZE)
    if kind == "ridge":
        vertices = vertices * [1.0, 1.0, -1.0]
    return Shell(vertices, triangles, crease_angle=np.radians(crease))


def profile(kind: str, angle: float, depth: float):
    """Centres in the plane across a fold at a constant depth in its nearer side: (n, 3)."""
    lean, reach = np.radians(angle / 2), 1 - depth
    if kind == "groove":
        # Beyond these the farther side is not touched, or not at its foot.
        ends = [min(np.sin(lean), depth / np.sin(lean) / 2), np.sin(lean)]
        x = np.unique([s * e for e in [*ends, 0.0, 0.5] for s in (-1.4, -0.7, 0.0, 0.6, 1.5)])
        return np.stack([x, 0 * x, (reach + np.abs(x) * np.sin(lean)) / np.cos(lean)], axis=1)
    # Chords of the arc over the edge go deeper by a tenth of the depth.
    count = 2 + int(2 * lean / np.sqrt(0.8 * depth))
    tilt = np.linspace(-lean, lean, count)
    arc = reach * np.stack([np.sin(tilt), 0 * tilt, np.cos(tilt)], axis=1)
    down = 0.4 * np.array([np.cos(lean), 0.0, -np.sin(lean)])
    return np.concatenate([arc[:1] + down * [-1, 1, 1], arc, arc[-1:] + down])


def fold_paths(kind: str, angle: float, depth: float, where: str):
    """Across the fold, obliquely, or over the end of the crease at the border of the sheet."""
    path = profile(kind, angle, depth)
    if where == "across":
        yield path + [0.0, 0.123, 0.0]
        yield path + np.outer(path[:, 0], [0.0, 0.8, 0.0]) + [0.0, -0.31, 0.0]
    else:
        yield path + np.outer(path[:, 0], [0.0, 0.4, 0.0]) + [0.0, SIZE / 2 + 0.003, 0.0]
        out = np.linspace(-0.2, 0.3, 7)[:, None]
        for share in (0.5, 0.53):
            k = (len(path) - 1) * share
            top = path[int(k)] + (k - int(k)) * (path[int(k) + 1] - path[int(k)])
            yield top + [0.0, SIZE / 2, 0.0] + out * [0.0, 1.0, 0.0]


KINDS = ("ridge", "groove")


FOLDS = [(k, angle, where) for k in KINDS for angle in ANGLES for where in ("across", "end")]
folds = partial(mostly_studies, kept=lambda one: one[1] in (2, 20, 120))


@pytest.mark.parametrize(("kind", "angle", "where"), folds(FOLDS))
def test_creases(kind: str, angle: float, where: str) -> None:
    shell = fold(kind, angle, 0.5)
    for depth in sweeps.DEPTHS:
        paths = list(fold_paths(kind, angle, depth, where))
        sweeps.assert_continuous(shell, paths, depth, limit=1e-7 if angle >= 10 else sweeps.LIMIT)
        for path in paths:
            sweeps.assert_as_defined(shell, path[1 : -1 : max(1, len(path) // 3)] + 1e-5, depth)


@pytest.mark.parametrize(("kind", "angle", "where"), folds(f for f in FOLDS if f[1] <= 30))
def test_folds_that_count_as_smooth(kind: str, angle: float, where: str) -> None:
    shell = fold(kind, angle, 30.5)
    for depth in sweeps.DEPTHS:
        sweeps.assert_continuous(shell, fold_paths(kind, angle, depth, where), depth)


def rolled(name: str, depth: float, count: int, length: float, nodes: int, seed: int = 0):
    """Paths over a smooth surface: of constant depth, but on the wavy sheet of constant height."""
    rng = np.random.default_rng(1000 + seed)
    for center, normal in zip(*SURFACES[name].probes(count, depth, seed), strict=True):
        if "wavy" in name:
            along = np.cross(normal, rng.normal(size=3))
            yield sweeps.segment(center, center + length * along / np.linalg.norm(along), nodes)
        else:
            axis = sweeps.UP if "torus" in name else np.cross(center, rng.normal(size=3))
            axis = axis / np.linalg.norm(axis)
            reach = length / np.linalg.norm(np.cross(axis, center))
            yield sweeps.about(axis, center, np.linspace(0, reach, nodes))


SMOOTH = ("bowl", "dome", "torus inside", "wavy above", "wavy below")
SOME = {("bowl", True), ("torus inside", False), ("wavy above", False)}


@pytest.mark.parametrize(
    ("name", "exact"), mostly_studies(product(SMOOTH, (True, False)), SOME.__contains__)
)
def test_smooth_joints(name: str, exact: bool) -> None:
    for h, count in ((0.6, 6), (0.3, 6), (0.15, 2)):
        for depth in sweeps.DEPTHS:
            shell = shell_of(name, h, exact)
            sweeps.assert_continuous(shell, rolled(name, depth, count, 0.7 * h, 4), depth, 2)


@pytest.mark.parametrize("name", ["bowl", "dome"])
def test_along_mesh_lines(name: str) -> None:
    """From vertex to vertex the centre is over edges all the way, to round-off."""
    shell = shell_of(name, 0.6)
    side = SURFACES[name].sign
    rng = np.random.default_rng(4)
    for depth in sweeps.DEPTHS:
        radius = 4.0 + side * (1 - depth)
        lines = shell.vertices[rng.choice(shell.edge_vertices, 4)] * (radius / 4.0)
        paths = [a + np.linspace(-0.3, 1.3, 7)[:, None] * (b - a) for a, b in lines]
        paths = [p * (radius / np.linalg.norm(p, axis=1)[:, None]) for p in paths]
        sweeps.assert_continuous(shell, paths, depth)
