"""One-sided shells push back out of the inside."""

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
