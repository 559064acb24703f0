"""Real files that others wrote: what is known about each of them is found."""

import hashlib
import re
from collections import Counter

import numpy as np
import pytest

from sphshell_pin.shell import Shell
from tests.tables import cases_of

from .surfaces import DATA, areas, expect, surface_file

FIGURES = (
    *("input_elements", "elements", "boundary_edges", "non_manifold_edges"),
    *("degenerate_elements", "duplicate_elements", "components"),
)
KNOWN = cases_of("corpus")


def load(name):
    return Shell.from_file(surface_file(name), unit="mm")


def test_the_readme_of_the_files_is_true():
    """Every file is listed with its sum and a licence that is there; nothing else is copied."""
    listed = {}
    for entry in (DATA / "README.md").read_text(encoding="utf-8").split("\n## ")[1:]:
        name, licence, total = (
            re.search(pattern, entry)[1]
            for pattern in (r"^(\S+)\n", r"- licence: `(\S+)`", r"- sha256: ([0-9a-f]{64})\b")
        )
        notice = (DATA / licence).read_text(encoding="utf-8")
        assert any(line.startswith("Copyright ") for line in notice.splitlines()[:3])
        listed[name] = total
    other = ("README.md", ".gitattributes")
    there = [p for p in DATA.iterdir() if p.is_file() and p.name not in other]
    assert listed == {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in there}
    assert sum(p.stat().st_size for p in there) < 4e6


@pytest.mark.parametrize("name", KNOWN["figures"])
def test_what_is_known_of_each_file_is_found(name):
    shell = load(name)
    health = shell.health
    expect(health, **dict(zip(FIGURES, KNOWN["figures"][name], strict=True)))
    lost = health.welded_vertices + health.unused_vertices
    assert health.vertices + lost == health.input_vertices
    assert health.worst_shape > 1e-12
    spans = 2 * areas(shell)
    assert (np.linalg.norm(spans, axis=1) > 0.0).all()
    if health.is_closed:
        assert health.volume > 0.0
        assert np.abs(spans.sum(axis=0)).max() < 1e-9 * np.abs(spans).sum()
    # Cleaning again finds nothing to do.
    again = Shell(shell.vertices, shell.elements, side=shell.side).health
    expect(again, elements=health.elements, boundary_edges=health.boundary_edges)
    assert not again.repairs


@pytest.mark.parametrize("name", KNOWN["faces"])
def test_faces_are_recognized_as_before(name):
    shell = load(name)
    kinds = Counter(face.kind for face in shell.faces)
    assert [kinds, sum(len(face.elements) for face in shell.faces)] == KNOWN["faces"][name]


def test_curved_elements_of_a_part_are_as_near_as_before():
    """Mean distance from the faces of the CAD file, against that of the flat elements."""
    exact = Shell.from_file(surface_file("trimesh_featuretype.STEP"))
    shell = Shell.from_file(surface_file("trimesh_featuretype.STL"), unit="in")
    rng = np.random.default_rng(0)
    corners = exact.vertices[exact.triangles[rng.integers(len(exact.triangles), size=20_000)]]
    places = np.einsum("nkx,nk->nx", corners, rng.dirichlet([1, 1, 1], 20_000))
    places = exact.closest_points(places).points
    found = (shell.closest_points(places, method=method) for method in ("smooth", "facets"))
    curved, flat = (np.abs(one.distances) for one in found)
    assert curved.mean() < 0.036 * flat.mean()
    assert curved.max() <= flat.max()
