"""Contact sets on whatever triangles hypothesis thinks of."""

from types import SimpleNamespace

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sphshell_pin import Shell
from tests.oracle import contacts as oracle
from tests.oracle.geometry import corners_of, norm

coordinate = st.floats(-1.0, 1.0, allow_nan=False).map(lambda x: round(x, 3) + 0.0)
place = st.tuples(coordinate, coordinate, coordinate)


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
