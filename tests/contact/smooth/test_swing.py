"""A ball swings in a bowl without friction: its period is the exact bowl's, its energy stays."""

from functools import cache

import numpy as np
import pytest

from sphshell_pin import RungeKutta4, Scene, Simulation
from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report import swing
from sphshell_pin.study.report.surfaces import Mesh, icosphere
from tests.hard_cases.balls import exact_scene

PERIODS = 2
BARS = {0.3: (5e-6, 1e-5), 0.15: (5e-7, 1e-6)}  # of period and energy, with exact normals
# The elements are far better than the bars that were asked for; keep them so.
BETTER = 50
exact_period = cache(swing.reference_period)
ELLIPSOID = np.array([4.0, 4.6, 3.6]) * swing.RADIUS


def test_reference_periods_agree() -> None:
    """The closed form leaves out the second order of m g / (k L), 0.0016; the rest is exact."""
    period = exact_period(periods=PERIODS)
    assert swing.closed_form() == pytest.approx(period, rel=3e-6)
    assert swing.swing(exact_scene(), 0.7, swing.DT, PERIODS).period == pytest.approx(
        period, rel=1e-9
    )
    assert (
        pytest.approx(swing.MASS * swing.GRAVITY * swing.ARM * (1 - np.cos(swing.ANGLE)))
        == swing.ENERGY
    )


def test_crossings_of_a_cosine() -> None:
    t = np.linspace(0, 2.1, 2101)
    found = swing.downward_crossings(t, np.cos(2 * np.pi * t), -2 * np.pi * np.sin(2 * np.pi * t))
    assert found == pytest.approx([0.25, 1.25], abs=1e-12)


@pytest.mark.parametrize("exact_normals", [True, False])
@pytest.mark.parametrize("side", BARS)
def test_period_and_energy(side: float, exact_normals: bool) -> None:
    scene = swing.mesh_scene(swing.bowl(side), exact_normals=exact_normals)
    row = swing.measure(
        scene, exact_period(periods=PERIODS), swing.AZIMUTHS[::2], swing.DT, PERIODS
    )
    period_bar, energy_bar = BARS[side]
    assert row.rms <= period_bar / BETTER
    assert row.energy <= energy_bar / BETTER


def test_swing_along_edges() -> None:
    """Two mirror planes of the mesh, full of edges and vertices, are the planes of the swings."""
    scene = swing.mesh_scene(swing.bowl(0.3, np.eye(3)))
    row = swing.measure(scene, exact_period(periods=PERIODS), (0.0, np.pi / 2), swing.DT, PERIODS)
    period_bar, energy_bar = BARS[0.3]
    assert row.rms <= period_bar / BETTER
    assert row.energy <= energy_bar / BETTER


def ellipsoid(level: int, jitter: float = 0.2, seed: int = 3) -> Mesh:
    """Return an ellipsoid whose vertices are moved along it by up to `jitter` sides."""
    ball = icosphere(level, 1.0)
    rng = np.random.default_rng(seed)
    moved = ball.vertices + jitter * ball.mean_side * rng.uniform(-1, 1, ball.vertices.shape)
    moved /= np.linalg.norm(moved, axis=1)[:, None]
    normals = moved / ELLIPSOID
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return Mesh(moved * ELLIPSOID, ball.triangles, normals)


def ellipsoid_start(azimuth: float) -> Array:
    """Return a center (3,) [m] in balance where the ellipsoid is 40 degrees from its bottom."""
    sine, cosine = np.sin(swing.ANGLE), np.cos(swing.ANGLE)
    out = np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), -cosine])
    point = out * ELLIPSOID
    normal = out / ELLIPSOID
    normal /= np.linalg.norm(normal)
    depth = swing.MASS * swing.GRAVITY * -normal[2] / swing.STIFFNESS
    center: Array = point - (swing.RADIUS - depth) * normal
    return center


def ellipsoid_energy(scene: Scene, azimuth: float, swings: int) -> float:
    """Return the largest change of energy over the energy of a swing in the ellipsoid."""
    center = ellipsoid_start(azimuth)
    fall = float(center[2] + ELLIPSOID[2] - swing.RADIUS)
    simulation, duration = Simulation(scene, RungeKutta4(swing.DT)), swings * swing.closed_form()
    result = simulation.run(center, duration=duration, record_dt=1e-3)
    assert (result.contacts.row == np.arange(len(result.t))).all()  # one contact throughout
    changes = swing.energy_changes(result, swing.MASS * swing.GRAVITY * fall)
    return float(np.abs(changes).max())


@pytest.mark.parametrize("azimuth", [0.1, 0.9])
def test_energy_in_an_uneven_ellipsoid(azimuth: float) -> None:
    assert ellipsoid_energy(swing.mesh_scene(ellipsoid(4)), azimuth, 10) <= BARS[0.3][1]
