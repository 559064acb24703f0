"""Balls that roll on a turntable, in a golf cup and on a curved track: closed forms, experiments.

The runs are those of the hard cases (benchmarks/rolling.py), with other balls.
"""

import math

import coal
import numpy as np

import sphshell_pin as sp
from sphshell_pin.study.report.swing import GRAVITY
from tests import meshes
from tests.rolling import Ball, in_bowl, in_cylinder, on_turntable, velocities
from tests.validation.balls import plane
from tests.validation.cases import Outcome, case, read, within
from tests.validation.pictures import Panel, Series

WOOD = 1e10  # Young's modulus [Pa]
RESISTANCE = 0.005
SHARE = 3e-5  # depth under the weight, over the radius: it does not count
FILE = "rolling_balls"


def wall(radius: float, angle: float, length: float, columns: int) -> sp.Shell:
    """Return the inside of a cylinder of `radius` and `length` [m] about y, `angle` [rad] from -z.

    It goes to both sides.
    """
    vertices, elements = meshes.grid_plate(columns, 1, quads=True)
    turn = 2 * angle * vertices[:, 0]
    inward = np.stack([-np.sin(turn), 0 * turn, np.cos(turn)], axis=1)
    place = length * vertices * [0.0, 1.0, 0.0] - radius * inward
    return sp.Shell(place, elements, normals=inward)


@case("turntable")
def turntable() -> Outcome:
    """Roll three balls two orbits each."""
    ratio = read(FILE).where("case", "turntable").published["ratio"]
    shell, ratios, misses = plane(1.0), [], []
    ours: list[Series] = []
    theory: list[Series] = []
    for mass, radius, rpm, place, velocity in (
        (0.002, 0.005, 20.0, (0.1, 0.0), (0.0, 0.05)),
        (0.050, 0.010, 100 / 3, (0.0, -0.05), (0.15, 0.0)),
        (0.900, 0.040, 78.0, (-0.1, 0.1), (0.0, 0.2)),
    ):
        turn = 2 * math.pi * rpm / 60
        stiffness = mass * GRAVITY / (SHARE * radius)
        run = on_turntable(
            Ball(mass, radius), shell, turn, place=place, velocity=velocity,
            stiffness=stiffness, bristles=stiffness,
        )  # fmt: skip
        ratios.append(run.ratio)
        # The velocity turns at `pace`: the center of the circle is at its left, v / pace away.
        pace = ratio * turn
        center = np.array(place) + np.array([-velocity[1], velocity[0]]) / pace
        size = math.hypot(*velocity) / pace
        path = run.result.q[:, :2]
        away = np.linalg.norm(path - center, axis=1)
        misses.append(np.abs(away / size - 1).max())
        around = np.linspace(0, 2 * math.pi, 181)
        ours.append((f"ours, {radius * 1e3:g} mm, {rpm:.3g} rpm", *(1e3 * path.T)))
        circle = center[:, None] + size * np.array([np.cos(around), np.sin(around)])
        theory.append(("circles at 2/7" if not theory else "_circle", *(1e3 * circle)))
    error = max(abs(seen / ratio - 1) for seen in ratios)
    findings = within(
        1e-4,
        ("orbit over table, largest error relative to 2/7", error),
        ("largest distance of a path from its circle, over the radius", max(misses)),
    )
    panel = Panel("x [mm]", "y [mm]", (), ours, theory, equal=True)
    return Outcome(findings, [panel])


@case("golf_ball")
def golf_ball() -> Outcome:
    """Roll the ball three times down and up again."""
    given = read(FILE).where("case", "cylinder").published
    radius, cup, orbit = given["ball radius [m]"], given["cup radius [m]"], 30.0
    shell = sp.Shell.from_geometry(coal.Cylinder(cup, 0.2), side="inside")
    run = in_cylinder(Ball(0.046, radius), shell, cup, orbit, stiffness=1e6)
    t, height = run.result.t, run.result.q[:, 2] - run.swing
    exact = run.swing * (np.cos(run.expected * orbit * t) - 1)
    bobbing = "frequency of bobbing over that of the orbit, error relative to sqrt(2/7)"
    fall = "height, largest distance from the closed form, over the depth of the fall"
    findings = within(1e-4, (bobbing, run.ratio / given["ratio"] - 1))
    findings += within(1e-3, (fall, np.abs(height - exact).max() / (2 * run.swing)))
    findings += within(1e-4, ("speed around that is lost in three swings", run.lost))
    ours, form = ("ours", t, 1e3 * height), ("closed form", t, 1e3 * exact)
    panel = Panel("time [s]", "height over the rim [mm]", (), [ours], [form])
    return Outcome(findings, [panel])


@case("curved_track")
def curved_track() -> Outcome:
    """Swing without rolling resistance, and compare force and period; then with it."""
    given = read(FILE).where("case", "track").published
    bend, angle = given["radius [m]"], given["displacement [m]"] / given["radius [m]"]
    ball = Ball(0.067, 0.0127)
    shell = wall(bend, 1.5 * angle, 0.05, columns=40)
    run = in_bowl(ball, shell, bend, angle, stiffness=1e6)
    result, weight = run.result, ball.mass * GRAVITY
    force = result.contacts.normal_force / weight
    turning = np.argmin(np.abs(result.t - run.expected / 2))
    tilt = np.arctan2(result.q[:, 0], -result.q[:, 2])
    # cos from gravity, and m v^2 / arm of the fall, of which rolling takes b / (1 + b).
    b = ball.beta()
    exact = np.cos(tilt) + 2 / (1 + b) * (np.cos(tilt) - math.cos(angle))
    speed = np.linalg.norm(velocities(result), axis=1)
    resisting = sp.MindlinFriction(1.0, 1.0, WOOD, 0.3, damping_time=1e-4, rolling=RESISTANCE)
    damped = in_bowl(ball, shell, bend, angle, stiffness=1e6, friction=resisting, periods=4).result
    place = bend * np.arctan2(damped.q[:, 0], -damped.q[:, 2])
    turns = 1 + np.flatnonzero(np.diff(np.sign(np.diff(place))))
    heights, count = np.abs(place[turns]), np.arange(1, turns.size + 1)
    line = np.polynomial.Polynomial.fit(count, heights, 1).convert()
    swings = [angle]
    for _ in turns:
        # The work of the resistance for each radian, to second order of the angle.
        swings.append(swings[-1] - 2 * RESISTANCE * (1 + 10 / 21 * (swings[-1] - RESISTANCE) ** 2))
    expected = bend * np.array(swings[1:])
    published, off = given["normal force over weight"], np.abs(force - exact)[20:].max()
    turned = "normal force over weight where the ball turns, relative to the published one"
    way = "normal force over weight on the way, largest distance from the closed form"
    damping = "amplitudes with rolling resistance, largest distance from {}, over the first"
    straight, lost = (np.abs(heights - one).max() / heights[0] for one in (line(count), expected))
    findings = within(0.005 / published, (turned, force[turning] / published - 1))
    what = "period, relative to the closed form"
    findings += within(1e-4, (what, run.period / run.expected - 1))
    findings += within(1e-3, (way, off))
    findings += within(0.01, (damping.format("a straight line"), straight))
    findings += within(1e-3, (damping.format("the closed form"), lost))
    t, start = result.t, given["displacement [m]"]
    ours = [("ours", t, bend * tilt), ("ours, rolling resistance", damped.t, place)]
    theory = [("closed form of amplitudes", damped.t[turns], expected)]
    places = [("published start", [0.0], [start])], ours, theory
    marks, theory = [("published, at the start", [0.0], [published])], [("closed form", t, exact)]
    panels = [
        Panel("time [s]", "place along the track [m]", *places),
        Panel("time [s]", "normal force / weight", marks, [("ours", t[1:], force[1:])], theory),
    ]
    bottom = float(exact[np.argmax(speed)])
    notes = [
        "The paper takes the force as constant, as it is 3 % less than the weight where the ball "
        f"turns. At the bottom, where the ball is fastest, it is {bottom:.3f} of the weight."
    ]
    return Outcome(findings, panels, notes=notes)
