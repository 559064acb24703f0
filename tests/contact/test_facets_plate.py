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
    share = rng.choice([0.5, 0.25, rng.uniform()], (200, 1))
    sides = ends[:, 0] + share * (ends[:, 1] - ends[:, 0])
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
