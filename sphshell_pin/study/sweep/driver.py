"""A sweep from its start to its table: plan, check, do the runs that are missing, write."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from sphshell_pin.base.summary import MOST_ROWS, Detail, Fact, Summarized, names
from sphshell_pin.base.tables import column
from sphshell_pin.errors import InvalidParameter, ResultError, SweepError
from sphshell_pin.study.sweep.cluster import run_on_cluster
from sphshell_pin.study.sweep.curves import columns_of_curves
from sphshell_pin.study.sweep.distributions import Dist
from sphshell_pin.study.sweep.grid import Vary
from sphshell_pin.study.sweep.job import FAILED, Outcome, need
from sphshell_pin.study.sweep.journal import SUFFIX, Journal
from sphshell_pin.study.sweep.local import run_locally
from sphshell_pin.study.sweep.plan import Plan, plan_sweep
from sphshell_pin.study.sweep.table import (
    check_place,
    check_suffix,
    columns_of,
    frame_of,
    main_figures,
    varied_keys,
    write_table,
)
from sphshell_pin.study.sweep.worker import run_one

if TYPE_CHECKING:
    import pandas as pd

MOST_FIGURES = 3
"""Figures of each run that a notebook shows."""
Progress = Callable[[int, int, int], object]
"""Called with the numbers of runs done, failed among them, and in all."""


@dataclass(frozen=True, repr=False)
class SweepReport(Summarized):
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
    curves: pd.DataFrame | None = None
    """The curves of all runs of the sample that are done: `run`, `t` [s], a column for each."""
    curves_out: Path | None = None

    @property
    def _title(self) -> str:
        return "Sweep"

    def _facts(self) -> list[Fact]:
        units = self.table.attrs.get("units", {})
        facts = [
            Fact("runs", len(self.table)),
            Fact("failed", self.failed),
            Fact(
                "varied", names(column(key, units.get(key, "")) for key in varied_keys(self.table))
            ),
            Fact("table", self.out or "not written"),
            Fact("done before", self.resumed, brief=False),
        ]
        return [*facts, *(Fact("note", sentence, brief=False) for sentence in self.notes)]

    def _rows(self) -> Detail:
        units = self.table.attrs.get("units", {})
        own = main_figures(self.table)[:MOST_FIGURES]
        shown = ["run", *varied_keys(self.table), "status", *own]
        rows = self.table[shown].head(MOST_ROWS).to_numpy(dtype=object).tolist()
        return Detail([column(name, units.get(name, "")) for name in shown], rows, len(self.table))


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
    bands: Sequence[str] = (),
    band_steps: int | None = None,
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
    dist : in place of `vary`, what is uncertain: a mapping from dotted keys of numbers to
        distributions, `Normal`, `Uniform`, `LogNormal` or texts as "normal(1e5,1e4)"; or texts
        "key=normal(1e5,1e4)". Inputs are independent of each other.
    sample : "sobol" (points of a scrambled Sobol sequence) or "lhs" (a Latin hypercube).
    n : number of points; a power of 2 for "sobol".
    seed : of the points.
    indices : make n (d + 2) runs for d uncertain inputs, from which `sobol_indices` follow.
    tornado : add 2 d + 1 runs: all inputs at their medians, and each in turn at its quantiles of
        5 and 95 %; see `sphshell_pin.study.sweep.tornado`. Alone, without a sample, too.
    bands : curves to record of each run of the sample, as "pairs.NAME.normal_force"; they are
        written beside the table, as `out` with ".curves" before its suffix; see `quantile_bands`.
    band_steps : number of equal steps of these curves from 0 to run.duration; by default 200, or
        fewer where the rows of a run are farther apart (run.record_dt).

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
        The journal is of another sweep, no scheduler answers, or a worker cannot do any run.
    ResultError
        The table or the journal cannot be written.
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
        bands=bands,
        band_steps=band_steps,
    )
    report = run_plan(
        plan,
        workers=workers,
        scheduler=scheduler,
        out=None if out is None else Path(out),
        retry_failed=retry_failed,
        progress=progress,
    )
    return report.table


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
        for path in (out, *([] if plan.job.curves is None else [_curves_file(out)])):
            check_place(path)
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
    outcomes: dict[int, Outcome] = {} if journal is None else dict(journal.outcomes)
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
        table, curves = _write(plan, outcomes, out)
    return SweepReport(
        table=table,
        out=out,
        journal=None if journal is None else journal.path,
        resumed=resumed,
        deaths=sum(deaths),
        failed=failed,
        notes=tuple(notes),
        curves=curves,
        curves_out=None if curves is None or out is None else _curves_file(out),
    )


def _write(
    plan: Plan, outcomes: Mapping[int, Outcome], out: Path | None
) -> tuple[pd.DataFrame, pd.DataFrame | None]:
    """Return the table of all runs and that of their curves, as written to `out`."""
    wanted = plan.job.curves
    curves = None if wanted is None else columns_of_curves(wanted, outcomes)
    parts = () if plan.design is None else plan.design.parts
    columns = columns_of(plan.axes, plan.points, plan.digests, outcomes, plan.figures, parts)
    if out is not None:
        if curves is not None:
            write_table(_curves_file(out), curves, plan.head)
        write_table(out, columns, plan.head, plan.units)
    return frame_of(columns, plan.units), None if curves is None else frame_of(curves)


def _curves_file(out: Path) -> Path:
    return out.with_suffix(f".curves{out.suffix}")


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


def _count_workers(workers: int | None, scheduler: str | None) -> int:
    if scheduler is not None and workers is not None:
        raise InvalidParameter("workers", workers, "is for this machine: a scheduler has its own")
    if workers is None:
        allowed = getattr(os, "sched_getaffinity", None)
        return len(allowed(0)) if allowed else os.cpu_count() or 1
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 0:
        raise InvalidParameter("workers", workers, "must be a whole number, 0 or more")
    return workers
