"""Orders of convergence in dt, resting depths, and restitution, through the package's own runs."""

from itertools import pairwise

import numpy as np
import pytest

import sphshell_pin as sp
from tests import models

MM, RADIUS = 1e-3, 0.05
SMOOTH_FRICTION = sp.CoulombFriction(0.3, 0.1, 20.0, 40.0)
STEPPERS = [(sp.SemiImplicitEuler, 1), (sp.RungeKutta4, 4)]


def rolling(integrator, steps: int, damping: float = 20.0, friction=SMOOTH_FRICTION):
    """Ball deep in a plate that slides, spins and bobs without ever leaving it."""
    scene = models.on_plate(
        models.ball(), models.linear_law(4000.0, damping), friction, radius=RADIUS
    )
    q0 = models.free_q([-0.1, 0.03, RADIUS - 0.004])
    v0 = np.array([1.0, -0.5, 0.05, 20.0, 30.0, -10.0])
    result = sp.Simulation(scene, integrator(dt=0.1 / steps)).run(q0, v0, 0.1)
    assert not [e for e in result.events if e.kind == "lift_off"]
    return scene.model, result


@pytest.mark.parametrize(("integrator", "order"), STEPPERS)
@pytest.mark.parametrize("friction", [None, SMOOTH_FRICTION])
@pytest.mark.parametrize("damping", [0.0, 20.0])
def test_energy_residual_falls_at_the_order(integrator, order, friction, damping) -> None:
    steps = 200 if order == 1 else 50
    audits = [rolling(integrator, steps * k, damping, friction)[1].energy for k in (1, 2, 4)]
    residual = [float(np.abs(a.residual[-1])) for a in audits]
    scale = float(audits[-1].kinetic[0])
    for a, b in pairwise(residual):
        assert np.log2(a / b) >= order - 0.3 or b <= 1e-13 * scale, residual
    assert residual[-1] <= (2e-2 if order == 1 else 1e-7) * scale
    finest = audits[-1]
    assert (finest.damping_loss[-1] > 1e-3) == (damping > 0)
    assert (finest.friction_loss[-1] > 1e-3) == (friction is not None)


@pytest.mark.parametrize(
    ("law", "depth_mm"),
    [
        (sp.ImpactLaw.from_adams(1e5, 2.2, 10.0, 0.1, units="mm-N-s"), 0.0150671588506),
        (sp.ImpactLaw(1e8, 2.2, 150.0, 1e-4), 0.652221338485),
    ],
)
def test_resting_depth(law: sp.ImpactLaw, depth_mm: float) -> None:
    """1 kg let go a little above its rest settles at (m g / k)^(1/e)."""
    scene = models.on_plate(models.slider(), law, radius=RADIUS)
    q0 = np.array([RADIUS - 0.9 * depth_mm * MM])
    slow = depth_mm > 0.1
    dt, duration = (2e-5, 0.6) if slow else (1e-5, 0.15)
    result = sp.Simulation(scene, sp.RungeKutta4(dt=dt)).run(q0, np.zeros(1), duration)
    assert (RADIUS - result.q[-1, 0]) / MM == pytest.approx(depth_mm, rel=1e-9)
    assert abs(result.v[-1, 0]) < 1e-10
    assert scene.contacts(result.q[-1], result.v[-1]).normal_force == pytest.approx(
        [9.81], rel=1e-8
    )


@pytest.mark.parametrize(
    ("speed_mm", "restitution", "deepest_mm"), [(100, 0.2074, 0.04295), (1000, 0.0874, 0.13032)]
)
def test_restitution_of_impact(speed_mm: float, restitution: float, deepest_mm: float) -> None:
    """1 kg against a fixed plane with ADAMS's defaults, no gravity."""
    law = sp.ImpactLaw.from_adams(1e5, 2.2, 10.0, 0.1, units="mm-N-s")
    scene = models.on_plate(models.slider(gravity=0.0), law, radius=RADIUS)
    v0 = np.array([-speed_mm * MM])
    result = sp.Simulation(scene, sp.RungeKutta4(dt=1e-6)).run(np.array([RADIUS + 1e-6]), v0, 4e-3)
    assert result.v[-1, 0] / (speed_mm * MM) == pytest.approx(restitution, abs=1e-4)
    deepest = result.stats.pairs["ball-plate"].max_depth
    assert deepest / MM == pytest.approx(deepest_mm, abs=1e-5)
