"""What the tolerances of contact/query/tolerances.hpp change; nothing else depends on them."""

import numpy as np
import pytest

from sphshell_pin import Shell
from tests import meshes
from tests.contact.helpers import energy, force_sum
from tests.contact.smooth.surfaces import SURFACES

UP = np.array([0.0, 0.0, 1.0])


def sheets(gap: float) -> Shell:
    """Two plates, one above the other."""
    vertices, elements = meshes.grid_plate(3, 3, 4.0)
    both = np.concatenate([vertices, vertices + gap * UP])
    doubled = np.concatenate([elements, elements + len(vertices)])
    return Shell(both, doubled, crease_angle=0.0, clean=False)


@pytest.mark.parametrize(
    ("method", "one", "two"), [("smooth", 5e-9, 2e-8), ("facets", 5e-11, 2e-9)]
)
def test_equal_places(method: str, one: float, two: float) -> None:
    """kSamePlace, kSamePoint: sheets nearer than this are one, farther apart two."""
    center = [0.1, 0.2, 0.96]
    assert sheets(one).contacts(center, 1.0, method=method).terms.weight.sum() == 1
    assert sheets(two).contacts(center, 1.0, method=method).terms.weight.sum() == 2


@pytest.mark.parametrize("distance", [1e-7, 1e-9, 1e-11, 0.0])
def test_normal_at_the_surface(distance: float) -> None:
    """kAtSurface: however near the centre is to a corner of a cube, the normal is a unit vector and
    leads away from it; below the tolerance it is that of a face."""
    shell = Shell(*meshes.cube(2.0), side="outside")
    found = shell.contacts((1.0 + distance) * np.ones(3), 1.0)
    assert len(found) == 1
    assert np.linalg.norm(found.normal[0]) == pytest.approx(1.0, abs=1e-15)
    if distance > 1e-9:
        assert found.normal[0] == pytest.approx(np.ones(3) / np.sqrt(3), abs=1e-6)
    else:
        assert (found.normal[0] >= -1e-15).all()


def fold(turn: float) -> Shell:
    vertices, elements = meshes.v_groove(turn / 2, size=8.0, cells=2)
    return Shell(vertices, elements, crease_angle=1e-6)


def test_shown_as_one() -> None:
    """kShallow, kShallowFlat, kAlike: what they merge is shown only; force and energy of the minima
    and saddles do not feel whether it is."""
    shown, stored = [], []
    for turn in np.geomspace(1e-3, 0.1, 60):
        found = fold(turn).contacts([0.0, 0.1, 0.96 / np.cos(turn / 2)], 1.0)
        assert found.terms.weight.tolist() == [1.0, 1.0, -1.0]
        shown.append(len(found))
        stored.append(energy(found))
        assert np.linalg.norm(force_sum(found)) <= 2 * 0.04**1.5
    # One below the angle at which the saddle is 1e-4 of its depth below the minima, then three.
    changes = np.flatnonzero(np.diff(shown))
    assert (shown[0], shown[-1], len(changes)) == (1, 3, 1)
    turn = np.geomspace(1e-3, 0.1, 60)[changes[0]]
    saddle = 1 - 0.96 / np.cos(turn / 2)
    assert (0.04 - saddle) / saddle == pytest.approx(1e-4, rel=0.2)
    # The energy rises with the angle without a step.
    rise = np.diff(np.log(stored))
    assert rise.min() >= 0
    assert rise.max() < 0.2


def test_shown_contact_is_the_resultant() -> None:
    """The contact that is shown has the force of its terms, to the square of kShallow."""
    merged = 0
    vertices, elements, normals = SURFACES["bowl"].mesh(0.6)
    noise = 1e-2 * np.random.default_rng(1).normal(size=normals.shape)
    shell = Shell(vertices, elements, normals=normals + noise)
    for center in SURFACES["bowl"].probes(2000, 0.04)[0]:
        found = shell.contacts(center, 1.0)
        merged += len(found) != len(found.terms)
        if len(found) == 1:
            force = found.depth[0] ** 1.5 * found.normal[0]
            assert force == pytest.approx(force_sum(found), abs=2e-4 * 0.04**1.5)
    assert merged > 10
