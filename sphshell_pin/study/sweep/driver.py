"""A sweep from its start to its table: do the runs that the table does not hold yet."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from sphshell_pin.errors import InvalidParameter, SweepError
from sphshell_pin.study.sweep.distributions import Dist
from sphshell_pin.study.sweep.grid import Vary
from sphshell_pin.study.sweep.job import FAILED, Outcome, need
from sphshell_pin.study.sweep.plan import Plan, plan_sweep
from sphshell_pin.study.sweep.table import check_place, read_outcomes, table_of, write_table
from sphshell_pin.study.sweep.workers import run_all

if TYPE_CHECKING:
    import pandas as pd

# A table that grows is written after so many seconds, and so many times as long as writing takes.
_SAVE_AFTER, _SAVE_SELDOM = 5.0, 20.0
Progress = Callable[[int, int, int], object]
"""Called with the numbers of runs done, failed among them, and in all."""


@dataclass(frozen=True)
class SweepReport:
    """What a sweep left behind."""

    table: pd.DataFrame
    """A row for each run."""
    resumed: int
    """Runs that had been done before."""
    failed: int


def sweep(
    scenario: str | PathLike[str],
    vary: Vary | Iterable[str] | None = None,
    *,
    changes: Mapping[str, str] | None = None,
    together: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    out: str | PathLike[str] | None = None,
    verdicts: bool = False,
    retry_failed: bool = False,
    progress: Progress | None = None,
    dist: Dist | Iterable[str] | None = None,
    sample: str | None = None,
    n: int | None = None,
    seed: int = 0,
    indices: bool = False,
    tornado: bool = False,
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
    out : .parquet file of the table. It is written as it grows, each time whole; the same call, or
        one with more values, does the runs that it does not hold yet. None: nothing is kept.
    verdicts : give each expectation of the scenario a column: 1 where met, 0 where missed.
    retry_failed : do again the runs that failed, as the table says.
    progress : called with the numbers of runs done, failed among them, and in all.
    dist : in place of `vary`, what is uncertain: a mapping from dotted keys of numbers to
        distributions, `Normal`, `Uniform`, `LogNormal` or texts as "normal(1e5,1e4)"; or texts
        "key=normal(1e5,1e4)". Inputs are independent of each other.
    sample : "sobol" (points of a scrambled Sobol sequence) or "lhs" (a Latin hypercube).
    n : number of points; a power of 2 for "sobol".
    seed : of the points.
    indices : make n (d + 2) runs for d uncertain inputs, from which `sobol_indices` follow.
    tornado : add 2 d + 1 runs: all inputs at their medians, and each in turn at its quantiles of
        5 and 95 %; see `sphshell_pin.study.sweep.tornado`. Alone, without a sample, too.

    Returns
    -------
    pandas.DataFrame : row i is run i: `run`, the varied keys, `status` ("done", "failed"), `error`
        (why it failed, in one sentence), with `dist` also `design` (what the run is for: "sample";
        "A", "B", "AB KEY" of Saltelli's design; "median", "5 % KEY", "95 % KEY"), the figures of a
        run's summary [SI units] (NaN where a run has none), `settings`, the digest of its settings.
        Bit for bit the same however and wherever the runs were made, on one kind of processor.

    The units of columns, by their names, are attrs["units"] of the table: those of keys as the
    file states their values, those of figures in SI.

    Raises
    ------
    ScenarioError, NameNotFound, InvalidParameter
        The scenario, a key or a value is wrong; raised before anything runs.
    SweepError
        The table is that of another sweep, no scheduler answers, or a worker cannot do any run.
    ResultError
        The table cannot be read or written.
    MissingExtra
        An optional package is missing: pip install 'sphshell-pin[sweep]'.
    KeyboardInterrupt
        On Ctrl-C; its text says how many runs are done and kept.
    """
    plan = plan_sweep(
        scenario,
        vary,
        changes=changes,
        together=together,
        verdicts=verdicts,
        dist=dist,
        sample=sample,
        n=n,
        seed=seed,
        indices=indices,
        tornado=tornado,
    )
    return run_plan(
        plan,
        workers=workers,
        scheduler=scheduler,
        out=None if out is None else Path(out),
        retry_failed=retry_failed,
        progress=progress,
    ).table


def run_plan(
    plan: Plan,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    out: Path | None = None,
    retry_failed: bool = False,
    progress: Progress | None = None,
    note: Callable[[str], object] = lambda _: None,
) -> SweepReport:
    """Do what the table at `out` does not hold yet, and write the table; see `sweep`.

    `note` is called with what a person who waits should know, in one sentence.
    """
    workers = _count_workers(workers, scheduler)
    need("pandas")
    outcomes = {} if out is None else _kept(plan, out, retry_failed=retry_failed)
    resumed = len(outcomes)
    failed = sum(one.status == FAILED for one in outcomes.values())

    def report_progress() -> None:
        if progress is not None:
            progress(len(outcomes), failed, len(plan.runs))

    def save() -> None:
        if out is not None:
            write_table(out, table_of(plan, outcomes))

    missing = [run for run in plan.runs if run.number not in outcomes]
    next_save = time.monotonic() + _SAVE_AFTER
    try:
        with contextlib.closing(run_all(plan.job, missing, workers, scheduler, note)) as done:
            report_progress()
            for outcome in done:
                outcomes[outcome.number] = outcome
                failed += outcome.status == FAILED
                report_progress()
                if (start := time.monotonic()) > next_save:
                    save()
                    end = time.monotonic()
                    next_save = end + max(_SAVE_AFTER, _SAVE_SELDOM * (end - start))
    except KeyboardInterrupt:
        kept = "were done" if out is None else f"are done and kept in {out}"
        text = f"{len(outcomes)} of {len(plan.runs)} runs {kept}"
        raise KeyboardInterrupt(text) from None
    finally:
        if len(outcomes) > resumed:
            save()
    return SweepReport(table_of(plan, outcomes), resumed, failed)


def _kept(plan: Plan, out: Path, *, retry_failed: bool) -> dict[int, Outcome]:
    """Return the outcomes of the plan's runs that the table at `out` holds.

    Raises
    ------
    SweepError
        It holds other runs as well, which would be lost.
    """
    check_place(out)
    kept = read_outcomes(out, plan.head)
    if others := len(kept.keys() - set(plan.digests)):
        raise SweepError(
            f"{out} holds {others} runs with values or settings that this sweep does not have: "
            "delete it to start again, or give another --out"
        )
    return {
        i: replace(kept[settings], number=i)
        for i, settings in enumerate(plan.digests)
        if settings in kept and not (retry_failed and kept[settings].status == FAILED)
    }


def _count_workers(workers: int | None, scheduler: str | None) -> int:
    if scheduler is not None and workers is not None:
        raise InvalidParameter("workers", workers, "is for this machine: a scheduler has its own")
    if workers is None:
        allowed = getattr(os, "sched_getaffinity", None)
        return len(allowed(0)) if allowed else os.cpu_count() or 1
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 0:
        raise InvalidParameter("workers", workers, "must be a whole number, 0 or more")
    return workers
