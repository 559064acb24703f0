"""Depths and time scales of laws and frictions, in closed form."""

import math

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.contact import NormalLaw
from sphshell_pin.contact.normal_law import inverse

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


def test_what_increases_is_inverted_to_the_last_bits() -> None:
    for value in (1e-30, 1e-7, 3.0, 1e30):
        assert inverse(lambda x: x**3, value) ** 3 == pytest.approx(value, rel=1e-15)
    assert inverse(lambda x: 1e-6 * x, 1e-12) == pytest.approx(1e-6, rel=1e-15)
    assert inverse(math.exp, 0.0) == inverse(math.exp, -1.0) == 0.0


# The damping [N s/m] at DEPTH, half of DEPTH and none.
DAMPED = {
    "impact, on its way": (sp.ImpactLaw(1e5, 1.5, 8.0, 2 * DEPTH), (4.0, 1.25, 0.0)),
    "impact, all": (sp.ImpactLaw(1e5, 1.5, 8.0, 0.1 * DEPTH), (8.0, 8.0, 0.0)),
    "hunt-crossley": (sp.HuntCrossleyLaw(1e5, 1.0, 0.5), (50e3 * DEPTH, 25e3 * DEPTH, 0.0)),
    "undamped": (sp.HuntCrossleyLaw(1e5, 1.0), (0.0, 0.0, 0.0)),
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
    depth = soft.depth_of(0.5 * MASS * SPEED**2)
    stiffness = soft.normal_stiffness(soft.depth_at(0.9))
    half = math.pi * math.sqrt(MASS / stiffness)
    assert 0 < stiffness < 1
    assert half < soft.contact_time(depth, SPEED)
    assert soft.shortest_time(MASS, SPEED, 0.9) == pytest.approx(half, rel=1e-9)
    linear = sp.ImpactLaw(0.1, 1.0)
    expected = math.pi * math.sqrt(MASS / 0.1)
    assert linear.shortest_time(MASS, SPEED, 0.0) == pytest.approx(expected, rel=1e-9)
    assert sp.TableLaw([0.0, 1.0], [0.0, 1.0]).decay_time(MASS, 0.5) == math.inf


def test_a_law_that_cannot_carry_the_load_has_its_other_scales() -> None:
    layer = sp.FoundationLaw(1e6, 0.05).on_plane(0.05)
    most = layer.normal_force(0.05)
    assert layer.depth_at(most) == pytest.approx(0.05, rel=1e-9)
    assert layer.depth_at(3 * most) == pytest.approx(0.15, rel=1e-12)
    assert layer.depth_at(0.5 * most) < 0.05
    stored = layer.energy(0.05)
    assert layer.depth_of(stored) == pytest.approx(0.05, rel=1e-9)
    assert layer.depth_of(3 * stored) == pytest.approx(0.15, rel=1e-12)
    assert layer.contact_time(0.15, 1.0) == layer.contact_time(0.05, 1.0)
    assert layer.contact_time(0.02, 1.0) < layer.contact_time(0.05, 1.0)


def test_slow_slip_of_coulomb_friction() -> None:
    friction = sp.CoulombFriction(0.4, 0.3, 1e-3, 1e-2)
    # mu (3 - s^2) s / 2 with s = v / v_static: a damper of 1.5 mu N / v_static.
    assert friction.slip_time(MASS, 50.0, 1.0) == pytest.approx(20 * MASS * 1e-3 / (1.5 * 0.4 * 50))
    light = friction.slip_time(MASS, 0.5, 1.0)
    assert light == pytest.approx(100 * friction.slip_time(MASS, 50.0, 1.0))
    assert friction.slip_time(MASS, 0.0, 1.0) == math.inf
    assert friction.slip_time(MASS, -1.0, 1.0) == math.inf
    assert sp.CoulombFriction(0.0, 0.0).slip_time(MASS, 50.0, 1.0) == math.inf


def test_bristles_ring_or_decay() -> None:
    soft = sp.BristleFriction(0.4, 0.3, 0.5)
    assert soft.slip_time(MASS, 50.0, 1.0) == pytest.approx(math.pi * math.sqrt(MASS / 0.5))
    half = math.pi * math.sqrt(MASS / 1e5)
    for damping in (0.0, 100.0, 1e4):
        scales = [half, *([20 * MASS / damping] if damping else [])]
        friction = sp.BristleFriction(0.4, 0.3, 1e5, damping)
        assert friction.slip_time(MASS, 50.0, 1.0) == pytest.approx(min(scales), rel=1e-14)


def test_bristles_of_mindlin_follow_the_disc() -> None:
    disc, load = 5e-3, 50.0
    plain = sp.MindlinFriction(0.4, 0.4, *RUBBER)
    stiffness = plain.tangential_stiffness(disc)
    half = math.pi * math.sqrt(MASS / stiffness)
    assert plain.slip_time(MASS, load, disc) == pytest.approx(half, rel=1e-14)
    assert plain.slip_time(MASS, load, math.nan) == plain.slip_time(MASS, load, 0.0) == math.inf
    for time in (1e-4, 1.0):
        damped = sp.MindlinFriction(0.4, 0.4, *RUBBER, damping_time=time)
        expected = min(half, 20 * MASS / (time * stiffness))
        assert damped.slip_time(MASS, load, disc) == pytest.approx(expected, rel=1e-14)
    for speed in (1e-5, 10.0):
        rolls = sp.MindlinFriction(0.4, 0.4, *RUBBER, rolling=0.02, rolling_speed=speed)
        expected = min(half, 20 * MASS * speed / (1.5 * 0.02 * load))
        assert rolls.slip_time(MASS, load, disc) == pytest.approx(expected, rel=1e-14)
        light = min(half, 20 * MASS * speed / (1.5 * 0.02 * 0.5))
        assert rolls.slip_time(MASS, 0.5, disc) == pytest.approx(light, rel=1e-14)
        assert rolls.slip_time(MASS, 0.0, disc) == pytest.approx(half, rel=1e-14)
