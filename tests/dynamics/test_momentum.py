"""Action equals reaction at one point: what two free bodies do to each other cancels."""

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import CoulombFriction, testing
from tests.models import linear_law, two_free_bodies, two_free_state

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
