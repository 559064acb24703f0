"""Depths and time scales of laws and frictions, in closed form."""

import math

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.contact import NormalLaw

MASS, SPEED, DEPTH = 0.7, 0.3, 2e-3
RUBBER = (4e6, 0.48)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
def test_a_power_law_is_inverted(exponent: float) -> None:
    law = sp.ImpactLaw(3e5, exponent)
    assert law.depth_at(law.normal_force(DEPTH)) == pytest.approx(DEPTH, rel=1e-14)
    assert law.depth_of(law.energy(DEPTH)) == pytest.approx(DEPTH, rel=1e-14)
    assert (law.depth_at(0.0), law.depth_at(-1.0), law.depth_of(0.0)) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
def test_contact_time_by_its_integral(exponent: float) -> None:
    """The law's closed form and Gauss's rule, against the trapezium rule in x = d sin a."""
    law = sp.ImpactLaw(3e5, exponent)
    angle = (np.arange(4000) + 0.5) * (math.pi / 8000)
    x = np.sin(angle)
    expected = 2 * DEPTH / SPEED * np.mean(np.cos(angle) / np.sqrt(1 - x ** (exponent + 1)))
    expected *= math.pi / 2
    assert law.contact_time(DEPTH, SPEED) == pytest.approx(expected, rel=1e-6)
    assert NormalLaw.contact_time(law, DEPTH, SPEED) == pytest.approx(expected, rel=1e-6)
    assert law.contact_time(DEPTH, 0.0) == math.inf


# The damping [N s/m] at DEPTH, half of DEPTH and none.
DAMPED = {
    "impact, on its way": (sp.ImpactLaw(1e5, 1.5, 8.0, 2 * DEPTH), (4.0, 1.25, 0.0)),
    "impact, all": (sp.ImpactLaw(1e5, 1.5, 8.0, 0.1 * DEPTH), (8.0, 8.0, 0.0)),
    "hunt-crossley": (sp.HuntCrossleyLaw(1e5, 1.0, 0.5), (50e3 * DEPTH, 25e3 * DEPTH, 0.0)),
    "undamped": (sp.HuntCrossleyLaw(1e5, 1.0), (0.0, 0.0, 0.0)),
    "table": (sp.TableLaw([0.0, 1.0], [0.0, 1.0]), (0.0, 0.0, 0.0)),
    "function": (lambda: sp.FunctionLaw(lambda d, r, p: 1e5 * d - 7.0 * d**2 * r), None),
    "function that drives": (lambda: sp.FunctionLaw(lambda d, r, p: 1e5 * d + 7.0 * r), (0.0,) * 3),
    "hertz": (sp.HertzLaw(*RUBBER, restitution=0.5, speed=1.0, radius=0.05), None),
    "viscoelastic": (sp.HertzLaw(*RUBBER, loss_tangent=0.2, frequency=9.0, radius=0.05), None),
    "foundation": (sp.FoundationLaw(1e6, 0.05, 0.4).on_plane(0.05), None),
    "elastic foundation": (sp.FoundationLaw(1e6, 0.05).on_plane(0.05), (0.0, 0.0, 0.0)),
}


@pytest.mark.filterwarnings("ignore::sphshell_pin.errors.SlowLawWarning")
@pytest.mark.parametrize("name", DAMPED)
def test_decay_is_mass_over_damping(name: str) -> None:
    """The damping is the slope of the force by the gap rate."""
    law, known = DAMPED[name]
    law = law() if callable(law) else law
    for k, depth in enumerate((DEPTH, DEPTH / 2, 0.0)):
        slope = (law.normal_force(depth, -1e-6) - law.normal_force(depth, 1e-6)) / 2e-6
        damping = (max(slope, 0.0) if depth else 0.0) if known is None else known[k]
        expected = MASS / damping if damping else math.inf
        assert law.decay_time(MASS, depth) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("damping", [0.0, 300.0, 3e4])
@pytest.mark.parametrize("load", [-1.0, 0.0, 30.0, 3e5])
def test_the_shortest_of_impact_oscillation_and_decay(load: float, damping: float) -> None:
    law = sp.ImpactLaw(1e7, 1.5, damping, 1e-9)
    depth = (1.25 * MASS * SPEED**2 / 1e7) ** 0.4
    scales = [law.contact_time(depth, SPEED)]
    if load > 0:
        stiffness = 1.5 * 1e7 * (load / 1e7) ** (1 / 3)
        scales.append(math.pi * math.sqrt(MASS / stiffness))
    if damping:
        scales.append(20 * MASS / damping)
    assert law.shortest_time(MASS, SPEED, load) == pytest.approx(min(scales), rel=1e-9)


def test_a_soft_law_under_a_light_load() -> None:
    soft = sp.ImpactLaw(1e-3, 2.0)
    half = math.pi * math.sqrt(MASS / soft.normal_stiffness(soft.depth_at(0.9)))
    assert half < soft.contact_time(soft.depth_of(0.5 * MASS * SPEED**2), SPEED)
    assert soft.shortest_time(MASS, SPEED, 0.9) == pytest.approx(half, rel=1e-9)
    expected = math.pi * math.sqrt(MASS / 0.1)
    assert sp.ImpactLaw(0.1, 1.0).shortest_time(MASS, SPEED, 0.0) == pytest.approx(expected)


def test_a_law_that_cannot_carry_the_load_has_its_other_scales() -> None:
    layer = sp.FoundationLaw(1e6, 0.05).on_plane(0.05)
    inverses = (layer.depth_at, layer.normal_force(0.05)), (layer.depth_of, layer.energy(0.05))
    for inverted, most in inverses:
        assert inverted(most) == pytest.approx(0.05, rel=1e-9)
        assert inverted(3 * most) == pytest.approx(0.15, rel=1e-12)
        assert inverted(0.5 * most) < 0.05
    assert layer.contact_time(0.15, 1.0) == layer.contact_time(0.05, 1.0)
    assert layer.contact_time(0.02, 1.0) < layer.contact_time(0.05, 1.0)


def half(stiffness: float) -> float:
    return math.pi * math.sqrt(MASS / stiffness)


COULOMB, SOFT = sp.CoulombFriction(0.4, 0.3, 1e-3, 1e-2), sp.BristleFriction(0.4, 0.3, 0.5)
LOAD, DISC, STIFF = 50.0, 5e-3, sp.MindlinFriction(0.4, 0.4, *RUBBER).tangential_stiffness(5e-3)


def mindlin(**more) -> sp.MindlinFriction:
    return sp.MindlinFriction(0.4, 0.4, *RUBBER, **more)


# Coulomb: mu (3 - s^2) s / 2 with s = v / v_static, a damper of 1.5 mu N / v_static. Bristles ring
# or decay, those of Mindlin with the stiffness of the disc.
SLIPS = [
    (COULOMB, LOAD, 1.0, 20 * MASS * 1e-3 / (1.5 * 0.4 * LOAD)),
    (COULOMB, LOAD / 100, 1.0, 20 * MASS * 1e-3 / (1.5 * 0.4 * LOAD / 100)),
    (COULOMB, 0.0, 1.0, math.inf),
    (COULOMB, -1.0, 1.0, math.inf),
    (sp.CoulombFriction(0.0, 0.0), LOAD, 1.0, math.inf),
    (SOFT, LOAD, 1.0, half(0.5)),
    (sp.BristleFriction(0.4, 0.3, 1e5), LOAD, 1.0, half(1e5)),
    (sp.BristleFriction(0.4, 0.3, 1e5, 100.0), LOAD, 1.0, half(1e5)),
    (sp.BristleFriction(0.4, 0.3, 1e5, 1e4), LOAD, 1.0, 20 * MASS / 1e4),
    (mindlin(), LOAD, DISC, half(STIFF)),
    (mindlin(), LOAD, math.nan, math.inf),
    (mindlin(), LOAD, 0.0, math.inf),
    (mindlin(damping_time=1.0), LOAD, DISC, 20 * MASS / STIFF),
    (mindlin(rolling=0.02, rolling_speed=1e-5), LOAD, DISC, 20 * MASS * 1e-5 / (0.03 * LOAD)),
    (mindlin(rolling=0.02, rolling_speed=1e-5), 0.0, DISC, half(STIFF)),
    (mindlin(rolling=0.02, rolling_speed=10.0), LOAD, DISC, half(STIFF)),
]


@pytest.mark.parametrize(("friction", "load", "disc", "expected"), SLIPS)
def test_time_scale_of_a_slip(friction, load: float, disc: float, expected: float) -> None:
    assert friction.slip_time(MASS, load, disc) == pytest.approx(expected, rel=1e-14)
