"""Balls that rest on several places.

In a groove, on eight spikes.
"""

import math
from typing import Any

import numpy as np

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.normal_law import bisect
from tests import meshes, models
from tests.hard_cases.verdict import Verdicts, at_most, case, compare

RADIUS, MASS, GRAVITY = 0.02, 0.3, 9.81
WEIGHT = MASS * GRAVITY


def rest(model, shell, law, q, integrator, duration, method="smooth"):
    """Let the ball settle on `shell`."""
    scene = models.on_shell(model, shell, law, radius=RADIUS, method=method)
    return sp.Simulation(scene, integrator).run(q, duration=duration, record_dt=duration)


def last_forces(result: sp.Result) -> Array:
    """Return normal forces [N] of the last row, saddles with a minus."""
    log = result.contacts
    return np.asarray(log.normal_force[log.row == len(result.t) - 1])


def damped(stiffness: float, damping: float) -> sp.ImpactLaw:
    """Return a spring whose damping is constant from 1 nm on."""
    return sp.ImpactLaw(stiffness, 1.0, damping, 1e-9)


def wedge(half_angle: float, integrator: Any, method: str) -> tuple[Array, Array]:
    """Let a ball settle in a V; return both forces, and its depth there, and what is right.

    N = m g / (2 sin a) with half the angle of the V, a.
    """
    force = WEIGHT / (2 * math.sin(half_angle))
    depth = 2e-4 * RADIUS
    stiffness = force / depth
    shell = sp.Shell(*meshes.v_groove(math.pi / 2 - half_angle), crease_angle=0.0)
    # Critical for the slower way, up and down.
    damping = math.sqrt(2 * stiffness * MASS) / math.sin(half_angle)
    height = (RADIUS - 0.9 * depth) / math.sin(half_angle)
    slow = math.sqrt(MASS / (2 * stiffness)) / math.sin(half_angle)
    result = rest(
        models.block(GRAVITY, MASS),
        shell,
        damped(stiffness, damping),
        np.array([0.0, 0.01, height]),
        integrator,
        60 * slow,
        method,
    )
    found = np.append(last_forces(result), RADIUS - result.q[-1, 2] * math.sin(half_angle))
    return found, np.array([force, force, depth])


@case("ball wedged in a V")
def wedged() -> Verdicts:
    for integrator in (sp.Implicit(), sp.LinearlyImplicitEuler(1e-3)):
        for degrees in (2.0, 10.0, 45.0, 80.0):
            for method in ("smooth", "facets"):
                found, right = wedge(math.radians(degrees), integrator, method)
                tried = f"{type(integrator).__name__}, {degrees:g} deg to each side, {method}"
                laws = ("N = m g / (2 sin a)", "N, other plate", "depth = N / k")
                if len(found) != 3:
                    yield at_most("wedge", tried, "two contacts", len(found) - 3, 0)
                    continue
                for law, a, b in zip(laws, found, right, strict=True):
                    yield compare("wedge", tried, law, float(b), float(a), 1e-6)


SPIKES = 8


def spikes() -> sp.Shell:
    """Return eight spikes whose tips stand at z = 0 on a circle of 0.6 r."""
    vertices, elements = [], []
    foot = np.array([[1.0, 0.0], [-0.5, 0.75**0.5], [-0.5, -(0.75**0.5)]]) * 0.15 * RADIUS
    for k in range(SPIKES):
        turn = 2 * math.pi * k / SPIKES
        x, y = 0.6 * RADIUS * math.cos(turn), 0.6 * RADIUS * math.sin(turn)
        vertices.append([x, y, 0.0])
        vertices += [[x + fx, y + fy, -RADIUS] for fx, fy in foot]
        elements += [[4 * k, 4 * k + 1 + i, 4 * k + 1 + (i + 1) % 3] for i in range(3)]
    return sp.Shell(np.array(vertices), elements)


def height_on_spikes(stiffness: float) -> float:
    """Return the height z at rest [m] where 8 k (r - l) z / l = m g, l^2 = z^2 + (0.6 r)^2."""

    def left(z: float) -> float:
        length = math.hypot(z, 0.6 * RADIUS)
        return WEIGHT - SPIKES * stiffness * (RADIUS - length) * z / length

    return bisect(left, 0.5 * RADIUS, 0.8 * RADIUS)


def on_spikes(integrator: Any, method: str) -> tuple[Array, float, float]:
    """Let a ball settle on the spikes; return the forces, the force that is right, its height
    over the one that is right.
    """
    stiffness = WEIGHT / (SPIKES * 0.8 * 0.01 * RADIUS)
    law = damped(stiffness, math.sqrt(stiffness * MASS / SPIKES))
    z = height_on_spikes(stiffness)
    q = np.array([1e-4 * RADIUS, 2e-4 * RADIUS, z + 1e-3 * RADIUS])
    duration = 120 * math.sqrt(0.02 * RADIUS / GRAVITY)
    result = rest(models.block(GRAVITY, MASS), spikes(), law, q, integrator, duration, method)
    form = WEIGHT / (SPIKES * z / math.hypot(z, 0.6 * RADIUS))
    return last_forces(result), form, float(result.q[-1, 2]) / z


@case("ball on eight spikes")
def spiked() -> Verdicts:
    for integrator in (sp.Implicit(), sp.LinearlyImplicitEuler(1e-3)):
        for method in ("smooth", "facets"):
            forces, form, height = on_spikes(integrator, method)
            tried = f"{type(integrator).__name__}, {method}"
            if len(forces) != SPIKES:
                count = len(forces) - SPIKES
                yield at_most("spikes", tried, "eight contacts", count, 0)
                continue
            worst = float(forces[np.argmax(np.abs(forces - form))])
            law = "N = m g / (8 cos), each"
            yield compare("spikes", tried, law, form, worst, 1e-6)
            yield compare("spikes", tried, "height, of what is right", 1, height, 1e-8)
