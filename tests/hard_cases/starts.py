"""Starts and postures on the verge.

A start in overlap, a path that overlaps by 1e-12 m, and a finger that presses along its own length.
"""

import math
from typing import Any

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin import robots
from tests import models
from tests.hard_cases.verdict import Verdict, Verdicts, at_most, case, compare

RADIUS, MASS = 0.01, 0.1
# Audit of a run: energy from nowhere, of the energy exchanged.
AUDIT = 1e-4


def leaving_speed(depth: float, exponent: float, integrator: Any) -> tuple[float, float]:
    """Let go of a ball in overlap; return its speed after it, and sqrt(2 E / m).

    E = k depth^(e + 1) / (e + 1); the law is such that the speed is 1 m/s.
    """
    law = sp.ImpactLaw(0.5 * (exponent + 1) * MASS / depth ** (exponent + 1), exponent)
    plate = models.plate(20 * RADIUS)
    scene = models.on_plate(models.slider(0.0, MASS), law, radius=RADIUS, shell=plate)
    start = np.array([RADIUS - depth])
    found = (RADIUS - start[0]) / depth
    result = sp.Simulation(scene, integrator).run(start, duration=4 * depth, record_dt=depth)
    # The depth that was reached is that of the rounded height.
    return float(result.v[-1, 0]), found ** (0.5 * (exponent + 1))


@case("starts in overlap")
def overlaps() -> Verdicts:
    law = "leaves with sqrt(2 E / m)"
    for share in (1e-6, 1e-3, 0.1, 0.49):
        depth = share * RADIUS
        fine = 1e-9 * depth
        for integrator, what, bound in (
            (sp.Adaptive(rtol=1e-8, atol=fine), "Adaptive(1e-8, 1e-9 depth)", 1e-6),
            (sp.Implicit(rtol=1e-6, atol=fine), "Implicit(1e-6, 1e-9 depth)", 1e-4),
            (sp.RungeKutta4(1e-3 * depth), "RungeKutta4(depth / 1000 speed)", 1e-6),
            (sp.SemiImplicitEuler(1e-3 * depth), "SemiImplicitEuler(depth / 1000 speed)", 2e-3),
        ):
            pairs = [leaving_speed(depth, e, integrator) for e in (1.0, 1.5, 2.2)]
            found, right = max(pairs, key=lambda pair: abs(pair[0] - pair[1]))
            tried = f"{what}, {share:g} r, worst of e = 1, 1.5, 2.2"
            yield compare("overlap", tried, law, right, found, bound)


GRAZE = 1e-12
STIFFNESS = 1e6


def graze(integrator: Any, friction: Any) -> tuple[float, float]:
    """Fly along a plate, 1e-12 m deep in it, at 1 m/s; return speeds away and along [m/s]."""
    model, law = models.block(0.0, MASS, RADIUS), sp.ImpactLaw(STIFFNESS, 1.0)
    scene = models.on_plate(model, law, friction, radius=RADIUS, shell=models.plate(0.5))
    q, v = np.array([-0.1, 0.01, RADIUS - GRAZE]), np.array([1.0, 0.0, 0.0])
    result = sp.Simulation(scene, integrator).run(q, v, 0.2, record_dt=0.1)
    if not np.isfinite(result.q).all():
        return math.nan, math.nan
    return float(result.v[-1, 2]), float(result.v[-1, 0])


@case("flight along a plate, 1e-12 m deep")
def grazing() -> Verdicts:
    """The impulse is that of a quarter of an oscillation, m d sqrt(k / m)."""
    form = GRAZE * math.sqrt(STIFFNESS / MASS)
    for integrator, allowed in (
        (sp.RungeKutta4(1e-5), 0.01),
        (sp.SemiImplicitEuler(1e-5), 0.05),
        (sp.Adaptive(rtol=1e-6, atol=1e-15), 0.01),
        (sp.Adaptive(), 1.0),
        (sp.Implicit(), 1.0),
        (sp.LinearlyImplicitEuler(1e-3), 1.0),
    ):
        for friction, mu in ((None, 0.0), (sp.CoulombFriction(0.5, 0.4, 0.01, 0.1), 0.4)):
            away, along = graze(integrator, friction)
            tried = f"{integrator}, friction {mu:g}"
            law = "leaves with d sqrt(k / m)" if allowed < 1 else "d sqrt(k / m) at most"
            over = abs(away / form - 1) if allowed < 1 else max(away / form - 1, -away / form)
            yield Verdict.on("graze", tried, law, form, away, over, allowed)
            # Rounding of a speed of 1 m/s hides what friction takes.
            slowed = abs(1 - along - mu * away)
            law = "slowed by mu of that"
            yield at_most("graze", tried, law, slowed, 0.1 * form + 1e-14)


def stretched(integrator: Any, start: float) -> tuple[float, float]:
    """Press a straight finger, but for `start` [rad] a joint, on a level wall over its tip.

    Return the residual of the energy, of what is exchanged and stored, and the largest joint angle
    at the end. At zero the press is in the singular direction: no torque answers it, and the mass
    along it has no bound.
    """
    model = robots.load("three_link_finger").model
    tip = models.pose_of(model, np.zeros(3), "tip").translation
    scene, wall = sp.Scene(model), np.array([0.0, 0.0, tip[2] + RADIUS - 1e-4])
    law, friction = sp.HuntCrossleyLaw(1e5, 1.0, 1.0), sp.CoulombFriction(0.3, 0.25, 0.005, 0.05)
    placed = {"placement": pin.SE3(np.eye(3), wall), "law": law, "friction": friction}
    scene.add_contact(sp.Sphere(RADIUS, "tip"), models.plate(0.3), **placed)
    gains = {"stiffness": 100.0, "damping": 1.0, "joint_damping": 0.01}
    controller = sp.CartesianImpedance("tip", [[0.0, 0.0, 0.2]], **gains)
    simulation, q = sp.Simulation(scene, integrator), np.full(3, start)
    result = simulation.run(q, duration=0.5, controller=controller, record_dt=1e-3)
    energy = result.energy
    residual = np.abs(energy.residual).max() / (energy.exchanged + energy.elastic.max())
    return float(residual), float(np.abs(result.q[-1]).max())


@case("finger that presses along its own length", slow=True)
def singular() -> Verdicts:
    for integrator, bound in (
        (sp.Adaptive(), AUDIT),
        (sp.Implicit(), AUDIT),
        (sp.RungeKutta4(1e-5), AUDIT),
        (sp.SemiImplicitEuler(1e-5), 1e-2),
    ):
        for start in (0.0, 1e-6, 0.05):
            residual, angle = stretched(integrator, start)
            tried = f"{type(integrator).__name__}, joints bent by {start:g} rad"
            law = "energy audit, of what is exchanged and stored"
            yield at_most("singular posture", tried, law, residual, bound)
            law = "stays within a turn [rad]"
            yield at_most("singular posture", tried, law, angle, math.pi)
