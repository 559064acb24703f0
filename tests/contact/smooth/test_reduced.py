"""The smallest meshes on which the potential of earlier versions jumped, cut out of real surfaces.

Each file holds vertices V and corner normals N of triangles T, in units of the sphere's radius, and
two centres a, b between which the potential jumped by the share `jump` of itself.
"""

from pathlib import Path

import numpy as np
import pytest

from sphshell_pin import Shell
from tests.contact.helpers import energy
from tests.contact.smooth.sweeps import query
from tests.contact.smooth.test_real_surfaces import jump, steepest_between

REDUCED = sorted((Path(__file__).parents[2] / "data" / "reduced").glob("*.npz"))


def test_the_meshes_are_there() -> None:
    assert len(REDUCED) == 8


@pytest.mark.parametrize("path", REDUCED, ids=lambda path: path.stem)
def test_potential_does_not_jump(path: Path) -> None:
    """Between the two centres, on a longer line through them, and on lines beside it."""
    mesh, rng = np.load(path), np.random.default_rng(0)
    shell = Shell(mesh["V"], mesh["T"], normals=mesh["N"])
    a, b = mesh["a"], mesh["b"]
    assert energy(query(shell, a)) > 0
    along = (b - a) / np.linalg.norm(b - a)
    lines = [(a, b), (a - 0.01 * along, b + 0.01 * along)]
    for reach in (1e-9, 1e-6, 1e-3, 0.03):
        for _ in range(10):
            lines.append((a + reach * rng.normal(size=3), b + reach * rng.normal(size=3)))
    for start, end in lines:
        before, after = steepest_between(lambda x: query(shell, x), start, end, 1e-9)
        assert jump(query(shell, before), query(shell, after), after - before) <= 1e-6
