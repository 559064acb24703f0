"""A ball swings in a bowl without friction: its period is the exact bowl's, its energy stays."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sphshell_pin.study.report import swing
from tests.hard_cases.balls import exact_scene

PERIODS = 2
BARS = {0.3: (5e-6, 1e-5), 0.15: (5e-7, 1e-6)}  # of period and energy, with exact normals
# The elements are far better than the bars that were asked for; keep them so.
BETTER = 50


def test_the_period_is_that_of_the_exact_bowl() -> None:
    """By SciPy, from one fall through the middle to another, and by the scene of exact points."""

    def motion(_, state):
        at, v = np.split(state, 2)
        reach = np.hypot(*at)
        pull = swing.STIFFNESS / swing.MASS * max(0.0, reach - swing.ARM) / reach * at
        return np.array([*v, -pull[0], -pull[1] - swing.GRAVITY])

    def falls(_, state):
        return state[0]

    falls.direction = -1.0
    first = np.r_[swing.start(0.0)[[0, 2]], 0.0, 0.0]
    found = solve_ivp(motion, (0.0, 1.6), first, "DOP853", events=falls, rtol=1e-12, atol=1e-14)
    crossings = found.t_events[0]
    assert (crossings[4] - crossings[0]) / 4 == pytest.approx(swing.PERIOD, rel=2e-10)
    period, _ = swing.swing(exact_scene(), 0.7, PERIODS)
    assert period == pytest.approx(swing.PERIOD, rel=1e-9)
    height = swing.ARM * (1 - np.cos(swing.ANGLE))
    assert pytest.approx(swing.ENERGY) == swing.MASS * swing.GRAVITY * height


@pytest.mark.parametrize("exact_normals", [True, False])
@pytest.mark.parametrize("side", BARS)
def test_period_and_energy(side: float, exact_normals: bool) -> None:
    scene = swing.mesh_scene(swing.bowl(side), exact_normals=exact_normals)
    row = swing.measure(scene, swing.AZIMUTHS[::2], PERIODS)
    period_bar, energy_bar = BARS[side]
    assert row.rms <= period_bar / BETTER
    assert row.energy <= energy_bar / BETTER
