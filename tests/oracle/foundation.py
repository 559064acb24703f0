"""The elastic foundation by its definition: integrals of the pressure over the overlap's volume."""

from collections.abc import Callable

import numpy as np

from sphshell_pin.base.arrays import Array


def pressure(rho: Array, radius: float) -> Array:
    """Pressure at distances from the center, per modulus / thickness."""
    return (radius**2 - rho**2) / (2 * rho)


def gauss(low: float, high: float, count: int) -> tuple[Array, Array]:
    """Gauss's nodes and weights, denser at both ends: for integrands with roots there."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    middle, half = (low + high) / 2, (high - low) / 2
    turn = nodes * np.pi / 2
    return middle + half * np.sin(turn), weights * half * np.pi / 2 * np.cos(turn)


def turned(
    radius: float,
    low: float,
    high: float,
    ring: Callable[[float], tuple[float, float]],
    count: int = 80,
) -> float:
    """Integral over a body of revolution about z, of which `ring(z)` gives the radii in z.

    The sphere's center is the origin. In a plane z, p 2 pi r dr = p 2 pi rho d(rho).
    """
    total = 0.0
    for z, weight in zip(*gauss(low, high, count), strict=True):
        inner, outer = (np.hypot(r, z) for r in ring(z))
        rho, weights = gauss(inner, max(inner, min(outer, radius)), 20)
        total += weight * float(weights @ (pressure(rho, radius) * 2 * np.pi * rho))
    return total


def slope(function: Callable[[float], float], at: float, step: float) -> float:
    """Derivative by central differences of sixth order."""
    f = [function(at + k * step) for k in (-3, -2, -1, 1, 2, 3)]
    return float(np.dot([-1, 9, -45, 45, -9, 1], f) / (60 * step))


def energy_in_ball(ball: float, apart: float, radius: float) -> float:
    """Potential of a solid ball at a distance `apart` from the center, which is outside it."""

    def ring(z: float) -> tuple[float, float]:
        return 0.0, float(np.sqrt(max(0.0, ball**2 - (z - apart) ** 2)))

    # Kinks of the rings' radii are at the end of an interval.
    low, high = apart - ball, min(radius, apart + ball)
    meets = float(np.clip((radius**2 - ball**2 + apart**2) / (2 * apart), low, high))
    return turned(radius, low, meets, ring) + turned(radius, meets, high, ring)


def energy_in_socket(socket: float, off: float, radius: float) -> float:
    """Potential of what is outside a cavity, the center `off` from that of the cavity."""

    def ring(z: float) -> tuple[float, float]:
        return float(np.sqrt(max(0.0, socket**2 - (z + off) ** 2))), 2 * radius

    # The spheres meet in one plane; below it the ball is inside the cavity.
    meets = (socket**2 - off**2 - radius**2) / (2 * off)
    top = socket - off
    if top >= radius:
        return 0.0
    return turned(radius, meets, top, ring) + turned(
        radius, top, radius, lambda z: (0.0, 2 * radius)
    )


def energy_in_box(low: Array, high: Array, center: Array, radius: float, count: int = 400) -> float:
    """Potential of a box, by directions from the center: along one, p rho^2 integrates to
    (R^2 - rho^2)^2 / 8 between the places where it enters and leaves the box."""
    cosine, weights = np.polynomial.legendre.leggauss(count)
    turn = 2 * np.pi * (np.arange(2 * count) + 0.5) / (2 * count)
    sine = np.sqrt(1 - cosine**2)
    across = sine[:, None, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    u = np.dstack([across, np.tile(cosine, (2 * count, 1)).T])
    with np.errstate(divide="ignore"):
        t = np.stack([(low - center) / u, (high - center) / u])
    enter = np.clip(t.min(axis=0).max(axis=2), 0, radius)
    leave = np.clip(t.max(axis=0).min(axis=2), 0, radius)
    leave = np.maximum(enter, leave)
    along = ((radius**2 - enter**2) ** 2 - (radius**2 - leave**2) ** 2) / 8
    return float((weights @ along).sum() * np.pi / count)
