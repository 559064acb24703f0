"""A run without an end: it goes on when asked to, and takes changes and pushes on its way."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_not_negative, check_vector
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.run_stats import RunStats
from sphshell_pin.dynamics.run import advance as advancing
from sphshell_pin.dynamics.run.advance import advance
from sphshell_pin.dynamics.run.simulation import Simulation
from sphshell_pin.dynamics.scene.models import find_moving_frame
from sphshell_pin.dynamics.scene.one_user import one_at_a_time
from sphshell_pin.dynamics.scene.scene import ContactPair, Scene
from sphshell_pin.dynamics.sensing.sensors import SensorSet
from sphshell_pin.errors import NotPicklable

# The compiled loop wants an end [s]; steps of a microsecond can be counted so far.
_FOR_EVER = 1e6


class OpenRun:
    """A run of `simulation` from q0 (nq,), v0 (nv,) that is advanced piece by piece.

    The parameters are those of `Simulation.run`; rows are recorded every `record_dt` [s]. The
    pieces are of one run: bristles, contact numbers and the energy audit go on from one to the
    next, and with fixed steps the motion is the same, bit for bit, however it is cut.

    It is for one user at a time: while a call is under way, what another thread or the run's own
    callback asks of it raises Busy.

    Attributes
    ----------
    simulation : the one it runs; its scene is that of the last `change`
    ended : why the run cannot go on, one sentence; None while it can
    """

    def __init__(
        self,
        simulation: Simulation,
        q0: ArrayLike,
        v0: ArrayLike | None = None,
        controller: advancing.AnyController = None,
        control_dt: float | None = None,
        *,
        record_dt: float,
        record: Collection[str] = (),
        t0: float = 0.0,
    ) -> None:
        self.simulation = simulation
        self.ended: str | None = None
        self._user = _core.OneUser("OpenRun")
        self._sensors = SensorSet(simulation.sensors, simulation.scene)
        # Scene.explain reports a weak law.
        self._core = advancing.start_run(
            simulation.scene,
            simulation.integrator,
            q0,
            v0,
            _FOR_EVER,
            controller,
            control_dt,
            record_dt=record_dt,
            record=record,
            t0=t0,
            sensors=self._sensors,
            warn=False,
        )
        self._controller, self._control_dt = controller, control_dt
        self._rows = 0
        self._start = self.snapshot()

    def __reduce__(self) -> NoReturn:
        """Refuse to be pickled: the run is with the compiled core."""
        raise NotPicklable(
            "an OpenRun cannot be pickled or copied: start another one from the state of its "
            "snapshot(), of the same simulation"
        )

    @property
    def scene(self) -> Scene:
        """The scene that runs."""
        return self.simulation.scene

    @property
    def time(self) -> float:
        """Where the run stands [s]."""
        return float(self._core.time)

    @one_at_a_time
    def advance(self, duration: float, wall: float = math.inf) -> Result:
        """Go on for `duration` [s], or until `wall` [s] of computing are over.

        Returns the rows recorded meanwhile, maybe none. Fixed steps end at the first one beyond,
        the others exactly there. After the run has `ended` it stands still.

        Raises InvalidParameter if duration or wall is negative.
        """
        until = self.time + check_not_negative("duration", duration, "s")
        left = wall if wall == math.inf else check_not_negative("wall", wall, "s")
        if self.ended is None:
            status = advance(self._core, until, left)
            self.ended = advancing.why_ended(status, self._core, self.scene)
        rows = self._result(self._core.take(), first=self._rows)
        self._rows += len(rows.t)
        return rows

    @one_at_a_time
    def record_torques(self) -> None:
        """Record the controller's torques from now on, as `record=["torque"]` does from the start.

        Rows that were recorded before have nan.
        """
        self._core.record_torques()

    @one_at_a_time
    def snapshot(self) -> Result:
        """Return the state where the run stands, as a result of one row."""
        return self._result(self._core.snapshot())

    @property
    def residual(self) -> float:
        """Energy that has appeared from nowhere since the start [J]."""
        now, start = self.snapshot().energy, self._start.energy
        return float(now.total[0] - start.total[0])

    @one_at_a_time
    def change(self, scene: Scene, controller: advancing.AnyController = None) -> bool:
        """Go on with the laws, friction and radii of `scene`, and with `controller` unless None.

        The scene must have the same model and the same pairs otherwise; what this adds to the
        elastic energy counts as work of the controller. Returns False, and changes nothing, where
        the scenes differ in more than that: then start another OpenRun from `snapshot()`.
        """
        if not _alike(self.scene, scene):
            return False
        simulation = Simulation(scene, self.simulation.integrator, self.simulation.sensors)
        q, v = np.array(self._core.q), np.array(self._core.v)
        core_controller = None
        if controller is not None and controller is not self._controller:
            # What it leaves to the start of the run, such as its posture, is as at the start.
            start = self._start.q[0]
            core_controller, _ = advancing.bind_controller(
                scene, simulation.integrator, controller, self._control_dt, start, self._sensors
            )
        pairs = advancing.core_pairs(scene, q, v, warn=False)
        self._core.change(pairs, scene.bind_joints(), core_controller)
        if core_controller is not None:
            self._controller = controller
        self.simulation = simulation
        return True

    @one_at_a_time
    def take_over(self, before: OpenRun) -> None:
        """Go on where the controller of the run `before` is, which is at the same time.

        A target stays where it is on the same path, and an orientation that is held is.
        """
        self._core.take_over(before._core)

    @one_at_a_time
    def push(self, frame: str, force_world: ArrayLike) -> None:
        """Push at the origin of `frame` with a force (3,) [N] in the world, from now on.

        A push replaces the one before; zeros end it. Its work counts as the controller's.

        Raises
        ------
        FrameNotFound
            The model has no such frame.
        InvalidParameter
            The frame is fixed to the world, or the force is no three numbers.
        """
        force = check_vector("force_world", force_world, 3, " [N]")
        self._act(frame, np.zeros(3), force, np.zeros(3), 0.0, 0.0)

    @one_at_a_time
    def pull(
        self,
        frame: str,
        point: ArrayLike,
        anchor_world: ArrayLike,
        stiffness: float,
        damping: float = 0.0,
    ) -> None:
        """Pull a point of a body to an anchor with a spring and a damper, from now on.

        The force on the point x, which has the coordinates `point` (3,) [m] in `frame`, is
        stiffness (anchor - x) - damping x' [N/m], [N s/m], with `anchor_world` (3,) [m]. It is
        evaluated at each stage of a step. It takes the place of a push; another push or pull, such
        as a push of zero force, ends it. Its work counts as the controller's.

        Raises
        ------
        FrameNotFound
            The model has no such frame.
        InvalidParameter
            The frame is fixed to the world, point or anchor are no three numbers, or stiffness or
            damping is negative.
        """
        at = check_vector("point", point, 3, " [m]")
        anchor = check_vector("anchor_world", anchor_world, 3, " [m]")
        stiffness = check_not_negative("stiffness", stiffness, "N/m")
        damping = check_not_negative("damping", damping, "N s/m")
        self._act(frame, at, np.zeros(3), anchor, stiffness, damping)

    def _act(self, frame: str, point: Array, force: Array, anchor: Array, *spring: float) -> None:
        """Let a force and a spring to an anchor (stiffness, damping) act on a point of `frame`."""
        model = self.scene.model
        number = find_moving_frame(model, frame)
        where = model.frames[number]
        at = where.placement.act(point)
        stiffness, damping = spring
        self._core.push(where.parentJoint, at, force, anchor, stiffness, damping, number)

    @one_at_a_time
    def record_patches(self, on: bool) -> None:
        """Record the patches of the contacts from now on, or no longer; see `Simulation.run`."""
        self._core.record_patches(on)

    def _result(self, record: dict[str, NDArray[np.generic]], first: int = 0) -> Result:
        # The core counts rows from the start of the run, a result from its own first one.
        record["contact_row"] = record["contact_row"] - first
        names = tuple(pair.name for pair in self.scene.pairs)
        return Result._from_record(record, names, RunStats(), self.scene, self._sensors)


def _alike(before: Scene, after: Scene) -> bool:
    """Whether two scenes differ in laws, friction of a kind, radii and values of joints alone."""
    same_model = before.model is after.model or before.model == after.model
    if not before.joints.alike(after.joints, before.model):
        return False
    pairs = list(zip(before.pairs, after.pairs, strict=False))
    return (
        same_model and len(before.pairs) == len(after.pairs) and all(_same_place(*p) for p in pairs)
    )


def _same_place(a: ContactPair, b: ContactPair) -> bool:
    return (
        (a.joint_i, a.joint_j, a.name) == (b.joint_i, b.joint_j, b.name)
        and [(id(one.shell), one.method) for one in a.shells]
        == [(id(one.shell), one.method) for one in b.shells]
        and getattr(a.side_i, "find", None) is getattr(b.side_i, "find", None)
        and (type(a.side_i), type(a.side_j)) == (type(b.side_i), type(b.side_j))
        and type(a.friction) is type(b.friction)
        and (a.friction and a.friction.state_size) == (b.friction and b.friction.state_size)
        and bool(a.placement_i == b.placement_i)
        and bool(a.placement_j == b.placement_j)
    )
