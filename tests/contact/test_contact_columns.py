"""The columns of a contact query: made when they are read, and the same however it is asked."""

import copy
import pickle
from dataclasses import fields

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.shell.contact_set import ContactSet
from tests import meshes

RADIUS = 0.3


@pytest.fixture(scope="module")
def shell() -> sp.Shell:
    return sp.Shell(*meshes.cube(), crease_angle=0.5)


def at_a_corner(shell: sp.Shell) -> np.ndarray:
    return np.asarray(shell.vertices.max(axis=0)) + 0.1


def columns_of(contacts: ContactSet) -> list[object]:
    return [getattr(contacts, one.name) for one in fields(contacts)]


@pytest.mark.parametrize("method", ["smooth", "facets", "elements"])
@pytest.mark.parametrize("away", [0.0, 9.0])
def test_all_ways_to_give_a_sphere_have_the_same_bits(shell, method, away) -> None:
    center = at_a_corner(shell) + away
    wide = np.repeat(center, 2)[::2]
    expected = columns_of(shell.contacts(center, RADIUS, method))
    for place in (center.tolist(), tuple(center), wide, center.astype(">f8")):
        for radius in (RADIUS, np.float64(RADIUS), np.array(RADIUS)):
            found = columns_of(shell.contacts(place, radius, method))
            np.testing.assert_equal(found, expected)


def test_columns_are_contiguous_and_only_to_be_read(shell) -> None:
    found = shell.contacts(at_a_corner(shell), RADIUS, gradient=True)
    for column in columns_of(found):
        if column is not None:
            assert isinstance(column, np.ndarray)
            assert column.flags.c_contiguous
            assert not column.flags.writeable
    assert np.array_equal(found.patch, shell.element_patch[found.element])
    with pytest.raises(AttributeError, match="no attribute 'depths'"):
        _ = found.depths


@pytest.mark.parametrize("away", [0.0, 9.0])
def test_contacts_that_nobody_has_read_are_copied_and_pickled(shell, away) -> None:
    found = shell.contacts(at_a_corner(shell) + away, RADIUS, gradient=True)
    for other in (copy.copy(found), copy.deepcopy(found), pickle.loads(pickle.dumps(found))):
        np.testing.assert_equal(columns_of(other), columns_of(found))
