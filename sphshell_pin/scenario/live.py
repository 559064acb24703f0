"""A scenario that keeps running while its parameters are changed and its bodies pushed."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin import _core
from sphshell_pin.checks import check_not_negative, check_vector
from sphshell_pin.dynamics.busy import one_at_a_time
from sphshell_pin.dynamics.open_run import OpenRun, contacts_of
from sphshell_pin.dynamics.patches import Patches
from sphshell_pin.dynamics.result import Result
from sphshell_pin.dynamics.scene import Scene, SceneContacts
from sphshell_pin.errors import InvalidParameter, NameNotFound, SphshellError
from sphshell_pin.scenario.build import Built, rebuild
from sphshell_pin.scenario.knobs import Knob, knobs_of
from sphshell_pin.scenario.player import Rows
from sphshell_pin.scenario.reading import look_up
from sphshell_pin.scenario.series import (
    RESIDUAL,
    Series,
    force_series,
    held,
    motion_series,
    sensor_series,
)

Array = npt.NDArray[np.float64]

# Between the rows for a chart [s].
ROW_DT = 5e-3


class LiveRun:
    """Plays the scenario of `built` from its start on, without an end.

    It is a player of the live page. Parameters of laws, friction, radii and the controller act on
    the run under way; with others it starts again, from where it is if it can. `ended` is
    why a run cannot go on; it waits for `reset` or another value.

    What it shows may be read in any thread; `advance`, `reset`, `change` and `push` are for one
    thread at a time, and raise Busy in others.

    Raises what `Simulation.run` raises of a start that cannot be.
    """

    duration: float | None = None

    def __init__(self, built: Built) -> None:
        self.built = built
        self.title = built.scenario.title or built.name
        self.start = 0.0
        self._user = _core.OneUser("LiveRun")
        self._knobs = knobs_of(built)
        self._torques = False
        self._begin(_open_run(built, built.q0, built.v0, 0.0))

    def _begin(self, run: OpenRun) -> None:
        """Go on with `run`, which is at its start."""
        self._run = run
        self._fault: str | None = None
        self._push: tuple[str, Array, float] | None = None
        self._readings: dict[str, Array] = {}
        if self._torques:
            run.record_torques()
        self._row = run.snapshot()
        self._total = float(self._row.energy.total[0])
        self._exchanged = 0.0

    @property
    def scene(self) -> Scene:
        """The scene that runs; another object after some changes."""
        return self._run.scene

    @property
    def visual_model(self) -> pin.GeometryModel:
        """Of the scene's model."""
        return self.built.visual_model

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self._row.t[0])

    @property
    def q(self) -> Array:
        """Configuration (nq,)."""
        q: Array = self._row.q[0]
        return q

    @property
    def v(self) -> Array:
        """Velocity (nv,)."""
        v: Array = self._row.v[0]
        return v

    @property
    def contacts(self) -> SceneContacts:
        """The contacts at `q`, `v`, with their forces."""
        return contacts_of(self._row)

    @property
    def patches(self) -> Patches | None:
        """The patches of `contacts`, None unless the scenario records them."""
        return self._row.patch_rows

    @property
    def residual(self) -> float:
        """Change of the total energy since the start [J]: the integration's error."""
        return float(self._row.energy.total[0] - self._total)

    @property
    def exchanged(self) -> float:
        """Energy that changed form since the start [J], the scale of `residual`."""
        return self._exchanged

    @property
    def ended(self) -> str | None:
        """Why the run cannot go on, one sentence; None while it can."""
        return self._fault or self._run.ended

    @property
    def knobs(self) -> tuple[Knob, ...]:
        """The parameters of the scenario with a slider, with their present values."""
        return self._knobs

    @property
    def bodies(self) -> tuple[str, ...]:
        """Frames that can be pushed, one of each moving body; those with a sphere first."""
        model = self.scene.model
        spheres = {pair.joint_i: pair.frame_i for pair in self.scene.pairs if pair.joint_i}
        names = dict(spheres)
        for frame in model.frames:
            if frame.type == pin.FrameType.BODY and frame.parentJoint:
                names.setdefault(frame.parentJoint, frame.name)
        for joint in range(1, model.njoints):
            if model.existFrame(model.names[joint]):
                names.setdefault(joint, model.names[joint])
        return tuple(names.values())

    @property
    def series(self) -> tuple[Series, ...]:
        """What charts can show of the run."""
        sensors = {one.name: one.columns(self.scene) for one in self.built.simulation.sensors}
        return (
            *force_series([pair.name for pair in self.scene.pairs]),
            *motion_series(self.scene.model, torque=self.built.controller is not None),
            *sensor_series(sensors),
            RESIDUAL,
        )

    @property
    def now(self) -> Rows:
        """The state of now as one row."""
        return self._rows(self._row)

    @one_at_a_time
    def ask(self, sources: Collection[str]) -> None:
        """Record these blocks of Rows from now on: "torque" is recorded only where it is asked for.

        A controller whose torques are not held is asked for them at each row.
        """
        if "torque" in sources and not self._torques:
            self._torques = True
            self._run.record_torques()
            self._row = self._run.snapshot()

    def _rows(self, rows: Result) -> Rows:
        more = {"q": rows.q, "v": rows.v, "residual": (rows.energy.total - self._total)[:, None]}
        if rows.torque is not None:
            more["torque"] = rows.torque
        for name, log in rows.sensors.items():
            more[f"sensor.{name}"] = held(log, rows.t, self._readings.get(name))
            if len(log):
                self._readings[name] = log.values[-1]
        pairs = len(self.scene.pairs)
        return Rows.of(rows.t, pairs, rows.contacts, rows.contacts.row, more)

    @one_at_a_time
    def advance(self, duration: float, wall: float = math.inf) -> Rows:
        """Go on for `duration` [s], or until `wall` [s] of computing are over; return the rows.

        A fault of the scenario's own routines ends the run as a divergence does.
        """
        until = self.time + check_not_negative("duration", duration, "s")
        pieces = []
        if self._push is not None and self._push[2] <= until:
            end = self._push[2]
            pieces.append(self._advance(max(end - self.time, 0.0), wall))
            if self.time >= end:
                self._end_push()
        if self.time < until:
            pieces.append(self._advance(until - self.time, wall))
        return Rows.joined(pieces) if pieces else Rows.empty(len(self.scene.pairs))

    def _advance(self, duration: float, wall: float) -> Rows:
        pairs = len(self.scene.pairs)
        if self.ended is not None:
            return Rows.empty(pairs)
        try:
            rows = self._run.advance(duration, wall)
            now = self._run.snapshot()
        except Exception as error:
            reason = str(error) if isinstance(error, SphshellError) else repr(error)
            self._fault = ", ".join([reason, *getattr(error, "__notes__", ())])
            return Rows.empty(pairs)
        self._exchanged += _exchanged(self._row, rows, now)
        self._row = now
        return self._rows(rows)

    @one_at_a_time
    def reset(self) -> None:
        """Start again with the present values of the parameters."""
        self._begin(_open_run(self.built, self.built.q0, self.built.v0, 0.0))

    @one_at_a_time
    def change(self, key: str, value: float) -> None:
        """Set the number at the dotted `key` of the scenario.

        Raises
        ------
        ScenarioError
            There is no such key, or the value is out of its range; the run goes on as it was.
        InvalidParameter
            Nothing can be computed with such a value; the run goes on as it was.
        """
        try:
            self._change(key, value)
        except ArithmeticError:
            why = "is too large or too small to compute with"
            raise InvalidParameter(key, value, why) from None

    def _change(self, key: str, value: float) -> None:
        before = self.built
        after = rebuild(before, {key: repr(float(value))})
        same = {
            name: getattr(before.scenario, name) == getattr(after.scenario, name)
            for name in ("robot", "shell", "sensor", "controller", "run")
        }
        controller = None if same["controller"] else after.controller
        goes_on = same["robot"] and same["shell"] and same["run"] and self.ended is None
        if not goes_on:
            self._begin(_open_run(after, after.q0, after.v0, 0.0))
        elif same["sensor"] and self._run.change(after.scene, controller):
            self._row = self._run.snapshot()
        else:  # another gravity or sensor: from here on, with it
            self._go_on(_open_run(after, self.q, self.v, self.time))
        self.built = after
        # Their ranges stay those of the start: they do not wander with the values.
        self._knobs = tuple(
            replace(knob, value=float(look_up(after.scenario, knob.key, after.path)[0]))
            for knob in self._knobs
        )

    def _go_on(self, run: OpenRun) -> None:
        """Go on with `run`, which is in the state of this one: with its push and its audit."""
        residual, exchanged, push = self.residual, self._exchanged, self._push
        self._begin(run)
        self._total -= residual
        self._exchanged = exchanged
        if push is not None:
            run.push(push[0], push[1])
            self._push = push

    @one_at_a_time
    def push(self, body: str, force_world: npt.ArrayLike, seconds: float) -> None:
        """Push at the origin of the frame `body` with a force (3,) [N] in the world for a time [s].

        Raises
        ------
        NameNotFound
            There is no such body.
        InvalidParameter
            The force is no three numbers, or the time is negative.
        """
        if body not in self.bodies:
            raise NameNotFound("body", body, "the scene", self.bodies)
        force = check_vector("force_world", force_world, 3, " [N]")
        seconds = check_not_negative("seconds", seconds, "s")
        self._run.push(body, force)
        self._push = body, force, self.time + seconds

    def seek(self, t: float) -> None:
        """Refuse: what has not happened yet cannot be shown.

        Raises
        ------
        SphshellError
            Always.
        """
        raise SphshellError(f"a live run cannot go to t = {t!r} s: only a finished run can")

    def _end_push(self) -> None:
        self._run.push(self.bodies[0], np.zeros(3))
        self._push = None


def _open_run(built: Built, q: Array, v: Array, t: float) -> OpenRun:
    """Open the run of `built` from a state; raises what `Simulation.run` raises of a start."""
    return OpenRun(
        built.simulation,
        q,
        v,
        built.controller,
        built.scenario.run.control_dt,
        record_dt=ROW_DT,
        record=built.scenario.run.record,
        t0=t,
    )


def _exchanged(before: Result, rows: Result, now: Result) -> float:
    """Energy that changed form from one state over rows to the next [J]."""
    columns = [
        np.concatenate([getattr(one.energy, name) for one in (before, rows, now)])
        for name in before.energy.__annotations__
    ]
    with np.errstate(all="ignore"):  # of a run that diverges
        return 0.5 * float(np.abs(np.diff(columns, axis=1)).sum())
