"""Action equals reaction at one point: what two free bodies do to each other cancels."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import CoulombFriction, RungeKutta4, Simulation, testing
from tests.models import linear_law, two_free_bodies, two_free_state
from tests.oracle.mechanics import total_momentum

# Slip stays below v_static, where friction is a polynomial of the velocity: the order shows.
SMOOTH_FRICTION = CoulombFriction(0.3, 0.1, 20.0, 40.0)
LAW = linear_law(2000.0, 5.0)


@pytest.mark.parametrize("friction", [None, SMOOTH_FRICTION, CoulombFriction(0.3, 0.1, 0.1, 1.0)])
@pytest.mark.parametrize("seed", range(8))
def test_wrenches_sum_to_zero(seed: int, friction) -> None:
    scene = two_free_bodies(LAW, friction)
    q, v = two_free_state(depth=0.01)
    rng = np.random.default_rng(seed)
    v = v + rng.normal(size=12) * 0.3
    q = pin.integrate(
        scene.model, q, np.concatenate([np.zeros(3), rng.normal(size=3), np.zeros(6)])
    )
    assert len(scene.contacts(q, v)) == 1
    testing.assert_wrenches_cancel(scene, q, v)


def test_without_contact_the_spin_alone_is_integrated_at_order_four() -> None:
    """Two bodies that tumble freely: angular momentum tests the stepper's rotations alone."""
    scene = two_free_bodies(LAW)
    q0, v0 = two_free_state(depth=-1.0)
    before = total_momentum(scene.model, q0, v0)
    drifts = []
    for steps in (20, 40, 80):
        result = Simulation(scene, RungeKutta4(dt=0.1 / steps)).run(q0, v0, 0.1)
        assert not result.events
        after = total_momentum(scene.model, result.q[-1], result.v[-1])
        drifts.append(np.linalg.norm((after - before).vector) / np.linalg.norm(before.vector))
    for a, b in pairwise(drifts):
        assert np.log2(a / b) >= 3.7 or b < 1e-12, drifts
