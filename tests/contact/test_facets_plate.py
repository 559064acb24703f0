"""A flat plate is one contact, whatever its tessellation: no ghost force, no side force."""

import numpy as np
import pytest

from sphshell_pin import Shell
from sphshell_pin.shell.contact_set import Feature
from tests import meshes
from tests.contact.helpers import force_sum, shell_of

RADIUS, DEPTH = 0.1, 0.005
COUNTS = (2, 8, 200, 2000, 20_000, 200_000)


def spots(vertices, triangles, seed):
    """Places (x, y) on the plate: random ones, vertices and places of sides."""
    rng = np.random.default_rng(seed)
    corners = vertices[rng.choice(len(vertices), min(200, len(vertices)), replace=False), :2]
    ends = vertices[rng.choice(triangles, 200)][:, :2, :2]
    sides = ends[:, 0] + rng.choice([0.5, 0.25, rng.uniform()], (200, 1)) * (
        ends[:, 1] - ends[:, 0]
    )
    return np.concatenate([rng.uniform(-0.5, 0.5, (1000, 2)), corners, sides])


@pytest.mark.parametrize(
    ("how", "count"),
    [("facets", count) for count in COUNTS]
    + [(how, count) for how in ("smooth", "given normals") for count in COUNTS[:-1]],
)
@pytest.mark.parametrize("kind", ["slivers", "delaunay"])
def test_one_exact_contact(kind: str, how: str, count: int) -> None:
    if kind == "delaunay":
        vertices, triangles = meshes.delaunay_plate(count, seed=count)
    else:
        vertices, triangles = meshes.random_plate(count, seed=count)
    up = np.array([0.0, 0.0, 1.0])
    given = how == "given normals"
    shell = Shell(vertices, triangles, normals=np.tile(up, (len(vertices), 1)) if given else None)
    assert len(shell.elements) == len(triangles)
    method = "facets" if how == "facets" else "smooth"
    places = spots(vertices, triangles, seed=count)
    for place in places if method == "facets" else places[::4]:
        for sign in (1.0, -1.0):
            center = np.array([place[0], place[1], sign * (RADIUS - DEPTH)])
            contacts = shell.contacts(center, RADIUS, method=method)
            assert len(contacts) == 1, (center, contacts.point)
            if np.abs(place).max() < 0.49:  # edges and vertices inside the plate are none
                assert contacts.feature[0] == Feature.FACE
            force = force_sum(contacts) / DEPTH**1.5
            assert np.abs(force - sign * up).max() <= 1e-12


def test_centre_on_the_surface_gives_a_finite_unit_normal() -> None:
    """With the centre on the plate the direction is undefined but for the element's own normal."""
    shell = shell_of(meshes.grid_plate(3, 3))
    for x, y in [(0.05, 0.1), (0.0, 0.0), (1 / 6, 0.05)]:
        contacts = shell.contacts([x, y, 0.0], RADIUS, method="facets")
        assert len(contacts) == 1
        assert contacts.depth[0] == pytest.approx(RADIUS, abs=1e-15)
        assert np.abs(contacts.normal[0]) == pytest.approx([0.0, 0.0, 1.0], abs=1e-15)


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("share", [0.3, 0.999, 1.0, 1.5])
def test_sheet_folded_flat_onto_itself(share: float, flip: bool) -> None:
    """Two triangles on the same side of their edge are coplanar but no planar face."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, share, 0]], dtype=float)
    triangles = np.array([[0, 1, 2], [0, 1, 3] if flip else [1, 0, 3]])
    shell = Shell(vertices, triangles)
    for sign in (1.0, -1.0):
        contacts = shell.contacts([0.3, 0.05, sign * 0.1], 1.0, method="facets")
        assert len(contacts) == 1
        assert contacts.point[0] == pytest.approx([0.3, 0.05, 0.0], abs=1e-15)
        beside = shell.contacts([0.4, -0.2, sign * 0.1], 1.0, method="facets")
        assert len(beside) == 1
        assert beside.point[0] == pytest.approx([0.4, 0.0, 0.0], abs=1e-15)


def test_wall_standing_on_a_floor() -> None:
    """A wall that stands on a floor, without sharing vertices, is not felt from below.

    Its foot lies in the floor, and along the floor the distance falls: no minimum there.
    """
    floor, halves = meshes.grid_plate()
    wall = np.array([[-0.2, 0.05, 0], [0.2, 0.05, 0], [0.2, 0.05, 0.3], [-0.2, 0.05, 0.3]])
    shell = Shell(np.concatenate([floor, wall]), np.concatenate([halves, [[4, 5, 6], [4, 6, 7]]]))
    below = shell.contacts([0.1, 0.02, -0.09], RADIUS, method="facets")
    assert len(below) == 1
    assert below.point[0] == pytest.approx([0.1, 0.02, 0.0], abs=1e-15)
    above = shell.contacts([0.1, 0.02, 0.09], RADIUS, method="facets")
    assert sorted(np.round(above.depth, 14)) == [0.01, 0.07]


def test_coplanar_elements_that_overlap() -> None:
    """The rim of an element that lies inside another one is no rim of the surface."""
    big = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], dtype=float)
    small = np.array([[-0.2, -0.4, 0], [0.3, -0.5, 0], [0.1, 0.1, 0]])
    shell = Shell(np.concatenate([big, small]), [[0, 1, 2], [3, 4, 5]])
    for x, y in np.random.default_rng(0).uniform(-0.4, 0.4, (100, 2)):
        if 2 * abs(x) + y < 1:
            contacts = shell.contacts([x, y, 0.05], 0.5, method="facets")
            assert len(contacts) == 1, (x, y)
            assert contacts.point[0] == pytest.approx([x, y, 0.0], abs=1e-15)
