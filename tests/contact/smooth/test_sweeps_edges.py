"""A sphere is swept over curved creases, borders and vertices: its force does not jump."""

from functools import cache

import numpy as np
import pytest

from sphshell_pin import Shell
from tests import meshes
from tests.contact.helpers import directions
from tests.contact.smooth import sweeps
from tests.contact.smooth.surfaces import SURFACES, can
from tests.contact.smooth.test_potential import query
from tests.contact.smooth.test_true_edges import cone
from tests.studies import mostly_studies


def lens(half: float, rows: int, columns: int):
    """Two caps of a sphere of radius four that meet in a circle of radius `half`, and their normals
    per corner: a round crease."""
    drop = np.sqrt(16.0 - half**2)
    polar = np.arcsin(half / 4) * np.arange(rows + 1) / rows
    upper = np.stack([4 * np.sin(polar), 4 * np.cos(polar) - drop], axis=1)
    upper[-1] = half, 0.0
    vertices, triangles = meshes.revolved([*upper, *(upper[-2::-1] * [1, -1])], columns)
    triangles, at = triangles[:, ::-1].copy(), vertices[triangles[:, ::-1]]
    # From the middles of the caps' spheres, which are behind each other.
    above = at.sum(axis=1)[:, None, 2:] > 0
    return vertices, triangles, (at + np.where(above, [0, 0, drop], [0, 0, -drop])) / 4


def curved_sheet(name: str):
    """Open sheets with curved borders: vertices, elements, normals."""
    if name == "cap":
        vertices, elements = meshes.dome(8, size=4.0, radius=4.0)
        return vertices, elements, (vertices + [0.0, 0.0, 4.0]) / 4
    if name == "gutter":
        flat, elements = meshes.random_plate(200, seed=3, size=4.0, slivers=False)
        x, y, _ = flat.T
        normals = np.stack([np.sin(x / 3), 0 * x, np.cos(x / 3)], axis=1)
        return 3 * normals + np.stack([0 * x, y, 0 * x - 3], axis=1), elements, normals
    return SURFACES[{"tube": "cylinder outside", "wave": "wavy above"}[name]].mesh(0.6)


@cache
def edged(kind: str, exact: bool = True) -> Shell:
    """Shells with borders and true edges, with exact normals or estimated ones."""
    if kind in ("can", "cup"):
        vertices, elements, normals = can()
        side, crease = {"can": "outside", "cup": "inside"}[kind], 30.0
    elif kind in ("lens", "inside a lens"):
        half, rows, columns = (1.6, 4, 24) if kind == "lens" else (3.95, 14, 64)
        vertices, elements, normals = lens(half, rows, columns)
        side, crease = ("outside" if kind == "lens" else "inside"), 12.0
    elif kind in ("tube", "cap", "wave", "gutter"):
        vertices, elements, normals = curved_sheet(kind)
        side, crease = "both", 30.0
    else:
        vertices, elements = {
            "sheet": lambda: meshes.grid_plate(3, 3, size=4.0),
            "l plate": lambda: meshes.l_plate(2),
            "cube": lambda: meshes.cube(4.0),
            "box": lambda: meshes.cube(4.0),
            "cone": lambda: cone(40, 0.8, 3),
        }[kind]()
        if kind in ("l plate", "cone"):
            vertices = 4 * vertices
        side, crease, exact = {"cube": "outside", "box": "inside"}.get(kind, "both"), 30.0, False
    return Shell(
        vertices,
        elements,
        normals=normals if exact else None,
        crease_angle=np.radians(crease),
        side=side,
    )


def deepest(shell, center) -> float:
    return query(shell, center).depth.max(initial=0.0)


def along_edges(shell, depth: float, count: int, seed: int = 0, reach: float = 0.3):
    """Paths near borders and creases, through a place of the given depth in a random direction."""
    rng = np.random.default_rng(seed)
    sign = {"both": 0, "outside": 1, "inside": -1}[shell.side]
    edges = shell.edge_vertices[np.flatnonzero(shell.edge_class > 0)]
    inner = shell.vertices.mean(axis=0)
    while count:
        a, b = shell.vertices[rng.choice(edges)]
        place = a + rng.choice([0.0, rng.uniform(), 1.0]) * (b - a)
        out = directions(rng)
        if sign * out @ (place - inner) < 0:
            out = -out
        low, high = 0.7, 1.8
        if not deepest(shell, place + low * out) > depth > deepest(shell, place + high * out):
            continue
        while high - low > 1e-9:
            middle = (low + high) / 2
            if deepest(shell, place + middle * out) > depth:
                low = middle
            else:
                high = middle
        along = reach * directions(rng)
        path = sweeps.segment(place + low * out - along, place + low * out + along, 9)
        # At the surface itself no normal is defined, and behind it a one-sided shell pushes back.
        distance = shell.closest_points(path).distances
        if (sign * distance if sign else distance).min() > 0.7:
            count -= 1
            yield path


EDGED = [
    (kind, exact)
    for kind in ("can", "cup", "lens", "inside a lens", "tube", "cap", "wave", "gutter")
    for exact in (True, False)
] + [(kind, False) for kind in ("sheet", "l plate", "cube", "box", "cone")]
SOME_EDGED = {
    *(
        ("can", True),
        ("can", False),
        ("cup", False),
        ("lens", False),
        ("wave", True),
        ("tube", True),
    ),
    *(("sheet", False), ("box", False), ("cone", False)),
}
EDGED = mostly_studies(EDGED, SOME_EDGED.__contains__)


@pytest.mark.parametrize(("kind", "exact"), EDGED)
def test_edges(kind: str, exact: bool) -> None:
    """Curved creases, borders, and bodies with plane sides."""
    shell = edged(kind, exact)
    for depth in sweeps.DEPTHS:
        sweeps.assert_continuous(shell, along_edges(shell, depth, 9), depth, 5)


def test_corner_of_a_box() -> None:
    """Three walls at right angles, touched one, two and three at a time."""
    shell = edged("box")
    rng = np.random.default_rng(6)
    for depth in sweeps.DEPTHS:
        corner = 2.0 - (1 - depth) * np.ones(3)
        along = 0.02 * directions(rng, 6)
        paths = [sweeps.segment(corner - d, corner + 0.8 * d, 9) for d in along]
        sweeps.assert_continuous(shell, paths, depth)
        sweeps.assert_as_defined(shell, [c for path in paths for c in path[:4]], depth)
