"""Laws of contact sets on whatever surfaces hypothesis thinks of."""

from types import SimpleNamespace

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sphshell_pin import Shell
from tests import meshes
from tests.oracle import contacts as oracle
from tests.oracle.geometry import closest_on_triangles, corners_of, norm

coordinate = st.floats(-1.0, 1.0, allow_nan=False).map(lambda x: round(x, 3) + 0.0)
place = st.tuples(coordinate, coordinate, coordinate)
surfaces = st.one_of(
    st.builds(meshes.soup, st.integers(1, 15), st.integers(0, 10**6), st.just(0.5)),
    st.builds(meshes.crumpled, st.integers(1, 3), st.integers(0, 10**6), st.floats(0.0, 0.3)),
    st.builds(meshes.fan, st.integers(1, 6), st.integers(0, 10**6)),
)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(surfaces, place, st.floats(0.05, 1.0))
def test_a_contact_set_is_what_it_says(mesh, center, radius: float) -> None:
    shell = Shell(*mesh)
    contacts = shell.contacts(center, radius, method="facets")
    corners, _ = corners_of(*mesh)
    nearest = float(norm(np.array(center) - closest_on_triangles(np.array(center), corners)).min())
    assert (len(contacts) > 0) == (nearest < radius) or abs(nearest - radius) < 1e-12
    for point, normal, depth in zip(contacts.point, contacts.normal, contacts.depth, strict=True):
        assert 0 < depth <= radius
        assert abs(np.linalg.norm(normal) - 1.0) < 1e-14
        assert np.abs(point + (radius - depth) * normal - center).max() < 1e-12
        assert float(norm(point - closest_on_triangles(point, corners)).min()) < 1e-12
    if len(contacts):
        assert abs(contacts.depth.max() - (radius - nearest)) < 1e-12
        elements = shell.contacts(center, radius, method="elements")
        assert len(elements) >= len(contacts)
        assert abs(elements.depth.max() - contacts.depth.max()) < 1e-15


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(st.tuples(place, place, place), min_size=1, max_size=8), place)
def test_triangles_of_coarse_coordinates(triangles, center) -> None:
    """Coordinates in thousandths make coplanar, touching and crossing elements likely."""
    vertices = np.array(triangles, dtype=float).reshape(-1, 3)
    elements = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    corners, owner = corners_of(vertices, elements)
    a, b, c = (corners[:, k] for k in range(3))
    longest = max(float(norm(p - q).max()) for p, q in ((a, b), (b, c), (c, a)))
    assume(float(norm(np.cross(b - a, c - a)).min()) > 1e-3 * longest)
    shell = Shell(vertices, elements)
    # The cleaning drops duplicates and divides elements at T-junctions: rows are then others.
    assume(np.array_equal(shell.source_element, np.arange(len(elements))))
    for radius in (0.3, 1.1):
        # At pinched vertices each fan counts: tests/contact/test_pinched.py.
        pinched = shell.vertices[shell._binding.pinched_vertices]
        expected = [
            touch
            for touch in oracle.facets(np.array(center), radius, corners, owner)
            if not (np.abs(pinched - touch.point) < 1e-9).all(axis=1).any()
        ]
        found = shell.contacts(center, radius, method="facets")
        away = np.abs(pinched - found.point[:, None]).max(axis=2, initial=0) >= 1e-9
        kept = np.flatnonzero(away.all(axis=1))
        others = {
            name: getattr(found, name)[kept] for name in ("depth", "point", "element", "normal")
        }
        why = oracle.mismatch(SimpleNamespace(**others), expected, 1e-11)
        assert not why, why


@settings(max_examples=100, deadline=None, derandomize=True)
@given(surfaces, place, st.floats(0.1, 0.5), st.floats(0.0, 0.5))
def test_a_larger_sphere_keeps_every_contact(mesh, center, radius: float, more: float) -> None:
    """A local minimum of the distance does not hang on the radius."""
    shell = Shell(*mesh)
    small = shell.contacts(center, radius, method="facets")
    large = shell.contacts(center, radius + more, method="facets")
    assert len(large) >= len(small)
    for k, point in enumerate(small.point):
        gaps = np.abs(large.point - point).max(axis=1)
        assert gaps.min() == 0.0
        grown = large.depth[gaps.argmin()] - small.depth[k]
        assert abs(grown - more) < 1e-14
