"""Makes many runs of one scene at once, over threads."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sphshell_pin import _core
from sphshell_pin.checks import as_floats, check_not_negative
from sphshell_pin.contact import BristleFriction
from sphshell_pin.dynamics.controllers import Callback, Controller
from sphshell_pin.dynamics.rollout import Plan, Rollout
from sphshell_pin.dynamics.scene import ContactPair
from sphshell_pin.dynamics.simulation import GLANCE, CtrlC, Simulation
from sphshell_pin.dynamics.variations import Variations
from sphshell_pin.errors import (
    DeepStart,
    InvalidParameter,
    RolloutInterrupted,
    SphshellError,
    WeakLawWarning,
)
from sphshell_pin.shell.options import thread_count

Array = NDArray[np.float64]
_OneController = Controller | Callback | None

# So many runs, for each thread, are made ready while others run.
_AHEAD = 32


def roll_out(
    simulation: Simulation,
    q0s: Any,
    v0s: Any,
    duration: float,
    threads: int | None,
    *,
    controller: Any,
    control_dt: float | None,
    vary: Mapping[str, Any] | None,
    record_dt: float | None,
    progress: Callable[[float], object] | None,
    t0: float,
) -> Rollout:
    """Make the runs of Simulation.rollout, which see."""
    began = time.perf_counter()
    workers = thread_count(threads)
    duration = check_not_negative("duration", duration, "s")
    starts = _states(simulation, q0s, v0s, vary, controller)
    controllers = _one_each(controller, len(starts))
    variations = Variations(simulation.scene, vary, len(starts))
    failures = _deep_starts(simulation, variations, starts)
    plan = Plan(starts, [None] * len(starts), variations, failures, t0)
    # Start and end are rows whatever the time between rows.
    rows = record_dt if record_dt is not None else (duration or None)
    settings: dict[float, _core.RunSettings] = {}

    def add(run: int) -> None:
        q0, v0 = starts[run]
        varied = Simulation(variations.scene(run), simulation.integrator)
        core_controller, hold = varied.bind(controllers[run], control_dt, q0)
        if hold not in settings:
            settings[hold] = varied.core_settings(duration, hold, record_dt=rows, t0=t0)
        core.add(_core_pairs(varied, q0, v0), core_controller, q0, v0, settings[hold])

    core = _core.Rollout(simulation.scene.model, workers)
    tasks = _Tasks(core, workers, progress, len(starts), len(failures))
    try:
        with CtrlC() as ctrl_c:
            for run in range(len(starts)):
                if run not in failures:
                    plan.numbers[run] = tasks.added
                    add(run)
                    tasks.make_room(ctrl_c)
            tasks.wait(0, ctrl_c)
    except KeyboardInterrupt:
        core.stop()
        for run, number in enumerate(plan.numbers):
            # The threads had not come to it.
            if number is not None and not len(core.outcome(number)["q"]):
                plan.numbers[run] = None
            if plan.numbers[run] is None and run not in failures:
                failures[run] = SphshellError("the rollout was interrupted before this run began")
        rollout = Rollout(simulation, core, plan, workers, time.perf_counter() - began)
        raise RolloutInterrupted(tasks.done, rollout) from None
    finally:
        core.stop()
    return Rollout(simulation, core, plan, workers, time.perf_counter() - began)


class _Tasks:
    """Keeps the threads busy without making all runs ready at once."""

    def __init__(
        self,
        core: _core.Rollout,
        workers: int,
        progress: Callable[[float], object] | None,
        count: int,
        failed: int,
    ) -> None:
        self.added = self.done = 0
        self._core, self._ahead = core, _AHEAD * workers
        self._progress, self._count, self._failed = progress, count, failed
        self._told = 0.0

    def make_room(self, ctrl_c: CtrlC) -> None:
        """Note one run more; wait where enough are waiting."""
        self.added += 1
        if self.added - self.done >= 2 * self._ahead:
            self.wait(self._ahead, ctrl_c)

    def wait(self, left: int, ctrl_c: CtrlC) -> None:
        """Wait until `left` runs or fewer are not done."""
        while True:
            self.done = self._core.wait(left, GLANCE)
            finished = self.done + self._failed == self._count
            if self._progress is not None and (
                finished or time.perf_counter() - self._told > GLANCE
            ):
                self._told = time.perf_counter()
                self._progress((self.done + self._failed) / self._count)
            if ctrl_c.pressed:
                raise KeyboardInterrupt
            if self.added - self.done <= left:
                return


def _one_each(controller: Any, count: int) -> Sequence[_OneController]:
    """Return the controller of each run."""
    if not isinstance(controller, list | tuple):
        return [controller] * count
    if len(controller) != count:
        raise InvalidParameter(
            "controller",
            controller,
            f"must be one for all runs, or {count}, one a run",
            given=f"of {len(controller)} controllers",
        )
    return controller


def _states(
    simulation: Simulation, q0s: Any, v0s: Any, vary: Mapping[str, Any] | None, controller: Any
) -> list[tuple[Array, Array]]:
    """Return the checked starts; what is given once holds for all runs."""
    model = simulation.scene.model
    tables = {}
    for name, given, size in (("q0s", q0s, model.nq), ("v0s", v0s, model.nv)):
        if given is None:
            continue
        try:
            table = as_floats(given)
        except (TypeError, ValueError):
            raise InvalidParameter(name, given, f"must be numbers, (n, {size})") from None
        if table.ndim not in (1, 2) or table.shape[-1] != size:
            raise InvalidParameter(
                name, given, f"must have shape (n, {size})", given=f"of shape {table.shape}"
            )
        tables[name] = table
    if "q0s" not in tables:
        raise InvalidParameter("q0s", q0s, f"must be numbers, (n, {model.nq})")
    counts = {name: len(table) for name, table in tables.items() if table.ndim == 2}
    lengths = {
        f"vary['{name}']": len(v) for name, v in (vary or {}).items() if hasattr(v, "__len__")
    }
    if isinstance(controller, list | tuple):
        lengths["controller"] = len(controller)
    count = next(iter({**counts, **lengths}.values()), 1)
    if len(set(counts.values())) > 1:
        raise InvalidParameter(
            "q0s, v0s", counts, "must have as many rows", given=f"of {counts} rows"
        )
    starts = []
    for run in range(count):
        row = {name: t if t.ndim == 1 else t[run] for name, t in tables.items()}
        try:
            starts.append(simulation.scene.check_state(row["q0s"], row.get("v0s")))
        except InvalidParameter as error:
            raise InvalidParameter(
                f"the start of run {run}", error.value, f"cannot be taken: {error}", given=""
            ) from None
    return starts


def _has_state(pairs: Sequence[ContactPair]) -> bool:
    return any(isinstance(pair.friction, BristleFriction) for pair in pairs)


def _core_pairs(simulation: Simulation, q0: Array, v0: Array) -> list[_core.Pair]:
    """Build the C++ twins of the pairs; what bristles need to know of the start costs most."""
    pairs = simulation.scene.pairs
    if not _has_state(pairs):
        return [pair.to_core() for pair in pairs]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", WeakLawWarning)  # told of what happens, when it has
        return simulation.core_pairs(q0, v0)


def _deep_starts(
    simulation: Simulation, variations: Variations, starts: list[tuple[Array, Array]]
) -> dict[int, SphshellError]:
    """Return the runs that would start with a sphere deep inside, as Simulation.run sees it."""
    scene = simulation.scene
    data = scene.model.createData()
    spheres = [k for k, pair in enumerate(scene.pairs) if pair.sphere is not None]
    centres = {k: np.empty((len(starts), 3)) for k in spheres}
    radii = {k: np.empty(len(starts)) for k in spheres}
    for run, (q0, _) in enumerate(starts if spheres else []):
        pin.forwardKinematics(scene.model, data, q0)
        pairs = variations.pairs(run)
        for k in spheres:
            pair = pairs[k]
            centre = data.oMi[pair.joint_i].act(pair.sphere_placement.translation)
            centres[k][run] = (data.oMi[pair.joint_j] * pair.shell_placement).actInv(centre)
            radii[k][run] = pair.sphere.radius if pair.sphere is not None else math.nan
    out: dict[int, SphshellError] = {}
    for k in spheres:
        pair = scene.pairs[k]
        assert pair.shell is not None
        depth, _ = pair.shell.contacts_batch(centres[k], radii[k], method=pair.method)
        if pair.shell.side != "both" and pair.shell.is_closed:
            away = pair.shell.closest_points(centres[k], threads=None, method=pair.method).distances
            depth = np.maximum(depth, radii[k] - (away if pair.shell.side == "outside" else -away))
        for run in np.flatnonzero(depth > 0.5 * radii[k]).tolist():
            out.setdefault(run, DeepStart(pair.name, float(depth[run]), float(radii[k][run])))
    return out
