"""One-sided shells: what counts outside, and the push back out of the inside."""

from itertools import islice

import numpy as np
import pytest

from tests import meshes
from tests.contact.helpers import positions, shell_of
from tests.oracle import contacts as oracle
from tests.oracle.geometry import corners_of

CLOSED = {"cube": meshes.cube(), "icosphere": meshes.icosphere(1), "quads": meshes.cube(quads=True)}


@pytest.mark.parametrize("side", ["outside", "inside"])
@pytest.mark.parametrize("name", CLOSED)
def test_same_set_as_the_definition(name: str, side: str) -> None:
    vertices, elements = CLOSED[name]
    shell = shell_of((vertices, elements), side=side)
    corners, owner = corners_of(vertices, elements)
    count = 0
    for radius in (0.1, 0.3):
        for center in islice(positions(vertices, elements, radius, 60, seed=2), 0, None, 5):
            if np.abs(center - shell.closest_points(center[None]).points[0]).max() < 1e-9:
                continue  # on the surface the side is undecided
            expected = oracle.facets(center, radius, corners, owner, side)
            if len(expected) == 1 and expected[0].depth > radius:
                # Behind the surface, several faces may be equally near: any of them is the nearest.
                distance = expected[0].depth - radius
                found = shell.contacts(center, radius, method="facets")
                assert len(found) == 1
                assert abs(found.depth[0] - radius - distance) <= 1e-12
                continue
            found = shell.contacts(center, radius, method="facets")
            why = oracle.mismatch(found, expected, 2e-12)
            assert not why, f"{name}, {side}, center {center.tolist()}: {why}"
            assert not len(found) or oracle.normal_error(found, expected) <= 1e-10
            count += len(found)
    assert count > 10


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
