"""The workers of this machine: processes, each of which does one run at a time."""

import multiprocessing
import os
import queue
import signal
import threading
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
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
_LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMEXPR")
_ONE_THREAD = {f"{one}_NUM_THREADS": "1" for one in _LIBRARIES} | {"VECLIB_MAXIMUM_THREADS": "1"}


def run_locally(
    job: Job, runs: Iterable[Run], workers: int, died: Callable[[int], object]
) -> Generator[Outcome, None, None]:
    """Yield the outcome of each run, as they come, from `workers` processes.

    A process that dies takes the whole pool with it. The pool is replaced, and the runs that were
    under way are done again; a run that was under way at two deaths is tried alone after all
    others. `died` is called with 1 at each death. Closing this iterator ends the processes at once.

    Raises
    ------
    SweepError
        The workers cannot be started, or cannot do any run.
    """
    waiting, suspects = deque(runs), deque[Run]()
    deaths: Counter[int] = Counter()
    while waiting or suspects:
        some, count = (waiting, workers) if waiting else (suspects, 1)
        broken = False
        for run, outcome in _pool(job, some, count):
            if outcome is not None:
                yield outcome
                continue
            broken = True
            deaths[run.number] += 1
            if deaths[run.number] == MOST_DEATHS:
                yield Outcome(run.number, FAILED, KILLED, {})
            else:
                (waiting if deaths[run.number] == 1 else suspects).appendleft(run)
        if broken:
            died(1)


def _pool(job: Job, runs: deque[Run], count: int) -> Iterator[tuple[Run, Outcome | None]]:
    """Take runs from `runs` and yield each with its outcome, None where the pool broke under it.

    Ends when all are done, or the pool is broken.
    """
    # "spawn": a fresh interpreter, without the threads and locks of this one.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(count, len(runs)), context, initializer=_begin)
    ended = queue.SimpleQueue[Future[Outcome]]()
    under_way: dict[Future[Outcome], Run] = {}
    broken = False
    try:
        _submit(pool, prepare, job).result()
        while True:
            while runs and len(under_way) < count and not broken:
                run = runs.popleft()
                try:
                    future = _submit(pool, run_one, job, run)
                except BrokenProcessPool:  # a process died that had nothing to do
                    runs.appendleft(run)
                    broken = True
                    break
                under_way[future] = run
                future.add_done_callback(ended.put)
            if not under_way:
                return
            future = ended.get()
            run = under_way.pop(future)
            try:
                outcome = future.result()
            except BrokenProcessPool:
                broken = True
                yield run, None
            else:
                yield run, outcome
    except BrokenProcessPool:
        raise SweepError(
            "a worker process ended before it was ready; a script must call sweep below "
            'if __name__ == "__main__":'
        ) from None
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
