"""The wrench routine for anybody's contact points: one point, two bodies that move and turn."""

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import CoulombFriction, HuntCrossleyLaw, ImpactLaw, contact_wrench
from tests.oracle import laws
from tests.oracle.mechanics import force_on_i

LAW = ImpactLaw(1e5, 1.5, 50.0, 1e-3)
FRICTION = CoulombFriction(0.3, 0.1, 0.1, 1.0)


def impact(depth: float, gap_rate: float) -> float:
    return laws.impact(-depth, gap_rate, 0.0, 1e5, 1.5, 50.0, 1e-3)


def coulomb(slip: float) -> float:
    return laws.coulomb(slip, 0.3, 0.1, 0.1, 1.0)


def random_case(seed: int):
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=3)
    speed = 10 ** rng.uniform(-2, 1)
    motions = [pin.Motion(rng.normal(size=6) * speed) for _ in range(2)]
    return rng.normal(size=3), normal / np.linalg.norm(normal), rng.uniform(1e-3, 1e-2), *motions


@pytest.mark.parametrize("friction", [None, FRICTION])
@pytest.mark.parametrize("seed", range(40))
def test_against_plain_vectors(seed: int, friction) -> None:
    case, coefficient = random_case(seed), coulomb if friction else None
    on_i, on_j = contact_wrench(*case, LAW, friction)
    force = force_on_i(*case, normal_force=impact, coefficient=coefficient)
    scale = np.linalg.norm(force) + 1.0
    assert np.abs(on_i.linear - force).max() <= 1e-12 * scale
    assert np.abs(on_i.angular - np.cross(case[0], force)).max() <= 1e-11 * scale
    assert np.array_equal(on_i.vector, -on_j.vector)


def test_creep_is_smooth_through_zero_slip() -> None:
    """No division by the slip speed: tiny slips give tiny, exact forces."""
    normal = np.array([0.0, 0.0, 1.0])
    law = ImpactLaw(1.0, 1.0, 0.0, 1.0)
    for slip in (0.0, 1e-300, 1e-160, 1e-20, 1e-9):
        motion = pin.Motion(np.array([slip, 0.0, 0.0]), np.zeros(3))
        on_i, _ = contact_wrench(np.zeros(3), normal, 1.0, motion, pin.Motion.Zero(), law, FRICTION)
        assert on_i.linear == pytest.approx([-0.3 * 1.5 * slip / 0.1, 0.0, 1.0], rel=1e-9, abs=0.0)


def test_no_touch_no_force() -> None:
    zero = pin.Motion.Zero()
    args = (np.zeros(3), np.array([0.0, 0.0, 1.0]))
    for law in (LAW, HuntCrossleyLaw(1e5, 1.5, 0.1)):
        for depth in (0.0, -1e-3):
            for wrench in contact_wrench(*args, depth, zero, zero, law, FRICTION):
                assert not wrench.vector.any()
