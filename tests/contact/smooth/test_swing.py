"""A ball swings in a bowl without friction: its period is the exact bowl's, its energy stays."""

from functools import cache

import numpy as np
import pytest

from sphshell_pin.study.report import swing
from tests.hard_cases.balls import exact_scene

PERIODS = 2
BARS = {0.3: (5e-6, 1e-5), 0.15: (5e-7, 1e-6)}  # of period and energy, with exact normals
# The elements are far better than the bars that were asked for; keep them so.
BETTER = 50
exact_period = cache(swing.reference_period)


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
