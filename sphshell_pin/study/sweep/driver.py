"""A sweep from its start to its table: plan, check, do the runs that are missing, write."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import tempfile
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from sphshell_pin.errors import (
    InvalidParameter,
    ResultError,
    ScenarioError,
    SphshellError,
    SweepError,
)
from sphshell_pin.scenario import (
    Built,
    Scenario,
    find_scenario,
    read_scenario,
    shipped_scenarios,
)
from sphshell_pin.scenario.build import build_scenario
from sphshell_pin.scenario.figures import check_expectations
from sphshell_pin.scenario.knobs import meaning
from sphshell_pin.scenario.reading import look_up
from sphshell_pin.study.sweep.cluster import run_on_cluster
from sphshell_pin.study.sweep.grid import Axis, Value, Vary, axes_of, points_of, text_of
from sphshell_pin.study.sweep.job import (
    FAILED,
    Job,
    Run,
    digest,
    digest_files,
    digest_settings,
    files_of,
    need,
    versions,
)
from sphshell_pin.study.sweep.journal import SUFFIX, Journal
from sphshell_pin.study.sweep.local import run_locally
from sphshell_pin.study.sweep.table import (
    check_place,
    check_suffix,
    columns_of,
    frame_of,
    varied_columns,
    write_table,
)
from sphshell_pin.study.sweep.worker import changed, run_one, sweep_figures, verdict_names

if TYPE_CHECKING:
    import pandas as pd

Progress = Callable[[int, int, int], object]
"""Called with the numbers of runs done, failed among them, and in all."""


@dataclass(frozen=True)
class Plan:
    """A sweep whose keys and values were checked."""

    axes: tuple[Axis, ...]
    points: list[tuple[Value, ...]]
    """The values of each run, in the order of `axes`."""
    runs: list[Run]
    digests: list[str]
    """Of each run's settings."""
    figures: tuple[str, ...]
    """Columns that a finished run fills."""
    job: Job
    head: Mapping[str, object]
    """What distinguishes this sweep from another."""

    @property
    def varied(self) -> pd.DataFrame:
        """The columns of the varied keys, as a pandas.DataFrame."""
        return frame_of(varied_columns(self.axes, self.points))


@dataclass(frozen=True)
class SweepReport:
    """What a sweep left behind."""

    table: pd.DataFrame
    """A row for each run."""
    out: Path | None
    journal: Path | None
    resumed: int
    """Runs that had been done before."""
    deaths: int
    """Workers that died; their runs were done again."""
    failed: int
    notes: tuple[str, ...] = field(default=())
    """What happened on the way, one sentence each."""


def sweep(
    scenario: str | PathLike[str],
    vary: Vary | Iterable[str],
    *,
    changes: Mapping[str, str] | None = None,
    together: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    out: str | PathLike[str] | None = None,
    verdicts: bool = False,
    retry_failed: bool = False,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """Run a scenario many times with other values and return the table of its figures.

    Parameters
    ----------
    scenario : name of a shipped one, or path of a file.
    vary : what varies: a mapping from dotted keys, as --set takes them, to sequences of values or
        to texts "lo:hi:n", "lo:hi:log:n", "a,b,c"; or texts "key=lo:hi:n". All combinations are
        run; the last key varies fastest.
    changes : values by dotted key that are the same in all runs.
    together : let all keys take their first values in the first run, and so on, in place of all
        combinations.
    workers : processes of this machine; by default as many as there are processors. 0 does the
        runs in this process.
    scheduler : address of a Dask scheduler, "tcp://host:port", whose workers do the runs instead.
    out : .parquet or .h5 file of the table. What is done is kept beside it, in `out` + ".journal";
        the same call continues from there, whatever ended the one before. None: nothing is kept.
    verdicts : give each expectation of the scenario a column: 1 where met, 0 where missed.
    retry_failed : do again the runs that failed, as the journal says.
    progress : called with the numbers of runs done, failed among them, and in all.

    Returns
    -------
    pandas.DataFrame : row i is run i: `run`, the varied keys, `status` ("done", "failed"), `error`
        (why it failed, in one sentence), the figures of a run's summary [SI units] (NaN where a
        run has none), `settings`, the digest of its settings. Bit for bit the same however and
        wherever the runs were made, on one kind of processor.

    Raises
    ------
    ScenarioError, NameNotFound, InvalidParameter
        The scenario, a key or a value is wrong; raised before anything runs.
    SweepError
        The journal is of another sweep, no scheduler answers, or a worker cannot do any run.
    ResultError
        The table or the journal cannot be written.
    MissingExtra
        An optional package is missing: pip install 'sphshell-pin[sweep]'.
    KeyboardInterrupt
        On Ctrl-C; its text says how many runs are done and kept.
    """
    plan = plan_sweep(scenario, vary, changes=changes, together=together, verdicts=verdicts)
    report = run_plan(
        plan,
        workers=workers,
        scheduler=scheduler,
        out=None if out is None else Path(out),
        retry_failed=retry_failed,
        progress=progress,
    )
    return report.table


def plan_sweep(
    scenario: str | PathLike[str],
    vary: Vary | Iterable[str],
    *,
    changes: Mapping[str, str] | None = None,
    together: bool = False,
    verdicts: bool = False,
) -> Plan:
    """Check all runs of a sweep, see `sweep`, and return what it will do."""
    given = axes_of(vary)
    path = find_scenario(scenario)
    _check_keys(given, changes or {}, path)
    points = points_of(given, together)
    fixed = read_scenario(path, changes)
    axes = tuple(replace(axis, unit=_unit(fixed, axis.key, path)) for axis in given)
    runs = [
        Run(i, {axis.key: text_of(value) for axis, value in zip(axes, point, strict=True)})
        for i, point in enumerate(points)
    ]
    digests, names = [], set[str]()
    for run in runs:
        one = changed(fixed, run, path)
        digests.append(digest_settings(one))
        names |= files_of(one)
    sample, built = _build_one(runs, fixed, path)
    figures = sweep_figures(built)
    if verdicts:
        check_expectations(built)
        figures += [f"met.{name}" for name in verdict_names(fixed)]
    for axis in axes:
        if axis.key in figures:
            raise InvalidParameter(
                "vary",
                axis.key,
                "is what a column of figures is called: give each routine a figure of its own",
            )
    shipped = path == shipped_scenarios().get(path.stem)
    files, used = digest_files(path.parent, names), versions()
    head = {
        "scenario": path.stem,
        "settings": digest_settings(fixed),
        "vary": [[axis.key, list(axis.values)] for axis in axes],
        "together": together,
        "verdicts": verdicts,
        "files": files,
        "versions": used,
    }
    job = Job(
        name=path.stem if shipped else str(path.absolute()),
        shipped=shipped,
        scenario=fixed,
        sample=sample,
        verdicts=verdicts,
        files=files,
        versions=used,
        token=digest([str(path.absolute()), head]),
    )
    return Plan(axes, points, runs, digests, tuple(figures), job, head)


def run_plan(
    plan: Plan,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    out: Path | None = None,
    retry_failed: bool = False,
    progress: Progress | None = None,
    note: Callable[[str], object] | None = None,
) -> SweepReport:
    """Do what the journal beside `out` does not hold yet, and write the table; see `sweep`.

    `note` is called with what a person who waits should know, in one sentence.
    """
    workers = _count_workers(workers, scheduler)
    need("pandas")
    if out is not None:
        check_suffix(out)
        check_place(out)
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        # A worker that loads the script of its parent must not begin the sweep again.
        raise SweepError('a script must call sweep below if __name__ == "__main__":')
    notes: list[str] = []

    def report_note(sentence: str) -> None:
        notes.append(sentence)
        if note is not None:
            note(sentence)

    journal = None
    if out is not None:
        _make_folder(out.parent)
        journal = Journal(out.with_name(out.name + SUFFIX), plan.head, len(plan.runs))
        for sentence in journal.notes:
            report_note(sentence)
    outcomes = {} if journal is None else dict(journal.outcomes)
    if retry_failed:
        outcomes = {i: one for i, one in outcomes.items() if one.status != FAILED}
    resumed = len(outcomes)
    failed = sum(one.status == FAILED for one in outcomes.values())
    missing = [run for run in plan.runs if run.number not in outcomes]
    deaths: list[int] = []
    if scheduler is not None and missing:
        done = run_on_cluster(plan.job, missing, scheduler, report_note, deaths.append)
    elif workers:
        done = run_locally(plan.job, missing, workers, deaths.append)
    else:
        done = (run_one(plan.job, run) for run in missing)
    with contextlib.closing(journal) if journal else contextlib.nullcontext():
        try:
            with contextlib.closing(done):
                if progress is not None:
                    progress(len(outcomes), failed, len(plan.runs))
                for outcome in done:
                    if journal is not None:
                        journal.add(outcome)
                    outcomes[outcome.number] = outcome
                    failed += outcome.status == FAILED
                    if progress is not None:
                        progress(len(outcomes), failed, len(plan.runs))
        except KeyboardInterrupt:
            kept = f"are done and kept in {journal.path}" if journal is not None else "were done"
            text = f"{len(outcomes)} of {len(plan.runs)} runs {kept}"
            raise KeyboardInterrupt(text) from None
    columns = columns_of(plan.axes, plan.points, plan.digests, outcomes, plan.figures)
    if out is not None:
        write_table(out, columns, plan.head)
    return SweepReport(
        table=frame_of(columns),
        out=out,
        journal=None if journal is None else journal.path,
        resumed=resumed,
        deaths=sum(deaths),
        failed=failed,
        notes=tuple(notes),
    )


def _make_folder(folder: Path) -> None:
    """Make the folder of the table, and prove that it can be written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as fault:
        raise ResultError(
            folder, f"the folder cannot be written: {fault.strerror}; give another with --out"
        ) from None


def _check_keys(axes: Iterable[Axis], changes: Mapping[str, str], path: Path) -> None:
    """Refuse two keys for one value: which of them holds would be a matter of order."""
    scenario = read_scenario(path)

    def full_name(key: str) -> str:
        try:
            return look_up(scenario, key, path)[1]
        except ScenarioError:
            return key  # not in the file; read_scenario raises if no file may have it

    keys = [axis.key for axis in axes]
    meant = [full_name(key) for key in keys]
    for key, whole in zip(keys, meant, strict=True):
        if meant.count(whole) > 1:
            raise InvalidParameter("vary", key, "is given twice: put all its values together")
        if whole in map(full_name, changes):
            raise InvalidParameter("vary", key, "is set as well: leave one of the two out")


def _unit(scenario: Scenario, key: str, path: Path) -> str:
    try:
        return meaning(scenario, look_up(scenario, key, path)).unit
    except ScenarioError:
        return ""  # not in the file; read_scenario raises if no file may have it


def _build_one(runs: list[Run], scenario: Scenario, path: Path) -> tuple[Run, Built]:
    """Build the first run, or else the last: where neither can be, no run can be built."""
    faults: list[SphshellError] = []
    for run in (runs[0], runs[-1]):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return run, build_scenario(changed(scenario, run, path), path)
        except SphshellError as fault:
            faults.append(fault)
    raise faults[0]


def _count_workers(workers: int | None, scheduler: str | None) -> int:
    if scheduler is not None and workers is not None:
        raise InvalidParameter("workers", workers, "is for this machine: a scheduler has its own")
    if workers is None:
        return (
            len(os.sched_getaffinity(0))
            if hasattr(os, "sched_getaffinity")
            else os.cpu_count() or 1
        )
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 0:
        raise InvalidParameter("workers", workers, "must be a whole number, 0 or more")
    return workers
