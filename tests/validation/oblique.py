"""Oblique impacts of one ball on a plane: what the cases of them share."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.friction import Friction
from tests.oracle import oblique as oracle
from tests.validation.balls import Ball, head_on, on_plane

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

    def impact(self, normal: float, tangential: float, spin: float = 0.0) -> Array:
        """Shoot the ball down at `normal` and along x at `tangential` speed [m/s].

        `spin` [rad/s] is about y, positive where the ball rolls on along x. Return what it has
        after it: normal and tangential velocity [m/s], spin, velocity of the contact patch.
        """
        ball = Ball(self.radius, self.density, (tangential, 0.0, -normal), (0.0, spin, 0.0))
        if self.radius_2 is None:
            seen = on_plane(ball, *self.laws(normal))
        else:
            seen = head_on(ball, Ball(self.radius_2, self.density_2), *self.laws(normal))
        (x, _, z), (_, after, _) = seen.velocities[0], seen.spins[0]
        return np.array([z, x, after, x - self.radius * after])


def thrown(setting: Setting, speed: float, angles: ArrayLike) -> dict[str, Array]:
    """Throw the ball at `speed` [m/s], at each of the angles (n,) from the normal [degrees].

    Return by name, each (n,): the restitution along the plane, the spin, and the angles of the
    velocities of the center and of the contact patch from the normal [degrees].
    """
    radians = np.radians(np.asarray(angles, dtype=float))
    found = [setting.impact(speed * math.cos(a), speed * math.sin(a)) for a in radians]
    normal, tangential, spin, patch = np.array(found).T
    return {
        "restitution": tangential / (speed * np.sin(radians)),
        "spin": spin,
        "rebound_angle": np.degrees(np.arctan2(tangential, normal)),
        "patch_angle": np.degrees(np.arctan2(patch, normal)),
    }


def rms(errors: Array) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(errors**2)))
