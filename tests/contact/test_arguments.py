"""Wrong arguments are named, and nothing else happens."""

from __future__ import annotations

import numpy as np
import pytest

from sphshell_pin import Sphere
from sphshell_pin.errors import InvalidParameter, SphshellError
from tests import meshes
from tests.contact.helpers import shell_of


@pytest.mark.parametrize("radius", [0.0, -1.0, float("nan"), float("inf")])
def test_radius(radius: float) -> None:
    shell = shell_of(meshes.cube())
    with pytest.raises(InvalidParameter, match="radius"):
        shell.contacts([0, 0, 1], radius, method="facets")
    with pytest.raises(InvalidParameter, match="radi"):
        shell.contacts_batch(np.zeros((2, 3)), np.array([1.0, radius]))
    with pytest.raises(InvalidParameter, match="radius"):
        Sphere(radius, frame="tip")


@pytest.mark.parametrize("center", [[0, 0], [0, 0, float("nan")], [[0, 0, 1]]])
def test_center(center) -> None:
    with pytest.raises(InvalidParameter, match="center"):
        shell_of(meshes.cube()).contacts(center, 0.1, method="facets")


def test_method() -> None:
    with pytest.raises(SphshellError, match=r"magic.*facets"):
        shell_of(meshes.cube()).contacts([0, 0, 1], 0.1, method="magic")


def test_batch_shapes() -> None:
    shell = shell_of(meshes.cube())
    with pytest.raises(InvalidParameter):
        shell.contacts_batch(np.zeros((3, 2)), np.ones(3))
    with pytest.raises(InvalidParameter):
        shell.contacts_batch(np.zeros((3, 3)), np.ones(2))
    with pytest.raises(InvalidParameter, match="threads"):
        shell.contacts_batch(np.zeros((3, 3)), np.ones(3), threads=-1)


def test_nothing_in_reach() -> None:
    contacts = shell_of(meshes.cube()).contacts([5, 0, 0], 0.1, method="facets")
    assert len(contacts) == 0
    assert contacts.point.shape == contacts.normal.shape == (0, 3)
    assert contacts.depth.shape == contacts.element.shape == contacts.feature.shape == (0,)


def test_answers_are_read_only() -> None:
    contacts = shell_of(meshes.cube()).contacts([0, 0, 0.6], 0.2, method="facets")
    with pytest.raises((ValueError, AttributeError)):
        contacts.depth[0] = 1.0
    with pytest.raises(AttributeError):
        contacts.depth = np.zeros(1)
