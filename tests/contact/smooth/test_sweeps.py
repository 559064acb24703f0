"""A sphere of radius one is swept over every kind of joint: its force does not jump."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from sphshell_pin import Shell
from tests import meshes
from tests.contact.helpers import energy, force_sum
from tests.contact.smooth.surfaces import SURFACES, can, shell_of
from tests.contact.smooth.test_potential import crossing, query
from tests.contact.smooth.test_true_edges import cone
from tests.oracle.pieces import potential_and_force

DEPTHS = (0.04, 0.004, 0.0004)
# Two centres this far apart are on two sides of a border of regions.
WIDTH = 1e-11
# A jump is a change by more than this share of the force.
LIMIT = 1e-6
UP = np.array([0.0, 0.0, 1.0])


# Sweeps


def segment(start, end, nodes: int):
    """Centres (nodes, 3) along a straight line."""
    return start + np.linspace(0, 1, nodes)[:, None] * (np.asarray(end) - start)


def about(axis, center, angles):
    """`center` turned about an axis through the origin by `angles`: (n, 3)."""
    along = center @ axis * axis
    east = center - along
    return along + np.outer(np.cos(angles), east) + np.outer(np.sin(angles), np.cross(axis, east))


def borders(shell, start, end, width: float = WIDTH):
    """All places between two centres where the contacts' features change: pairs of centres."""
    found = []
    while len(found) < 60 and (pair := crossing(shell, start, end, width)) is not None:
        found.append(pair)
        start = pair[1]
    return found


def steepest(shell, start, end, width: float = WIDTH):
    """Two centres `width` apart, between which the force changes most, by halving."""
    first, last = (force_sum(query(shell, c)) for c in (start, end))
    while np.linalg.norm(end - start) > width:
        middle = (start + end) / 2
        if (middle == start).all() or (middle == end).all():
            break
        force = force_sum(query(shell, middle))
        if np.linalg.norm(force - first) > np.linalg.norm(last - force):
            end, last = middle, force
        else:
            start, first = middle, force
    return start, end


def sweep(shell, path):
    """Pairs of centres WIDTH apart where the force may jump: wherever the features change, and,
    lest it jump where they do not, in the step of the path over which it changes most."""
    pairs = [pair for ends in pairwise(path) for pair in borders(shell, *ends)]
    forces = np.array([force_sum(query(shell, center)) for center in path])
    k = np.linalg.norm(np.diff(forces, axis=0), axis=1).argmax()
    return [*pairs, steepest(shell, path[k], path[k + 1])]


def changes(shell, pairs, depth: float):
    """Change of the force, and of the potential, within each pair: (n, 2), of their sizes."""
    found = []
    for pair in pairs:
        before, after = (query(shell, center) for center in pair)
        forces = force_sum(before), force_sum(after)
        energies = energy(before), energy(after)
        size = max(*(np.linalg.norm(f) for f in forces), depth**1.5)
        jump = np.linalg.norm(forces[1] - forces[0]) / size
        found.append((jump, abs(energies[1] - energies[0]) / max(*energies, depth**2.5)))
    return np.array(found)


def assert_continuous(shell, paths, depth: float, least: int = 1, limit: float = LIMIT):
    """Neither the force nor the potential jumps along any of the paths."""
    worst, seen = (0.0, None), 0
    for path in paths:
        pairs = sweep(shell, path)
        seen += len(pairs) - 1
        for (force, potential), (before, _) in zip(
            changes(shell, pairs, depth), pairs, strict=True
        ):
            worst = max(worst, (float(max(force, potential)), before.tolist()), key=lambda w: w[0])
    assert seen >= least
    assert worst[0] <= limit, worst


def work_error(shell, path):
    """Work of the force along a path and change of the potential, which should cancel; as a share
    of the largest potential. Gauss's rule, twelve nodes between borders of regions."""
    places = [path[0]]
    for start, end in pairwise(path):
        places += [center for pair in borders(shell, start, end, 1e-9) for center in pair] + [end]
    nodes, weights = np.polynomial.legendre.leggauss(12)
    done = 0.0
    for start, end in pairwise(places):
        middle, half = (start + end) / 2, (end - start) / 2
        forces = [force_sum(query(shell, middle + s * half)) for s in nodes]
        done += weights @ forces @ half
    energies = [energy(query(shell, place)) for place in path]
    return abs(done + energies[-1] - energies[0]) / max(energies)


# 1. Smooth joints


def rolled(name: str, depth: float, count: int, length: float, nodes: int, seed: int = 0):
    """Paths over a smooth surface: of constant depth, but on the wavy sheet of constant height."""
    rng = np.random.default_rng(1000 + seed)
    for center, normal in zip(*SURFACES[name].probes(count, depth, seed), strict=True):
        if "wavy" in name:
            along = np.cross(normal, rng.normal(size=3))
            yield segment(center, center + length * along / np.linalg.norm(along), nodes)
        else:
            axis = UP if "torus" in name else np.cross(center, rng.normal(size=3))
            axis = axis / np.linalg.norm(axis)
            reach = length / np.linalg.norm(np.cross(axis, center))
            yield about(axis, center, np.linspace(0, reach, nodes))


@cache
def joints(name: str, exact: bool, h: float, step: float):
    """Changes of the force over a step across smooth joints, relative to the force: as they are,
    and without those over such a step before the joint and behind it."""
    shell = shell_of(name, h, exact)
    found = []
    for path in rolled(name, 0.04, 14, h, 4, seed=1):
        for start, end in pairwise(path):
            for before, after in borders(shell, start, end, step):
                move = step * (after - before) / np.linalg.norm(after - before)
                places = [(before + after) / 2 + s * move for s in (-1.5, -0.5, 0.5, 1.5)]
                force = np.array([force_sum(query(shell, place)) for place in places])
                change = np.diff(force, axis=0)
                jump = change[1] - (change[0] + change[2]) / 2
                size = np.linalg.norm(force[1])
                found.append((np.linalg.norm(change[1]) / size, np.linalg.norm(jump) / size))
    assert len(found) > 20
    return np.array(found)


SMOOTH = ("bowl", "dome", "torus inside", "wavy above", "wavy below")


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("name", SMOOTH)
def test_steps_across_smooth_joints(name: str, exact: bool) -> None:
    """Over steps of 1e-5 the force changes by hundred thousandths; what it turns by at a joint
    falls with refinement."""
    change, jump = joints(name, exact, 0.3, 1e-5).T
    assert change.max() <= 6e-5
    assert change.mean() <= 2e-5
    assert jump.max() <= 3e-5
    assert jump.mean() <= 7e-6
    turns = [joints(name, exact, h, 1e-3)[:, 1] for h in (0.6, 0.3, 0.15)]
    assert turns[1].max() <= 1.5e-3
    assert turns[1].mean() <= 3e-4
    assert turns[1].mean() <= turns[0].mean() / 2
    assert turns[2].mean() <= turns[0].mean() / 4


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("name", SMOOTH)
def test_smooth_joints(name: str, exact: bool) -> None:
    for h, count in ((0.6, 6), (0.3, 6), (0.15, 2)):
        for depth in DEPTHS:
            shell = shell_of(name, h, exact)
            assert_continuous(shell, rolled(name, depth, count, 0.7 * h, 4), depth, 2)


@pytest.mark.parametrize("name", ["bowl", "dome"])
def test_along_mesh_lines(name: str) -> None:
    """From vertex to vertex the centre is over edges all the way, to round-off."""
    shell = shell_of(name, 0.6)
    side = SURFACES[name].sign
    rng = np.random.default_rng(4)
    for depth in DEPTHS:
        radius = 4.0 + side * (1 - depth)
        lines = shell.vertices[rng.choice(shell.edge_vertices, 4)] * (radius / 4.0)
        paths = [a + np.linspace(-0.3, 1.3, 7)[:, None] * (b - a) for a, b in lines]
        paths = [p * (radius / np.linalg.norm(p, axis=1)[:, None]) for p in paths]
        assert_continuous(shell, paths, depth)


# 2. Folds of flat sides


ANGLES = (1, 2, 5, 10, 16, 20, 30, 45, 60, 90, 120, 150, 170)
SIZE = 4.0


def fold(kind: str, angle: float, crease: float) -> Shell:
    """Fold of `angle` [deg] along y, of eight triangles; a groove or a ridge seen from +z."""
    vertices, triangles = meshes.v_groove(np.radians(angle / 2), size=SIZE)
    if kind == "ridge":
        vertices = vertices * [1.0, 1.0, -1.0]
    return Shell(vertices, triangles, crease_angle=np.radians(crease))


def profile(kind: str, angle: float, depth: float):
    """Centres in the plane across a fold at a constant depth in its nearer side: (n, 3)."""
    lean, reach = np.radians(angle / 2), 1 - depth
    if kind == "groove":
        # Beyond these the farther side is not touched, or not at its foot.
        ends = [min(np.sin(lean), depth / np.sin(lean) / 2), np.sin(lean)]
        x = np.unique([s * e for e in [*ends, 0.0, 0.5] for s in (-1.4, -0.7, 0.0, 0.6, 1.5)])
        return np.stack([x, 0 * x, (reach + np.abs(x) * np.sin(lean)) / np.cos(lean)], axis=1)
    # Chords of the arc over the edge go deeper by a tenth of the depth.
    count = 2 + int(2 * lean / np.sqrt(0.8 * depth))
    tilt = np.linspace(-lean, lean, count)
    arc = reach * np.stack([np.sin(tilt), 0 * tilt, np.cos(tilt)], axis=1)
    down = 0.4 * np.array([np.cos(lean), 0.0, -np.sin(lean)])
    return np.concatenate([arc[:1] + down * [-1, 1, 1], arc, arc[-1:] + down])


def fold_paths(kind: str, angle: float, depth: float, where: str):
    """Across the fold, obliquely, or over the end of the crease at the border of the sheet."""
    path = profile(kind, angle, depth)
    if where == "across":
        yield path + [0.0, 0.123, 0.0]
        yield path + np.outer(path[:, 0], [0.0, 0.8, 0.0]) + [0.0, -0.31, 0.0]
    else:
        yield path + np.outer(path[:, 0], [0.0, 0.4, 0.0]) + [0.0, SIZE / 2 + 0.003, 0.0]
        out = np.linspace(-0.2, 0.3, 7)[:, None]
        for share in (0.5, 0.53):
            k = (len(path) - 1) * share
            top = path[int(k)] + (k - int(k)) * (path[int(k) + 1] - path[int(k)])
            yield top + [0.0, SIZE / 2, 0.0] + out * [0.0, 1.0, 0.0]


def assert_as_defined(shell, places, depth: float) -> None:
    """Force and potential are those of the pieces of surface inside the sphere."""
    for center in places:
        found = query(shell, center)
        exact, force = potential_and_force(shell.vertices, shell.triangles, center, 1.0)
        assert abs(energy(found) - exact) <= 1e-6 * max(exact, depth**2.5), center.tolist()
        size = max(np.linalg.norm(force), depth**1.5)
        assert np.linalg.norm(force_sum(found) - force) <= LIMIT * size, center.tolist()


KINDS = ("ridge", "groove")


FOLDS = [(k, angle, where) for k in KINDS for angle in ANGLES for where in ("across", "end")]


@pytest.mark.parametrize(("kind", "angle", "where"), FOLDS)
def test_creases(kind: str, angle: float, where: str) -> None:
    shell = fold(kind, angle, 0.5)
    for depth in DEPTHS:
        paths = list(fold_paths(kind, angle, depth, where))
        assert_continuous(shell, paths, depth)
        for path in paths:
            assert_as_defined(shell, path[1 : -1 : max(1, len(path) // 3)] + 1e-5, depth)


@pytest.mark.parametrize(("kind", "angle", "where"), [f for f in FOLDS if f[1] <= 30])
def test_folds_that_count_as_smooth(kind: str, angle: float, where: str) -> None:
    shell = fold(kind, angle, 30.5)
    for depth in DEPTHS:
        assert_continuous(shell, fold_paths(kind, angle, depth, where), depth)


# 3 to 5. Curved creases, borders, vertices


def lens(half: float, rows: int, columns: int):
    """Two caps of a sphere of radius four that meet in a circle of radius `half`, and their normals
    per corner: a round crease."""
    drop = np.sqrt(16.0 - half**2)
    polar = np.arcsin(half / 4) * np.arange(1, rows + 1) / rows
    turn = 2 * np.pi * np.arange(columns) / columns
    polar, turn = (g.ravel() for g in np.meshgrid(polar, turn, indexing="ij"))
    upper = 4 * np.stack(
        [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=1
    )
    upper = np.concatenate([[[0.0, 0.0, 4.0]], upper])
    triangles = cone(columns, 0.5, rows)[1]
    upper[-columns:, 2] = drop
    below = np.arange(len(upper)) + len(upper)
    below[-columns:] = np.arange(len(upper) - columns, len(upper))
    vertices = np.concatenate([upper - [0, 0, drop], (upper - [0, 0, drop]) * [1, 1, -1]])
    normals = np.concatenate([upper[triangles], (upper * [1, 1, -1])[triangles][:, ::-1]]) / 4
    triangles = np.concatenate([triangles, below[triangles][:, ::-1]])
    used, triangles = np.unique(triangles, return_inverse=True)
    return vertices[used], triangles.reshape(-1, 3).astype(np.int32), normals


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
        out = rng.normal(size=3)
        out /= np.linalg.norm(out)
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
        along = rng.normal(size=3)
        along *= reach / np.linalg.norm(along)
        path = segment(place + low * out - along, place + low * out + along, 9)
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


@pytest.mark.parametrize(("kind", "exact"), EDGED)
def test_edges(kind: str, exact: bool) -> None:
    """Curved creases, borders, and bodies with plane sides."""
    shell = edged(kind, exact)
    for depth in DEPTHS:
        assert_continuous(shell, along_edges(shell, depth, 9), depth, 5)


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
        found = query(shell, center)
        lift = (found.depth[0] - depth) / found.normal[0, 2] if len(found) else -0.05
        center = center + lift * UP
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
        foot = aside * np.array([-along[1], along[0], 0.0]) + UP
        path = foot + 0.6 * (share * abs(share))[:, None] * along
        if aside == 0.02:
            yield path + (lowered(shell, foot, depth) - foot)
        else:
            yield np.array([lowered(shell, center, depth) for center in path])


STARS = [
    (kind, facets, slope)
    for kind in ("tip", "pit", "saddle")
    for facets in (3, 4, 6, 12)
    for slope in (2, 10, 40)
    if (kind, facets) != ("saddle", 3)
]


def assert_jumps_as_defined(shell, paths, depth: float) -> None:
    """The potential does not jump, and the force only where that of the definition does: where
    passes close a ring round a pit and two are equally high, either may be the last."""
    for path in paths:
        pairs = sweep(shell, path)
        for pair, (force, potential) in zip(pairs, changes(shell, pairs, depth), strict=True):
            assert potential <= LIMIT, (potential, pair[0].tolist())
            if force > LIMIT:
                # A little off the tie, which round-off decides.
                off = 1e-10 * (pair[1] - pair[0]) / np.linalg.norm(pair[1] - pair[0])
                assert_as_defined(shell, [pair[0] - off, pair[1] + off], depth)


@pytest.mark.parametrize(("kind", "facets", "slope"), STARS)
def test_vertices(kind: str, facets: int, slope: float) -> None:
    """Pyramids from outside and inside, and saddles of up and down folds, all creases."""
    shell = Shell(*star(kind, facets, slope), crease_angle=np.radians(0.3))
    for depth in DEPTHS:
        paths = list(over_vertex(shell, depth))
        if kind == "pit":
            assert_jumps_as_defined(shell, paths, depth)
        else:
            assert_continuous(shell, paths, depth)
        assert_as_defined(shell, [path[k] for path in paths for k in (3, 6)], depth)


@pytest.mark.parametrize(("kind", "facets", "slope"), [s for s in STARS if s[2] <= 10])
def test_vertices_that_count_as_smooth(kind: str, facets: int, slope: float) -> None:
    """The same flat facets with their own normals and the crease angle of 30 degrees: the potential
    does not jump, nor, but in pits, the force."""
    vertices, triangles = star(kind, facets, slope)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    shell = Shell(vertices, triangles, normals=np.repeat(normals[:, None], 3, axis=1))
    for depth in DEPTHS:
        for path in over_vertex(shell, depth):
            pairs = sweep(shell, path)
            change = changes(shell, pairs, depth)[:, 1 if kind == "pit" else 0]
            assert change.max() <= LIMIT, (change.max(), pairs[change.argmax()][0].tolist())


def test_corner_of_a_box() -> None:
    """Three walls at right angles, touched one, two and three at a time."""
    shell = edged("box")
    rng = np.random.default_rng(6)
    for depth in DEPTHS:
        corner = 2.0 - (1 - depth) * np.ones(3)
        along = rng.normal(size=(6, 3))
        along *= 0.02 / np.linalg.norm(along, axis=1)[:, None]
        paths = [segment(corner - d, corner + 0.8 * d, 9) for d in along]
        assert_continuous(shell, paths, depth)
        assert_as_defined(shell, [c for path in paths for c in path[:4]], depth)


# 6. The potential


def work_case(name: str):
    """A shell, and paths of a depth of 0.04 to 0.06 over its joints."""
    kind, *size = name.split(" ") if name[-1].isdigit() else (name,)
    if kind in SMOOTH:
        return shell_of(kind, 0.3, kind != "dome"), rolled(kind, 0.04, 4, 0.5, 9, seed=3)
    if kind in KINDS:
        angle = float(size[0])
        paths = [p for where in ("across", "end") for p in fold_paths(kind, angle, 0.04, where)]
        return fold(kind, angle, 0.5), paths
    if size:
        shell = Shell(*star(kind, int(size[0]), float(size[1])), crease_angle=np.radians(0.3))
        return shell, over_vertex(shell, 0.04)
    return edged(kind), along_edges(edged(kind), 0.04, 4)


WORKS = """bowl;dome;torus inside;wavy below;groove 2;groove 20;groove 60;ridge 10;ridge 120;
can;cup;lens;tube;gutter;l plate;box;tip 6 10;pit 4 10;pit 12 40;saddle 6 40"""


@pytest.mark.parametrize("name", WORKS.replace("\n", "").split(";"))
def test_work_is_what_the_potential_loses(name: str) -> None:
    shell, paths = work_case(name)
    assert max(work_error(shell, path) for path in paths) <= 3e-6
