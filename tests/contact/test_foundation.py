"""FoundationLaw's integrals against its definition, closed forms, and its own potential."""

from functools import cache

import numpy as np
import pytest

from sphshell_pin import Shell, _core
from tests import meshes
from tests.contact.helpers import directions
from tests.contact.smooth.surfaces import SURFACES, shell_of
from tests.contact.smooth.test_sweeps_edges import edged
from tests.oracle import foundation as oracle

METHODS = {"facets": 0, "smooth": 2}


def foundation(shell, center, radius=1.0, method="smooth", points=False):
    """Columns of the rows and of the quadrature points, for a modulus / thickness of one."""
    core = shell.core_for(method)
    place = np.asarray(center, dtype=float)
    return _core.Foundation().find(core, place, radius, METHODS[method], points)


def total(shell, center, radius=1.0, method="smooth"):
    """Force, energy and derivative of the force."""
    rows, _ = foundation(shell, center, radius, method)
    return rows[4].sum(axis=0), rows[5].sum(), rows[6].sum(axis=0)


def plane_force(radius, depth):
    return np.pi * depth**2 * (radius - depth / 3)


PLATES = {
    "two triangles": lambda: meshes.grid_plate(1, 1, size=4.0),
    "random": lambda: meshes.random_plate(400, seed=3, size=4.0),
    "slivers": lambda: meshes.random_plate(300, seed=5, size=4.0, slivers=True),
}


@pytest.mark.parametrize("method", list(METHODS))
@pytest.mark.parametrize("plate", list(PLATES))
def test_on_a_plane(plate: str, method: str) -> None:
    """kappa times the volume of the cap, however the plane is divided."""
    shell = Shell(*PLATES[plate]())
    for depth in (0.01, 0.1, 0.5, 0.9):
        center = [0.013, 0.021, 1 - depth]
        force, energy, slope = total(shell, center, method=method)
        rows, _ = foundation(shell, center, method=method)
        assert rows[2].max() == pytest.approx(depth, abs=1e-12)
        exact = plane_force(1.0, depth)
        assert force == pytest.approx([0, 0, exact], rel=1e-12, abs=1e-12 * exact)
        stored = np.pi * (depth**3 / 3 - depth**4 / 12)
        assert energy == pytest.approx(stored, rel=1e-10 / depth)
        stiffness = np.pi * (2 * depth - depth**2)
        assert slope == pytest.approx(np.diag([0, 0, -stiffness]), abs=1e-11 * stiffness)


@pytest.mark.parametrize("ball", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("depth", [0.02, 0.3, 0.55])
def test_on_a_sphere(ball: float, depth: float) -> None:
    """Against the integral over the lens of overlap."""
    apart = ball + 1.0 - depth
    found, points = _core.Foundation().find_on_ball(ball, np.array([0, 0, apart]), 1.0, True)
    assert found[5] == pytest.approx([oracle.energy_in_ball(ball, apart, 1.0)], rel=1e-12)
    force = -oracle.slope(lambda x: oracle.energy_in_ball(ball, x, 1.0), apart, 1e-3)
    assert found[4] == pytest.approx(np.array([[0, 0, force]]), rel=1e-11, abs=1e-11 * force)
    assert points[4].sum(axis=0) == pytest.approx(found[4][0], rel=1e-12, abs=1e-14)

    def force_at(x):
        return _core.Foundation().find_on_ball(ball, x, 1.0)[0][4][0]

    center, steps = np.array([0, 0, apart]), 1e-5 * np.eye(3)
    slope = np.array([(force_at(center + h) - force_at(center - h)) / 2e-5 for h in steps]).T
    assert found[6][0] == pytest.approx(slope, abs=1e-8 * np.abs(slope).max())


@cache
def socket(size: float, level: int) -> Shell:
    vertices, elements = meshes.icosphere(level, 1.0)
    return Shell(vertices * size, elements, normals=vertices, side="inside")


@pytest.mark.parametrize("size", [1.01, 1.1, 1.5])
def test_in_a_socket(size: float) -> None:
    """A ball in a conforming cavity: where Hertz's theory ends."""
    off = size - 1 + 0.1
    force = -oracle.slope(lambda x: oracle.energy_in_socket(size, x, 1.0), off, 1e-3)
    stored = oracle.energy_in_socket(size, off, 1.0)
    errors = []
    for level in (2, 3, 4):
        found, energy, _ = total(socket(size, level), [0.0, 0.6 * off, -0.8 * off])
        errors.append(np.linalg.norm(found - force * np.array([0, 0.6, -0.8])) / abs(force))
    assert energy == pytest.approx(stored, rel=1e-7)
    assert errors[0] <= 1e-3
    assert errors[1] <= errors[0] / 4
    assert errors[2] <= 1e-7


def test_round_a_cube() -> None:
    """Creases and corners of a solid, outside it and with the center inside."""
    shell = Shell(*meshes.cube(2.0), side="outside")
    on_creases = [(1.2, 0.3, -0.1), (1.4, 1.3, 0.2), (1.3, 1.2, 1.35)]
    for center in np.array([*on_creases, (0.8, 0.7, 0.9), (0.1, 0.2, 0.9)]):
        exact = oracle.energy_in_box(-np.ones(3), np.ones(3), center, 1.0)
        assert total(shell, center)[1] == pytest.approx(exact, rel=2e-3)


BORDERS = ["can", "cup", "lens", "tube", "cap", "wave", "sheet", "l plate", "cube", "box"]


@pytest.mark.parametrize("kind", [*BORDERS, "cone", "dome", "bowl", "torus inside", "wavy above"])
def test_force_and_slope_are_derivatives(kind: str) -> None:
    """On curved shells, over creases, borders and holes, as deep as half the radius."""
    rng = np.random.default_rng(1)
    if kind in SURFACES:
        shell = shell_of(kind, 0.6)
        centers = np.concatenate([SURFACES[kind].probes(6, d, seed=3)[0] for d in (0.04, 0.4)])
    else:
        shell = edged(kind)
        ends = shell.vertices[rng.choice(shell.edge_vertices[shell.edge_class > 0], 12)]
        out = directions(rng, 12) * rng.uniform(0.5, 0.95, (12, 1))
        centers = ends[:, 0] + rng.uniform(size=(12, 1)) * (ends[:, 1] - ends[:, 0]) + out
    for center in centers:
        force, energy, slope = total(shell, center)
        if energy < 1e-6:
            continue
        step = 1e-5
        ends = [(total(shell, center + h), total(shell, center - h)) for h in step * np.eye(3)]
        falls = [(behind[1] - ahead[1]) / (2 * step) for ahead, behind in ends]
        turns = np.array([(ahead[0] - behind[0]) / (2 * step) for ahead, behind in ends]).T
        assert np.linalg.norm(force - falls) <= 3e-6 * np.linalg.norm(force), center
        assert np.abs(slope - turns).max() <= 3e-6 * np.abs(slope).max(), center


def test_hole_and_thin_wall() -> None:
    """A plate with a hole, and both faces of a thin one: V is additive, so nothing is special."""
    vertices, elements = meshes.grid_plate(6, 6, size=4.0)
    inner = (np.abs(vertices[elements].mean(axis=1)[:, :2]) < 0.7).all(axis=1)
    center = np.array([0.05, 0.1, 0.9])
    whole = total(Shell(vertices, elements), center)
    ring = total(Shell(vertices, elements[~inner]), center)
    plug = total(Shell(vertices, elements[inner]), center)
    for all_, part, rest in zip(whole, ring, plug, strict=True):
        assert part + rest == pytest.approx(all_, abs=1e-9 * np.abs(all_).max())
    vertices, elements = meshes.cube(4.0)
    thin = Shell(vertices * [1.0, 1.0, 0.0125], elements, side="outside")
    force, energy, _ = total(thin, [0.0, 0.0, 0.025 + 0.8])
    exact = plane_force(1.0, 0.2) - plane_force(1.0, 0.15)
    assert force[2] == pytest.approx(exact, rel=1e-12)
    assert energy > 0


@pytest.mark.parametrize(("kind", "center"), [("dome", [1.0, 2.0, 4.3]), ("cube", [2.3, 2.2, 2.6])])
def test_points_add_up(kind: str, center: list[float]) -> None:
    """Forces of the quadrature points, their patches' and the whole."""
    shell = shell_of(kind, 0.6) if kind in SURFACES else edged(kind)
    rows, (points, normals, areas, pressures, forces, row) = foundation(shell, center, points=True)
    force = rows[4].sum(axis=0)
    for k, one in enumerate(rows[4]):
        assert np.abs(forces[row == k].sum(axis=0) - one).max() <= 1e-13 * np.linalg.norm(force)
    pressed = areas > 0
    rho = np.linalg.norm(points - center, axis=1)
    assert pressures[pressed] == pytest.approx(oracle.pressure(rho[pressed], 1.0), rel=1e-9)
    each = (areas * pressures)[:, None] * normals
    assert forces[pressed] == pytest.approx(each[pressed], abs=1e-15)
    # The potential depends on the center alone: there is no moment about it.
    moment = np.cross(points - center, forces).sum(axis=0)
    assert np.linalg.norm(moment) <= 1e-6 * np.linalg.norm(force)


def test_points_follow_the_area_and_not_the_aspect() -> None:
    """On a plane of needles of aspect 1e4, few points have the moments of those on squares."""
    squares, needles = meshes.grid_plate(12, 12, size=4.0), meshes.grid_plate(1, 12, size=4.0)
    sums, counts = [], []
    for (vertices, elements), stretch in ((squares, 1.0), (needles, 1e4 / 12)):
        shell, center = Shell(vertices * [stretch, 1, 1], elements), [0.4 * stretch, 0.03, 0.1]
        _, (points, *_, forces, _) = foundation(shell, center, points=True)
        arms = np.c_[np.ones(len(points)), (points - center)[:, :2] ** 2]
        sums.append(forces[:, 2] @ arms)
        counts.append(len(points))
    assert sums[1] == pytest.approx(sums[0], rel=1e-6)
    assert counts[1] < 4 * counts[0]


def test_rows_are_patches() -> None:
    """One per face that is overlapped, with its depth and its center of pressure."""
    shell = edged("box")
    center = np.array([-1.1, 0.2, -1.3])
    (patch, _, depth, at, force, _, _), _ = foundation(shell, center)
    assert len(set(patch)) == 2
    order = np.argsort(depth)[::-1]
    assert depth[order] == pytest.approx([0.3, 0.1], abs=1e-12)
    expected = np.array([[0, 0, plane_force(1.0, 0.3)], [plane_force(1.0, 0.1), 0, 0]])
    assert force[order] == pytest.approx(expected, abs=1e-9)
    assert at[order] == pytest.approx(np.array([[-1.1, 0.2, -2.0], [-2.0, 0.2, -1.3]]), abs=1e-9)
