"""Hertz's theory written from Johnson, Contact Mechanics (1985), 4.26, by plain quadrature."""

import math

import numpy as np


def elliptic(complement: float) -> tuple[float, float]:
    """Return K and E of the complementary modulus by the midpoint rule, exact for periodic ones."""
    angle = (np.arange(4000) + 0.5) * (math.pi / 8000)
    root = np.sqrt(np.cos(angle) ** 2 + complement**2 * np.sin(angle) ** 2)
    return float(np.mean(1 / root)) * math.pi / 2, float(np.mean(root)) * math.pi / 2


def ellipse(complement: float) -> tuple[float, float, float, float]:
    """Return A, B [1/m], depth [m], load [N] of half axes 1 and `complement`, p0 = E* = 1."""
    k, e = elliptic(complement)
    square = 1 - complement**2
    if square < 1e-9:
        return math.pi / 4, math.pi / 4, math.pi / 2, 2 * math.pi / 3
    a = complement / square * (k - e)
    b = complement / square * (e / complement**2 - k)
    return a, b, complement * k, 2 * math.pi / 3 * complement


def hertz_contact(
    a: float, b: float, modulus: float, depth: float
) -> tuple[float, float, float, float]:
    """Return load [N], half axes a >= b [m] and peak pressure [Pa] of the gap a x^2 + b y^2.

    `a`, `b` [1/m] positive, in any order; `modulus` E* [Pa]; `depth` [m] is the approach.
    """
    low, high = 1e-6, 1.0
    ratio = max(a, b) / min(a, b)
    for _ in range(100):
        middle = 0.5 * (low + high)
        found = ellipse(middle)
        low, high = (middle, high) if found[1] / found[0] > ratio else (low, middle)
    unit = ellipse(0.5 * (low + high))
    # Lengths by s, pressures by p: curvatures go with p / (E* s), depths with p s / E*.
    total = a + b
    pressure_over = math.sqrt(total * depth / ((unit[0] + unit[1]) * unit[2]))
    size = depth / (unit[2] * pressure_over)
    load = unit[3] * pressure_over * modulus * size**2
    return load, size, size * 0.5 * (low + high), pressure_over * modulus
