"""The period of stick-slip, and what `v_stribeck` costs of it: the figures of docs/dynamics.md."""

import numpy as np
import pytest

import sphshell_pin as sp
from tests import models

MASS, SPRING, DRAWN, STATIC, DYNAMIC, RADIUS = 1.0, 1e3, 0.01, 0.6, 0.4, 0.02


def period() -> float:
    """With mu_static until it slips and mu_dynamic while it does, it sticks again at rest."""
    stretch = (STATIC - DYNAMIC) * MASS * 9.81 / SPRING
    frequency = np.sqrt(SPRING / MASS)
    slip = 2 / frequency * (np.pi - np.arctan(stretch * frequency / DRAWN))
    return 2 * stretch / DRAWN + slip


@pytest.mark.study
@pytest.mark.parametrize(
    ("v_stribeck", "percent"), [(1e-4, -0.13), (1e-3, 2.7), (3e-3, 5.2), (1e-2, 9.5)]
)
def test_the_period_of_stick_slip(v_stribeck: float, percent: float) -> None:
    friction = sp.BristleFriction(STATIC, DYNAMIC, 1e6, 100.0, v_stribeck)
    law = sp.ImpactLaw(1e6, 1.0, 300.0, 1e-6)
    model = models.block(9.81, MASS, RADIUS)
    scene = models.on_shell(model, models.square(), law, friction, radius=RADIUS)

    def pull(t, q, _v, _contacts):
        return np.array([SPRING * (DRAWN * t - q[0]), 0.0, 0.0])

    start = np.array([0.0, 0.0, RADIUS - MASS * 9.81 / 1e6])
    run = sp.Simulation(scene, sp.Adaptive(1e-7, 1e-10)).run(
        start, np.zeros(3), 3.0, controller=pull, control_dt=2e-4, record_dt=1e-4
    )
    fast = run.v[:, 0] > 2 * DRAWN
    begins = run.t[np.flatnonzero(fast[1:] & ~fast[:-1])]
    found = 100 * (np.diff(begins)[1:].mean() / period() - 1)
    assert np.isclose(found, percent, atol=0.15)
