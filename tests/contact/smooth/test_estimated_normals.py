"""Normals estimated from the elements alone, as the method "smooth" bends elements to them."""

import numpy as np
import pytest

from sphshell_pin import Shell
from tests import meshes
from tests.contact.smooth.surfaces import SURFACES, mean_edge


def corner_normals(shell: Shell):
    """Unit normals (t, 3, 3) at the corners of the triangles."""
    return shell.core_for("smooth").corner_normals


@pytest.mark.parametrize("name", ["torus inside", "wavy above"])
def test_order_of_the_normals(name: str) -> None:
    """Away from the borders; on meshes with jittered vertices and random diagonals."""
    errors, sides = [], []
    for h in (0.6, 0.3, 0.15):
        vertices, elements, exact = SURFACES[name].mesh(h)
        shell = Shell(vertices, elements, faces=False)  # a torus is recognized, and exact
        corners = exact[elements]
        error = np.linalg.norm(np.cross(corner_normals(shell), corners), axis=2)
        border = np.unique(shell.edge_vertices[shell.edge_class == 2])
        near = np.isin(elements, border).any(axis=1)
        inner = ~np.isin(elements, np.unique(elements[near])).any(axis=1)
        errors.append(np.sqrt((error[inner] ** 2).mean()))
        sides.append(mean_edge(vertices, elements))
    assert np.polyfit(np.log(sides), np.log(errors), 1)[0] >= 2.5
    assert errors[1] <= 5e-4


@pytest.mark.parametrize("columns", [16, 40])
def test_exact_on_spheres(columns: int) -> None:
    """Elements of longitude and latitude, however narrow near the poles."""
    polar = np.linspace(0.05, np.pi - 0.05, columns)
    vertices, elements = meshes.revolved(np.stack([np.sin(polar), -np.cos(polar)], 1), columns)
    error = corner_normals(Shell(vertices, elements)) - vertices[elements]
    assert np.abs(error).max() <= 1e-9


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
