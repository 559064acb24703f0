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
    """Velocities after a bounce over those of the approach, and the spin [rad/s] as it rolls on."""

    tangential: float
    normal: float
    spin: float
    result: sp.Result


def thrown(degrees: float, speed: float = SPEED, law=ELASTIC, friction=KHARAZ) -> Bounce:  # type: ignore[no-untyped-def]
    """Throw the ball at an angle from the normal."""
    down, along = (speed * part(math.radians(degrees)) for part in (math.cos, math.sin))
    seen = on_plane(Ball(BALL, DENSITY, (along, 0.0, -down)), law, friction)
    (x, _, z), (_, spin, _) = seen.velocities[0], seen.spins[0]
    return Bounce(x / along, z / down, spin, seen.result)


@pytest.mark.parametrize("rings", [1, 2, 8])
def test_rings_against_the_theory(rings: int) -> None:
    """At a speed at which the depth, which theory neglects, is 3e-5 of the radius."""
    degrees = np.array([5, 10, 15, 20, 25, 28])
    psi = KAPPA * np.tan(np.radians(degrees)) / MU
    theory = 1 + 2 / 7 * (oblique.rings(psi, KAPPA, rings, steps=20_000) / psi - 1)
    friction = replace(KHARAZ, rings=rings)
    runs = [thrown(one, 0.0039, friction=friction) for one in degrees]
    assert [one.tangential for one in runs] == pytest.approx(theory, abs=1e-4)
    for one in runs:
        assert one.normal == pytest.approx(1.0, abs=1e-8)
        energy = one.result.energy
        assert np.abs(energy.residual).max() < 1e-8 * energy.exchanged
        assert np.diff(energy.friction_loss).min() > -1e-8 * energy.exchanged
