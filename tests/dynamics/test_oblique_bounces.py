"""Oblique impacts with MindlinFriction against theory: Maw, Barber and Fawcett; gross sliding."""

import numpy as np
import pytest

import sphshell_pin as sp
from tests.oracle import oblique
from tests.validation.balls import Ball, on_plane

ALUMINA_GLASS = (380e9, 0.23, 70e9, 0.25)
BALL, DENSITY, MU = 2.5e-3, 4000.0, 0.092
# At which the depth, which theory neglects, is 3e-5 of the radius [m/s].
SPEED = 0.0039
KAPPA = oblique.kappa(*ALUMINA_GLASS)


@pytest.mark.parametrize("rings", [1, 2, 8])
def test_rings_against_the_theory(rings: int) -> None:
    """A ball is thrown at an angle from the normal."""
    degrees = np.array([5, 10, 15, 20, 25, 28])
    psi = KAPPA * np.tan(np.radians(degrees)) / MU
    theory = 1 + 2 / 7 * (oblique.rings(psi, KAPPA, rings, steps=20_000) / psi - 1)
    law = sp.HertzLaw(*ALUMINA_GLASS)
    friction = sp.MindlinFriction(MU, MU, *ALUMINA_GLASS, rings=rings)
    for angle, expected in zip(np.radians(degrees), theory, strict=True):
        down, along = SPEED * np.cos(angle), SPEED * np.sin(angle)
        seen = on_plane(Ball(BALL, DENSITY, (along, 0.0, -down)), law, friction)
        x, _, z = seen.velocities[0]
        assert x / along == pytest.approx(expected, abs=1e-4)
        assert z / down == pytest.approx(1.0, abs=1e-8)
        energy = seen.result.energy
        assert np.abs(energy.residual).max() < 1e-8 * energy.exchanged
        assert np.diff(energy.friction_loss).min() > -1e-8 * energy.exchanged
