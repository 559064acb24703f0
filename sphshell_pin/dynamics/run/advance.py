"""Starts compiled runs and makes results of what they recorded: for run, open run and rollout."""

from __future__ import annotations

import functools
import math
import os
import resource
import signal
import threading
import warnings
from collections.abc import Callable, Collection
from types import FrameType
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sphshell_pin import _core, errors
from sphshell_pin.base import checks
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.regular_file import read_text
from sphshell_pin.dynamics.control import controllers
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_parts import RunState, check_record
from sphshell_pin.dynamics.result.run_stats import JointFigures, PairFigures, RunStats
from sphshell_pin.dynamics.run.integrators import Integrator
from sphshell_pin.dynamics.scene import explain
from sphshell_pin.dynamics.scene.explain import DEFAULT_SPEED, coarseness, weakness
from sphshell_pin.dynamics.scene.joint_components import moving_joints
from sphshell_pin.dynamics.scene.models import find_joint
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.dynamics.sensing.sensors import SensorSet

AnyController = controllers.Controller | controllers.Callback | None
# A compiled run, or what a rollout keeps of one.
Ended: TypeAlias = "_core.Simulation | _core.Outcome"

_DIVERGED, _STUCK = 2, 3
# Python looks up this often [s] while compiled code runs: progress, Ctrl-C.
GLANCE = 0.05
_MOST_STEPS = 2.0**31 - 1
# More rows than these are announced before a run.
_MANY_ROWS = 1_000_000
# Rows of more bytes than these are announced as soon as they are recorded.
_MANY_BYTES = 1e9
# A run ends where it has taken more than this share of the memory: its result needs as much again.
_MOST_MEMORY = 0.4
# The compiled loop gives up beyond this position [m or rad].
_FARTHEST = 1e12


def start_run(
    scene: Scene,
    integrator: Integrator,
    q0: ArrayLike | RunState,
    v0: ArrayLike | None,
    duration: float,
    controller: AnyController,
    control_dt: float | None,
    *,
    record_dt: float | None,
    t0: float,
    sensors: SensorSet,
    record: Collection[str] = (),
    warn: bool = True,
    prepare: Callable[[_core.Simulation], None] | None = None,
) -> _core.Simulation:
    """Check the arguments of Simulation.run and return the compiled run at its start.

    `prepare` is called with it before its first row is recorded. With `warn`, a law that cannot
    stop its sphere causes a WeakLawWarning, and a controller whose parameters are probably a
    mistake, steps that are longer than recommended, or more than a million rows, a SetupWarning.
    """
    resumed = None
    if isinstance(q0, RunState):
        if v0 is not None:
            raise errors.InvalidParameter(
                "v0", v0, "must not be given: the state of a run has its own"
            )
        resumed, t0 = q0, q0.t
        q0, v0 = resumed.q, resumed.v
    q, v = scene.check_state(q0, v0)
    duration = checks.check_not_negative("duration", duration, "s")
    core_controller, hold = bind_controller(scene, integrator, controller, control_dt, q, sensors)
    if warn and isinstance(controller, controllers.Controller):
        for text in controller._setup_warnings(scene, q):
            warnings.warn(text, errors.SetupWarning, stacklevel=3)
    rows = many_rows(integrator, duration, record_dt) if warn else None
    if rows is not None:
        warnings.warn(rows, errors.SetupWarning, stacklevel=3)
    settings = run_settings(
        scene, integrator, duration, hold, record_dt=record_dt, record=record, t0=t0
    )
    pairs = core_pairs(scene, q, v, warn=warn, limited_dt=integrator.limited_dt)
    joints = scene.bind_joints()
    core = _core.Simulation(
        scene.model, pairs, joints, core_controller, q, v, settings, sensors.core
    )
    if prepare is not None:
        prepare(core)
    if resumed is not None and not core.resume(resumed.values):
        must = "must be the state of a run of a scene with the same pairs and joints"
        raise errors.InvalidParameter("q0", resumed, must)
    deep = core.deep_start()
    if deep is not None:
        raise deep_start(scene, *deep)
    return core


def many_rows(integrator: Integrator, duration: float, record_dt: object) -> str | None:
    """Say so where a run of `duration` [s] would record more than a million rows.

    How many those of a variable step without `record_dt` [s] are is not known before.
    """
    stated = 0.0 if record_dt is None else checks.check_positive("record_dt", record_dt, "s")
    between = max(stated, step_of(integrator))
    if between == 0 or duration / between <= _MANY_ROWS:
        return None
    return (
        f"the run will record {duration / between:.3g} rows, one every {between:.3g} s, and keep "
        f"them in memory: record_dt = {duration / 1e4:.1g} s gives ten thousand"
    )


class KeptRows:
    """Watches the memory that the rows of a run under way fill.

    How many rows an integrator with error control will record is known only as it goes.
    """

    def __init__(self, core: _core.Simulation, scene: Scene, record_dt: float | None) -> None:
        """`record_dt` [s] as for the run; None: a row at every step."""
        self._core, self._every, self._began = core, record_dt, core.time
        self._row = 8 * (scene.model.nq + scene.model.nv + 7)  # without contacts [bytes]
        # Of the first look, when little is recorded yet: asking takes as long as a run of one step.
        self._before = math.nan
        self._said = False

    def _rows(self) -> float:
        steps = float(self._core.counts["steps"])
        elapsed = self._core.time - self._began
        return steps if self._every is None else min(steps, elapsed / self._every)

    def warn(self, duration: float, *, announced: bool, stacklevel: int) -> None:
        """Say once, unless it was announced, that very much is recorded in `duration` [s]."""
        rows = self._rows()
        size = rows * self._row
        if self._said or announced or (rows <= _MANY_ROWS and size <= _MANY_BYTES):
            return
        self._said = True
        text = (
            f"the run has recorded {rows:.3g} rows by t = {self._core.time:.6g} s, "
            f"{size / 1e9:.2g} GB without contacts, and keeps them in memory: "
            f"record_dt = {duration / 1e4:.1g} s gives ten thousand"
        )
        warnings.warn(text, errors.SetupWarning, stacklevel=stacklevel + 1)

    def full(self) -> str | None:
        """Say so where the run fills the memory."""
        peak = _peak_memory()
        if math.isnan(self._before):
            self._before = peak
        taken = peak - self._before
        if taken <= _MOST_MEMORY * _all_memory() or self._rows() < 2:
            return None
        return f"its {self._rows():.3g} rows fill {taken / 1e9:.2g} GB of memory"


def _peak_memory() -> float:
    """Return the most memory that this process has had [bytes]."""
    unit = 1 if os.uname().sysname == "Darwin" else 1024
    return float(unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)


@functools.cache  # reading a file of the system takes a fifth of a run of one step
def _all_memory() -> float:
    """Return the memory of this machine or its container [bytes]; infinite where not known."""
    sizes = [math.inf]
    try:
        sizes.append(float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")))
        sizes.append(float(read_text("/sys/fs/cgroup/memory.max")))
    except (AttributeError, OSError, ValueError):  # no such number, or "max"
        pass
    return min(sizes)


def run_settings(
    scene: Scene,
    integrator: Integrator,
    duration: float,
    hold: float,
    *,
    record_dt: float | None,
    record: Collection[str] = (),
    t0: float,
) -> _core.RunSettings:
    """Check and collect the settings of a compiled run; torques are held for `hold` [s]."""
    dt = step_of(integrator)
    t0 = checks.check_finite("t0", t0)
    if np.spacing(abs(t0) + duration) > 1e-3 * (dt or 1e-6):
        raise errors.InvalidParameter(
            "t0, duration",
            (t0, duration),
            f"must be small enough to count steps of {dt or 1e-6!r} s",
        )
    scene._check_moved_mass()
    recorded = check_record(record)
    every = 0.0
    if record_dt is not None:
        every = min(checks.check_positive("record_dt", record_dt, "s"), _MOST_STEPS * (dt or 1.0))
    return _core.RunSettings(
        integrator=integrator.kind,
        dt=dt,
        rtol=float(getattr(integrator, "rtol", 0.0)),
        atol=float(getattr(integrator, "atol", 0.0)),
        duration=duration,
        start_time=t0,
        control_dt=hold,
        record_dt=every,
        patches="patch" in recorded,
        torques="torque" in recorded,
        states="state" in recorded,
    )


def step_of(integrator: Integrator) -> float:
    """Return the fixed step [s], or 0 where the error decides."""
    return float(getattr(integrator, "dt", 0.0))


def bind_controller(
    scene: Scene,
    integrator: Integrator,
    controller: AnyController,
    control_dt: float | None,
    q0: Array,
    sensors: SensorSet,
) -> tuple[_core.Controller | None, float]:
    """Return the C++ controller, started at q0 (nq,), and how long its torques are held [s]."""
    dt = step_of(integrator)
    if control_dt is not None and checks.check_positive("control_dt", control_dt, "s") < dt:
        raise errors.InvalidParameter("control_dt", control_dt, f"must not be below dt = {dt!r} s")
    if controller is None:
        return None, 0.0
    if isinstance(controller, type):
        raise errors.InvalidParameter(
            "controller", controller, "is a class, not a controller: did you forget ()?"
        )
    if isinstance(controller, controllers.Controller):
        return controller._bind(scene, q0), control_dt or 0.0
    if callable(controller):
        if not controllers.reads_sensors(controller):
            return controllers.wrap_callable(controller, scene.model), control_dt or dt
        if control_dt is None and dt == 0:
            raise errors.InvalidParameter(
                "control_dt",
                None,
                "must be given for a controller that reads sensors with an integrator of variable "
                "step: how long its torques are held [s]",
            )
        return controllers.wrap_callable(
            controller, scene.model, sensors.readings
        ), control_dt or dt
    raise errors.InvalidParameter(
        "controller", controller, "must be None, a controller or tau(t, q, v, contacts)"
    )


def core_pairs(
    scene: Scene, q0: Array, v0: Array, *, warn: bool, limited_dt: float | None = None
) -> list[_core.Pair]:
    """Build the C++ pairs for a run from q0 (nq,), v0 (nv,).

    `warn` as of `start_run`; `limited_dt` [s] is that of the run's integrator.
    """
    cores, figures = explain.core_pairs(scene, q0, v0, explained=warn)
    for pair, figure in zip(scene.pairs, figures, strict=False) if warn else ():
        weak = weakness(pair, figure)
        # A sphere at rest in touch has no speed to judge by.
        if weak is not None and figure.approach_speed != DEFAULT_SPEED:
            warnings.warn(weak, errors.WeakLawWarning, stacklevel=4)
    coarse = coarseness(scene, figures, limited_dt) if warn else None
    if coarse is not None:
        warnings.warn(coarse, errors.SetupWarning, stacklevel=4)
    return cores


def deep_start(scene: Scene, pair: int, depth: float) -> errors.DeepStart:
    """Return the error of a sphere that starts too deep [m] in the shell of its pair."""
    return errors.DeepStart(scene.pairs[pair].name, depth, scene.pairs[pair].least_radius)


def advance(
    core: _core.Simulation,
    until: float = math.inf,
    wall: float = math.inf,
    glance: Callable[[], None] | None = None,
) -> int:
    """Advance a run to the time `until` or the end, for `wall` [s] of computing at most.

    `glance` is called several times a second. Returns the status of the compiled run: 0 while it
    can go on.
    """
    began = core.wall_time
    while True:
        status = core.advance(min(GLANCE, wall - (core.wall_time - began)), until)
        if glance is not None:
            glance()
        if status or core.time >= until or core.wall_time - began >= wall:
            return status


def result_of(
    scene: Scene,
    integrator: Integrator,
    core: Ended,
    record: dict[str, NDArray[np.generic]],
    sensors: SensorSet,
) -> Result:
    """Make the result of a compiled run, or of what is left of one, and its record."""
    names = tuple(pair.name for pair in scene.pairs)
    summaries = core.summaries
    if len(summaries) != len(names) + len(scene.joints.stopped_joints(scene.model)):
        raise errors.SphshellError(
            "the scene's contacts were changed during the run: it has no result"
        )
    counts, wall_time = core.counts, core.wall_time
    simulated = core.time - float(record["t"][0] if len(record["t"]) else core.time)
    figures = map(PairFigures.from_core, summaries[: len(names)])
    stats = RunStats(
        **counts,
        wall_time=wall_time,
        real_time_factor=simulated / wall_time if wall_time > 0 else math.inf,
        duration=simulated,
        dt=step_of(integrator) or (simulated / counts["steps"] if counts["steps"] else 0.0),
        integrator=type(integrator).__name__,
        pairs=dict(zip(names, figures, strict=True)),
        joints=joint_figures(scene, summaries[len(names) :], core.limits),
    )
    return Result._from_record(record, names, stats, scene, sensors)


def joint_figures(
    scene: Scene, stops: list[dict[str, float]], limits: list[dict[str, float]]
) -> dict[str, JointFigures]:
    """Return the figures of the joints that have stops or limits, from what the core adds up."""
    model, joints = scene.model, scene.joints
    stopped, found = joints.stopped_joints(model), {}
    for name in dict.fromkeys((*stopped, *joints.effort, *joints.speed)):
        joint, limited = find_joint(model, name), name in joints.effort or name in joints.speed
        found[name] = JointFigures.from_core(
            [sums for one, sums in zip(stopped, stops, strict=True) if one == name],
            limits[joint.idx_v : joint.idx_v + joint.nv] if limited else [],
        )
    return found


class CtrlC:
    """Notes Ctrl-C during a run, which does not interrupt a user's callback then.

    A second one interrupts it. Outside the main thread signals cannot be caught.
    """

    def __init__(self) -> None:
        self.pressed = False
        self._replaced = False

    def __enter__(self) -> CtrlC:
        if threading.current_thread() is threading.main_thread():
            self._replaced = signal.getsignal(signal.SIGINT) is signal.default_int_handler
            if self._replaced:
                signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(self, *_: object) -> None:
        if self._replaced:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.pressed:
            signal.default_int_handler(number, frame)
        self.pressed = True


def why_ended(status: int, core: Ended, scene: Scene) -> str | None:
    """Say why the compiled run cannot go on after `status`; None where it can, or has finished."""
    if status == _STUCK:
        return f"the error stays too large however short the step (tried {core.last_step:.1e} s)"
    return _runaway(core, scene) if status == _DIVERGED else None


def _runaway(core: Ended, scene: Scene) -> str:
    """Say which joint ran away first."""
    if not np.abs(core.q).max(initial=0.0) < _FARTHEST:
        return "a joint's position grew beyond all bounds"
    v = np.abs(core.v)
    v = np.where(np.isfinite(v), v, np.inf)
    worst = int(np.argmax(v))
    for name, joint in moving_joints(scene.model):
        if joint.idx_v <= worst < joint.idx_v + joint.nv:
            return f"the speed of joint '{name}' grew to {v[worst]:.3g}"
    return "the state is no longer finite"
