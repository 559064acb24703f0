"""Force laws, friction, two materials: documented spot values, units, closed forms, limits."""

import dataclasses
from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sphshell_pin as sp
from sphshell_pin import CoulombFriction, HuntCrossleyLaw, ImpactLaw
from tests.oracle import laws as oracle

MM = 1e-3
DEFAULTS = ImpactLaw.from_adams(1e5, 2.2, 10.0, 0.1, units="mm-N-s")


def test_impact_spot_values() -> None:
    """ADAMS's IMPACT with its default numbers, mm and mm/s."""
    depths = np.array([0.05, 0.05, 0.05, 0.1, 0.2, 0.01]) * MM
    rates = np.array([0.0, -100.0, 100.0, -100.0, -1000.0, 100.0]) * MM
    found = [DEFAULTS.normal_force(*one) for one in zip(depths, rates, strict=True)]
    forces = [137.320068, 637.320068, 0.0, 1630.957344, 12899.118655, 0.0]
    assert found == pytest.approx(forces, rel=0, abs=5e-7)


COULOMB = CoulombFriction(mu_static=0.3, mu_dynamic=0.1, v_static=0.1, v_dynamic=1.0)


def test_friction_spot_values() -> None:
    found = [COULOMB.coefficient(slip * MM) for slip in (0, 10, 50, 100, 300, 550, 1000)]
    expected = [0, 0.04485, 0.20625, 0.3, 0.27476, 0.2, 0.1]
    assert found == pytest.approx(expected, rel=0, abs=5e-6)


@settings(derandomize=True, deadline=None)
@given(st.floats(0.0, 3.0))
def test_friction_is_the_printed_formula(slip: float) -> None:
    expected = oracle.coulomb(slip, 0.3, 0.1, 0.1, 1.0)
    assert COULOMB.coefficient(slip) == pytest.approx(expected, abs=1e-15)


def test_the_documented_example() -> None:
    """IMPACT(14.5, -20, 15, 100, 1.2, 2.5, 0.01) in its own units."""
    law = ImpactLaw(stiffness=100.0, exponent=1.2, damping=2.5, full_damping_depth=0.01)
    assert law.normal_force(0.5, -20.0) == pytest.approx(93.5275281648, abs=1e-10)


@settings(derandomize=True, deadline=None)
@given(
    depth=st.floats(-1e-3, 1e-3),
    gap_rate=st.floats(-5.0, 5.0),
    exponent=st.floats(1.0, 3.0),
    damping=st.floats(0.0, 1e4),
    full=st.floats(1e-5, 1e-3),
)
def test_impact_is_the_printed_formula(depth, gap_rate, exponent, damping, full) -> None:
    law = ImpactLaw(1e7, exponent, damping, full)
    expected = oracle.impact(-depth, gap_rate, 0.0, 1e7, exponent, damping, full)
    scale = 1e7 * abs(depth) ** exponent + damping * abs(gap_rate)
    assert law.normal_force(depth, gap_rate) == pytest.approx(expected, abs=1e-11 * scale + 1e-300)


@settings(derandomize=True, deadline=None)
@given(
    depth=st.floats(-1e-3, 1e-3), gap_rate=st.floats(-5.0, 5.0), dissipation=st.floats(0.0, 10.0)
)
def test_hunt_crossley_is_the_printed_formula(depth, gap_rate, dissipation) -> None:
    law = HuntCrossleyLaw(stiffness=1e9, exponent=1.5, dissipation=dissipation)
    expected = oracle.hunt_crossley(depth, gap_rate, 1e9, 1.5, dissipation)
    assert law.normal_force(depth, gap_rate) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("law", [DEFAULTS, HuntCrossleyLaw(1e9, 1.5, 0.3), ImpactLaw(1e4, 1, 0, 1)])
def test_energy_is_the_work_of_the_spring(law) -> None:
    assert law.energy(0.0) == law.energy(-1e-3) == 0.0
    for depth in np.linspace(1e-5, 2e-3, 7):
        h = 1e-4 * depth
        slope = (law.energy(depth + h) - law.energy(depth - h)) / (2 * h)
        assert slope == pytest.approx(law.normal_force(depth, 0.0), rel=1e-7)


def test_hertz_of_two_materials() -> None:
    """4/3 E* sqrt(R)."""
    law = ImpactLaw.hertz(0.01, 207e9, 0.29, 3e9, 0.4)
    inverse = (1 - 0.29**2) / 207e9 + (1 - 0.4**2) / 3e9
    assert law.stiffness == pytest.approx(4 / 3 / inverse * 0.1, rel=1e-14)
    damped = ImpactLaw.hertz(0.01, 207e9, 0.29, 3e9, 0.4, restitution=0.7, speed=0.3)
    assert damped == HuntCrossleyLaw.with_restitution(law.stiffness, 1.5, 0.7, 0.3)


RESTITUTIONS = [0.05, 0.3, 0.5, 0.7, 0.9, 0.93, 0.99, 0.99999, 1 - 1e-7, 1 - 1e-14]


@pytest.mark.parametrize("speed", [0.01, 0.5, 5.0])
@pytest.mark.parametrize("restitution", RESTITUTIONS)
def test_dissipation_is_exact_however_near_the_restitution_is_to_one(restitution, speed) -> None:
    """d v0 - ln(1 + d v0) = -d v1 - ln(1 - d v1), v1 = restitution v0."""
    with localcontext(prec=60):
        e = Decimal(restitution)

        def excess(x: Decimal) -> Decimal:
            return -e * x - (1 - e * x).ln() - x + (1 + x).ln()

        low, high = Decimal("1e-18"), (1 - Decimal("1e-30")) / e
        for _ in range(120):
            middle = (low + high) / 2
            low, high = (middle, high) if excess(middle) < 0 else (low, middle)
        exact = float(low)
    law = HuntCrossleyLaw.with_restitution(1e5, 1.5, restitution, speed)
    assert speed * law.dissipation == pytest.approx(exact, rel=2e-14)


def test_laws_are_values() -> None:
    assert ImpactLaw(1.0, 1.5, 0.0, 1.0) == ImpactLaw(1.0, 1.5, 0.0, 1.0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        DEFAULTS.stiffness = 1.0


M = sp.MATERIALS


@pytest.mark.parametrize("name", M)
def test_against_steel_they_are_those_of_the_table(name):
    one = M[name]
    static, dynamic = one.friction, one.friction * one.slip
    for pair in ((one, M["steel"]), (M["steel"], one)):
        assert sp.friction_between(*pair) == pytest.approx((static, dynamic), rel=1e-15)
        assert sp.restitution_between(*pair) == min(one.restitution, 0.90)


@pytest.mark.parametrize(
    ("one", "other", "static", "dynamic"),
    [
        ("rubber", "wood", 0.80, 0.80 * 0.85),  # a thousand times softer: it conforms
        ("silicone", "rubber", 0.70, 0.70 * 0.85),
        ("plastic", "aluminium", 0.30, 0.30 * 0.80),  # 28 times softer
        ("plastic", "wood", 0.35, 0.35 * 0.80),  # 4 times: the mean, the slip of the softer one
        ("wood", "aluminium", 0.425, 0.425 * 0.75),  # 7 times
    ],
)
def test_the_much_softer_one_decides_else_the_mean(one, other, static, dynamic):
    for pair in ((M[one], M[other]), (M[other], M[one])):
        assert sp.friction_between(*pair) == pytest.approx((static, dynamic), rel=1e-12)


def test_the_more_dissipative_one_decides_the_restitution():
    assert sp.restitution_between(M["wood"], M["rubber"]) == 0.60
    assert sp.restitution_between(M["plastic"], M["rubber"]) == 0.70
