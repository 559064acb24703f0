"""Extremes of stiffness, mass, size and weight.

Stiffness 1e3 to 1e9 N/m, masses from 1 mg to 100 kg, radii from 10 um to 10 m, on a plate.
"""

import math
from itertools import product
from typing import Any

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from tests import models
from tests.hard_cases import balls
from tests.hard_cases.analytic_impact import touch_time
from tests.hard_cases.verdict import Verdict, Verdicts, at_most, case, compare

EPS = float(np.finfo(float).eps)
GRAVITY = 9.81


def on_plate(model: pin.Model, law: sp.ImpactLaw, radius: float) -> sp.Scene:
    """Return the scene of a ball on a plate of 20 radii."""
    return models.on_plate(model, law, radius=radius, shell=models.plate(20 * radius))


def damped(mass: float, stiffness: float, depth: float) -> sp.ImpactLaw:
    """Return a spring that damps `mass` to 0.7 of critical from a tenth of `depth` on."""
    return sp.ImpactLaw(stiffness, 1.0, 1.4 * math.sqrt(stiffness * mass), 0.1 * depth)


def resting_depth(mass, stiffness, integrator, gravity=GRAVITY, start=0.0):
    """Let a ball settle; return its depth, m g / k, and what rounding may make of it, relative.

    It starts at `start` times its depth at rest.
    """
    depth = mass * gravity / stiffness
    radius = float(np.clip(20 * depth, 1e-5, 10.0))
    law = damped(mass, stiffness, depth)
    scene = on_plate(models.slider(gravity, mass), law, radius)
    duration = 40 * math.sqrt(mass / stiffness)
    # Long enough for tens of steps, however short the time scale.
    duration = max(duration, 50 * getattr(integrator, "dt", 2e-4))
    q = np.array([radius - start * depth])
    result = sp.Simulation(scene, integrator).run(q, duration=duration, record_dt=duration)
    # A step that moves by less than half a bit does not move: so much of the way may be left.
    return radius - float(result.q[-1, 0]), depth, 100 * EPS * radius / depth


STIFFNESS, MASSES = (1e3, 1e5, 1e7, 1e9), (1e-6, 1e-3, 1.0, 100.0)


def settle_all(integrator: Any, gravity: float, start: float) -> Verdict:
    """Return the verdict on the worst of all masses on all springs."""
    found = []
    for stiffness, mass in product(STIFFNESS, MASSES):
        if mass * gravity / stiffness <= 1.0:
            seen, depth, rounding = resting_depth(mass, stiffness, integrator, gravity, start)
            error = max(0.0, abs(seen / depth - 1) - rounding)
            which = f"{mass:g} kg on {stiffness:g} N/m"
            found.append((math.inf if math.isnan(error) else error, which, depth, seen))
    error, which, depth, seen = max(found)
    begun = "dropped from depth 0" if start == 0 else "laid down"
    tried = f"{type(integrator).__name__}, {begun}; worst of 16: {which}"
    law = f"depth = m g / k, but for rounding{', 1000 g' if gravity > GRAVITY else ''}"
    return Verdict.on("ball at rest", tried, law, depth, seen, error, 1e-6)


@case("balls of 1 mg to 100 kg on springs of 1e3 to 1e9 N/m")
def stiffness_and_mass() -> Verdicts:
    stiff = (sp.Implicit(), sp.LinearlyImplicitEuler(1e-3))
    for integrator, start in product(stiff, ((GRAVITY, 0.0), (GRAVITY, 0.9), (1e3 * GRAVITY, 0.9))):
        yield settle_all(integrator, *start)


def stacked_depths(upper: float, lower: float, integrator: Any) -> tuple[list[float], list[float]]:
    """Let a ball of mass `upper` rest on a plate that one of mass `lower` carries on the ground.

    Both slide up and down; 1e6 N/m each. Return the depths of both contacts, and the closed forms.
    """
    model, whole = models.empty(GRAVITY), upper + lower
    for name, mass in (("low", lower), ("high", upper)):
        inertia = pin.Inertia.FromSphere(mass, 0.01)
        models.add_body(model, name, pin.JointModelPZ(), inertia=inertia)
    scene = sp.Scene(model)
    expected = [whole * GRAVITY / 1e6, upper * GRAVITY / 1e6]
    stack = ("low", "universe", 0.0, whole), ("high", "low", 0.02, upper)
    for ball, frame, height, carried in stack:
        law, top = damped(carried, 1e6, carried * GRAVITY / 1e6), np.array([0.0, 0.0, height])
        placed = pin.SE3(np.eye(3), top)
        scene.add_contact(sp.Sphere(0.01, ball), models.plate(0.2), frame, placed, law=law)
    duration = 60 * math.sqrt(whole / 1e6)
    simulation = sp.Simulation(scene, integrator)
    low, high = simulation.run([0.01, 0.04], duration=duration, record_dt=1.0).q[-1]
    return [0.01 - low, 0.01 - (high - low - 0.02)], expected


@case("balls of one kilogram and one milligram on each other")
def mass_ratio() -> Verdicts:
    for integrator, (upper, lower) in product(
        (sp.Implicit(), sp.LinearlyImplicitEuler(1e-3)), ((1.0, 1e-6), (1e-6, 1.0))
    ):
        tried = f"{type(integrator).__name__}, {upper:g} kg over {lower:g} kg"
        found, expected = stacked_depths(upper, lower, integrator)
        for name, depth, form in zip(("below", "between"), found, expected, strict=True):
            bound = 1e-6 + 4 * EPS * 0.04 / form
            law = f"depth {name} = weight above / k"
            yield compare("stack", tried, law, form, depth, bound)


@case("at rest without weight")
def weightless() -> Verdicts:
    """Nothing acts, so nothing moves: not by one bit."""
    for integrator in (
        sp.SemiImplicitEuler(1e-3),
        sp.RungeKutta4(1e-3),
        sp.Adaptive(),
        sp.Implicit(),
        sp.LinearlyImplicitEuler(1e-3),
    ):
        moved = sum(_moves(integrator, gap) for gap in (0.0, 1e-15, 1e-3))
        tried = f"{type(integrator).__name__}, three gaps from 0 to 1 mm"
        yield at_most("no gravity", tried, "moves by no bit", moved, 0)


def _moves(integrator: Any, gap: float) -> bool:
    scene = on_plate(models.ball(gravity=0.0), models.linear_law(1e6, 10.0), 0.05)
    q = models.free_q(np.array([0.013, -0.021, 0.05 + gap]))
    q[3:] = [0.5, -0.5, 0.5, 0.5]
    result = sp.Simulation(scene, integrator).run(q, duration=1.0, record_dt=1.0)
    return result.q[-1].tobytes() != q.tobytes() or bool(np.any(result.v[-1]))


RADII = 10.0 ** np.arange(-5, 2)


def bounce(radius: float, integrator: Any) -> tuple[float, float]:
    """Let a ball of 1000 kg/m^3 hit at 1 m/s a Hertz spring that stops it at 0.05 r.

    Return restitution, and time of contact over 2.9433 depth / speed (Johnson, Contact Mechanics,
    11.24).
    """
    mass, depth = 4e3 / 3 * math.pi * radius**3, 0.05 * radius
    law = sp.ImpactLaw(1.25 * mass / depth**2.5, 1.5)
    scene = on_plate(models.slider(0.0, mass), law, radius)
    form = touch_time(1.5, depth, 1.0)
    duration = 0.02 * radius + 1.1 * form
    result = sp.Simulation(scene, integrator).run([1.01 * radius], [-1.0], duration)
    touch, lift = (
        next(iter(balls.event_times(result, kind)), math.nan) for kind in ("touch", "lift_off")
    )
    return float(result.v[-1, 0]), (lift - touch) / form


@case("elastic impact of balls of 10 um to 10 m")
def radii() -> Verdicts:
    for what, make, bound in (
        ("Adaptive(1e-8, 1e-10 r)", lambda r: sp.Adaptive(rtol=1e-8, atol=1e-10 * r), 1e-6),
        ("Adaptive()", lambda r: sp.Adaptive(), 1e-4),
        ("Implicit(1e-6, 1e-8 r)", lambda r: sp.Implicit(rtol=1e-6, atol=1e-8 * r), 1e-4),
    ):
        found = np.array([bounce(r, make(r)) for r in RADII])
        for k, law in enumerate(("restitution 1", "time of contact 2.9433 depth / speed, ratio")):
            worst = int(np.argmax(np.abs(found[:, k] - 1)))
            tried = f"{what}; worst of {len(RADII)}: r = {RADII[worst]:g} m"
            yield compare("impact", tried, law, 1.0, float(found[worst, k]), bound)
