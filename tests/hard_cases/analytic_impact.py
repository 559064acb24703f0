"""Impacts. A ball of 10 mm and 50 g meets a flat plate; no gravity but for the bouncing ball.

Undamped, `F = k depth^e` gives back all energy; the largest depth is
`((e + 1) m v^2 / (2 k))^(1 / (e + 1))` and the time of touch `2 I depth / v` with
`I = sqrt(pi) Gamma(1 + 1/(e+1)) / Gamma(1/2 + 1/(e+1))`; for Hertz's e = 3/2 that is
2.943 depth / v (Johnson, *Contact Mechanics*, 11.24). Times are those of the events.
"""

import math

import numpy as np

import sphshell_pin as sp
from sphshell_pin.study.report.closed_forms import FALL, bounce
from tests import models
from tests.hard_cases import balls
from tests.hard_cases.verdict import Verdict, Verdicts, at_most, case, compare

PRECISE = sp.Adaptive(1e-9)
GAP = 1e-4
STEEL = sp.ImpactLaw.hertz(balls.RADIUS, 2.1e11, 0.3, 2.1e11, 0.3)
FIXED = ((sp.SemiImplicitEuler, 1), (sp.LinearlyImplicitEuler, 1), (sp.RungeKutta4, 4))
BY_TOLERANCE = ((sp.Adaptive, (1e-4, 1e-9)), (sp.Implicit, (1e-3, 1e-7)))


def impact(law: sp.ImpactLaw, speed: float, expected: float) -> tuple[float, ...]:
    """Shoot the ball at the plate; `expected` [s] is about how long it stays in touch.

    Return when it touched and how long [s], its largest depth [m], speed back over speed.
    """
    scene = balls.scene_of(models.square(), law, model=balls.free_ball(gravity=0.0))
    q0, v0 = balls.state([0.1, 0.03, balls.RADIUS + GAP], [0.0, 0.0, -speed])
    duration = GAP / speed + 2 * expected
    result = sp.Simulation(scene, PRECISE).run(q0, v0, duration, record_dt=expected / 4000)
    (touch,), (left,) = balls.event_times(result, "touch"), balls.event_times(result, "lift_off")
    depth, back = balls.RADIUS - result.q[:, 2].min(), balls.velocities(result)[-1, 2]
    return touch, left - touch, float(depth), float(back) / speed


def touch_time(exponent: float, depth: float, speed: float) -> float:
    share = 1 / (exponent + 1)
    integral = math.sqrt(math.pi) * math.gamma(1 + share) / math.gamma(0.5 + share)
    return 2 * integral * depth / speed


@case("impact without damping")
def undamped() -> Verdicts:
    soft = sp.ImpactLaw(1e5, 1.0)
    for title, law, speed in (
        ("spring", soft, 1.0),
        ("Hertz, steel", STEEL, 0.1),
        ("Hertz, steel", STEEL, 10.0),
        ("exponent 2.2", sp.ImpactLaw(1e9, 2.2), 1.0),
    ):
        e = law.exponent
        depth = ((e + 1) * balls.MASS * speed**2 / (2 * law.stiffness)) ** (1 / (e + 1))
        duration = touch_time(e, depth, speed)
        tried = f"{title}, {speed:g} m/s"
        laws = (
            ("time of the touch", "gap / v", GAP / speed),
            ("time in touch", "2 I depth / v", duration),
            ("largest depth", "((e + 1) m v^2 / (2 k))^(1 / (e + 1))", depth),
            ("restitution", "1", 1.0),
        )
        for (what, *expected), seen in zip(laws, impact(law, speed, duration), strict=True):
            yield compare(what, tried, *expected, seen, 1e-6)


def hops(stiffness: float, height: float, end: float, integrator: object) -> tuple[float, float]:
    """Return height [m] and speed [m/s] of a ball `end` [s] after its release on a spring."""
    model = models.slider(balls.GRAVITY, balls.MASS)
    scene = balls.scene_of(models.square(), sp.ImpactLaw(stiffness, 1.0), model=model)
    result = sp.Simulation(scene, integrator).run([balls.RADIUS + height], None, end)
    return float(result.q[-1, 0] - balls.RADIUS), float(result.v[-1, 0])


def bouncing_error(integrator: object) -> float:
    """Return the error after five bounces, in the sixth flight, over the height of fall."""
    stiffness, end = 1e4, 0.75
    at, speed = hops(stiffness, FALL, end, integrator)
    z, exact = bounce(np.array(end), stiffness)
    return math.hypot((at - z) / FALL, (speed - exact) / math.sqrt(2 * balls.GRAVITY * FALL))


def oscillation_error(integrator: object) -> float:
    """Return the error of a ball that bobs on a spring without leaving it, over its amplitude."""
    stiffness, end = 1e4, 0.05
    omega, sag = math.sqrt(stiffness / balls.MASS), balls.MASS * balls.GRAVITY / stiffness
    start = 0.8 * sag
    at, speed = hops(stiffness, start - sag, end, integrator)
    z, exact = math.cos(omega * end), -math.sin(omega * end)
    return math.hypot((at + sag) / start - z, speed / (start * omega) - exact)


def order_by_step(error, integrator, steps):
    """Return the order seen between the last two steps [s]."""
    coarse, fine = (error(integrator(dt)) for dt in steps)
    return math.log(coarse / fine) / math.log(steps[0] / steps[1])


def by_tolerance(error, integrator, span, tried, law, unit):
    """Yield the verdicts on the power of the tolerance with which an error falls, and the last.

    A higher power is no fault.
    """
    tolerances, name = np.geomspace(*span, 6), integrator.__name__
    errors = [error(integrator(float(rtol))) for rtol in tolerances]
    power = float(np.polyfit(np.log(tolerances), np.log(errors), 1)[0])
    about = "error ~ rtol^p, p about 0.8 to 1, or better"
    what = f"{name}, rtol {span[0]:g} to {span[1]:g}"
    yield Verdict.on(what, tried, about, ">= 0.8", power, max(0.0, 0.8 - power), 0.05)
    yield at_most(f"{name}({span[1]:g}){unit}", tried, law, errors[-1], 1e2 * span[1])


@case("order of the fixed steps")
def fixed_orders() -> Verdicts:
    for integrator, order in FIXED:
        steps = (1e-4, 5e-5) if order == 4 else (1e-5, 5e-6)
        seen = order_by_step(oscillation_error, integrator, steps)
        name, tried = integrator.__name__, "ball that bobs on a spring, m z'' = -m g + k depth"
        yield compare(f"order of {name}", tried, "error ~ dt^p", order, seen, 0.1, scale=1.0)


@case("error against tolerance")
def tolerances() -> Verdicts:
    for integrator, span in BY_TOLERANCE:
        for tried, error, law in (
            ("ball that bobs on a spring", oscillation_error, "cosine"),
            ("five bounces on a spring", bouncing_error, "closed form of flights and touches"),
        ):
            yield from by_tolerance(error, integrator, span, tried, law, "")
