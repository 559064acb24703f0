"""Flat faces and lines beside a plane under laws of a point: potential, derivatives, rest."""

import warnings
from itertools import product

import coal
import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import minimize

import sphshell_pin as sp
from sphshell_pin import testing
from sphshell_pin.errors import SetupWarning
from tests.contact.test_planes import pose, scene_of
from tests.dynamics import test_planes as planes
from tests.dynamics.test_derivatives import assert_derivatives, assert_rows
from tests.meshes import cube, grid_plate
from tests.models import linear_law

LAW = sp.ImpactLaw(1e6, 1.5, 50.0, 1e-4)
CROWN = 1e3  # its radius over the size of the shell


def prism(outline: np.ndarray, height: float) -> sp.Shell:
    """A right prism over a polygon."""
    n = len(outline)
    ends = [np.c_[outline, np.full(n, z)] for z in (0.0, height)]
    walls = [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
    middle = np.array([[*outline.mean(axis=0), z] for z in (0.0, height)])
    caps = [[(k + 1) % n, k, 2 * n, -1] for k in range(n)]
    caps += [[n + k, n + (k + 1) % n, 2 * n + 1, -1] for k in range(n)]
    return sp.Shell(np.vstack([*ends, middle]), np.array(walls + caps))


TRIANGLE = np.array([[0.0, 0.0], [0.05, 0.0], [0.01, 0.03]])
COIN, ROLLER = coal.Cylinder(0.02, 0.004), coal.Cylinder(0.02, 0.06)
CONE, SLANT = coal.Cone(0.03, 0.06), np.pi / 2 + np.arctan2(0.03, 0.06)


def solid(geometry: object) -> sp.Shell:
    return sp.Shell.from_geometry(geometry, segments=48)


SHELLS = {
    "box": (planes.box, np.eye(3)),
    "box on an edge": (planes.box, pin.utils.rotate("x", 0.6)),
    "wedge": (lambda: prism(TRIANGLE, 0.02), np.eye(3)),
    "coin": (lambda: solid(COIN), np.eye(3)),
    "coin on its other side": (lambda: solid(COIN), pin.utils.rotate("x", np.pi)),
    "roller": (lambda: solid(ROLLER), pin.utils.rotate("x", np.pi / 2)),
    "cone": (lambda: solid(CONE), pin.utils.rotate("y", SLANT)),
    "sheet": (lambda: sp.Shell(*grid_plate(2, 2, 0.05)), np.eye(3)),
}


def lying(name, law, friction, *, ground=True, tilt=0.2):
    """A body that lies flat but for a share of the crown's tilt, and its state."""
    make, flat = SHELLS[name]
    shell = make()
    scene = planes.over_plane(shell, law, friction, ground=ground)
    lean = np.random.default_rng(5).normal(size=3) * [1, 1, 0]
    lean *= tilt / CROWN / np.linalg.norm(lean)
    turn = pin.exp3(lean) @ pin.utils.rotate("z", 0.4) @ flat
    q, v = planes.touching(scene, 2e-4, 5, turn, planes.reach_of(shell))
    return scene, q, v / 15  # so that all corners press


@pytest.mark.parametrize("ground", [True, False])
@pytest.mark.parametrize("friction", planes.FRICTIONS)
@pytest.mark.parametrize("name", SHELLS)
def test_derivatives_are_those_of_finite_differences(name: str, friction, ground: bool) -> None:
    # Steps of the differences are a share of the crown's tilt.
    scene, q, v = lying(name, LAW, friction, ground=ground)
    assert len(scene.contacts(q, v)) == 1
    assert_derivatives(scene, q, v)
    assert_rows(scene, q, v)
    if not ground:
        testing.assert_wrenches_cancel(scene, q, v)


@pytest.mark.parametrize("name", ["box", "coin"])
def test_derivatives_where_places_slide_in_different_directions(name: str) -> None:
    """Round the normal: what friction adds at each does not cancel in their sum."""
    scene, q, v = lying(name, LAW, planes.FRICTIONS[1])
    assert_derivatives(scene, q, v + np.array([0.03, 0.0, 0.0, 0.0, 0.0, 3.0]))


@pytest.mark.parametrize("name", SHELLS)
def test_the_force_is_the_gradient_of_a_potential(name: str) -> None:
    """Round closed ways through states that lie flat, on edges and on corners."""
    law = sp.ImpactLaw(1e6, 1.5)
    rng = np.random.default_rng(1)
    for tilt in (0.3, 1.0):
        scene, q, _ = lying(name, law, None, tilt=0.0)
        model = scene.model
        ways = rng.normal(size=(2, 6)) * np.r_[[1e-5] * 3, [tilt / CROWN] * 3]
        turns, weights = np.polynomial.legendre.leggauss(12)
        angles = np.add.outer(np.pi / 30 * (np.arange(60) + 0.5), np.pi / 60 * turns)
        total = size = 0.0
        for angle, share in zip(angles.ravel(), np.tile(weights, 60), strict=True):
            at = np.cos(angle) * ways[0] + np.sin(angle) * ways[1]
            along = -np.sin(angle) * ways[0] + np.cos(angle) * ways[1]
            rate = pin.dIntegrate(model, q, at)[1] @ along
            here = pin.integrate(model, q, at)
            power = share * scene.external_forces(here, np.zeros(6))[1].vector @ rate
            total, size = total + power, size + abs(power)
        assert abs(total) < 1e-5 * size  # kinks within the rule


def enclosing(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Middle and radius of the smallest circle round points."""
    reach = lambda middle: np.linalg.norm(points - middle, axis=1).max()  # noqa: E731
    found = minimize(reach, points.mean(axis=0), method="Nelder-Mead", tol=1e-9)
    return found.x, found.fun


@pytest.mark.parametrize("corners", [3, 4, 5, 8])
def test_a_level_face_is_one_contact_in_the_middle_of_its_circle(corners: int) -> None:
    """However the face is divided; the crown raises it by the circle's radius squared over 2 R."""
    rng = np.random.default_rng(corners)
    angles = np.sort(rng.uniform(0, 2 * np.pi, corners))
    outline = 0.03 * np.c_[np.cos(angles), 0.6 * np.sin(angles)]
    shell = prism(outline, 0.02)
    middle, radius = enclosing(outline)
    found = scene_of(shell, linear_law(1e4)).contacts(pose(np.eye(3), -1e-4))
    rise = radius**2 / (2 * CROWN * shell.size)
    assert found.depth == pytest.approx([1e-4 + rise], abs=1e-4 * shell.size / CROWN)
    assert found.point_world[0, :2] == pytest.approx(middle + [0.3, -0.2], abs=1e-4)


def test_division_of_a_face_changes_nothing() -> None:
    turn = pin.exp3(np.array([2e-6, -1e-5, 0.3]))
    found = []
    for cells in (1, 2, 7):
        vertices, elements = grid_plate(cells, cells, 0.05)
        scene = scene_of(sp.Shell(vertices - vertices.mean(axis=0), elements), linear_law(1e4))
        rows = scene.contacts(pose(turn, -1e-4))
        found.append((rows.depth, rows.point_world))
    for depth, point in found[1:]:
        assert depth == pytest.approx(found[0][0], abs=1e-15)
        assert point == pytest.approx(found[0][1], abs=1e-9)


def test_one_corner_has_its_own_depth() -> None:
    """As soon as the others are above it by the square of their distance over 2 R."""
    shell = planes.box()
    scene = scene_of(shell, linear_law(1e4))
    for tilt in (4.0 / CROWN, 1e-2, 0.5):
        turn = pin.exp3(tilt * np.array([0.6, -0.8, 0.0]))
        lowest = (shell.vertices @ turn.T)[:, 2].min()
        found = scene.contacts(pose(turn, -lowest - 1e-4))
        assert found.depth == pytest.approx([1e-4], abs=1e-16)
        corner = shell.vertices @ turn.T + [0.3, -0.2, 0]
        corner = corner[np.argmin(corner[:, 2])]
        assert found.point_world[0, :2] == pytest.approx(corner[:2], abs=1e-15)


def test_the_other_end_of_an_edge_begins_to_share_where_the_maximum_says() -> None:
    """With its lead l = L^2 / 2 - R rise and the ridge e: from l = -e on, (l + e) / (L^2 + 2 e)."""
    shell, length = planes.box(), 0.06
    ridge = 1e-4 * shell.size**2
    scene = scene_of(shell, linear_law(1e4))
    for lead in (-1.5 * ridge, -0.5 * ridge, 0.5 * ridge, 2.0 * ridge):
        rise = (length**2 / 2 - lead) / (CROWN * shell.size)
        turn = pin.utils.rotate("y", rise / length) @ pin.utils.rotate("x", 0.6)
        placed = shell.vertices @ turn.T
        low, high = placed[np.argsort(placed[:, 2])[:2]]
        found = scene.contacts(pose(turn, -low[2] - 1e-4))
        share = (found.point_world[0, 0] - 0.3 - low[0]) / (high[0] - low[0])
        assert share == pytest.approx(max(0.0, lead + ridge) / (length**2 + 2 * ridge), abs=1e-6)


# Shell, inertia, and how they fall: on a corner, with a spin, or, as a coin or cone that is thrown
# rolls on its rim without loss, put down obliquely.
SOLIDS = {
    "box": (planes.box, planes.BOX, (0.5, 0.3), planes.SPUN),
    "coin": (SHELLS["coin"][0], pin.Inertia.FromCylinder(0.2, 0.02, 0.004), (0.3, 0.1), [0] * 6),
    "cone": (SHELLS["cone"][0], pin.Inertia.FromCylinder(0.2, 0.02, 0.06), (2.03, 0.0), [0] * 6),
}


LAYER = sp.FoundationLaw(1e5, 1e-3, 10.0)
SLIPS = [planes.FRICTIONS[1], sp.BristleFriction(0.4, 0.4, 1e4, 30.0)]


def steppers(rtol: float) -> list:
    return [sp.Adaptive(rtol, 1e-3 * rtol), sp.Implicit(rtol, 1e-3 * rtol), sp.RungeKutta4(5e-5)]


FALLS = [("box", LAW, *one) for one in product(steppers(1e-7), SLIPS)]
FALLS += [("box", LAYER, *one) for one in product(steppers(1e-6), SLIPS)]
FALLS += [(name, LAW, one, SLIPS[0]) for name in ("coin", "cone") for one in steppers(1e-7)]


@pytest.mark.parametrize(("name", "law", "integrator", "friction"), FALLS)
def test_solids_come_to_rest_at_an_ordinary_cost(name: str, law, integrator, friction) -> None:
    """They fall, rattle, and lie still; the energies close."""
    make, inertia, turn, v = SOLIDS[name]
    duration = 1.0 if name == "box" else 0.5
    more = {"v": v, "turn": turn, "duration": duration, "record_dt": 1e-3}
    result = planes.fallen(make, inertia, law, friction, integrator, **more)
    assert result.stats.steps <= 20_000 * duration
    assert np.abs(result.v[-1]).max() < 1e-6
    assert np.abs(result.energy.residual).max() < 1e-6 * result.energy.exchanged


@pytest.mark.parametrize("friction", [None, sp.CoulombFriction(0.4, 0.4, 0.01, 0.1)])
def test_fixed_steps_resolve_where_damping_and_friction_come_on(friction) -> None:
    """Damping comes on within two steps of the fall, friction within some at the impact."""
    sides, law = (0.1, 0.06, 0.04), sp.ImpactLaw(1e5, 1.0, 20.0, 1e-4)
    inertia, more = pin.Inertia.FromBox(0.5, *sides), {"duration": 0.2, "record_dt": 1e-3}
    falls = lambda: planes.box(sides), inertia, law, friction, sp.RungeKutta4(5e-5)
    result = planes.fallen(*falls, **more)
    assert np.abs(result.energy.residual).max() < 1e-6 * result.energy.exchanged


def test_a_face_with_a_notch_is_warned_of() -> None:
    notched = np.array([[0, 0], [0.04, 0], [0.04, 0.02], [0.02, 0.02], [0.02, 0.04], [0, 0.04]])
    with pytest.warns(SetupWarning, match="stands on one point at a time"):
        scene_of(prism(notched, 0.02), LAW)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene_of(sp.Shell(*cube(0.2)), LAW)
