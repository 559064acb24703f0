"""Sizes that the search tree, in single precision, cannot hold are refused in one sentence."""

import numpy as np
import pytest

from sphshell_pin import Shell
from sphshell_pin.errors import InvalidShell
from tests import meshes
from tests.contact.helpers import force_sum


def wavy(scale: float) -> Shell:
    vertices, elements = meshes.grid_plate(11, 11, size=2.0, quads=True)
    x, y, _ = vertices.T
    vertices[:, 2] = 0.2 * np.sin(3 * x) * np.cos(2 * y)
    along_x, along_y = 0.6 * np.cos(3 * x) * np.cos(2 * y), -0.4 * np.sin(3 * x) * np.sin(2 * y)
    normals = np.stack([-along_x, -along_y, np.ones_like(x)], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return Shell(scale * vertices, elements, normals=normals)


@pytest.mark.parametrize("exponent", [-46, -45, -38, -20, -13, 15, 20, 38, 39, 100])
def test_sizes_out_of_range_are_refused(exponent: int) -> None:
    with pytest.raises(InvalidShell, match=r"diagonal of .* m: it must be between 1e-12"):
        wavy(10.0**exponent)


@pytest.mark.parametrize("exponent", [-12, -9, -3, 3, 9, 14])
def test_sizes_within_range_find_the_same(exponent: int) -> None:
    """The contacts are those of the surface of one meter, in its units."""
    scale, rng = 10.0**exponent, np.random.default_rng(0)
    here, there, touched = wavy(1.0), wavy(scale), 0
    for _ in range(300):
        center, radius = rng.uniform(-1, 1, 3), rng.uniform(0.05, 1.2)
        a, b = here.contacts(center, radius), there.contacts(scale * center, scale * radius)
        assert force_sum(b) / scale**1.5 == pytest.approx(force_sum(a), rel=1e-6, abs=1e-8)
        touched += len(a)
    assert touched > 100
