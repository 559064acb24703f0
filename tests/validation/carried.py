"""SimBenchmark's rolling test: a box is pushed over the ground, with 25 balls on it.

The box slides, F - mu (M + 25 m) g - 25 f = M a, and the balls roll on it, f = m a_ball,
a - a_ball = 5/2 a_ball. So f = (F - mu (M + 25 m) g) / (M 7/2 + 25 m) m, whatever the direction.
"""

import math

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report.contents import Table, columns
from sphshell_pin.study.report.models import model_of
from sphshell_pin.study.report.swing import GRAVITY
from tests.rolling import Ball, turned
from tests.validation.balls import plane
from tests.validation.cases import Outcome, case, read, within
from tests.validation.pictures import Panel

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
    free, names = pin.JointModelFreeFlyer(), [f"ball{k}" for k in range(len(PLACES))]
    round_one = pin.Inertia.FromSphere(BALL.mass, BALL.radius)
    bodies = [("box", free, pin.Inertia.FromBox(BOX, *SIDES))]
    model = model_of(*bodies, *((name, free, round_one) for name in names), gravity=GRAVITY)
    scene = sp.Scene(model)
    feet = Ball(LOAD / 4, FOOT)  # as deep as a ball
    stiff = STIFF * feet.mass / BALL.mass
    laws = feet.spring(stiff), feet.bristle(SLIDES, stiff, feet.mass)
    reach, ground = SIDES / 2 - FOOT, plane(100.0)
    for k in range(4):
        offset = (reach[0] * (-1) ** k, reach[1] * (-1) ** (k // 2), -reach[2])
        sphere = sp.Sphere(FOOT, "box", offset=offset)
        scene.add_contact(sphere, ground, "universe", None, *laws, name=f"corner{k}")
    top = "box", pin.SE3(np.eye(3), np.array([0.0, 0.0, SIDES[2] / 2]))
    laws, shell = (BALL.spring(STIFF), BALL.bristle(ROLLS, STIFF / 10)), plane(SIDES[0] / 2)
    for name in names:
        scene.add_contact(sp.Sphere(BALL.radius, name), shell, *top, *laws, name=name)
    depth = BALL.mass * GRAVITY / STIFF
    height = SIDES[2] - depth + BALL.radius - depth
    places = [(0.0, 0.0, SIDES[2] / 2 - depth), *((x, y, height) for x, y in PLACES)]
    q0 = np.concatenate([[*place, 0.0, 0.0, 0.0, 1.0] for place in places])
    along = np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle)), 0.0])
    push = np.zeros(model.nv)
    push[:3] = FORCE * along
    simulation, control = sp.Simulation(scene, sp.RungeKutta4(2e-4)), lambda *_: push
    result = simulation.run(q0, None, duration, control, record_dt=0.01)
    turns, moves = (result.q[:, 3:7], result.q[:, 10:14]), (result.v[:, :3], result.v[:, 6:9])
    both = np.stack([turned(*one) for one in zip(turns, moves, strict=True)], axis=1)
    return result.t, both @ along, np.linalg.norm(np.cross(both, along), axis=2)


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
    box, ball = np.abs(slopes / EXACT - 1).max(axis=0)
    off = [(speeds - np.outer(t, EXACT), across) for t, speeds, across in (runs[90.0], runs[60.0])]
    errors = [float(np.sum(one**2 + across**2, axis=1).mean()) for one, across in off]
    aside = max(float((across[-1] / speeds[-1]).max()) for _, speeds, across in runs.values())
    theirs = {name: data[name] for name in ("along y", "diagonal")}
    what = "four directions, acceleration relative to"
    findings = [
        *within(1e-4, (f"box, {what} {EXACT[0]:.4f} m/s²", box)),
        *within(1e-4, (f"ball, {what} {EXACT[1]:.3f} m/s²", ball)),
        *within(1e-5, ("speed across the force, over that along it", aside)),
        *within(1e-5, ("SimBenchmark's error, along y", errors[0]), unit="m²/s²"),
        *within(1e-5, ("SimBenchmark's error, diagonal", errors[1]), unit="m²/s²"),
    ]
    rows = [("ours", *errors), *zip(data.texts("engine"), *theirs.values(), strict=True)]
    what = "SimBenchmark's error of velocities [m²/s²]."
    table = Table("simbenchmark", what, columns("engine", *theirs), rows)
    t, speeds, _ = runs[60.0]
    motion = [("box, 60°", t, speeds[:, 0]), ("ball, 60°", t, speeds[:, 1])]
    exact = [("closed form", t, EXACT[0] * t), ("_ball", t, EXACT[1] * t)]
    panel = Panel("time [s]", "speed along the force [m/s]", (), motion, exact)
    return Outcome(findings, [panel], tables=[table])
