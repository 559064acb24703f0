"""Surfaces the shell tests share, and ways to compare them by place instead of by number."""

import os
from pathlib import Path

import numpy as np
import pytest

from sphshell_pin.results import CleanedSurface
from tests import meshes

DATA = Path(__file__).parents[1] / "data" / "corpus"
"""Other people's surfaces whose licenses allow a copy; README.md there has origins and licenses."""

MORE_DATA = Path(os.environ.get("SPHSHELL_SURFACES", Path(__file__).parents[3] / "shared" / "data"))
"""Where further ones may be that are not in the repository: ../shared/data beside the clone."""

CUBE, _QUADS = meshes.cube(quads=True)
CUBE = CUBE + 0.5
CUBE_QUADS = _QUADS.tolist()

TRIANGLE = {
    "obj": "v 2 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "off": "OFF\n3 1 0\n2 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "shl": "3 1 1.0\n2 0 0\n1 0 0\n0 1 0\n3 1 2 3\n",
    "ply": "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "2 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
}
"""As files have it, by suffix."""


def surface_file(name: str) -> Path:
    """Return the path of other people's surface `name`, or skip the test that needs it."""
    for folder in (DATA, MORE_DATA):
        if (folder / name).is_file():
            return folder / name
    pytest.skip(f"{name} is not in the repository, for its license, nor in {MORE_DATA}")


def plate(n, height=0.0):
    """Return a unit plate of n x n quads with +z normals: vertices, quads."""
    vertices, quads = meshes.grid_plate(n, n, quads=True)
    return vertices + [0.5, 0.5, height], quads


def tetrahedron(scale=1.0, at=(0.0, 0.0, 0.0)):
    """Return a tetrahedron wound outward: vertices, triangles."""
    points = scale * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) + np.array(at)
    return points, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def star(corners, rng):
    """Return a random star-shaped polygon (n, 2), counter-clockwise."""
    angle = 2 * np.pi * (np.arange(corners) + rng.uniform(-0.3, 0.3, corners)) / corners
    return rng.uniform(0.3, 1.0, corners)[:, None] * np.c_[np.cos(angle), np.sin(angle)]


def joined(*parts):
    """Return several (vertices, elements) as one list of polygons."""
    vertices, polygons, before = [], [], 0
    for points, elements in parts:
        vertices.append(points)
        polygons += [[int(v) + before for v in row if v >= 0] for row in elements]
        before += len(points)
    return np.concatenate(vertices), polygons


def areas(surface: CleanedSurface):
    """Return the area vector of each triangle (t, 3)."""
    p = surface.vertices[surface.triangles]
    return 0.5 * np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])


def by_place(surface: CleanedSurface, wound=True):
    """Return the elements as a sorted list of corner places, cyclic, with or without winding."""
    out = []
    for row in surface.elements:
        places = [tuple(np.round(surface.vertices[v], 9) + 0.0) for v in row if v >= 0]
        if wound:
            k = places.index(min(places))
            out.append(tuple(places[k:] + places[:k]))
        else:
            out.append(tuple(sorted(places)))
    return sorted(out)


def expect(health, *said, **figures):
    """Check figures of a report on a surface's health, and parts of sentences that it has."""
    assert {name: getattr(health, name) for name in figures} == pytest.approx(figures)
    sentences = " ".join((*health.repairs, *health.problems, *health.notes))
    assert [part for part in said if part not in sentences] == []


def signed_volume(surface):
    """Volume inside a cleaned surface by its winding."""
    p = surface.vertices[surface.triangles]
    return np.einsum("ij,ij->i", p[:, 0], np.cross(p[:, 1], p[:, 2])).sum() / 6.0
