"""Normals estimated from the elements alone, as the method "smooth" bends elements to them."""

import numpy as np
import pytest

from sphshell_pin import Shell
from tests import meshes


@pytest.mark.parametrize("columns", [16, 40])
def test_exact_on_spheres(columns: int) -> None:
    """Elements of longitude and latitude, however narrow near the poles."""
    polar = np.linspace(0.05, np.pi - 0.05, columns)
    vertices, elements = meshes.revolved(np.stack([np.sin(polar), -np.cos(polar)], 1), columns)
    found = Shell(vertices, elements).core_for("smooth").corner_normals
    assert np.abs(found - vertices[elements]).max() <= 1e-9


@pytest.mark.parametrize("rows", [2, 3, 6])
def test_wall_that_ends_in_fillets(rows: int) -> None:
    """Long elements of a wall stay straight beside the short ones of a fillet."""
    bend = np.linspace(0, np.pi / 3, rows + 1)
    fillet = np.stack([1 - 0.2 * (1 - np.cos(bend)), 3 + 0.2 * np.sin(bend)], 1)
    profile = np.concatenate([fillet[::-1] * [1, -1], fillet])
    shell = Shell(*meshes.revolved(profile, 48))
    lifted = np.linalg.norm(shell.core_for("smooth").control_point_offsets, axis=2).max(axis=1)
    wall = np.ptp(shell.vertices[shell.triangles][:, :, 2], axis=1) > 5
    assert wall.sum() == 2 * 48
    # Their own sagitta is 0.0021.
    assert lifted[wall].max() <= 0.02
    rng = np.random.default_rng(0)
    for turn, z in zip(rng.uniform(0, 2 * np.pi, 50), rng.uniform(-2.9, 2.9, 50), strict=True):
        out = np.array([np.cos(turn), np.sin(turn), 0.0])
        found = shell.contacts((1 + 0.45) * out + [0, 0, z], 0.5)
        assert len(found) == 1
        assert abs(found.depth[0] - 0.05) <= 5e-3
