"""Runs a scene: checks, starts the compiled loop, gathers what it records."""

from __future__ import annotations

import math
import signal
import threading
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sphshell_pin import _core
from sphshell_pin.checks import (
    check_finite,
    check_moved_mass,
    check_not_negative,
    check_positive,
)
from sphshell_pin.dynamics.controllers import Callback, Controller, wrap_callable
from sphshell_pin.dynamics.integrators import Adaptive, Integrator
from sphshell_pin.dynamics.result import Result
from sphshell_pin.dynamics.run_stats import PairFigures, RunStats
from sphshell_pin.dynamics.scene import Scene
from sphshell_pin.errors import (
    DeepStart,
    Interrupted,
    InvalidParameter,
    SimulationDiverged,
    WeakLawWarning,
)

if TYPE_CHECKING:
    from sphshell_pin.dynamics.rollout import Rollout

Array = NDArray[np.float64]

_DIVERGED, _STUCK = 2, 3
# Python looks up this often [s] while the compiled loop runs: progress, Ctrl-C.
GLANCE = 0.05
_MOST_STEPS = 2.0**31 - 1
# The compiled loop gives up beyond this position [m or rad].
_FARTHEST = 1e12


class Simulation:
    """Moves `scene` in time with `integrator`, Adaptive() unless given."""

    def __init__(self, scene: Scene, integrator: Integrator | None = None) -> None:
        if not isinstance(scene, Scene):
            raise InvalidParameter("scene", type(scene).__name__, "must be a sphshell_pin.Scene")
        integrator = Adaptive() if integrator is None else integrator
        if not isinstance(integrator, Integrator):
            raise InvalidParameter(
                "integrator",
                integrator,
                "must be Adaptive(rtol), Implicit(rtol), SemiImplicitEuler(dt), RungeKutta4(dt) or "
                "LinearlyImplicitEuler(dt)",
            )
        self.scene = scene
        self.integrator = integrator

    def run(
        self,
        q0: Any,
        v0: Any = None,
        duration: float = 1.0,
        controller: Controller | Callback | None = None,
        control_dt: float | None = None,
        *,
        record_dt: float | None = None,
        progress: Callable[[float], object] | None = None,
        t0: float = 0.0,
    ) -> Result:
        """Run from q0 (nq,), v0 (nv,) for `duration` [s] and return the Result.

        `controller`: None, a controller of this package, or a callable
        tau(t, q, v, contacts) -> (nv,). Torques are held for `control_dt` [s]; by default a
        callable is asked once a fixed step, a controller of this package at every stage of it.
        Adaptive and Implicit ask at every stage, and Implicit 2 nv + 2 times more a step, at states
        nearby: a callable with a memory needs control_dt. Rows are recorded every `record_dt` [s]
        (default: every step); `progress` is called a few times a second with the share done. The
        same input gives the same bits.

        A law that cannot stop its sphere earns a WeakLawWarning.

        Raises InvalidParameter for wrong sizes and values, DeepStart for a sphere that starts
        deep inside, SimulationDiverged and (on Ctrl-C) Interrupted, both with `.result`.
        """
        core = self.to_core(q0, v0, duration, controller, control_dt, record_dt=record_dt, t0=t0)
        blocks: list[dict[str, NDArray[Any]]] = []
        status = 0
        try:
            with CtrlC() as ctrl_c:
                while not status:
                    status = core.advance(GLANCE)
                    if status or core.full:
                        blocks.append(core.take())
                    if progress is not None:
                        progress(core.progress)
                    if ctrl_c.pressed and not status:
                        raise KeyboardInterrupt
        except KeyboardInterrupt:
            blocks.append(core.take())
            raise Interrupted(core.time, self.gather(core, blocks)) from None
        result = self.gather(core, blocks)
        reason = why_ended(status, core, self.scene)
        if reason is not None:
            raise SimulationDiverged(core.time, reason, result)
        return result

    def rollout(
        self,
        q0s: Any,
        v0s: Any = None,
        duration: float = 1.0,
        threads: int | None = None,
        *,
        controller: Controller | Callback | Sequence[Controller | Callback | None] | None = None,
        control_dt: float | None = None,
        vary: Mapping[str, Any] | None = None,
        record_dt: float | None = None,
        progress: Callable[[float], object] | None = None,
        t0: float = 0.0,
    ) -> Rollout:
        """Make many runs at once, over threads; each has the bits that `run` gives it.

        Parameters
        ----------
        q0s : (n, nq), or (nq,) for all runs
        v0s : (n, nv), or (nv,) for all runs; at rest unless given
        duration, controller, control_dt, t0 : as of `run`; `controller` may be a list of n. A
            callable is asked for all runs in turn, and holds up the other threads meanwhile
        threads : how many, no more than runs; all processors unless given
        vary : parameters that differ from run to run: names to n values each. Names are
            "PAIR.law" and "PAIR.friction" (n laws, n frictions or None), "PAIR.law.FIELD" and
            "PAIR.friction.FIELD" (n numbers; the fields of the law or friction that the pair has),
            "PAIR.sphere.radius" (n) [m], "PAIR.sphere.offset" (n, 3) [m], "PAIR.placement" of
            the shell in its frame (n pinocchio.SE3)
        record_dt : between recorded rows [s]; unless given only start and end are recorded
        progress : called a few times a second with the share of the runs that are done

        Returns
        -------
        Rollout : its length is n, [i] gives the Result of run i. A run that fails is noted in
            `failures`, and the others go on

        Raises
        ------
        InvalidParameter, NameNotFound
            For wrong sizes, names and values, before anything runs.
        RolloutInterrupted
            On Ctrl-C, with the `rollout` so far.
        """
        from sphshell_pin.dynamics.many_runs import roll_out

        return roll_out(
            self,
            q0s,
            v0s,
            duration,
            threads,
            controller=controller,
            control_dt=control_dt,
            vary=vary,
            record_dt=record_dt,
            progress=progress,
            t0=t0,
        )

    def to_core(
        self,
        q0: Any,
        v0: Any,
        duration: float,
        controller: Controller | Callback | None,
        control_dt: float | None,
        *,
        record_dt: float | None,
        t0: float = 0.0,
        warn: bool = True,
    ) -> _core.Simulation:
        """Check the arguments of `run` and return the compiled run, not yet started.

        With `warn`, a law that cannot stop its sphere earns a WeakLawWarning.
        """
        q0, v0 = self.scene.check_state(q0, v0)
        duration = check_not_negative("duration", duration, "s")
        self._check_start(q0)
        core_controller, hold = self.bind(controller, control_dt, q0)
        settings = self.core_settings(duration, hold, record_dt=record_dt, t0=t0)
        return _core.Simulation(
            self.scene.model, self.core_pairs(q0, v0, warn), core_controller, q0, v0, settings
        )

    def core_settings(
        self, duration: float, hold: float, *, record_dt: float | None, t0: float
    ) -> _core.RunSettings:
        """Check and gather what the compiled loop is told; torques are held for `hold` [s]."""
        dt = self._dt
        t0 = check_finite("t0", t0)
        if np.spacing(abs(t0) + duration) > 1e-3 * (dt or 1e-6):
            raise InvalidParameter(
                "t0, duration",
                (t0, duration),
                f"must be small enough to count steps of {dt or 1e-6!r} s",
            )
        check_moved_mass(self.scene.model)
        record = 0.0
        if record_dt is not None:
            record = min(check_positive("record_dt", record_dt, "s"), _MOST_STEPS * (dt or 1.0))
        return _core.RunSettings(
            integrator=self.integrator.code,
            dt=dt,
            rtol=getattr(self.integrator, "rtol", 0.0),
            atol=getattr(self.integrator, "atol", 0.0),
            duration=duration,
            start_time=t0,
            control_dt=hold,
            record_dt=record,
        )

    def core_controller(
        self, controller: Controller | Callback | None, q: Array
    ) -> _core.Controller | None:
        """Return the C++ twin of a controller that `run` takes, started at q (nq,)."""
        return self.bind(controller, None, q)[0]

    def core_pairs(self, q0: Array, v0: Array, warn: bool = True) -> list[_core.Pair]:
        """Build the C++ twins of the pairs; `warn` as of `to_core`."""
        pairs = [pair.to_core() for pair in self.scene.pairs]
        if pairs:
            from sphshell_pin.dynamics.explain import (
                DEFAULT_SPEED,
                explain_pairs,
                relaxation_time,
                weakness,
            )

            figures = explain_pairs(self.scene, q0, v0)
            for pair, core, figure in zip(self.scene.pairs, pairs, figures, strict=True):
                core.relaxation = relaxation_time(pair, figure)
                weak = weakness(pair, figure)
                # Of a sphere at rest in touch no speed is known to judge by.
                if warn and weak is not None and figure.approach_speed != DEFAULT_SPEED:
                    warnings.warn(weak, WeakLawWarning, stacklevel=4)
        return pairs

    @property
    def _dt(self) -> float:
        """The fixed step [s], or 0 where the error decides."""
        return float(getattr(self.integrator, "dt", 0.0))

    def bind(
        self, controller: Controller | Callback | None, control_dt: float | None, q0: Array
    ) -> tuple[_core.Controller | None, float]:
        """Return the C++ twin of a controller, started at q0 (nq,), and how long it holds [s]."""
        dt = self._dt
        if control_dt is not None and check_positive("control_dt", control_dt, "s") < dt:
            raise InvalidParameter("control_dt", control_dt, f"must not be below dt = {dt!r} s")
        if controller is None:
            return None, 0.0
        if isinstance(controller, type):
            raise InvalidParameter(
                "controller", controller, "is a class, not a controller: did you forget ()?"
            )
        if isinstance(controller, Controller):
            return controller.to_core(self.scene, q0), control_dt or 0.0
        if callable(controller):
            return wrap_callable(controller, self.scene.model), control_dt or dt
        raise InvalidParameter(
            "controller", controller, "must be None, a controller or tau(t, q, v, contacts)"
        )

    def _check_start(self, q0: Array) -> None:
        pairs = self.scene.pairs
        contacts = self.scene.contacts(q0) if pairs else None
        for k, pair in enumerate(pairs):
            if pair.sphere is None or pair.shell is None or contacts is None:
                continue
            radius = pair.sphere.radius
            depth = float(np.max(contacts.depth[contacts.pair == k], initial=0.0))
            if pair.shell.side != "both" and pair.shell.is_closed:
                depth = max(depth, self._depth_in_solid(k, q0))
            if depth > 0.5 * radius:
                raise DeepStart(pair.name, depth, radius)

    def _depth_in_solid(self, index: int, q0: Array) -> float:
        """Signed depth [m] of a sphere's start in a one-sided shell, however deep."""
        pair = self.scene.pairs[index]
        if pair.shell is None or pair.sphere is None:
            return -math.inf
        data = self.scene.model.createData()
        pin.forwardKinematics(self.scene.model, data, q0)
        centre = (data.oMi[pair.joint_i] * pair.placement_i).translation
        local = (data.oMi[pair.joint_j] * pair.placement_j).actInv(centre)
        distance = float(pair.shell.closest_points(local[None], method=pair.method).distances[0])
        return pair.sphere.radius - (distance if pair.shell.side == "outside" else -distance)

    def gather(self, core: Any, blocks: list[dict[str, NDArray[Any]]]) -> Result:
        """Make the result of a compiled run `core`, or of what is left of one, and its blocks."""
        names = tuple(pair.name for pair in self.scene.pairs)
        figures = map(PairFigures.from_core, core.summaries)
        first = blocks[0]["t"][0] if len(blocks[0]["t"]) else core.time
        simulated = core.time - float(first)
        stats = RunStats(
            steps=core.steps,
            wall_time=core.wall_time,
            real_time_factor=simulated / core.wall_time if core.wall_time > 0 else math.inf,
            duration=simulated,
            rejected=core.rejected,
            evaluations=core.evaluations,
            dt=self._dt or (simulated / core.steps if core.steps else 0.0),
            integrator=type(self.integrator).__name__,
            pairs=dict(zip(names, figures, strict=True)),
        )
        return Result.from_blocks(blocks, names, stats, self.scene)


class CtrlC:
    """Notes Ctrl-C during a run instead of letting it break into somebody's callback.

    A second one breaks in all the same. Outside the main thread signals cannot be caught.
    """

    def __init__(self) -> None:
        self.pressed = False
        self._before: Any = None

    def __enter__(self) -> CtrlC:
        if threading.current_thread() is threading.main_thread():
            self._before = signal.getsignal(signal.SIGINT)
            if self._before is signal.default_int_handler:
                signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(self, *_: object) -> None:
        if self._before is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._before)

    def _note(self, number: int, frame: Any) -> None:
        if self.pressed:
            signal.default_int_handler(number, frame)
        self.pressed = True


def why_ended(status: int, core: Any, scene: Scene) -> str | None:
    """Say why the compiled run cannot go on after `status`; None where it can, or has finished."""
    if status == _STUCK:
        return f"the error stays too large however short the step (tried {core.last_step:.1e} s)"
    return _runaway(core, scene) if status == _DIVERGED else None


def _runaway(core: Any, scene: Scene) -> str:
    """Say which joint ran away first."""
    if not np.abs(np.asarray(core.q)).max(initial=0.0) < _FARTHEST:
        return "a joint's position grew beyond all bounds"
    v = np.abs(np.asarray(core.v))
    v = np.where(np.isfinite(v), v, np.inf)
    worst = int(np.argmax(v))
    for name, joint in zip(scene.model.names, scene.model.joints, strict=True):
        if joint.idx_v <= worst < joint.idx_v + joint.nv:
            return f"the speed of joint '{name}' grew to {v[worst]:.3g}"
    return "the state is no longer finite"
