"""A ball that rolls off a fixed ball: where it slips and where it leaves, in closed form.

At the angle a from the top N / m = g (cos(a) - w), w = (R + r) a'^2 / g. It rolls with
(1 + b) w = 2 (cos(a0) - cos(a)), b = 2/5, until b / (1 + b) sin(a) exceeds mu (cos(a) - w); then it
slips with w' = 2 (sin(a) - mu (cos(a) - w)), which is linear. It leaves where w = cos(a).
"""

import math

import numpy as np

import sphshell_pin as sp
from sphshell_pin.contact.normal_law import bisect
from sphshell_pin.study.report.swing import GRAVITY
from tests.rolling import Ball, state
from tests.validation.cases import Outcome, case, within
from tests.validation.pictures import Panel

BALL, BIG = Ball(0.1, 0.02), 0.2  # [kg], [m]; radius of the fixed one [m]
START = 1e-3  # [rad] from the top, at rest
STIFF, LIGHTLY = 1e7, 0.01  # [N/m]; a damper that holds the ball delays the lift-off
STICKS = 1e5  # coefficient: near the lift-off any finite one lets the ball slip
COEFFICIENTS = (0.0, 0.05, 0.2, 0.8, 3.2, STICKS)


def leaving_angle(mu: float) -> float:
    """Return the angle [rad] from the top where the ball leaves."""
    top, b = math.cos(START), 0.4

    def rolling(a: float) -> float:
        return 2 * (top - math.cos(a)) / (1 + b)

    def unheld(a: float) -> float:
        return b / (1 + b) * math.sin(a) - mu * (math.cos(a) - rolling(a))

    slips = bisect(unheld, START, math.pi / 2) if mu else START
    first = (4 * mu**2 - 2) / (1 + 4 * mu**2)
    second = 2 * mu * (first - 1)

    def particular(a: float) -> float:
        return first * math.cos(a) + second * math.sin(a)

    def slipping(a: float) -> float:
        grown = (rolling(slips) - particular(slips)) * math.exp(2 * mu * (a - slips))
        return particular(a) + grown - math.cos(a)

    # From w = 0 at the start, where a ball without friction slips at once.
    return bisect(slipping, slips, min(slips + 5 / max(mu, 1e-9), math.pi / 2))


def roll_off(mu: float) -> float:
    """Return the angle [rad] where the contact of a run ends."""
    law = BALL.spring(STIFF, LIGHTLY)
    depth = law.depth_at(BALL.mass * GRAVITY * math.cos(START))
    friction = BALL.bristle(mu, STIFF) if mu else None
    scene = sp.Scene(BALL.model())
    balls = sp.Sphere(BALL.radius, "ball"), sp.Sphere(BIG, "universe")
    scene.add_contact(*balls, law=law, friction=friction)
    reach = BIG + BALL.radius - depth
    above = reach * np.array([math.sin(START), 0.0, math.cos(START)])
    q0, v0 = state(above, np.zeros(3), np.zeros(3))
    pace = math.sqrt(GRAVITY / reach / 1.4)
    duration = math.log(4 / START) / pace
    result = sp.Simulation(scene, sp.Adaptive(1e-9)).run(q0, v0, duration, record_dt=1e-4)
    left = next(event.t for event in result.events if event.kind == "lift_off")
    angle = np.arctan2(result.q[:, 0], result.q[:, 2])
    return float(np.interp(left, result.t, angle))


@case("ball_leaves_ball")
def ball_leaves_ball() -> Outcome:
    """Roll down with every coefficient, from none to one that sticks until the end."""
    left = {mu: roll_off(mu) for mu in COEFFICIENTS}
    errors = [abs(angle / leaving_angle(mu) - 1) for mu, angle in left.items()]
    off = "error of the angle, relative"
    findings = within(
        1e-4,
        (f"sticks, acos(10/17), {off}", left[STICKS] / math.acos(10 / 17) - 1),
        (f"frictionless, acos(2/3), {off}", left[0.0] / math.acos(2 / 3) - 1),
        (f"six coefficients, closed form, {off}", max(errors)),
    )
    fine = np.linspace(0.0, 3.5, 141)
    shown = [mu for mu in COEFFICIENTS if mu <= fine[-1]]
    curve = np.degrees([leaving_angle(mu) for mu in fine])
    ends = [np.full(fine.size, math.degrees(math.acos(one))) for one in (2 / 3, 10 / 17)]
    panel = Panel(
        "coefficient of friction",
        "angle of leaving [deg]",
        [("ours", shown, np.degrees([left[mu] for mu in shown]))],
        (),
        [("closed form; acos(2/3), acos(10/17)", fine, curve), *(("_end", fine, y) for y in ends)],
    )
    return Outcome(findings, [panel])
