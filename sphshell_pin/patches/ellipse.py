"""Integrals of Hertz's pressure over an ellipse, p0 sqrt(1 - x^2/a^2 - y^2/b^2), in closed form.

Coordinates are normalized: u = (x / a, y / b), so that the ellipse is the unit disc and the
pressure over the peak is sqrt(1 - |u|^2) in it, zero outside.
"""

import numpy as np

from sphshell_pin.base.arrays import Array


def pressure(u: Array) -> Array:
    """Pressure over the peak (...) at the places u (..., 2)."""
    return np.asarray(np.sqrt(np.maximum(0.0, 1.0 - (u * u).sum(axis=-1))))


def load_in_polygons(corners: Array) -> Array:
    """Share of the load within polygons (..., k, 2), positive where they turn counterclockwise.

    Exact: with F(rho) the load within rho, the sum over the sides of the integral of
    (F / 2 pi) d(theta), by Green's theorem. A side that two polygons share counts in both with
    opposite signs, so that the loads of a grid add up to that of its outline.
    """
    after = np.roll(corners, -1, axis=-2)
    side = after - corners
    length = np.linalg.norm(side, axis=-1)
    along = side / np.where(length > 0.0, length, 1.0)[..., None]
    # The side is x = d n + t e with the signed distance d of its line and t from `t0` to `t1`.
    distance = corners[..., 0] * along[..., 1] - corners[..., 1] * along[..., 0]
    sign, d = np.where(distance < 0.0, -1.0, 1.0), np.abs(distance)
    t0 = (corners * along).sum(axis=-1)
    t1 = t0 + length
    # Outside the disc F is all of the load; inside it lacks (1 - rho^2)^(3/2) of it.
    turned = np.arctan2(t1, d) - np.arctan2(t0, d)
    half = np.sqrt(np.maximum(0.0, 1.0 - d * d))
    lacking = _lacking(np.clip(t1, -half, half), d, half) - _lacking(
        np.clip(t0, -half, half), d, half
    )
    return np.asarray((sign * (turned - np.where(half > 0.0, lacking, 0.0))).sum(axis=-1)) / (
        2.0 * np.pi
    )


def _lacking(t: Array, d: Array, half: Array) -> Array:
    """Integral from 0 to t of d (1 - rho^2)^(3/2) / rho^2, rho^2 = d^2 + t^2."""
    root = np.sqrt(np.maximum(0.0, half * half - t * t))
    angle = np.arcsin(np.clip(t / np.where(half > 0.0, half, 1.0), -1.0, 1.0))
    return np.asarray(
        np.arctan2(t, d * root) - d * angle - 0.5 * d * (t * root + half * half * angle)
    )
