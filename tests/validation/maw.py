"""The theory of oblique impact with micro-slip, as a line beside ours (Maw, Barber and Fawcett).

Each ring of the disc of contact sticks or slips for itself. Computed by the method of
dimensionality reduction, a row of independent springs on a parabola, which is exact here (Popov and
Hess, Method of Dimensionality Reduction in Contact Mechanics and Friction, 2015).
"""

import math

import numpy as np

from sphshell_pin.base.arrays import Array

STEPS, SPRINGS = 4000, 200  # error about 1e-3
MOBILITY = 3.5  # of the patch of a solid ball, times its mass: 1 + 5/2


def kappa(young_1: float, poisson_1: float, young_2: float, poisson_2: float) -> float:
    """Return the stiffness along the surface over that along the normal, 4 G* / E*."""
    normal = (1 - poisson_1**2) / young_1 + (1 - poisson_2**2) / young_2
    along = sum(
        2 * (1 + nu) * (2 - nu) / young
        for young, nu in ((young_1, poisson_1), (young_2, poisson_2))
    )
    return 4 * normal / along


def recoil(incident: Array, kappa: float, dissipation: float = 0.0) -> Array:
    """Return the patch's velocity after an impact (n,), like `incident` over mu v_n before it.

    `dissipation` is Hunt and Crossley's b times v_n. In units where the largest depth of the
    undamped impact, its duration and mu v_n are about one: x'' = -5/4 x^1.5 (1 - b x').
    """
    h = 3.3 / STEPS
    place = (np.arange(SPRINGS) + 0.5) / SPRINGS
    parabola = 1.5 * place[:, None] ** 2
    stretch = np.zeros((SPRINGS, len(incident)))
    patch = np.array(incident, dtype=float)
    x, speed = 0.0, 1.0
    while True:
        x += 0.5 * h * speed
        if x <= 0:
            return patch
        push = 1.25 * x**1.5 * max(0.0, 1 + dissipation * speed)
        limit = (push / (1.25 * x**1.5)) * np.maximum(x - parabola, 0.0)
        stretch = np.clip(stretch + h * kappa * patch, -limit, limit)
        force = 15 / 8 * math.sqrt(1.5) * stretch.mean(axis=0)
        patch = patch - h * MOBILITY * force
        speed -= h * push
        x += 0.5 * h * speed
