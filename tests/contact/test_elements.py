"""The paper's sum over elements, ghost forces and all."""

from __future__ import annotations

import numpy as np
import pytest

from sphshell_pin import ImpactLaw
from tests import meshes
from tests.contact.helpers import shell_of

MM = 1e-3


def ratio(shell, center, radius, depth, law) -> float:
    """Summed normal force over that of one element alone."""
    contacts = shell.contacts(center, radius, method="elements")
    return sum(law.normal_force(d, 0.0) for d in contacts.depth) / law.normal_force(depth, 0.0)


def test_twice_the_force_over_the_middle_edge() -> None:
    law = ImpactLaw.from_adams(1e5, 2.2, 10.0, 0.1, units="mm-N-s")
    shell = shell_of(meshes.grid_plate())
    radius, depth = 10 * MM, 0.1 * MM
    height = radius - depth
    assert ratio(shell, [0.0, 0.0, height], radius, depth, law) == pytest.approx(2.0, abs=1e-12)
    facets = shell.contacts([0.0, 0.0, height], radius, method="facets")
    assert len(facets) == 1


@pytest.mark.parametrize(
    ("offset", "neighbour"), [(0.0, 1.0), (0.3, 0.903), (0.7, 0.536), (1.0, 0.214), (1.3, 0.015)]
)
def test_what_the_neighbour_adds(offset: float, neighbour: float) -> None:
    """R = 10 mm, p = 0.1 mm, e = 2.2: the neighbour sees the distance sqrt((R-p)^2 + s^2)."""
    law = ImpactLaw.from_adams(1e5, 2.2, 10.0, 0.1, units="mm-N-s")
    radius, depth, s = 10 * MM, 0.1 * MM, offset * MM
    shell = shell_of(meshes.grid_plate())
    away = s / 2**0.5 * np.array([1.0, -1.0, 0.0])  # square to the diagonal x = y
    got = ratio(shell, [*away[:2], radius - depth], radius, depth, law) - 1.0
    exact = ((radius - np.hypot(radius - depth, s)) / depth) ** 2.2
    assert got == pytest.approx(exact, abs=1e-12)
    assert got == pytest.approx(neighbour, abs=6e-4)


def test_beyond_the_half_width_the_neighbour_is_out_of_reach() -> None:
    shell = shell_of(meshes.grid_plate())
    half_width = np.sqrt(10.0**2 - 9.9**2) * MM
    for s, count in ((0.999 * half_width, 2), (1.001 * half_width, 1)):
        away = s / 2**0.5
        assert len(shell.contacts([away, -away, 9.9 * MM], 10 * MM, method="elements")) == count


def test_a_quad_is_one_element() -> None:
    quad, pair = shell_of(meshes.grid_plate(quads=True)), shell_of(meshes.grid_plate())
    center, radius = [0.0, 0.0, 0.095], 0.1
    assert len(quad.contacts(center, radius, method="elements")) == 1
    assert len(pair.contacts(center, radius, method="elements")) == 2
    nine = shell_of(meshes.grid_plate(3, 3, quads=True))
    assert len(nine.contacts(center, 2.0, method="elements")) == 9


def test_each_element_once_in_its_own_name() -> None:
    shell = shell_of(meshes.crumpled(5, seed=4))
    contacts = shell.contacts([0.0, 0.0, 0.1], 5.0, method="elements")
    assert sorted(contacts.element) == list(range(len(shell.elements)))
