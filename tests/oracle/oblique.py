"""Oblique impact of elastic spheres, computed apart from the package.

Two theories of the same impact, both in Maw, Barber and Fawcett's dimensionless numbers (Wear 38
(1976) 101): psi = kappa u / (mu v_n) of the contact point's tangential velocity u, and
chi = kappa (1 + 1 / K^2) / 2, with kappa = 4 G* / E* and K^2 = 2/5 of a solid ball.

- `rings`: the disc is divided into equal shares of its radius, each of which sticks or slips as a
  whole; what it carries moves with the places that the shares move over. A single one is the disc
  as a whole: its force is kept while it grows and falls with its radius.
- `micro_slip`: each ring of it slips for itself, the theory of Mindlin, Deresiewicz and Maw, by the
  method of dimensionality reduction (Popov and Hess, Method of Dimensionality Reduction in Contact
  Mechanics and Friction, 2015; of impacts Lyashenko and Popov, Scientific Reports 5 (2015) 8479):
  a row of independent springs on a parabola, which is exact for these theories.

Lengths are in units of the largest depth, times in those of that depth over the normal speed.
"""

import numpy as np

from sphshell_pin.base.arrays import Array

# K^2 of a solid ball: a force moves its contact point 1 + 1 / K^2 times as much as its center.
SOLID = 0.4


def kappa(young_1: float, poisson_1: float, young_2: float, poisson_2: float) -> float:
    """Return the tangential over the normal stiffness of two elastic half-spaces."""
    shear = young_1 / (2 + 2 * poisson_1), young_2 / (2 + 2 * poisson_2)
    tangential = (2 - poisson_1) / shear[0] + (2 - poisson_2) / shear[1]
    normal = (1 - poisson_1**2) / young_1 + (1 - poisson_2**2) / young_2
    return 4 * normal / tangential


def rings(
    psi_1: Array, kappa: float, count: int, dissipation: float = 0.0, steps: int = 40_000
) -> Array:
    """Return psi (k,) of the rebound, where `count` shares of the disc slip for themselves."""
    edges = np.linspace(0.0, 1.0, count + 1)[:, None]
    widths = np.diff(edges, axis=0)
    shares = 1.5 * (widths - np.diff(edges**3, axis=0) / 3)
    force = np.zeros((count, len(psi_1)))
    before = 0.0

    def advance(psi: Array, x: float, limit: float, h: float) -> Array:
        nonlocal force, before
        a = np.sqrt(x)
        # What crosses the edges, outwards where they move inwards, with the force per length there.
        density = np.vstack([force / (a * widths), np.zeros_like(psi)])
        moved = a - np.sqrt(before)
        crosses = -moved * edges * (density if moved > 0 else np.roll(density, 1, axis=0))
        force = force - np.diff(crosses, axis=0) + 15 / 8 * a * widths * h * psi
        force = np.clip(force, -limit * shares, limit * shares)
        before = x
        return np.asarray(force.sum(axis=0))

    return _rebound(psi_1, kappa, dissipation, steps, advance)


def micro_slip(
    psi_1: Array, kappa: float, dissipation: float = 0.0, steps: int = 40_000, springs: int = 400
) -> Array:
    """Return psi (k,) of the rebound, where each ring of the disc slips for itself."""
    # Middles of equal parts of the half-disc.
    place = (np.arange(springs) + 0.5) / springs
    shape = 1.5 * place**2  # the deepest point of a damped impact is not deeper than 1
    stretch = np.zeros((springs, len(psi_1)))

    def advance(psi: Array, x: float, limit: float, h: float) -> Array:
        nonlocal stretch
        # Of each spring; the damping makes all of them heavier alike.
        share = limit / (5 / 4 * x**1.5)
        most = share * np.maximum(x - shape, 0.0)[:, None]
        stretch = np.clip(stretch + h * psi, -most, most)
        return np.asarray(15 / 8 * np.sqrt(1.5) * stretch.mean(axis=0))

    return _rebound(psi_1, kappa, dissipation, steps, advance)


def _rebound(psi_1: Array, kappa: float, dissipation: float, steps: int, advance) -> Array:  # type: ignore[no-untyped-def]
    """Integrate psi' = -kappa (1 + 1/K^2) force, x'' = -5/4 x^1.5 (1 + b x') by leapfrog."""
    psi = np.array(psi_1, dtype=float)
    x, speed, h = 0.0, 1.0, 3.3 / steps
    while True:
        x += h * speed / 2
        if x <= 0:
            return psi
        push = max(0.0, 5 / 4 * x**1.5 * (1 + dissipation * speed))
        psi = psi - h * kappa * (1 + 1 / SOLID) * advance(psi, x, push, h)
        speed -= h * push
        x += h * speed / 2
