"""Runs a scene, once or many times."""

import time
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from numpy.typing import ArrayLike

from sphshell_pin import _core, errors
from sphshell_pin.base.checks import check_not_negative, check_type
from sphshell_pin.base.summary import Fact, Summarized
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_parts import RunState
from sphshell_pin.dynamics.run import advance as advancing
from sphshell_pin.dynamics.run import rollout as rollouts
from sphshell_pin.dynamics.run.integrators import Adaptive, Integrator
from sphshell_pin.dynamics.run.sensitivities import Asked
from sphshell_pin.dynamics.scene.derivatives import StepDerivatives
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.dynamics.scene.scene_state import SceneState
from sphshell_pin.dynamics.scene.variations import Variations, check_names_of
from sphshell_pin.dynamics.sensing.sensors import Sensor, SensorSet, check_sensors


class Simulation(Summarized):
    """Moves `scene` in time with `integrator`, Adaptive() unless given.

    `sensors` are read on the way: for the results, and for controller callables.
    """

    def __init__(
        self, scene: Scene, integrator: Integrator | None = None, sensors: Iterable[Sensor] = ()
    ) -> None:
        if not isinstance(scene, Scene):
            raise errors.InvalidParameter(
                "scene", type(scene).__name__, "must be a sphshell_pin.Scene"
            )
        integrator = Adaptive() if integrator is None else integrator
        fixed = "SemiImplicitEuler(dt), RungeKutta4(dt) or LinearlyImplicitEuler(dt)"
        must = f"must be Adaptive(rtol), Implicit(rtol), {fixed}"
        check_type("integrator", integrator, Integrator, must)
        self.scene = scene
        self.integrator = integrator
        self.sensors = check_sensors(sensors)

    def _facts(self) -> list[Fact]:
        sensors = [Fact("sensors", len(self.sensors))] if self.sensors else []
        return [Fact("integrator", repr(self.integrator)), *self.scene._facts(), *sensors]

    def run(
        self,
        q0: ArrayLike | RunState,
        v0: ArrayLike | None = None,
        duration: float = 1.0,
        controller: advancing.AnyController = None,
        control_dt: float | None = None,
        *,
        record_dt: float | None = None,
        record: Collection[str] = (),
        sensitivities: Collection[str] = (),
        progress: Callable[[float], object] | None = None,
        t0: float = 0.0,
    ) -> Result:
        """Run from q0 (nq,), v0 (nv,) for `duration` [s] and return the Result.

        `controller`: None, a controller of this package, or a callable
        tau(t, q, v, contacts) -> (nv,). Torques are held for `control_dt` [s]; by default a
        callable is asked once a fixed step, a controller of this package at every stage of it.
        Adaptive and Implicit ask at every stage, and Implicit 2 nv + 2 times more a step, at states
        nearby: a callable with a memory needs control_dt. So does one with a fifth argument
        `sensors`: it gets the latest reading of each sensor by name. Rows are recorded every
        `record_dt` [s] (default: every step); `progress` is called a few times a second with the
        share done. The same input gives the same bits. With `record=("patch",)` the patch of each
        recorded contact is kept, too: `Result.patches`; with "torque" the controller's torques, cut
        to their limits: `Result.torque`. A controller that is not held is asked at each row then.
        With "state" each row has the state of the run, which `Result.at` returns; in place of q0,
        v0 and t0 it makes this run go on from there. Sensors begin anew, and controllers as well.

        `sensitivities` names what the rows are differentiated by: parameters as in
        `Scene.dynamics_derivatives`, "q0" and "v0" (nv columns each); `Result.sensitivities` then
        has the derivatives of q, v, forces and depths. Of fixed steps they are those of the steps
        that are made, of the other integrators those of the motion; stretches of bristles begin
        with their touch. A controller is then asked at states nearby as well, so that one with a
        memory, or that reads sensors, cannot be taken.

        A law that cannot stop its sphere earns a WeakLawWarning; a path off its shell, steps of
        SemiImplicitEuler that are longer than `Scene.explain` recommends, and more than a million
        rows, or more than a gigabyte of them, a SetupWarning.

        Raises InvalidParameter for wrong sizes and values, DeepStart for a sphere that starts
        deep inside, SimulationDiverged, RowsFillMemory and (on Ctrl-C) Interrupted, all with
        `.result`.
        """
        sensors = SensorSet(self.sensors, self.scene)
        asked = None
        if not isinstance(sensitivities, tuple) or sensitivities:
            asked = Asked(self.scene, sensitivities, controller)
        core = advancing.start_run(
            self.scene,
            self.integrator,
            q0,
            v0,
            duration,
            controller,
            control_dt,
            record_dt=record_dt,
            record=record,
            t0=t0,
            sensors=sensors,
            prepare=None if asked is None else asked.begin,
        )
        ctrl_c = advancing.CtrlC()
        kept = advancing.KeptRows(core, self.scene, record_dt)
        announced = advancing.many_rows(self.integrator, duration, record_dt) is not None

        def glance() -> None:
            kept.warn(duration, announced=announced, stacklevel=4)
            full = kept.full() if core.progress < 1 else None
            if full is not None:
                raise errors.RowsFillMemory(core.time, full, so_far())
            if progress is not None:
                progress(core.progress)
            if asked:
                asked.check(core)
            if ctrl_c.pressed and core.progress < 1:
                raise KeyboardInterrupt

        def so_far() -> Result:
            result = advancing.result_of(self.scene, self.integrator, core, core.take(), sensors)
            return replace(result, sensitivities=asked.rows(core)) if asked else result

        try:
            with ctrl_c:
                status = advancing.advance(core, glance=glance)
        except KeyboardInterrupt:
            raise errors.Interrupted(core.time, so_far()) from None
        result = so_far()
        reason = advancing.why_ended(status, core, self.scene)
        if reason is not None:
            raise errors.SimulationDiverged(core.time, reason, result)
        return result

    def step_derivatives(
        self,
        q: ArrayLike,
        v: ArrayLike | None = None,
        tau: ArrayLike | None = None,
        *,
        parameters: Collection[str] = (),
        state: SceneState | None = None,
    ) -> StepDerivatives:
        """Return where one fixed step from q (nq,), v (nv,) leads, and its derivatives.

        The torques tau (nv,) are held over the step (zero unless given). `parameters` and `state`
        as in `Scene.dynamics_derivatives`. They are the derivatives of what the step computes, not
        of the motion that it approximates.

        Raises InvalidParameter for an integrator whose steps have no fixed length.
        """
        dt = advancing.step_of(self.integrator)
        if dt == 0:
            raise errors.InvalidParameter(
                "integrator",
                self.integrator,
                "has no fixed step to differentiate: take SemiImplicitEuler(dt), RungeKutta4(dt) "
                "or LinearlyImplicitEuler(dt)",
            )
        columns, core = self.scene._bind_parameters(parameters, state)
        at = self.scene._at(state)
        found = at.step_derivatives(self.integrator.kind, dt, q, v, tau, core)
        return StepDerivatives(*found, columns)

    def rollout(
        self,
        q0s: ArrayLike,
        v0s: ArrayLike | None = None,
        duration: float = 1.0,
        threads: int | None = None,
        *,
        controller: advancing.AnyController | Sequence[advancing.AnyController] = None,
        control_dt: float | None = None,
        vary: Mapping[str, object] | None = None,
        record_dt: float | None = None,
        record: Collection[str] = (),
        progress: Callable[[float], object] | None = None,
        t0: float = 0.0,
    ) -> rollouts.Rollout:
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
            "PAIR.sphere.radius" (n) [m], "PAIR.sphere.offset" (n, 3) [m], the same of
            "PAIR.other_sphere", "PAIR.placement" of
            the shell in its frame (n pinocchio.SE3), "sensors.NAME.FIELD" (n numbers), such as the
            seed of a sensor's noise
        record_dt : between recorded rows [s]; unless given only start and end are recorded
        record : as of `run`
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
        scene, integrator = self.scene, self.integrator
        sensors = SensorSet(self.sensors, scene)
        began = time.perf_counter()
        workers = rollouts.worker_count(threads)
        duration = check_not_negative("duration", duration, "s")
        vary = check_names_of(vary)
        starts = rollouts.states_of(scene, q0s, v0s, vary, controller)
        # Start and end are rows whatever the time between rows.
        rows = record_dt if record_dt is not None else (duration or None)

        def settings_of(scene: Scene, hold: float) -> _core.RunSettings:
            return advancing.run_settings(
                scene, integrator, duration, hold, record_dt=rows, record=record, t0=t0
            )

        settings = {0.0: settings_of(scene, 0.0)}
        controllers = rollouts.one_each(controller, len(starts))
        rollouts.check_controllers(scene, integrator, controllers, control_dt, starts, sensors)
        variations = Variations(scene, vary, len(starts), sensors.sensors)
        plan = rollouts.Plan(starts, [None] * len(starts), variations, {}, t0)

        def add(run: int) -> None:
            q0, v0 = starts[run]
            varied = variations.scene(run)
            bound, hold = advancing.bind_controller(
                varied, integrator, controllers[run], control_dt, q0, sensors
            )
            if hold not in settings:
                settings[hold] = settings_of(varied, hold)
            # The rollout warns of a weak law when a sphere has gone through.
            pairs = advancing.core_pairs(varied, q0, v0, warn=False)
            measuring = variations.sensors(run)
            read = sensors if measuring is sensors.sensors else SensorSet(measuring, scene)
            core.add(pairs, joints, bound, q0, v0, settings[hold], read.core)

        def rollout() -> rollouts.Rollout:
            wall_time = time.perf_counter() - began
            return rollouts.Rollout(scene, integrator, core, plan, workers, wall_time, sensors)

        workers = max(min(workers, len(starts)), 1)
        joints = scene.bind_joints()
        core = _core.Rollout(scene.model, workers)
        tasks = rollouts.Tasks(core, workers, progress, len(starts), plan.failures)
        try:
            with advancing.CtrlC() as ctrl_c:
                for run in range(len(starts)):
                    try:
                        add(run)
                    except Exception as fault:
                        # A contact source is asked about the start, and may raise.
                        plan.failures[run] = rollouts.not_begun(fault)
                        continue
                    plan.numbers[run] = tasks.added
                    tasks.make_room(ctrl_c)
                tasks.wait(0, ctrl_c)
        except KeyboardInterrupt:
            core.stop()
            plan.leave_out(core)
            raise errors.RolloutInterrupted(tasks.done, rollout()) from None
        finally:
            core.stop()
        return rollout()
