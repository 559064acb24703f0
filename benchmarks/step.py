"""Cost of one simulation step of a Panda with a fingertip on 200 k triangles."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

import sphshell_pin as sp
from sphshell_pin import robots
from sphshell_pin.benchmarks.surfaces import wavy_sheet
from sphshell_pin.benchmarks.timing import Progress, median_us, ratio, silent, take_turns

Array = NDArray[np.float64]
DT, STEPS, RADIUS = 1e-5, 5000, 0.012
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")
START = np.array([0, 0.35, 0, -2.0, 0, 2.35, 0.8])
LAW = sp.ImpactLaw(1e4, 1.5, 50.0, 1e-4)
UNDAMPED = sp.ImpactLaw(1e4, 1.5)
FRICTION = sp.CoulombFriction(0.3, 0.2, 0.01, 0.1)


def panda(lock: tuple[str, ...] = FINGERS) -> sp.Scene:
    """Return the Panda without contacts."""
    return sp.Scene(robots.load("panda").model, lock=lock)


def start_of(scene: sp.Scene) -> Array:
    """Return the start (nq,) of the arm, with open fingers if they are not locked."""
    return START if scene.model.nq == len(START) else np.r_[START, 0.02, 0.02]


def tip_position(scene: sp.Scene, q: Array) -> Array:
    data = scene.model.createData()
    pin.framesForwardKinematics(scene.model, data, q)
    tip: Array = data.oMf[scene.model.getFrameId("panda_hand_tcp")].translation
    return tip


def with_sheet(scene: sp.Scene, shell: sp.Shell, rise: float, **settings: Any) -> sp.Scene:
    """Put the sheet under the fingertip, `rise` [m] above the height at which it just touches."""
    q = start_of(scene)
    place = tip_position(scene, q) + [0, 0, rise - RADIUS]
    settings = {"law": LAW, "friction": FRICTION, **settings}
    scene.add_contact(
        sphere=sp.Sphere(RADIUS, "panda_hand_tcp"),
        shell=shell,
        placement=pin.SE3(np.eye(3), place),
        **settings,
    )
    return scene


def runner(scene: sp.Scene, controller: Any = None) -> Callable[[], float]:
    """Seconds per step of a run that records two rows."""
    simulation = sp.Simulation(scene, sp.SemiImplicitEuler(DT))
    q = start_of(scene)

    def run() -> float:
        result = simulation.run(q, None, STEPS * DT, controller, record_dt=STEPS * DT)
        return float(result.stats.wall_time) / STEPS

    return run


def bare(scene: sp.Scene) -> Callable[[], float]:
    """Seconds per step of ABA and integrate alone, of many states at once in Pinocchio's loop.

    All joints must be revolute or prismatic: then integrate is a sum.
    """
    model = scene.model
    pool = pin.ModelPool(model, 1)
    q = start_of(scene)
    start = np.asfortranarray(np.tile(q[:, None], STEPS))
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


def measure_step(rounds: int, progress: Progress = silent) -> dict[str, Array]:
    """Return the times of a step [s], by what the scene holds."""
    shell = sp.Shell(*wavy_sheet(316, 1.0))
    pd = sp.JointPD(100.0, 10.0)
    return take_turns(
        {
            BARE: bare(panda()),
            FREE: runner(panda()),
            FAR: runner(with_sheet(panda(), shell, -1.0)),
            TOUCHING: runner(with_sheet(panda(), shell, 5e-4)),
            CONTROL_FREE: runner(panda(), pd),
            CONTROL_TOUCHING: runner(with_sheet(panda(), shell, 5e-4), pd),
        },
        rounds,
        progress,
    )


def step_cost(rounds: int) -> None:
    """Print whole step against bare ABA + integrate, and touching against free with control."""
    times = measure_step(rounds)
    print("Step, Panda and fingertip on 199712 triangles, against ABA + integrate")
    for name, t in times.items():
        print(f"  {name:40s} {median_us(t)}   {ratio(t, times[BARE])} x")
    share = ratio(times[CONTROL_TOUCHING], times[CONTROL_FREE])
    print(f"  {'with control: touching / no contact':40s} {'':12s}   {share} x")


PARTS = ("aba", "stepping", "contact")


def parts_of(times: dict[str, Array]) -> dict[str, dict[str, Array]]:
    """Return the parts of a step [s] from the times of `measure_step`, by scene.

    "aba": ABA and integrate; "stepping": what a scene without contact takes beyond them; "contact":
    what a scene takes beyond one without contact (kinematics, query, law and wrench).
    """
    stepping = times[FREE] - times[BARE]
    return {
        name: {"aba": times[BARE], "stepping": stepping, "contact": times[name] - times[FREE]}
        for name in (FREE, FAR, TOUCHING)
    }


def with_moving_sheet(shell: sp.Shell) -> sp.Scene:
    """Let the Panda carry the sheet on its hand and touch a fixed ball with it.

    The same joints move; the wrench acts on the shell's side instead of the sphere's.
    """
    scene = panda()
    tip = tip_position(scene, START)
    data = scene.model.createData()
    pin.framesForwardKinematics(scene.model, data, START)
    hand = data.oMf[scene.model.getFrameId("panda_hand_tcp")]
    sheet_world = pin.SE3(np.eye(3), tip + [0, 0, 5e-4 - RADIUS])
    scene.add_contact(
        sphere=sp.Sphere(RADIUS, "universe", tuple(tip)),
        shell=shell,
        frame="panda_hand_tcp",
        placement=hand.actInv(sheet_world),
        law=UNDAMPED,
    )
    return scene


def measure_ingredients(rounds: int, progress: Progress = silent) -> dict[str, Array]:
    """Return the times of a step [s] of scenes that differ by one ingredient."""
    shell = sp.Shell(*wavy_sheet(316, 1.0))

    def touching(**settings: Any) -> sp.Scene:
        return with_sheet(panda(), shell, 5e-4, **settings)

    two = touching(law=UNDAMPED, friction=None)
    with_sheet(two, shell, 5e-4, law=UNDAMPED, friction=None)
    far = with_sheet(
        touching(law=UNDAMPED, friction=None), shell, -1.0, law=UNDAMPED, friction=None
    )

    def zero(t: float, q: Array, v: Array, contacts: sp.dynamics.SceneContacts) -> Array:
        return np.zeros_like(v)

    return take_turns(
        {
            "no contact": runner(panda()),
            "fingers not locked, no contact": runner(panda(lock=())),
            "far sphere, no damping, no friction": runner(
                with_sheet(panda(), shell, -1.0, law=UNDAMPED, friction=None)
            ),
            "touching, no damping, no friction": runner(touching(law=UNDAMPED, friction=None)),
            "... and damping": runner(touching(friction=None)),
            "... and friction": runner(touching(law=UNDAMPED)),
            "... and a far second sphere": runner(far),
            "... and a touching second sphere": runner(two),
            "... and the shell on a moving body": runner(with_moving_sheet(shell)),
            "... and a Python controller": runner(touching(law=UNDAMPED, friction=None), zero),
        },
        rounds,
        progress,
    )


def ingredients(rounds: int) -> None:
    """Print what each ingredient of a scene adds to the step."""
    times = measure_ingredients(rounds)
    base = times["no contact"]
    print("What an ingredient adds to the step")
    for name, t in times.items():
        added = np.median(t - base) * 1e6
        print(f"  {name:40s} {median_us(t)}   {added:+9.3f} us")
