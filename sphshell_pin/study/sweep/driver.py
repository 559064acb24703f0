"""A sweep from its start to its table: do the runs that the table does not hold yet."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Generator, Iterable, Mapping
from concurrent.futures import CancelledError
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from sphshell_pin.base.atomic.file import atomic_file, check_writable
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.errors import InvalidParameter, ResultError, SweepError, import_extra
from sphshell_pin.study.sweep import worker
from sphshell_pin.study.sweep.indices import DESIGN, figures_of
from sphshell_pin.study.sweep.plan import Changes, Plan, plan_sweep
from sphshell_pin.study.sweep.points import Dist, Vary, text_of
from sphshell_pin.study.sweep.worker import Outcome

if TYPE_CHECKING:
    import pandas as pd

# A table that grows is written after so many seconds, and so many times as long as writing takes.
_SAVE_AFTER, _SAVE_SELDOM = 5.0, 20.0
_CONNECT_TIMEOUT = 10.0
Progress = Callable[[int, int, int], object]
"""Called with the numbers of runs done, failed now among them, and in all; first before any run."""
_need = partial(import_extra, extra="sweep", purpose="a sweep")


def sweep(
    scenario: StrPath,
    vary: Vary | Iterable[str] | None = None,
    *,
    changes: Mapping[str, str] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    out: StrPath | None = None,
    progress: Progress | None = None,
    dist: Dist | Iterable[str] | None = None,
    n: int | None = None,
    seed: int = 0,
    indices: bool = False,
) -> pd.DataFrame:
    """Run a scenario many times with other values and return the table of its figures.

    Parameters
    ----------
    scenario : name of a shipped one, or path of a file.
    vary : what varies: a mapping from dotted keys, as --set takes them, to sequences of values or
        to texts "lo:hi:n", "lo:hi:log:n", "a,b,c"; or texts "key=lo:hi:n". All combinations are
        run; the last key varies fastest.
    changes : values by dotted key that are the same in all runs.
    workers : processes of this machine; by default as many as there are processors. 0 does the
        runs in this process.
    scheduler : address of a Dask scheduler, "tcp://host:port", whose workers do the runs instead.
    out : .parquet file of the table. It is written as it grows, each time whole; the same call, or
        one with more values, does the runs that it does not hold yet, and those that failed. None:
        nothing is kept.
    progress : called with the numbers of runs done, failed among them, and in all.
    dist : in place of `vary`, what is uncertain: a mapping from dotted keys of numbers to texts
        such as "normal(1e5,1e4)" or distributions of scipy.stats such as norm(1e5, 1e4); or texts
        "key=normal(1e5,1e4)". Inputs are independent of each other.
    n : number of points of a scrambled Sobol sequence, a power of 2.
    seed : of the points.
    indices : make n (d + 2) runs for d uncertain inputs, from which `sobol_indices` follow.

    Returns
    -------
    pandas.DataFrame : row i is run i: `run`, the varied keys, `status` ("done", "failed"), `error`
        (why it failed, in one sentence), with `dist` also `design` (what the run is for: "sample";
        "A", "B", "AB KEY" of Saltelli's design), the figures of a run's summary [SI units] (NaN
        where a run has none), `met.FIGURE` (1 where an expectation of the scenario was met, else
        0), `settings`, the digest of all that the run depends on. Bit for bit the same however and
        wherever the runs were made, on one kind of processor.

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
    plan = plan_sweep(scenario, vary, changes=changes, dist=dist, n=n, seed=seed, indices=indices)
    return run_plan(plan, workers=workers, scheduler=scheduler, out=out, progress=progress)


def run_plan(
    plan: Plan,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    out: StrPath | None = None,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """Do what the table at `out` does not hold yet, and write the table; see `sweep`."""
    if scheduler is not None and workers is not None:
        raise InvalidParameter("workers", workers, "is for this machine: a scheduler has its own")
    if workers is not None and (type(workers) is not int or workers < 0):
        raise InvalidParameter("workers", workers, "must be a whole number, 0 or more")
    _need("pandas")
    path = None if out is None else Path(out)
    outcomes = {} if path is None else _read(plan, path)
    resumed, failed = len(outcomes), 0

    def report() -> None:
        if progress is not None:
            progress(len(outcomes), failed, len(plan.runs))

    def save() -> None:
        if path is not None:
            write_table(path, _table_of(plan, outcomes))

    missing = {i: run for i, run in enumerate(plan.runs) if i not in outcomes}
    next_save = time.monotonic() + _SAVE_AFTER
    report()
    try:
        with contextlib.closing(_outcomes(plan, missing, workers, scheduler)) as done:
            for number, outcome in done:
                outcomes[number] = outcome
                failed += bool(outcome.error)
                report()
                if (start := time.monotonic()) > next_save:
                    save()
                    end = time.monotonic()
                    next_save = end + max(_SAVE_AFTER, _SAVE_SELDOM * (end - start))
    except KeyboardInterrupt:
        kept = "were done" if path is None else f"are done and kept in {path}"
        text = f"{len(outcomes)} of {len(plan.runs)} runs {kept}"
        raise KeyboardInterrupt(text) from None
    finally:
        if len(outcomes) > resumed:
            save()
    return _table_of(plan, outcomes)


def write_table(path: Path, table: pd.DataFrame) -> None:
    """Write the table to `path` in place of an earlier one; the same table gives the same bytes.

    Raises ResultError where it cannot be written; an earlier table stays as it was.
    """
    try:
        with atomic_file(path) as file:
            table.to_parquet(file, compression="zstd", write_page_checksum=True, index=False)
    except OSError as fault:
        raise ResultError(path, f"cannot be written: {fault.strerror or fault}") from None


def _table_of(plan: Plan, outcomes: Mapping[int, Outcome]) -> pd.DataFrame:
    """Return the table of the runs that have an outcome, their numbers in order.

    Figures that only some runs have, where robots or contacts vary, come last.
    """
    pandas, numbers = _need("pandas"), sorted(outcomes)
    rows = [outcomes[i] for i in numbers]
    varied = pandas.DataFrame(plan.points.values)
    for key, values in plan.points.values.items():  # numbers where all values are, else texts
        if varied[key].dtype.kind not in "bif":
            varied[key] = pandas.Series(map(text_of, values), dtype=object)
    varied = varied.iloc[numbers].reset_index(drop=True)
    varied.insert(0, "run", pandas.Series(numbers, dtype="int64"))
    told = {"status": ["failed" if one.error else "done" for one in rows]}
    told["error"] = [one.error for one in rows]
    if plan.points.parts:
        told[DESIGN] = [plan.points.parts[i] for i in numbers]
    others = {name for one in rows for name in one.figures} - set(plan.figures)
    figures = pandas.DataFrame(
        [one.figures for one in rows], columns=[*plan.figures, *sorted(others)], dtype=float
    )
    settings = pandas.Series([plan.digests[i] for i in numbers], dtype=object, name="settings")
    parts = varied, pandas.DataFrame(told, dtype=object), figures, settings
    frame: pd.DataFrame = pandas.concat(parts, axis=1)
    frame.attrs["units"] = {name: one for name, one in plan.units.items() if name in frame}
    return frame


def _read(plan: Plan, path: Path) -> dict[int, Outcome]:
    """Return the outcomes of the plan's runs that the table at `path` holds, but failed ones.

    Raises
    ------
    InvalidParameter, ResultError
        No table can be written there, or what is there is not that of a sweep.
    SweepError
        It holds other runs as well, which would be lost.
    """
    if path.suffix.lower() != ".parquet":
        raise InvalidParameter("out", str(path), "must end in .parquet")
    _need("pyarrow")
    check_writable(path)
    if not path.exists() or not path.stat().st_size:
        return {}
    try:
        table = _need("pandas").read_parquet(path, page_checksum_verification=True)
        figures = table[figures_of(table)].to_dict("records")
        rows = zip(table["settings"], table["error"], figures, strict=True)
        kept = {settings: Outcome(error, own) for settings, error, own in rows}
    except (OSError, ValueError, KeyError, TypeError):  # pyarrow's faults are ValueErrors
        why = "is a file that no sweep wrote, or a damaged one: give another --out, or delete it"
        raise ResultError(path, why) from None
    if others := len(kept.keys() - set(plan.digests)):
        raise SweepError(
            f"{path} holds {others} runs that this sweep does not have (with other values, files "
            "or versions of the libraries): delete it to start again, or give another --out"
        )
    held = ((i, kept.get(settings)) for i, settings in enumerate(plan.digests))
    return {i: one for i, one in held if one is not None and not one.error}


def _outcomes(
    plan: Plan, runs: Mapping[int, Changes], workers: int | None, scheduler: str | None
) -> Generator[tuple[int, Outcome], None, None]:
    """Yield number and outcome of each run, as they come; closing ends what is under way.

    Dask starts a worker that died anew and tries all runs that were on it again, a few times. Of
    those that are then given up, any one may have killed the others: each is done again, alone.

    Raises
    ------
    SweepError
        No scheduler answers or it went away, or a worker cannot be started or do any run.
    """
    if not runs or (scheduler is None and workers == 0):
        yield from ((i, worker.run_one(plan.job, run)) for i, run in runs.items())
        return
    distributed = _need("distributed")
    where = f"the Dask scheduler at {scheduler}" if scheduler else "the scheduler on this machine"
    with contextlib.ExitStack() as stack:
        # A new process loads the module that is called __main__, also one that takes the place of
        # another: a script would begin its sweep again.
        stack.callback(sys.modules.update, {"__main__": sys.modules["__main__"]})
        sys.modules["__main__"] = ModuleType("__main__")
        # A worker that died and is not back by then, on a busy machine, would never come again.
        patient = {"distributed.deploy.lost-worker-timeout": "10 days"}
        stack.enter_context(_need("dask.config").set(patient))
        client = stack.enter_context(contextlib.closing(_client(workers, len(runs), scheduler)))
        submit = partial(client.submit, worker.run_one, plan.job, pure=False)
        groups = [list(runs)]
        for group in groups:  # which grows
            numbers = {submit(runs[i]): i for i in group}
            for future in distributed.as_completed(list(numbers), loop=client.loop):
                number = numbers.pop(future)
                try:
                    yield number, future.result()
                except distributed.KilledWorker:
                    if len(group) > 1:
                        groups.append([number])
                    else:
                        yield number, Outcome("its worker process died each time it was tried")
                except SweepError:
                    raise
                except (CancelledError, OSError):
                    raise SweepError(f"{where} went away") from None
                except Exception as fault:
                    raise SweepError(
                        f"the workers of {where} cannot do the runs, is the same sphshell-pin "
                        f"installed there? ({type(fault).__name__}: {' '.join(str(fault).split())})"
                    ) from None


def _client(workers: int | None, runs: int, scheduler: str | None) -> Any:
    distributed = _need("distributed")
    local = {
        "n_workers": min(workers or _need("dask.system").CPU_COUNT, runs),
        "threads_per_worker": 1,
        "memory_limit": None,
        "preload": worker.__name__,
        "dashboard_address": None,
        "scheduler_kwargs": {"dashboard_address": "127.0.0.1:0"},  # its server has one all the same
        "silence_logs": "CRITICAL",
    }
    remote = {"address": scheduler, "timeout": _CONNECT_TIMEOUT}
    # `silence_logs` leaves what a worker itself logs, as where it ends while another begins.
    quiet = {"distributed.nanny.pre-spawn-environ.DASK_LOGGING__DISTRIBUTED": "critical"}
    try:
        with _need("dask.config").set(quiet):
            return distributed.Client(**(remote if scheduler else local), set_as_default=False)
    # Another server at that address may be misread in any way.
    except Exception as fault:
        why = "no worker process can be started"
        if scheduler:
            why = f"no Dask scheduler answers at {scheduler}: start one with dask scheduler, and "
            why += "give the address that it prints"
        raise SweepError(f"{why} ({' '.join(str(fault).split())})") from None
