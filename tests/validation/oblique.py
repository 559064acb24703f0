"""Oblique impacts of one ball on a plane: what the cases of them share."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.friction import Friction
from tests.oracle import oblique as oracle
from tests.validation.balls import Ball, Impact, head_on, on_plane

MOBILITY = 1 + 1 / oracle.SOLID  # of the contact patch of a solid ball, times its mass
RIGID = 1e20  # Young's modulus [Pa] of what the benchmarks call rigid


@dataclass(frozen=True)
class Setting:
    """A ball of one material on a plane or ball of another; Young's moduli in Pa.

    `restitution` is that of each impact at its own normal speed, None without damping; `radius_2`
    [m] and `density_2` are those of a second ball in place of the plane; `rings` of the disc of
    contact slip for themselves.
    """

    radius: float
    density: float
    young: float
    poisson: float
    mu: float
    young_2: float = RIGID
    poisson_2: float | None = None
    restitution: float | None = None
    radius_2: float | None = None
    density_2: float = 0.0
    rings: int = 1

    @property
    def materials(self) -> tuple[float, float, float, float]:
        """Young's modulus [Pa] and Poisson's ratio of the ball and of the other body."""
        other = self.poisson if self.poisson_2 is None else self.poisson_2
        return self.young, self.poisson, self.young_2, other

    def recoil(self, incident: Array, dissipation: float = 0.0) -> Array:
        """Return the patch's velocity after an impact with micro-slip, like `incident` (n,).

        That is over mu and the normal speed; `dissipation` is Hunt and Crossley's b times it.
        """
        kappa = oracle.kappa(*self.materials)
        psi = oracle.micro_slip(kappa * incident, kappa, dissipation, steps=4000, springs=200)
        return psi / kappa

    def laws(self, speed: float) -> tuple[sp.HertzLaw, Friction]:
        """Return the law along the normal and that of friction at a normal `speed` [m/s]."""
        damping = (self.restitution, speed) if self.restitution is not None else (None, None)
        law = sp.HertzLaw(*self.materials, *damping)
        return law, sp.MindlinFriction(self.mu, self.mu, *self.materials, rings=self.rings)

    def impact(self, normal: float, tangential: float, spin: float = 0.0) -> Rebound:
        """Shoot the ball down at `normal` and along x at `tangential` speed [m/s].

        `spin` [rad/s] is about y, positive where the ball rolls on along x.
        """
        law, friction = self.laws(normal)
        ball = Ball(self.radius, self.density, (tangential, 0.0, -normal), (0.0, spin, 0.0))
        if self.radius_2 is None:
            seen = on_plane(ball, law, friction)
        else:
            seen = head_on(ball, Ball(self.radius_2, self.density_2), law, friction)
        return Rebound.of(self.radius, seen)


@dataclass(frozen=True)
class Rebound:
    """A ball after an impact: velocity of its center [m/s], spin [rad/s], of its contact patch."""

    normal: float
    tangential: float
    spin: float
    patch: float

    @classmethod
    def of(cls, radius: float, impact: Impact) -> Rebound:
        """Return that of the first ball."""
        (x, _, z), (_, spin, _) = impact.velocities[0], impact.spins[0]
        return cls(float(z), float(x), float(spin), float(x - radius * spin))

    @property
    def rebound_angle(self) -> float:
        """Angle of the center's velocity from the normal [degrees]."""
        return math.degrees(math.atan2(self.tangential, self.normal))

    @property
    def patch_angle(self) -> float:
        """Angle of the contact patch's velocity from the normal [degrees]."""
        return math.degrees(math.atan2(self.patch, self.normal))


def thrown(setting: Setting, speed: float, angles: ArrayLike) -> list[Rebound]:
    """Throw the ball at `speed` [m/s], at each of the angles from the normal [degrees]."""
    radians = np.radians(np.asarray(angles, dtype=float))
    return [setting.impact(speed * math.cos(a), speed * math.sin(a)) for a in radians]


def of(rebounds: Iterable[Rebound], quantity: str) -> Array:
    """Return one quantity of rebounds (n,)."""
    return np.array([getattr(one, quantity) for one in rebounds])


def rms(errors: Array) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(errors**2)))
