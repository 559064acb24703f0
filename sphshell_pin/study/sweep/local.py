"""The workers of this machine: processes, each of which does one run at a time."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from typing import TypeVar
from unittest.mock import patch

from sphshell_pin.errors import SweepError
from sphshell_pin.study.sweep.job import FAILED, Job, Outcome, Run
from sphshell_pin.study.sweep.worker import prepare, run_one

T = TypeVar("T")

MOST_DEATHS = 3
"""A run whose worker dies so often is given up."""

KILLED = "its worker process died each time it was tried"

# A worker has one processor: threads of the libraries would compete for it.
_ONE_THREAD = dict.fromkeys(
    (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "NUMEXPR_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
    ),
    "1",
)


def run_locally(
    job: Job, runs: Iterable[Run], workers: int, died: Callable[[int], object]
) -> Generator[Outcome, None, None]:
    """Yield the outcome of each run, as they come, from `workers` processes.

    A process that dies takes the whole pool with it: `died` is called with 1, and what has no
    outcome is done again. The last of MOST_DEATHS times one process does it, in order: if it dies,
    too, it is known of which run. Closing this iterator ends the processes at once.

    Raises
    ------
    SweepError
        The workers cannot be started, or cannot do any run.
    """
    waiting = {run.number: run for run in runs}
    deaths = 0
    while waiting:
        alone = deaths == MOST_DEATHS - 1
        try:
            for outcome in _pool(job, list(waiting.values()), 1 if alone else workers):
                del waiting[outcome.number]
                yield outcome
        except BrokenProcessPool:
            died(1)
            deaths += 1
            if alone:
                first = next(iter(waiting))
                del waiting[first]
                deaths = 0
                yield Outcome(first, FAILED, KILLED, {})


def _pool(job: Job, runs: Sequence[Run], count: int) -> Iterator[Outcome]:
    """Yield the outcomes of runs, of which one process at most does each at a time, in order."""
    # "spawn": a fresh interpreter, without the threads and locks of this one.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(count, len(runs)), context, initializer=_begin)
    try:
        try:
            _submit(pool, prepare, job).result()
        except BrokenProcessPool:
            raise SweepError(
                "a worker process ended before it was ready; a script must call sweep below "
                'if __name__ == "__main__":'
            ) from None
        waiting = iter(runs)
        under_way = {_submit(pool, run_one, job, run) for run in islice(waiting, count)}
        while under_way:
            done, under_way = wait(under_way, return_when=FIRST_COMPLETED)
            outcomes = [future.result() for future in done]
            under_way |= {_submit(pool, run_one, job, run) for run in islice(waiting, len(done))}
            yield from outcomes
    finally:
        # Before Python 3.14 no public method ends a process that is in a run.
        for process in list((pool._processes or {}).values()):
            process.kill()
        pool.shutdown(wait=True, cancel_futures=True)


def _submit(pool: ProcessPoolExecutor, call: Callable[..., T], *arguments: object) -> Future[T]:
    # This may start a process, whose libraries read the environment when they are loaded.
    with patch.dict(os.environ, _ONE_THREAD):
        return pool.submit(call, *arguments)


def _begin() -> None:
    """Set up a worker process: it ends with its parent, and not by Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
