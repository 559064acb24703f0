"""The paper's sum over elements, ghost forces and all."""

import numpy as np
import pytest

from sphshell_pin import ImpactLaw
from tests import meshes
from tests.contact.helpers import shell_of

MM = 1e-3


@pytest.mark.parametrize(
    ("offset", "neighbour"), [(0.0, 1.0), (0.3, 0.903), (0.7, 0.536), (1.0, 0.214), (1.3, 0.015)]
)
def test_what_the_neighbour_adds(offset: float, neighbour: float) -> None:
    """R = 10 mm, p = 0.1 mm, e = 2.2: the neighbour sees the distance sqrt((R-p)^2 + s^2)."""
    law = ImpactLaw.from_adams(1e5, 2.2, 10.0, 0.1, units="mm-N-s")
    radius, depth, s = 10 * MM, 0.1 * MM, offset * MM
    shell = shell_of(meshes.grid_plate())
    away = s / 2**0.5 * np.array([1.0, -1.0, 0.0])  # square to the diagonal x = y
    found = shell.contacts([*away[:2], radius - depth], radius, method="elements")
    got = sum(map(law.normal_force, found.depth)) / law.normal_force(depth) - 1.0
    exact = ((radius - np.hypot(radius - depth, s)) / depth) ** 2.2
    assert got == pytest.approx(exact, abs=1e-12)
    assert got == pytest.approx(neighbour, abs=6e-4)
