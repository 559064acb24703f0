"""To how much the numbers of a file are known, and that shells carry it."""

import pickle

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.shell.raw import SCALES, rounding
from tests import meshes

from .surfaces import CUBE, CUBE_QUADS

X = np.random.default_rng(0).uniform(-100.0, 110.0, (5000, 3))
STEP = 2.488e-3


def digits(form, numbers=X):
    """Return numbers as a file with them in this format has them."""
    return np.array([float(form % x) for x in numbers.ravel()]).reshape(-1, 3)


@pytest.mark.parametrize(
    ("numbers", "expected"),
    [
        (X, 0.0),
        (X.astype(np.float32).astype(float), 6e-8 * np.abs(X).max()),
        (digits("%.6g"), 0.5e-3),
        (digits("%.6e"), 0.5e-4),
        (digits("%.4f"), 0.5e-4),
        (digits("%.4f", X - 10.0), 0.5e-4),  # below 100
        (digits("%.4f").astype(np.float32).astype(float), 0.5e-4),
        (np.round(X / STEP) * STEP, STEP / 2),
        (digits("%.9g", np.round(X[:90] / STEP) * STEP), STEP / 2),
    ],
)
@pytest.mark.parametrize("scale", SCALES)
def test_half_a_step(numbers, expected, scale):
    assert rounding(numbers) == pytest.approx(expected, rel=1e-3)
    # A user may have changed the unit.
    assert rounding(numbers * scale, SCALES) == pytest.approx(scale * expected, rel=1e-3)


def test_coarse_grids_and_few_numbers_are_no_rounding():
    voxels = np.random.default_rng(1).integers(0, 200, (2000, 3)).astype(float)
    for numbers in (CUBE, 0.1 * CUBE, 100 + CUBE, voxels, 0.3 * voxels):
        assert rounding(numbers) <= 1e-7 * np.abs(numbers).max()
    for nothing in (np.zeros((4, 3)), np.zeros((0, 3)), np.full((4, 3), np.nan), [[np.inf] * 3]):
        assert rounding(np.array(nothing)) == 0.0


def test_shells_carry_it(tmp_path):
    points, triangles = meshes.icosphere(2)
    path = tmp_path / "ball.off"
    rows = [f"{x:.6g} {y:.6g} {z:.6g}" for x, y, z in 90.0 * points]
    rows += [f"3 {a} {b} {c}" for a, b, c in triangles]
    path.write_text("\n".join([f"OFF\n{len(points)} {len(triangles)} 0", *rows]))
    shell = sp.Shell.from_file(path, "mm")
    for one, scale in (
        (shell, 1),
        (shell.transformed(scale=3.0), 3),
        (pickle.loads(pickle.dumps(shell)), 1),
        (sp.Shell(shell.vertices, shell.elements), 1),
    ):
        assert one.rounding == pytest.approx(scale * 0.5e-4 * 1e-3)
    assert sp.Shell(CUBE, CUBE_QUADS).rounding < 1e-7
    assert sp.Shell(points, triangles).rounding == 0.0
