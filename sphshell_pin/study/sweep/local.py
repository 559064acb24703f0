"""The workers of this machine: processes, each of which does one run at a time."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import queue
import signal
import threading
from collections import Counter, deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool

from sphshell_pin.errors import SweepError
from sphshell_pin.study.sweep.job import FAILED, Job, Outcome, Run
from sphshell_pin.study.sweep.worker import prepare, run_one

MOST_DEATHS = 3
"""A run whose worker dies so often is given up."""

# A worker that ends so often before it has begun will not begin.
_MOST_FAILED_STARTS = 2

KILLED = "its worker process died each time it was tried"

# A worker has one processor: the libraries' own threads would only get in each other's way.
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


class Here:
    """Does the runs one after the other in this process."""

    deaths = 0

    def __init__(self, job: Job) -> None:
        self._job = job

    def outcomes(self, runs: Iterable[Run]) -> Iterator[Outcome]:
        """Yield the outcome of each run."""
        return (run_one(self._job, run) for run in runs)

    def close(self) -> None:
        """Do nothing: no process was started."""


class LocalPool:
    """Does runs in `workers` processes; one that dies is replaced and its run done again."""

    def __init__(self, job: Job, workers: int) -> None:
        self._job = job
        self._wanted = workers
        self._slots: list[_Slot] = []
        self.deaths = 0
        """Workers that died in a run."""

    def outcomes(self, runs: Iterable[Run]) -> Iterator[Outcome]:
        """Yield the outcome of each run, as they come.

        Raises
        ------
        SweepError
            The workers cannot be started, or cannot do any run.
        """
        waiting = deque(runs)
        deaths: Counter[int] = Counter()
        failed_starts = 0
        ended: queue.SimpleQueue[tuple[_Slot, Future[Outcome]]] = queue.SimpleQueue()
        under_way: dict[_Slot, Run] = {}

        def give_work(slot: _Slot) -> None:
            if waiting:
                under_way[slot] = waiting.popleft()
                slot.submit(under_way[slot], ended)

        for _ in range(min(self._wanted, len(waiting))):
            self._slots.append(_Slot(self._job))
            give_work(self._slots[-1])
        while under_way:
            slot, future = ended.get()
            run = under_way.pop(slot)
            outcome = None
            try:
                outcome = future.result()
            except BrokenProcessPool:
                if slot.was_ready():
                    self.deaths += 1
                    deaths[run.number] += 1
                else:
                    failed_starts += 1
                if failed_starts == _MOST_FAILED_STARTS:
                    raise SweepError(
                        "the worker processes end before they are ready: a script must call sweep "
                        'below if __name__ == "__main__":'
                    ) from None
                slot.restart()
            if outcome is None and deaths[run.number] == MOST_DEATHS:
                outcome = Outcome(run.number, FAILED, KILLED, {})
            if outcome is None:
                waiting.appendleft(run)
            give_work(slot)
            if outcome is not None:
                yield outcome

    def close(self) -> None:
        """End all workers, at once if one is in a run."""
        for slot in self._slots:
            slot.end()


class _Slot:
    """A worker process and the next one, should it die."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._busy: Future[Outcome] = Future()
        self._start()

    def submit(self, run: Run, ended: queue.SimpleQueue[tuple[_Slot, Future[Outcome]]]) -> None:
        """Let the worker do `run`; when it ends, this slot and the future are put in `ended`."""
        try:
            future = self._pool.submit(run_one, self._job, run)
        except BrokenProcessPool as broken:  # it died while it had nothing to do
            future = Future()
            future.set_exception(broken)
        future.add_done_callback(lambda one: ended.put((self, one)))
        self._busy = future

    def was_ready(self) -> bool:
        """Whether the worker that died had begun to work.

        Raises SweepError where it could not do so.
        """
        try:
            self._ready.result()
        except BrokenProcessPool:
            return False
        return True

    def restart(self) -> None:
        """Start a process in place of the one that died."""
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._start()

    def end(self) -> None:
        """End the process, at once if it is in a run."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        if not self._busy.done() and self._ready.done() and not self._ready.exception():
            with contextlib.suppress(ProcessLookupError):
                os.kill(self._ready.result(), signal.SIGKILL)
        self._pool.shutdown(wait=True)

    def _start(self) -> None:
        # A fresh interpreter: threads and locks of this one are not for others.
        context = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(1, mp_context=context, initializer=_begin)
        with _environment(_ONE_THREAD):  # read when the libraries are loaded
            self._ready = self._pool.submit(prepare, self._job)


def _begin() -> None:
    """Begin the life of a worker process: it ends with its parent, not by Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextlib.contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
