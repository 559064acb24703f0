"""What is left of many runs of one scene."""

from __future__ import annotations

import math
import re
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, NoReturn, overload

import numpy as np
from numpy.typing import ArrayLike

from sphshell_pin import _core, errors
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_floats, read_only
from sphshell_pin.base.summary import Fact, Summarized, names
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.run_stats import PairFigures
from sphshell_pin.dynamics.run import advance
from sphshell_pin.dynamics.run.integrators import Integrator
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.dynamics.scene.variations import Variations, has_length
from sphshell_pin.dynamics.sensing.sensors import SensorSet
from sphshell_pin.shell.options import thread_count

if TYPE_CHECKING:
    import pandas as pd

Start = tuple[Array, Array]

# So many runs, for each thread, are made ready while others run.
_AHEAD = 32
# More would only wait for each other, and a system may not start them.
_MOST_THREADS = 1024


class Tasks:
    """Keeps the threads busy without making all runs ready at once."""

    def __init__(
        self,
        core: _core.Rollout,
        workers: int,
        progress: Callable[[float], object] | None,
        count: int,
        failures: Mapping[int, errors.SphshellError],
    ) -> None:
        self.added = self.done = 0
        self._core, self._ahead = core, _AHEAD * workers
        self._progress, self._count, self._failures = progress, count, failures
        self._told = 0.0

    def make_room(self, ctrl_c: advance.CtrlC) -> None:
        """Note one run more; wait where enough are waiting."""
        self.added += 1
        if self.added - self.done >= 2 * self._ahead:
            self.wait(self._ahead, ctrl_c)

    def wait(self, left: int, ctrl_c: advance.CtrlC) -> None:
        """Wait until `left` runs or fewer are not done."""
        while True:
            self.done = self._core.wait(left, advance.GLANCE)
            over = self.done + len(self._failures)
            finished = over == self._count
            if self._progress is not None and (
                finished or time.perf_counter() - self._told > advance.GLANCE
            ):
                self._told = time.perf_counter()
                self._progress(1.0 if finished else over / self._count)
            if ctrl_c.pressed:
                raise KeyboardInterrupt
            if self.added - self.done <= left:
                return


def worker_count(threads: int | None) -> int:
    """Return how many threads are wanted."""
    workers = thread_count(threads)
    if workers > _MOST_THREADS:
        raise errors.InvalidParameter("threads", threads, f"must be {_MOST_THREADS} at most")
    return workers


def not_begun(fault: Exception) -> errors.SphshellError:
    """Return why a run could not begin: a fault of this package, or of a user's routine."""
    if isinstance(fault, errors.SphshellError):
        return fault
    told = [f"{type(fault).__name__}: {fault}", *getattr(fault, "__notes__", ())]
    return errors.SphshellError(f"the run could not begin, its routine raised {', '.join(told)}")


def check_controllers(
    scene: Scene,
    integrator: Integrator,
    controllers: Sequence[advance.AnyController],
    control_dt: float | None,
    starts: list[Start],
    sensors: SensorSet,
) -> None:
    """Refuse a controller that cannot be, each of them once, before anything runs."""
    seen = set[int]()
    for run, controller in enumerate(controllers):
        if id(controller) in seen:
            continue
        seen.add(id(controller))
        try:
            advance.bind_controller(
                scene, integrator, controller, control_dt, starts[run][0], sensors
            )
        except errors.InvalidParameter as error:
            if run == 0:
                raise
            raise errors.InvalidParameter(
                f"the controller of run {run}", controller, str(error), given="cannot be taken:"
            ) from None


def one_each(
    controller: advance.AnyController | Sequence[advance.AnyController], count: int
) -> Sequence[advance.AnyController]:
    """Return the controller of each run."""
    if not isinstance(controller, Sequence):
        return [controller] * count
    if len(controller) != count:
        raise errors.InvalidParameter(
            "controller",
            controller,
            f"must be one for all runs, or {count}, one a run",
            given=f"of {len(controller)} controllers",
        )
    return controller


def states_of(
    scene: Scene,
    q0s: ArrayLike,
    v0s: ArrayLike | None,
    vary: Mapping[str, object],
    controller: advance.AnyController | Sequence[advance.AnyController],
) -> list[Start]:
    """Return the checked starts; what is given once holds for all runs."""
    model = scene.model
    tables = {}
    for name, given, size in (("q0s", q0s, model.nq), ("v0s", v0s, model.nv)):
        if given is None:
            continue
        table = check_floats(name, given, f"must be numbers, (n, {size})")
        if table.ndim not in (1, 2) or table.shape[-1] != size:
            raise errors.InvalidParameter(
                name, given, f"must have shape (n, {size})", given=f"of shape {table.shape}"
            )
        tables[name] = table
    if "q0s" not in tables:
        raise errors.InvalidParameter("q0s", q0s, f"must be numbers, (n, {model.nq})")
    counts = {name: len(table) for name, table in tables.items() if table.ndim == 2}
    lengths = {f"vary['{name}']": len(v) for name, v in vary.items() if has_length(v)}
    if isinstance(controller, Sequence):
        lengths["controller"] = len(controller)
    count = next(iter({**counts, **lengths}.values()), 1)
    if len(set(counts.values())) > 1:
        raise errors.InvalidParameter(
            "q0s, v0s", counts, "must have as many rows", given=f"of {counts} rows"
        )
    starts = []
    for run in range(count):
        row = {name: t if t.ndim == 1 else t[run] for name, t in tables.items()}
        try:
            starts.append(scene.check_state(row["q0s"], row.get("v0s")))
        except errors.InvalidParameter as error:
            raise errors.InvalidParameter(
                f"the start of run {run}", error.value, str(error), given="cannot be taken:"
            ) from None
    return starts


_STOPPED = 0
# What the interpreter tells before the exception itself.
_TRACEBACK = re.compile(r'Traceback .*\n(  File ".*", line \d+, in .*\n)*')


@dataclass(frozen=True)
class Plan:
    """What was to be run: `numbers` are those of the compiled runs, None of those not begun."""

    starts: list[tuple[Array, Array]]
    numbers: list[int | None]
    variations: Variations
    failures: dict[int, errors.SphshellError]
    t0: float

    def leave_out(self, core: _core.Rollout) -> None:
        """Note the runs that an interrupted rollout has not begun."""
        for run, number in enumerate(self.numbers):
            # The threads had not come to it.
            if number is not None and not len(core.outcome(number).q):
                self.numbers[run] = None
            if self.numbers[run] is None and run not in self.failures:
                why = "the rollout was interrupted before this run began"
                self.failures[run] = errors.SphshellError(why)


class Rollout(Summarized, Sequence[Result]):
    """Runs that Simulation.rollout made: n of them, in the order of their starts.

    [i] gives the Result of run i, with the rows that were recorded, and a slice a list of them; a
    run that could not begin raises its failure.

    Attributes
    ----------
    t (n,) : when each run ended [s]
    q (n, nq), v (n, nv) : its state there
    steps (n,) : how many it took
    residual (n,) : energy that appeared from nowhere from its first row to its last [J]
    figures : of each pair over all steps, (n,) each: "PAIR.peak_force", "PAIR.mean_force" [N],
        "PAIR.impulse" [N s], "PAIR.max_depth" [m], "PAIR.contact_time", "PAIR.peak_force_time",
        "PAIR.max_depth_time" [s], "PAIR.touches"; nan in runs that could not begin
    failures : why runs ended before their time, by their numbers; {} where all is well
    varied : what was varied, by name: the values of all runs
    threads : how many worked
    wall_time : of the whole rollout [s]
    """

    def __init__(
        self,
        scene: Scene,
        integrator: Integrator,
        core: _core.Rollout,
        plan: Plan,
        threads: int,
        wall_time: float,
        sensors: SensorSet,
    ) -> None:
        self._integrator, self._core, self._plan = integrator, core, plan
        self._sensors = sensors
        self.threads, self.wall_time = threads, wall_time
        self.varied = plan.variations.columns
        self.failures = dict(plan.failures)
        count = len(plan.starts)
        self.t = np.full(count, plan.t0)
        self.q = np.array([q for q, _ in plan.starts]).reshape(count, scene.model.nq)
        self.v = np.array([v for _, v in plan.starts]).reshape(count, scene.model.nv)
        self.steps = np.zeros(count, dtype=np.int64)
        self.residual = np.full(count, math.nan)
        self.figures: dict[str, Array] = {}
        through: list[tuple[int, str]] = []
        for run, number in enumerate(plan.numbers):
            if number is None:
                continue
            outcome = core.outcome(number)
            why_not = self._why_not_begun(run, outcome)
            if why_not is not None:
                plan.numbers[run] = None
                plan.failures[run] = self.failures[run] = why_not
                continue
            self.t[run], self.steps[run] = outcome.time, outcome.counts["steps"]
            self.q[run], self.v[run] = outcome.q, outcome.v
            self.residual[run] = outcome.residual
            # Behind the pairs are the stops of joints.
            for pair, summary in zip(scene.pairs, outcome.summaries, strict=False):
                for name, value in asdict(PairFigures.from_core(summary)).items():
                    column = self.figures.setdefault(
                        f"{pair.name}.{name}", np.full(count, math.nan)
                    )
                    column[run] = value
            through += [(run, scene.pairs[k].name) for k in outcome.through]
            why = self._why_failed(run, outcome)
            if why is not None:
                self.failures[run] = why
        self.failures = dict(sorted(self.failures.items()))
        for array in (self.t, self.q, self.v, self.steps, self.residual, *self.figures.values()):
            read_only(array)
        if through:
            run, name = through[0]
            runs = len({run for run, _ in through})
            warnings.warn(
                f"in {runs} of {count} runs, the first of them run {run}, a sphere's center was "
                f"pushed through the shell: the law of contact '{name}' is too weak for the speed",
                errors.WeakLawWarning,
                stacklevel=4,
            )

    def __len__(self) -> int:
        """Return the number of runs."""
        return len(self._plan.numbers)

    @overload
    def __getitem__(self, index: int) -> Result: ...
    @overload
    def __getitem__(self, index: slice) -> list[Result]: ...
    def __getitem__(self, index: int | slice) -> Result | list[Result]:
        """Return the result of a run, or of a slice of the runs."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        run = range(len(self))[index]
        number = self._plan.numbers[run]
        if number is None:
            raise self._plan.failures[run].with_traceback(None)
        return self._result(run, self._core.outcome(number))

    def _facts(self) -> list[Fact]:
        ended = float(self.t.max()) if len(self) else math.nan
        return [
            Fact("runs", len(self)),
            Fact("failed", len(self.failures)),
            Fact("until", ended, "s"),
            Fact("varied", names(self.varied)),
        ]

    def __reduce__(self) -> NoReturn:
        """Refuse to be pickled: the runs are with the compiled core."""
        raise errors.NotPicklable(
            "a Rollout cannot be pickled or copied: keep its to_dataframe(), or save a run with "
            "rollout[i].save(path)"
        )

    def to_dataframe(self) -> pd.DataFrame:
        """Return a pandas DataFrame with a row for each run: what was varied, and its figures.

        What was varied and is no number is left out. Raises MissingExtra without pandas.
        """
        pandas = errors.import_extra("pandas", "tables", "Rollout.to_dataframe")
        columns: dict[str, object] = {"run": np.arange(len(self))}
        for name, values in self.varied.items():
            array = np.asarray(values)
            if array.dtype.kind in "fi" and array.ndim < 3:  # poses are matrices
                parts = array.T if array.ndim == 2 else [array]
                suffixes = [f".{i}" for i in range(len(parts))] if array.ndim == 2 else [""]
                columns |= {f"{name}{s}": part for s, part in zip(suffixes, parts, strict=True)}
        columns |= {"t": self.t, "steps": self.steps, "residual": self.residual, **self.figures}
        columns["failure"] = [str(self.failures.get(run, "")) for run in range(len(self))]
        return pandas.DataFrame(columns)

    def _result(self, run: int, outcome: _core.Outcome) -> Result:
        number = self._plan.numbers[run]
        assert number is not None
        scene = self._plan.variations.scene(run)
        record = self._core.record(number)
        return advance.result_of(scene, self._integrator, outcome, record, self._sensors)

    def _why_not_begun(self, run: int, outcome: _core.Outcome) -> errors.SphshellError | None:
        if outcome.deep_start is not None:
            return advance.deep_start(self._plan.variations.scene(run), *outcome.deep_start)
        if not len(outcome.q):  # memory was short before the start
            return errors.SphshellError(f"the run could not begin: {outcome.fault}")
        return None

    def _why_failed(self, run: int, outcome: _core.Outcome) -> errors.SphshellError | None:
        if outcome.fault:
            why = " ".join(_TRACEBACK.sub("", outcome.fault, count=1).split()).rstrip(":")
            return errors.RunFailed(outcome.time, why, self._result(run, outcome))
        reason = advance.why_ended(outcome.status, outcome, self._plan.variations.scene(run))
        if reason is not None:
            return errors.SimulationDiverged(outcome.time, reason, self._result(run, outcome))
        if outcome.status == _STOPPED:
            return errors.Interrupted(outcome.time, self._result(run, outcome))
        return None
