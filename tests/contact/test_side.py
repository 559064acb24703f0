"""One-sided shells: what counts outside, and the push back out of the inside."""

import numpy as np
import pytest

from tests import meshes
from tests.contact.helpers import shell_of


def test_plate_pushes_up_from_below() -> None:
    """A centre that went through by less than a radius is pushed back, harder the deeper it is."""
    plate = shell_of(meshes.random_plate(50, seed=1), side="outside")
    last = 0.0
    for z in np.linspace(0.099, -0.099, 34):
        contacts = plate.contacts([0.05, 0.1, z], 0.1, method="facets")
        assert len(contacts) == 1
        assert contacts.depth[0] == pytest.approx(0.1 - z, abs=1e-15)
        assert contacts.normal[0] == pytest.approx([0, 0, 1], abs=1e-12)
        assert contacts.depth[0] > last
        last = contacts.depth[0]
    assert len(plate.contacts([0.05, 0.1, -0.101], 0.1, method="facets")) == 0


def test_closed_shells_are_turned_outward() -> None:
    """The winding of a file cannot be trusted: a cube wound inward still pushes outward."""
    vertices, triangles = meshes.cube()
    rng = np.random.default_rng(0)
    mixed = np.where(rng.random((len(triangles), 1)) < 0.5, triangles, triangles[:, ::-1])
    for winding in (triangles, triangles[:, ::-1], mixed):
        cube = shell_of((vertices, winding), side="outside")
        assert cube.is_closed
        pushed = cube.contacts([0.1, 0.05, 0.45], 0.1, method="facets")
        assert len(pushed) == 1
        assert pushed.depth[0] == pytest.approx(0.15, abs=1e-15)
        assert pushed.normal[0] == pytest.approx([0, 0, 1], abs=1e-15)
