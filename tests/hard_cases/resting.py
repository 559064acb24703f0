"""Balls that rest on several places.

In a groove, on eight spikes.
"""

import math
from itertools import product

import numpy as np

import sphshell_pin as sp
from sphshell_pin.contact.normal_law import bisect
from tests import meshes, models
from tests.hard_cases.verdict import Verdicts, at_most, case, compare

RADIUS, MASS, GRAVITY = 0.02, 0.3, 9.81
WEIGHT, SPIKES = MASS * GRAVITY, 8
WAYS = list(product((sp.Implicit(), sp.LinearlyImplicitEuler(1e-3)), ("smooth", "facets")))


def rest(shell, stiffness, damping, q, duration, integrator, method):
    """Let the ball settle; return the normal forces [N], saddles with a minus, and its height."""
    law = sp.ImpactLaw(stiffness, 1.0, damping, 1e-9)  # constant damping from 1 nm on
    model = models.block(GRAVITY, MASS)
    scene = models.on_shell(model, shell, law, radius=RADIUS, method=method)
    simulation = sp.Simulation(scene, integrator)
    result = simulation.run(np.array(q), duration=duration, record_dt=duration)
    log = result.contacts
    return log.normal_force[log.row == len(result.t) - 1], float(result.q[-1, 2])


@case("ball wedged in a V")
def wedged() -> Verdicts:
    """N = m g / (2 sin a) with half the angle of the V, a; depth = N / k."""
    for (integrator, method), degrees in product(WAYS, (2.0, 10.0, 45.0, 80.0)):
        sine, depth = math.sin(math.radians(degrees)), 2e-4 * RADIUS
        force = WEIGHT / (2 * sine)
        stiffness = force / depth
        groove = meshes.v_groove(math.pi / 2 - math.radians(degrees))
        shell = sp.Shell(*groove, crease_angle=0.0)
        # Critical for the slower way, up and down.
        damping, slow = math.sqrt(2 * stiffness * MASS), math.sqrt(MASS / (2 * stiffness))
        start = [0.0, 0.01, (RADIUS - 0.9 * depth) / sine]
        way = integrator, method
        forces, z = rest(shell, stiffness, damping / sine, start, 60 * slow / sine, *way)
        tried = f"{type(integrator).__name__}, {degrees:g} deg to each side, {method}"
        yield at_most("wedge", tried, "two contacts", len(forces) - 2, 0)
        for law, seen in zip(("N = m g / (2 sin a)", "N, other plate"), forces, strict=False):
            yield compare("wedge", tried, law, force, float(seen), 1e-6)
        yield compare("wedge", tried, "depth = N / k", depth, RADIUS - z * sine, 1e-6)


def spikes() -> sp.Shell:
    """Return eight spikes whose tips stand at z = 0 on a circle of 0.6 r."""
    turn = 2 * np.pi * np.arange(SPIKES) / SPIKES
    tips = 0.6 * RADIUS * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    feet = [[0.0, 0, 0], [0.15, 0, -1], [-0.075, 0.13, -1], [-0.075, -0.13, -1]]
    vertices = (tips[:, None] + RADIUS * np.array(feet)).reshape(-1, 3)
    sides = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1]])
    return sp.Shell(vertices, np.concatenate([sides + 4 * k for k in range(SPIKES)]))


@case("ball on eight spikes")
def spiked() -> Verdicts:
    """At rest 8 k (r - l) z / l = m g, l^2 = z^2 + (0.6 r)^2."""
    stiffness = WEIGHT / (SPIKES * 0.8 * 0.01 * RADIUS)

    def left(z: float) -> float:
        length = math.hypot(z, 0.6 * RADIUS)
        return WEIGHT - SPIKES * stiffness * (RADIUS - length) * z / length

    z = bisect(left, 0.5 * RADIUS, 0.8 * RADIUS)
    form = WEIGHT / (SPIKES * z / math.hypot(z, 0.6 * RADIUS))
    damping = math.sqrt(stiffness * MASS / SPIKES)
    duration = 120 * math.sqrt(0.02 * RADIUS / GRAVITY)
    start = [1e-4 * RADIUS, 2e-4 * RADIUS, z + 1e-3 * RADIUS]
    for integrator, method in WAYS:
        forces, height = rest(spikes(), stiffness, damping, start, duration, integrator, method)
        tried = f"{type(integrator).__name__}, {method}"
        yield at_most("spikes", tried, "eight contacts", len(forces) - SPIKES, 0)
        worst = float(forces[np.argmax(np.abs(forces - form))])
        yield compare("spikes", tried, "N = m g / (8 cos), each", form, worst, 1e-6)
        yield compare("spikes", tried, "height, of what is right", 1, height / z, 1e-8)
