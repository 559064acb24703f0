"""The energy that a run does not account for falls at the order of its integrator."""

from itertools import pairwise

import numpy as np
import pytest

import sphshell_pin as sp
from tests import models

RADIUS = 0.05
SMOOTH_FRICTION = sp.CoulombFriction(0.3, 0.1, 20.0, 40.0)
STEPPERS = [(sp.SemiImplicitEuler, 1), (sp.RungeKutta4, 4)]


def rolling(integrator, steps: int, damping: float = 20.0, friction=SMOOTH_FRICTION):
    """Ball deep in a plate that slides, spins and bobs without ever leaving it."""
    scene = models.on_plate(models.ball(), models.linear_law(4000.0, damping), friction)
    q0 = models.free_q([-0.1, 0.03, RADIUS - 0.004])
    v0 = np.array([1.0, -0.5, 0.05, 20.0, 30.0, -10.0])
    result = sp.Simulation(scene, integrator(dt=0.1 / steps)).run(q0, v0, 0.1)
    assert not [e for e in result.events if e.kind == "lift_off"]
    return result.energy


@pytest.mark.parametrize(("integrator", "order"), STEPPERS)
@pytest.mark.parametrize("friction", [None, SMOOTH_FRICTION])
@pytest.mark.parametrize("damping", [0.0, 20.0])
def test_energy_residual_falls_at_the_order(integrator, order, friction, damping) -> None:
    steps = 200 if order == 1 else 50
    audits = [rolling(integrator, steps * k, damping, friction) for k in (1, 2, 4)]
    residual = [float(np.abs(a.residual[-1])) for a in audits]
    scale = float(audits[-1].kinetic[0])
    for a, b in pairwise(residual):
        assert np.log2(a / b) >= order - 0.3 or b <= 1e-13 * scale, residual
    assert residual[-1] <= (2e-2 if order == 1 else 1e-7) * scale
    finest = audits[-1]
    assert (finest.damping_loss[-1] > 1e-3) == (damping > 0)
    assert (finest.friction_loss[-1] > 1e-3) == (friction is not None)
