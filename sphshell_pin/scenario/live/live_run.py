"""A scenario that keeps running while its parameters are changed and its bodies pushed."""

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_finite, check_not_negative, check_positive, check_vector
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_parts import Patches
from sphshell_pin.dynamics.run.advance import AnyController, step_of
from sphshell_pin.dynamics.run.open_run import OpenRun
from sphshell_pin.dynamics.scene.one_user import one_at_a_time
from sphshell_pin.dynamics.scene.scene import Scene, SceneContacts
from sphshell_pin.errors import InvalidParameter, NameNotFound, SphshellError
from sphshell_pin.scenario.format.build import Built, rebuild
from sphshell_pin.scenario.format.reading import look_up
from sphshell_pin.scenario.format.sliders import live_parameters
from sphshell_pin.scenario.live import acting
from sphshell_pin.scenario.running.rows import Rows, Series, series_of

# Between the rows for a chart [s].
ROW_DT = 5e-3


class LiveRun:
    """Plays the scenario of `built` from its start on, without an end.

    It is a player of the live page. Parameters of laws, friction, radii and the controller act on
    the run under way; with others it starts again, from where it is if it can. `ended` is
    why a run cannot go on; it waits for `reset` or another value. `parameters` are those with a
    slider, with their present values; `exchanged` is the energy that changed form since the start
    [J], the scale of `residual`.

    What it shows may be read in any thread; what changes it is for one thread at a time, and raises
    Busy in others.

    Raises what `Simulation.run` raises of a start that cannot be.
    """

    can_record_patches = True

    def __init__(self, built: Built) -> None:
        self.built = built
        self.title = built.scenario.title or built.name
        self.start = 0.0
        self._user = _core.OneUser("LiveRun")
        self.parameters = live_parameters(built)
        self._aims: dict[str, float] = {}
        self._targets: tuple[acting.Target, ...] | None = None
        self._patches = "patch" in built.scenario.run.record
        self._torques = False
        self._begin(self._open(built))

    def _begin(self, run: OpenRun) -> None:
        """Go on with `run`, which is at its start."""
        self._run = run
        self._fault: str | None = None
        self._push: tuple[str, Array, float] | None = None
        self._drag: acting.Drag | None = None
        self._readings: dict[str, Array] = {}
        if self._torques:
            run.record_torques()
        self._row = run.snapshot()
        self._total = float(self._row.energy.total[0])
        self.exchanged = 0.0

    @property
    def scene(self) -> Scene:
        """The scene that runs; another object after some changes."""
        return self._run.scene

    @property
    def visual_model(self) -> pin.GeometryModel:
        """Visual geometry of the scene's model."""
        return self.built.visual_model

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self._row.t[0])

    @property
    def q(self) -> Array:
        """Configuration (nq,)."""
        return np.asarray(self._row.q[0])

    @property
    def v(self) -> Array:
        """Velocity (nv,)."""
        return np.asarray(self._row.v[0])

    @property
    def contacts(self) -> SceneContacts:
        """The contacts at `q`, `v`, with their forces."""
        return self._row.contacts.at_row(0)

    @property
    def patches(self) -> Patches | None:
        """The patches of `contacts`, None unless they are recorded."""
        return self._row.patch_rows

    @property
    def residual(self) -> float:
        """Change of the total energy since the start [J]: the integration's error."""
        return float(self._row.energy.total[0] - self._total)

    @property
    def ended(self) -> str | None:
        """Why the run cannot go on, one sentence; None while it can."""
        return self._fault or self._run.ended

    @property
    def bodies(self) -> tuple[str, ...]:
        """Frames that can be pushed, one of each moving body; those with a sphere first."""
        return acting.movable_bodies(self.scene)

    @property
    def targets(self) -> tuple[acting.Target, ...]:
        """The joints that the controller pulls to a posture, with their present targets."""
        if self._targets is None:
            model, start = self.built.scene.model, self.built.q0
            self._targets = acting.targets_of(self._controller(self.built), model, start)
        return self._targets

    @property
    def drag(self) -> acting.Dragged | None:
        """What pulls at a body now, and with which force; None if nothing does."""
        return None if self._drag is None else self._drag.at(self.scene.model, self.q, self.v)

    @property
    def series(self) -> tuple[Series, ...]:
        """What charts can show of the run."""
        sensors = {one.name: one.columns(self.scene) for one in self.built.simulation.sensors}
        pairs, torque = [pair.name for pair in self.scene.pairs], self.built.controller is not None
        return series_of(pairs, self.scene.model, sensors, torque=torque)

    @property
    def planned(self) -> float | None:
        """How long the scenario runs [s]: the live run goes on, but nothing new is to be seen."""
        return float(self.built.scenario.run.duration)

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
        return Rows.from_result(rows, rows.energy.total - self._total, self._readings)

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
                self._run.push(self.bodies[0], np.zeros(3))
                self._push = None
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
        self.exchanged += _exchanged(self._row, rows, now)
        self._row = now
        return self._rows(rows)

    @one_at_a_time
    def reset(self) -> None:
        """Start again with the present values of the parameters."""
        self._begin(self._open(self.built))

    @one_at_a_time
    def change(self, key: str, value: float | str) -> None:
        """Set the number or choice at the dotted `key` of the scenario.

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

    def _change(self, key: str, value: float | str) -> None:
        before = self.built
        if isinstance(value, str):
            words = next((one.choices for one in self.parameters if one.key == key), ())
            if value not in words:
                valid = f"one of {', '.join(words)}" if words else "a number"
                raise InvalidParameter(key, value, f"must be {valid}")
        after = rebuild(before, {key: value if isinstance(value, str) else repr(float(value))})
        same = {
            name: getattr(before.scenario, name) == getattr(after.scenario, name)
            for name in ("robot", "shell", "sensor", "controller", "run")
        }
        self._drop_aims(before, after)
        controller = None if same["controller"] else self._controller(after)
        goes_on = same["robot"] and same["shell"] and same["run"] and self.ended is None
        if not goes_on:
            self._begin(self._open(after))
        elif same["sensor"] and self._run.change(after.scene, controller):
            self._row = self._run.snapshot()
        else:  # another gravity or sensor: from here on, with it
            self._go_on(self._open(after, (self.q, self.v, self.time)))
        self.built = after
        self._targets = None
        # Their ranges stay those of the start: they do not wander with the values.
        if isinstance(value, float) and key in (one.key for one in self.parameters):
            self.parameters = tuple(
                replace(one, value=value) if one.key == key else one for one in self.parameters
            )
        else:  # a word, or another spelling of a key
            self.parameters = tuple(
                replace(one, value=str(now) if one.choices else float(now))
                for one in self.parameters
                for now in [look_up(after.scenario, one.key, after.path).value]
            )

    def _go_on(self, run: OpenRun) -> None:
        """Go on with `run`, which is in the state of this one: with its push and its audit."""
        residual, exchanged = self.residual, self.exchanged
        push, drag = self._push, self._drag
        run.take_over(self._run)
        self._begin(run)
        self._total -= residual
        self.exchanged = exchanged
        if push is not None:
            run.push(push[0], push[1])
            self._push = push
        if drag is not None:
            drag.act_on(run)
            self._drag = drag

    def _controller(self, built: Built) -> AnyController:
        """Return the controller of `built` with the targets that were moved.

        Its posture is that of the start, also where it begins in the middle of a run.
        """
        return acting.aimed(built.controller, built.scene.model, built.q0, self._aims)

    def _drop_aims(self, before: Built, after: Built) -> None:
        """Forget the targets of joints whose posture another parameter changes."""
        if not self._aims:
            return
        then, now = (
            {one.joint: one.value for one in acting.targets_of(b.controller, b.scene.model, b.q0)}
            for b in (before, after)
        )
        self._aims = {
            joint: value for joint, value in self._aims.items() if then[joint] == now.get(joint)
        }

    def _open(self, built: Built, state: tuple[Array, Array, float] | None = None) -> OpenRun:
        """Open the run of `built` from q, v, t, else from its start.

        Raises what `Simulation.run` raises of a start.
        """
        q, v, t = (built.q0, built.v0, 0.0) if state is None else state
        record = {name for name in built.scenario.run.record if name != "patch"}
        return OpenRun(
            built.simulation,
            q,
            v,
            self._controller(built),
            built.scenario.run.control_dt,
            record_dt=ROW_DT,
            record=record | {"patch"} if self._patches else record,
            t0=t,
        )

    @one_at_a_time
    def aim(self, joint: str, value: float) -> None:
        """Move the controller's target of one joint to `value` [rad or m].

        Raises
        ------
        NameNotFound
            The controller has no target for such a joint.
        InvalidParameter
            The value is beyond the limits of the joint; the run goes on as it was.
        """
        value = check_finite("value", value)
        acting.check_aim(self.targets, joint, value)
        before = self._aims
        self._aims = {**before, joint: value}
        self._targets = None
        try:
            self._run.change(self.scene, self._controller(self.built))
        except SphshellError:
            self._aims = before
            raise

    @one_at_a_time
    def record_patches(self, on: bool) -> None:
        """Compute the patches of the contacts from now on, or no longer."""
        self._patches = on
        self._run.record_patches(on)
        self._row = self._run.snapshot()

    @one_at_a_time
    def pull(
        self, frame: str, point: npt.ArrayLike, target_world: npt.ArrayLike, stiffness: float
    ) -> None:
        """Pull a point of a body to a target, until `release` or another pull or push.

        The point has the coordinates `point` (3,) [m] in `frame`. The spring's stiffness is
        `stiffness` [N/m per kg] times the mass that has to be moved there, critically damped; with
        an integrator of fixed step dt it is at most 1/(4 dt)^2, which every integrator follows.

        Raises
        ------
        NameNotFound
            There is no such frame.
        InvalidParameter
            The frame cannot move, point or target are no three numbers, or the stiffness is not
            positive.
        """
        rate = math.sqrt(check_positive("stiffness", stiffness, "N/m per kg"))
        dt = step_of(self._run.simulation.integrator)
        rate = min(rate, 1.0 / (4.0 * dt)) if dt else rate
        at = check_vector("point", point, 3, " [m]")
        target = check_vector("target_world", target_world, 3, " [m]")
        # The mass is that of the configuration in which the body was taken hold of.
        held = self._drag
        if held is None or not held.is_at(frame, at, rate):
            held = acting.Drag.hold(self.scene.model, self.q, frame, at, rate)
        drag = replace(held, target=target)
        drag.act_on(self._run)
        self._drag, self._push = drag, None

    @one_at_a_time
    def release(self) -> None:
        """End a pull."""
        if self._drag is not None:
            self._run.push(self._drag.frame, np.zeros(3))
            self._drag = None

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
        self._push, self._drag = (body, force, self.time + seconds), None


def _exchanged(before: Result, rows: Result, now: Result) -> float:
    """Energy that changed form from one state over rows to the next [J]."""
    columns = [
        np.concatenate([getattr(one.energy, name) for one in (before, rows, now)])
        for name in before.energy.__annotations__
    ]
    with np.errstate(all="ignore"):  # of a run that diverges
        return 0.5 * float(np.abs(np.diff(columns, axis=1)).sum())
