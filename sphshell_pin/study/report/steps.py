"""What a step of a Panda with a fingertip on 200 k triangles costs, by its parts.

Semi-implicit Euler of a Panda with locked fingers and a 12 mm fingertip on a wavy sheet of 200 k
triangles, forces, losses and figures of every pair included, against Pinocchio's ABA and integrate
alone, in a compiled loop.
"""

import time
from collections.abc import Callable

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin import robots
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.run.advance import AnyController
from sphshell_pin.study.report import contents
from sphshell_pin.study.report.surfaces import wavy_sheet
from sphshell_pin.study.report.timing import silent, take_turns

Times = dict[str, Array]
DT, STEPS, RADIUS = 1e-5, 5000, 0.012
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")  # locked
START = np.array([0, 0.35, 0, -2.0, 0, 2.35, 0.8])
PRESSED, AWAY = 5e-4, -1.0  # of the sheet above the height at which it just touches [m]
LAW = sp.ImpactLaw(1e4, 1.5, 50.0, 1e-4)
FRICTION = sp.CoulombFriction(0.3, 0.2, 0.01, 0.1)


def panda() -> sp.Scene:
    """Return the Panda without contacts."""
    return sp.Scene(robots.load("panda").model, lock=FINGERS)


def with_sheet(scene: sp.Scene, shell: sp.Shell, rise: float) -> sp.Scene:
    """Put the sheet under the fingertip, `rise` [m] above the height at which it just touches."""
    data, tip = scene.model.createData(), "panda_hand_tcp"
    pin.framesForwardKinematics(scene.model, data, START)
    place = data.oMf[scene.model.getFrameId(tip)].translation
    placement = pin.SE3(np.eye(3), place + [0, 0, rise - RADIUS])
    ball = sp.Sphere(RADIUS, tip)
    scene.add_contact(ball, shell, placement=placement, law=LAW, friction=FRICTION)
    return scene


def runner(scene: sp.Scene, controller: AnyController = None) -> Callable[[], float]:
    """Seconds per step of a run that records two rows."""
    simulation = sp.Simulation(scene, sp.SemiImplicitEuler(DT))

    def run() -> float:
        result = simulation.run(START, None, STEPS * DT, controller, record_dt=STEPS * DT)
        return float(result.stats.wall_time) / STEPS

    return run


def bare(scene: sp.Scene) -> Callable[[], float]:
    """Seconds per step of ABA and integrate alone, of many states at once in Pinocchio's loop.

    All joints must be revolute or prismatic: then integrate is a sum.
    """
    model = scene.model
    pool = pin.ModelPool(model, 1)
    start = np.asfortranarray(np.tile(START[:, None], STEPS))
    torque, acceleration = np.zeros((2, STEPS, model.nv))

    def run() -> float:
        states, velocities = start.copy(order="F"), np.zeros_like(start)
        begin = time.perf_counter()
        pin.abaInParallel(1, pool, states, velocities, torque.T, acceleration.T)
        velocities += DT * acceleration.T
        states += DT * velocities
        return (time.perf_counter() - begin) / STEPS

    return run


BARE, FREE, FAR = "ABA + integrate alone, C++", "scene without contact", "far sphere"
TOUCHING = "touching, damping and friction"
CONTROL_FREE, CONTROL_TOUCHING = "joint PD + gravity, no contact", "joint PD + gravity, touching"


def measure(rounds: int, progress: contents.Progress = silent) -> Times:
    """Return the times of a step [s] of every kind."""
    shell = sp.Shell(*wavy_sheet(316, 1.0))
    pd = sp.JointPD(100.0, 10.0)
    runs = {
        BARE: bare(panda()),
        FREE: runner(panda()),
        FAR: runner(with_sheet(panda(), shell, AWAY)),
        TOUCHING: runner(with_sheet(panda(), shell, PRESSED)),
        CONTROL_FREE: runner(panda(), pd),
        CONTROL_TOUCHING: runner(with_sheet(panda(), shell, PRESSED), pd),
    }
    return take_turns(runs, rounds, progress)


KEY, TITLE = "steps", "Cost of a step"


def section(*, quick: bool, progress: contents.Progress) -> contents.Section:
    """Measure and return the section."""
    return assemble(measure(8 if quick else 50, progress))


def assemble(steps: Times) -> contents.Section:
    """Return the section of what was measured."""
    bare, ratio = steps[BARE], contents.Finding.of_rounds
    touching = "Panda and fingertip touching 200 k triangles: whole step / bare ABA + integrate"
    control = "Panda with joint PD and gravity compensation: step touching / without any contact"
    controlled = steps[CONTROL_TOUCHING] / steps[CONTROL_FREE]
    findings = [
        ratio("step_touching", touching, steps[TOUCHING] / bare, aim=1.8),
        ratio("step_far", "the same with the sphere far away", steps[FAR] / bare),
        ratio("step_control", control, controlled, aim=1.35),
    ]
    caption, over = "Whole steps, in turn in one process.", "over_bare: over ABA + integrate"
    tables = [contents.times_table("steps", caption, "scene", steps, BARE, over)]
    return contents.Section(KEY, TITLE, contents.about(__doc__), findings, tables=tables)
