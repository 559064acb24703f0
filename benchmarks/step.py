"""Cost of one simulation step of a Panda with a fingertip on 200 k triangles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

import sphshell_pin as sp
from sphshell_pin import _core, robots
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


def tip_position(scene: sp.Scene, q: Array) -> Array:
    data = scene.model.createData()
    pin.framesForwardKinematics(scene.model, data, q)
    tip: Array = data.oMf[scene.model.getFrameId("panda_hand_tcp")].translation
    return tip


def with_sheet(scene: sp.Scene, shell: sp.Shell, rise: float, **settings: Any) -> sp.Scene:
    """Put the sheet under the fingertip, `rise` [m] above the height at which it just touches."""
    q = START if scene.model.nq == len(START) else np.r_[START, 0.02, 0.02]
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
    q = START if scene.model.nq == len(START) else np.r_[START, 0.02, 0.02]

    def run() -> float:
        result = simulation.run(q, None, STEPS * DT, controller, record_dt=STEPS * DT)
        return float(result.stats.wall_time) / STEPS

    return run


def bare(scene: sp.Scene) -> Callable[[], float]:
    """Seconds per step of ABA and integrate alone."""
    model = scene.model
    q = START if model.nq == len(START) else np.r_[START, 0.02, 0.02]
    return lambda: float(_core.bare_dynamics(model, q, np.zeros(model.nv), DT, STEPS))


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


PARTS = ("kinematics", "query", "law", "aba", "integrate")


def measure_parts(rounds: int, progress: Progress = silent) -> dict[str, dict[str, Array]]:
    """Return the times [s] of the parts of a step and of the whole of it, by scene.

    The parts are timed one by one at the first state, the whole in a run. Of ABA and integrate
    alone there is the whole.
    """
    shell = sp.Shell(*wavy_sheet(316, 1.0))
    scenes = {FREE: panda(), FAR: with_sheet(panda(), shell, -1.0)}
    scenes[TOUCHING] = with_sheet(panda(), shell, 5e-4)
    runs = {name: runner(scene) for name, scene in scenes.items()}
    alone = bare(panda())
    found: dict[str, dict[str, list[float]]] = {
        name: {what: [] for what in (*PARTS, "whole")} for name in scenes
    }
    found[BARE] = {"whole": []}
    for turn in range(rounds + 1):
        times = {BARE: {"whole": alone()}}
        for name, scene in scenes.items():
            times[name] = {**parts_of(scene), "whole": runs[name]()}
        if turn > 0:  # the first warms up
            for name, parts in times.items():
                for what, seconds in parts.items():
                    found[name][what].append(seconds)
        progress((turn + 1) / (rounds + 1))
    return {name: {what: np.array(t) for what, t in times.items()} for name, times in found.items()}


def parts_of(scene: sp.Scene) -> dict[str, float]:
    """Return the times [s] of the parts of a step at the start."""
    pairs = [pair.to_core() for pair in scene.pairs]
    times: dict[str, float] = _core.step_parts(
        scene.model, pairs, START, np.zeros(scene.model.nv), DT, STEPS
    )
    return times


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
