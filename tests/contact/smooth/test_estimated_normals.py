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
