"""The ball of the analytic cases, its contacts, and what is read off its runs.

One point counts for both bodies, the contact point on the shell, so the ball rolls on the lever
`r - depth` about its center. Closed forms of rolling hold with it, and with the ball's own
I = 2/5 m r^2.
"""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

import sphshell_pin as sp
from sphshell_pin.benchmarks.swing import GRAVITY, MASS, RADIUS
from sphshell_pin.dynamics import Result
from tests import models

Array = NDArray[np.float64]
INERTIA = 0.4 * MASS * RADIUS**2
# What runs the cases that are about the physics and not about a stepper.
PRECISE = sp.Adaptive(1e-8)
# Stiffness of contacts whose depth should not count [N/m], and of bristles.
STIFF = 1e7
# Damping of springs, as a part of the critical one: their oscillation at the start dies out.
RATIO = 0.5


def beta(depth: float = 0.0) -> float:
    """Return I / (m (r - depth)^2), 2/5 for depth 0."""
    return INERTIA / (MASS * (RADIUS - depth) ** 2)


def spring(stiffness: float = STIFF, ratio: float = RATIO) -> sp.ImpactLaw:
    """Linear spring and dashpot; the dashpot is at its full strength almost from the touch on."""
    return sp.ImpactLaw(stiffness, 1.0, 2 * ratio * math.sqrt(stiffness * MASS), 1e-10)


def bristle(mu: float, stiffness: float = STIFF, mass: float = 2 / 7 * MASS) -> sp.BristleFriction:
    """Bristles of one coefficient; `mass` [kg] that they move: of a round ball 2/7 of its own."""
    return sp.BristleFriction(mu, mu, stiffness, 2 * RATIO * math.sqrt(stiffness * mass))


def free_ball(gravity: float = GRAVITY) -> pin.Model:
    """Ball on a free-flyer."""
    return models.ball(gravity, MASS, RADIUS)


def scene_of(
    shell: sp.Shell,
    law: sp.ImpactLaw | sp.HuntCrossleyLaw,
    friction: sp.BristleFriction | sp.CoulombFriction | None = None,
    *,
    model: pin.Model | None = None,
    frame: str = "universe",
    placement: pin.SE3 | None = None,
) -> sp.Scene:
    """Return the ball, on a free-flyer unless `model` is given, and a shell."""
    scene = sp.Scene(free_ball() if model is None else model)
    scene.add_contact(sp.Sphere(RADIUS, "ball"), shell, frame, placement, law, friction)
    return scene


def tilted(angle: float) -> pin.SE3:
    """Return the placement of a slope that falls along +x by `angle` [rad]."""
    return pin.SE3(pin.utils.rotate("y", angle), np.zeros(3))


def state(
    center: Array | list[float], velocity: Array | list[float], spin: Array | list[float]
) -> tuple[Array, Array]:
    """Return q0, v0 of the unturned free ball; all in the world, [m], [m/s], [rad/s]."""
    return models.free_q(np.asarray(center)), np.concatenate([velocity, spin]).astype(float)


def turned(quaternions: Array, vectors: Array) -> Array:
    """Turn vectors (n, 3) by unit quaternions x y z w (n, 4)."""
    axis, cosine = quaternions[:, :3], quaternions[:, 3:]
    across = 2 * np.cross(axis, vectors)
    out: Array = vectors + cosine * across + np.cross(axis, across)
    return out


def velocities(result: Result) -> Array:
    """Return the velocity (n, 3) of the free ball's center in the world [m/s]."""
    return turned(result.q[:, 3:7], result.v[:, :3])


def spins(result: Result) -> Array:
    """Return the angular velocity (n, 3) of the free ball in the world [rad/s]."""
    return turned(result.q[:, 3:7], result.v[:, 3:6])


def center_at(result: Result, t: float) -> tuple[Array, Array]:
    """Return the free ball's center and velocity at `t` [s], by Hermite's cubic between rows."""
    row = int(np.clip(np.searchsorted(result.t, t) - 1, 0, len(result.t) - 2))
    step = result.t[row + 1] - result.t[row]
    u = (t - result.t[row]) / step
    x, v = result.q[row : row + 2, :3], velocities(result)[row : row + 2] * step
    bend = 3 * (x[1] - x[0]) - 2 * v[0] - v[1], 2 * (x[0] - x[1]) + v[0] + v[1]
    center = x[0] + u * (v[0] + u * (bend[0] + u * bend[1]))
    return center, (v[0] + u * (2 * bend[0] + 3 * u * bend[1])) / step


def event_times(result: Result, kind: str) -> list[float]:
    """Return when contacts of a kind of event came [s]."""
    return [event.t for event in result.events if event.kind == kind]
