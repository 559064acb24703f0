"""A sphere is swept over curved creases, borders and vertices: its force does not jump."""

from functools import cache, partial
from itertools import product

import numpy as np
import pytest
from scipy.optimize import brentq

from sphshell_pin import Shell
from tests import meshes
from tests.contact.helpers import directions
from tests.contact.smooth import sweeps
from tests.contact.smooth.surfaces import SURFACES, can
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


def open_cap():
    vertices, elements = meshes.dome(8, size=4.0, radius=4.0)
    return vertices, elements, (vertices + [0.0, 0.0, 4.0]) / 4


def larger(mesh):
    return 4 * mesh[0], mesh[1]


# Shells with borders and true edges: vertices, elements and the exact normals, if there are any;
# the side, and the angle of a crease [deg].
EDGES = {
    "can": (can, "outside", 30),
    "cup": (can, "inside", 30),
    "lens": (lambda: lens(1.6, 4, 24), "outside", 12),
    "inside a lens": (lambda: lens(3.95, 14, 64), "inside", 12),
    "tube": (lambda: SURFACES["cylinder outside"].mesh(0.6), "both", 30),
    "cap": (open_cap, "both", 30),
    "wave": (lambda: SURFACES["wavy above"].mesh(0.6), "both", 30),
    "sheet": (lambda: meshes.grid_plate(3, 3, size=4.0), "both", 30),
    "l plate": (lambda: larger(meshes.l_plate(2)), "both", 30),
    "cube": (lambda: meshes.cube(4.0), "outside", 30),
    "box": (lambda: meshes.cube(4.0), "inside", 30),
    "cone": (lambda: larger(cone(40, 0.8, 3)), "both", 30),
}


@cache
def edged(kind: str, exact: bool = True) -> Shell:
    """One of them, with exact normals or estimated ones."""
    make, side, crease = EDGES[kind]
    vertices, elements, *normals = make()
    given = normals[0] if exact and normals else None
    return Shell(vertices, elements, normals=given, crease_angle=np.radians(crease), side=side)


def deepest(shell, center) -> float:
    return sweeps.query(shell, center).depth.max(initial=0.0)


def along_edges(shell, depth: float, count: int, seed: int = 0, reach: float = 0.3):
    """Paths near borders and creases, through a place of the given depth in a random direction."""
    rng = np.random.default_rng(seed)
    sign = {"both": 0, "outside": 1, "inside": -1}[shell.side]
    edges = shell.edge_vertices[np.flatnonzero(shell.edge_class > 0)]
    inner, low, high = shell.vertices.mean(axis=0), 0.7, 1.8
    while count:
        a, b = shell.vertices[rng.choice(edges)]
        place = a + rng.choice([0.0, rng.uniform(), 1.0]) * (b - a)
        out = directions(rng)
        if sign * out @ (place - inner) < 0:
            out = -out
        if not deepest(shell, place + low * out) > depth > deepest(shell, place + high * out):
            continue
        more = partial(lambda at, way, s: deepest(shell, at + s * way) - depth, place, out)
        out *= brentq(more, low, high, xtol=1e-10)
        along = reach * directions(rng)
        path = sweeps.segment(place + out - along, place + out + along, 9)
        # At the surface itself no normal is defined, and behind it a one-sided shell pushes back.
        distance = shell.closest_points(path).distances
        if (sign * distance if sign else distance).min() > 0.7:
            count -= 1
            yield path


CURVED = list(EDGES)[:7]
EDGED = [(kind, exact) for kind in EDGES for exact in (True, False) if kind in CURVED or not exact]
SOME_EDGED = {("can", True), ("wave", True), ("tube", True)}
SOME_EDGED |= {(kind, False) for kind in ("can", "cup", "lens", "sheet", "box", "cone")}
EDGED = mostly_studies(EDGED, SOME_EDGED.__contains__)


@pytest.mark.parametrize(("kind", "exact"), EDGED)
def test_edges(kind: str, exact: bool) -> None:
    """Curved creases, borders, and bodies with plane sides."""
    shell = edged(kind, exact)
    for depth in sweeps.DEPTHS:
        sweeps.assert_continuous(shell, along_edges(shell, depth, 9), depth, 5)


def star(kind: str, facets: int, slope: float):
    """Facets round a vertex at the origin, at irregular angles: a tip, a pit, or a saddle whose
    edges rise and fall by turns."""
    vertices, triangles = cone(facets, np.radians(slope))
    turn = np.arctan2(vertices[1:, 1], vertices[1:, 0])
    turn += np.random.default_rng(1).uniform(-0.2, 0.2, facets) * 2 * np.pi / facets
    vertices[1:, 0], vertices[1:, 1] = np.cos(turn), np.sin(turn)
    if kind == "saddle":
        vertices[1::2, 2] *= -1
    return 4 * vertices * [1, 1, -1 if kind == "pit" else 1], triangles


def lowered(shell, center, depth: float):
    """The centre moved up or down until its deepest contact has the given depth."""
    for _ in range(12):
        found = sweeps.query(shell, center)
        lift = (found.depth[0] - depth) / found.normal[0, 2] if len(found) else -0.05
        center = center + lift * sweeps.UP
        if 0 <= abs(lift) < 1e-9:
            break
    return center


def over_vertex(shell, depth: float):
    """Paths over the vertex at the origin and past it, of constant depth and of constant height."""
    rng = np.random.default_rng(5)
    share = np.linspace(-1, 1, 12)
    for aside in (1e-3, 0.02, 0.1):
        turn = rng.uniform(0, 2 * np.pi)
        along = np.array([np.cos(turn), np.sin(turn), 0.0])
        foot = aside * np.array([-along[1], along[0], 0.0]) + sweeps.UP
        path = foot + 0.6 * (share * abs(share))[:, None] * along
        if aside == 0.02:
            yield path + (lowered(shell, foot, depth) - foot)
        else:
            yield np.array([lowered(shell, center, depth) for center in path])


EVERY_STAR = product(("tip", "pit", "saddle"), (3, 4, 6, 12), (2, 10, 40))
STARS = [one for one in EVERY_STAR if one[:2] != ("saddle", 3)]
SOME_STARS = {("tip", 3, 10), ("tip", 12, 40), ("pit", 6, 2), ("pit", 12, 40)}
SOME_STARS |= {("saddle", 4, 2), ("saddle", 6, 40)}
STARS = mostly_studies(STARS, SOME_STARS.__contains__)


def assert_jumps_as_defined(shell, paths, depth: float) -> None:
    """The potential does not jump, and the force only where that of the definition does: where
    passes close a ring round a pit and two are equally high, either may be the last."""
    for path in paths:
        pairs = sweeps.sweep(shell, path)
        found = zip(pairs, sweeps.changes(shell, pairs, depth), strict=True)
        for pair, (force, potential) in found:
            assert potential <= sweeps.LIMIT, (potential, pair[0].tolist())
            if force > sweeps.LIMIT:
                # A little off the tie, which round-off decides.
                off = 1e-10 * (pair[1] - pair[0]) / np.linalg.norm(pair[1] - pair[0])
                sweeps.assert_as_defined(shell, [pair[0] - off, pair[1] + off], depth)


@pytest.mark.parametrize(("kind", "facets", "slope"), STARS)
def test_vertices(kind: str, facets: int, slope: float) -> None:
    """Pyramids from outside and inside, and saddles of up and down folds, all creases."""
    shell = Shell(*star(kind, facets, slope), crease_angle=np.radians(0.3))
    for depth in sweeps.DEPTHS:
        paths = list(over_vertex(shell, depth))
        if kind == "pit":
            assert_jumps_as_defined(shell, paths, depth)
        else:
            sweeps.assert_continuous(shell, paths, depth)
        sweeps.assert_as_defined(shell, [path[k] for path in paths for k in (3, 6)], depth)
