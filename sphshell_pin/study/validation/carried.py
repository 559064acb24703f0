"""SimBenchmark's rolling test: a box is pushed over the ground, with 25 balls on it.

The box slides, F - mu (M + 25 m) g - 25 f = M a, and the balls roll on it, f = m a_ball,
a - a_ball = 5/2 a_ball. So f = (F - mu (M + 25 m) g) / (M 7/2 + 25 m) m, whatever the direction.
"""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.benchmarks.models import model_of
from sphshell_pin.benchmarks.rolling import Ball, turned
from sphshell_pin.benchmarks.swing import GRAVITY
from sphshell_pin.cases.contents import Finding, Table, columns
from sphshell_pin.study.validation.balls import plane
from sphshell_pin.study.validation.cases import Array, Outcome, case, read
from sphshell_pin.study.validation.pictures import Panel, draw

BOX, SIDES, FORCE = 10.0, np.array([20.0, 20.0, 1.0]), 150.0  # [kg], [m], [N]
BALL, SLIDES, ROLLS = Ball(1.0, 0.5), 0.4, 0.8  # coefficients of box on ground, ball on box
PLACES = [(x, y) for x in range(-4, 5, 2) for y in range(-4, 5, 2)]  # [m]
STIFF, FOOT = 1e6, 0.5  # [N/m]; radius of the spheres in the corners of the box [m]
LOAD = BOX + len(PLACES) * BALL.mass
DURATIONS = {90.0: 4.0, 60.0: 4.0, 45.0: 1.0, 0.0: 1.0}
"""Of pushes [s] by direction [deg]: SimBenchmark's "along y" and "diagonal", and two more."""
SETTLED = 0.25  # [s]: the springs take up the force
_ball = (FORCE - SLIDES * LOAD * GRAVITY) / (3.5 * BOX + len(PLACES) * BALL.mass)
EXACT = np.array([3.5 * _ball, _ball])  # accelerations of box and ball [m/s^2]


def push_box(angle: float, duration: float) -> tuple[Array, Array, Array]:
    """Push at `angle` [deg]; return t (n,), and velocities of box and first ball, both (n, 2).

    The first are those along the force, the second the speeds across it.
    """
    inertia = pin.Inertia.FromBox(BOX, *SIDES)
    balls = [f"ball{k}" for k in range(len(PLACES))]
    round_one = pin.Inertia.FromSphere(BALL.mass, BALL.radius)
    bodies = [("box", inertia), *((name, round_one) for name in balls)]
    model = model_of(
        *((name, pin.JointModelFreeFlyer(), one) for name, one in bodies), gravity=GRAVITY
    )
    scene = sp.Scene(model)
    share = LOAD / 4  # [kg] on a corner, as deep as a ball
    feet = Ball(share, FOOT)
    stiff = STIFF * share / BALL.mass
    reach, ground = SIDES / 2 - FOOT, plane(100.0)
    for k in range(4):
        offset = (reach[0] * (-1) ** k, reach[1] * (-1) ** (k // 2), -reach[2])
        scene.add_contact(
            sp.Sphere(FOOT, "box", offset=offset),
            ground,
            law=feet.spring(stiff),
            friction=feet.bristle(SLIDES, stiff, share),
            name=f"corner{k}",
        )
    top = pin.SE3(np.eye(3), np.array([0.0, 0.0, SIDES[2] / 2]))
    for name in balls:
        scene.add_contact(
            sp.Sphere(BALL.radius, name),
            plane(SIDES[0] / 2),
            "box",
            top,
            BALL.spring(STIFF),
            BALL.bristle(ROLLS, STIFF / 10),
            name=name,
        )
    depth = BALL.mass * GRAVITY / STIFF
    middle = SIDES[2] / 2 - depth
    places = [(0.0, 0.0, middle)]
    places += [(x, y, middle + SIDES[2] / 2 + BALL.radius - depth) for x, y in PLACES]
    q0 = np.concatenate([[*place, 0.0, 0.0, 0.0, 1.0] for place in places])
    along = np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle)), 0.0])
    push = np.zeros(model.nv)
    push[:3] = FORCE * along
    result = sp.Simulation(scene, sp.RungeKutta4(2e-4)).run(
        q0, None, duration, lambda t, q, v, contacts: push, record_dt=0.01
    )
    along_it, across = [], []
    for k in (0, 1):
        q, v = result.q[:, 7 * k :], result.v[:, 6 * k :]
        velocity = turned(q[:, 3:7], v[:, :3])
        along_it.append(velocity @ along)
        across.append(np.linalg.norm(np.cross(velocity, along), axis=1))
    return result.t, np.stack(along_it, axis=1), np.stack(across, axis=1)


def accelerations(t: Array, speeds: Array) -> Array:
    """Return the accelerations of box and ball [m/s^2] after the start."""
    late = t >= SETTLED
    slopes: Array = np.polyfit(t[late], speeds[late], 1)[0]
    return slopes


@case("carried_balls")
def carried_balls() -> Outcome:
    """Push in four directions, and compare accelerations and SimBenchmark's error."""
    data = read("simbenchmark_rolling")
    runs = {angle: push_box(angle, duration) for angle, duration in DURATIONS.items()}
    slopes = np.array([accelerations(t, speeds) for t, speeds, _ in runs.values()])
    worst = np.abs(slopes / EXACT - 1).max(axis=0)
    errors = [
        float(np.sum((speeds - np.outer(t, EXACT)) ** 2 + across**2, axis=1).mean())
        for t, speeds, across in (runs[90.0], runs[60.0])
    ]
    aside = max(float((across[-1] / speeds[-1]).max()) for _, speeds, across in runs.values())
    theirs = {name: data[name] for name in ("along y", "diagonal")}
    findings = [
        Finding("box", f"box, four directions, acceleration relative to {EXACT[0]:.4f} m/s²",
                worst[0], aim=1e-4),
        Finding("balls", f"ball, four directions, acceleration relative to {EXACT[1]:.3f} m/s²",
                worst[1], aim=1e-4),
        Finding("aside", "speed across the force, over that along it", aside, aim=1e-5),
        *(
            Finding(name, f"SimBenchmark's error, {name}", error, "m²/s²", aim=1e-5)
            for name, error in zip(theirs, errors, strict=True)
        ),
    ]  # fmt: skip
    rows = [("ours", *errors), *zip(data.texts("engine"), *theirs.values(), strict=True)]
    table = Table(
        "simbenchmark",
        "SimBenchmark's error of velocities [m²/s²].",
        columns("engine", *theirs),
        rows,
    )
    t, speeds, _ = runs[60.0]
    motion = [("box, 60°", t, speeds[:, 0]), ("ball, 60°", t, speeds[:, 1])]
    exact = [("closed form", t, EXACT[0] * t), ("_ball", t, EXACT[1] * t)]
    panel = Panel("time [s]", "speed along the force [m/s]", (), motion, exact)
    caption = "Speeds of box and balls."
    return Outcome(findings, [draw("carried_balls", [panel], caption)], tables=[table])
