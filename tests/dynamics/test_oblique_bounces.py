"""Oblique impacts with MindlinFriction against theory: Maw, Barber and Fawcett; gross sliding."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

import sphshell_pin as sp
from tests.oracle import oblique
from tests.validation.balls import Ball, on_plane

ALUMINA_GLASS = (380e9, 0.23, 70e9, 0.25)
BALL, DENSITY, MU, SPEED = 2.5e-3, 4000.0, 0.092, 3.9
ELASTIC = sp.HertzLaw(*ALUMINA_GLASS)
KHARAZ = sp.MindlinFriction(MU, MU, *ALUMINA_GLASS)
KAPPA = oblique.kappa(*ALUMINA_GLASS)


class Bounce(NamedTuple):
    """Velocities after a bounce over those of the approach, and the spin [rad/s] as it rolls on.

    `slip` is that of the contact point, negative where it turns round.
    """

    tangential: float
    normal: float
    spin: float
    slip: float
    result: sp.Result


def thrown(degrees: float, speed: float = SPEED, law=ELASTIC, friction=KHARAZ) -> Bounce:  # type: ignore[no-untyped-def]
    """Throw the ball at an angle from the normal."""
    down, along = (speed * part(math.radians(degrees)) for part in (math.cos, math.sin))
    seen = on_plane(Ball(BALL, DENSITY, (along, 0.0, -down)), law, friction)
    (x, _, z), (_, spin, _) = seen.velocities[0], seen.spins[0]
    return Bounce(x / along, z / down, spin, (x - BALL * spin) / along, seen.result)


@pytest.mark.parametrize("degrees", [5, 10, 15, 20, 25, 28])
def test_oblique_bounce_against_the_theory(degrees: float) -> None:
    """Speeds at which the depth, which theory neglects, is 2e-4 and 3e-5 of the radius."""
    psi = KAPPA * math.tan(math.radians(degrees)) / MU
    theory = oblique.rigid_disc(np.array([psi]), KAPPA)[0] / psi
    slow, slower = thrown(degrees, 0.039), thrown(degrees, 0.0039)
    assert slow.tangential == pytest.approx(slower.tangential, abs=1e-3)
    assert slow.slip == pytest.approx(slower.slip, abs=1e-3)
    assert slower.tangential == pytest.approx(1 + 2 / 7 * (theory - 1), abs=1e-4)
    assert slower.normal == pytest.approx(1.0, abs=1e-8)


@pytest.mark.parametrize("rings", [1, 2, 8])
def test_rings_against_the_theory(rings: int) -> None:
    degrees = np.array([5, 10, 20, 28])
    psi = KAPPA * np.tan(np.radians(degrees)) / MU
    theory = 1 + 2 / 7 * (oblique.rings(psi, KAPPA, rings, steps=20_000) / psi - 1)
    friction = replace(KHARAZ, rings=rings)
    runs = [thrown(one, 0.0039, friction=friction) for one in degrees]
    assert [one.tangential for one in runs] == pytest.approx(theory, abs=1e-4)
    for one in runs:
        energy = one.result.energy
        assert np.abs(energy.residual).max() < 1e-8 * energy.exchanged
        assert np.diff(energy.friction_loss).min() > -1e-8 * energy.exchanged


def test_rings_converge_to_micro_slip() -> None:
    """The rms of v_t' / v_t against Maw et al.'s theory."""
    psi = KAPPA * np.tan(np.radians([2.0, 5, 10, 15, 20, 25, 30, 40, 60, 80])) / MU
    exact = oblique.micro_slip(psi, KAPPA, steps=20_000)
    errors = [
        2 / 7 * (oblique.rings(psi, KAPPA, n, steps=20_000) - exact) / psi for n in (1, 2, 4, 8)
    ]
    rms = [float(np.sqrt(np.mean(e**2))) for e in errors]
    assert rms == pytest.approx([0.0581, 0.0333, 0.0158, 0.0073], abs=1e-4)


@pytest.mark.parametrize("restitution", [1.0, 0.98])
@pytest.mark.parametrize("degrees", [35, 50, 70, 85])
def test_gross_sliding(degrees: float, restitution: float) -> None:
    """v_t' = v_t - mu (1 + e) v_n; the spin has the arm r - depth of the contact point."""
    law = sp.HertzLaw(*ALUMINA_GLASS, restitution=restitution, speed=SPEED)
    out = thrown(degrees, law=law)
    down = SPEED * math.cos(math.radians(degrees))
    along = SPEED * math.sin(math.radians(degrees))
    lost = MU * (1 + out.normal) * down
    assert out.tangential == pytest.approx(1 - lost / along, abs=1e-6)
    assert out.spin == pytest.approx(2.5 * lost / BALL, rel=6e-3)
    if restitution == 1.0:
        # The impulse-weighted depth of an elastic impact: B(2/5, 3/2) / (5/2) of the largest.
        beta = math.gamma(0.4) * math.gamma(1.5) / math.gamma(1.9)
        mass = DENSITY * 4 / 3 * math.pi * BALL**3
        mean = beta / 2.5 * ELASTIC.on_plane(BALL).depth_of(0.5 * mass * down**2)
        assert out.spin == pytest.approx(2.5 * lost * (BALL - mean) / BALL**2, rel=1e-6)
