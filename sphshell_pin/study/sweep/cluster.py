"""The workers of a Dask cluster that somebody runs: a sweep is one of its clients."""

from __future__ import annotations

import asyncio
import queue
import re
import uuid
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, ThreadPoolExecutor
from itertools import islice
from typing import Any

from sphshell_pin.errors import InvalidParameter, SweepError
from sphshell_pin.study.sweep.extras import need
from sphshell_pin.study.sweep.job import FAILED, Job, Outcome, Run
from sphshell_pin.study.sweep.local import KILLED
from sphshell_pin.study.sweep.worker import run_one

# So many runs are with the scheduler at a time: enough for any cluster, few enough to keep track.
_AHEAD = 1000
_PATIENCE = 5.0
"""After so long [s] without an outcome, look whether there are workers at all."""
_CONNECT_TIMEOUT = 10.0
_ADDRESS = re.compile(r"(\w+://)?\S+:\d+")


class ClusterPool:
    """Does runs on the workers of the Dask scheduler at `address`.

    The scheduler gives the runs of a worker that died to others, and gives up a run that was with
    too many dying workers, guilty or not. Such runs are tried once more at the end, each alone.
    """

    def __init__(self, job: Job, address: str, note: Callable[[str], object]) -> None:
        if not _ADDRESS.fullmatch(address):
            raise InvalidParameter("scheduler", address, "must be an address like tcp://host:8786")
        self._job = job
        self._address = address
        self._note = note
        self._distributed: Any = need("distributed")
        self.deaths = 0
        """Runs that were given up with their workers, and tried again."""
        try:
            _greet(address)
            self._client = self._distributed.Client(
                address, timeout=_CONNECT_TIMEOUT, set_as_default=False
            )
        # Whoever answers in place of a scheduler may be misread in any way.
        except Exception as fault:
            raise SweepError(
                f"no Dask scheduler answers at {address}: start one with dask scheduler, and give "
                f"the address that it prints ({' '.join(str(fault).split())})"
            ) from None

    def outcomes(self, runs: Iterable[Run]) -> Iterator[Outcome]:
        """Yield the outcome of each run, as they come.

        Raises
        ------
        SweepError
            The scheduler went away, or a worker cannot do any run.
        """
        suspects: list[Run] = []
        for run, outcome in self._each(runs, _AHEAD):
            if outcome is None:
                suspects.append(run)
            else:
                yield outcome
        self.deaths += len(suspects)
        # Alone, none can suffer from another.
        for run, outcome in self._each(suspects, 1):
            yield outcome or Outcome(run.number, FAILED, KILLED, {})

    def close(self) -> None:
        """Leave the cluster; what it still computes for this sweep is dropped."""
        self._client.close()

    def _each(self, runs: Iterable[Run], ahead: int) -> Iterator[tuple[Run, Outcome | None]]:
        """Yield each run with its outcome; None where its workers died too often."""
        waiting = iter(runs)
        ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
        under_way: dict[str, Run] = {}

        def submit(count: int) -> None:
            for run in islice(waiting, count):
                key = f"sweep-{run.number}-{uuid.uuid4().hex}"
                under_way[key] = run
                future = self._client.submit(run_one, self._job, run, key=key, pure=False)
                future.add_done_callback(ended.put)
                futures[key] = future

        futures: dict[str, Any] = {}  # the scheduler drops what nobody holds
        submit(ahead)
        waits = False
        while under_way:
            try:
                future = ended.get(timeout=_PATIENCE)
            except queue.Empty:
                waits = waits or self._look_for_workers()
                continue
            run, _ = under_way.pop(future.key), futures.pop(future.key)
            submit(1)
            yield run, self._outcome(future)

    def _outcome(self, future: Any) -> Outcome | None:
        try:
            outcome: Outcome = future.result()
        except self._distributed.KilledWorker:
            return None
        except SweepError:
            raise
        except (CancelledError, OSError):
            raise SweepError(f"the Dask scheduler at {self._address} went away") from None
        except Exception as fault:
            raise SweepError(
                f"the workers at {self._address} cannot do the runs, is the same sphshell-pin "
                f"installed there? ({type(fault).__name__}: {' '.join(str(fault).split())})"
            ) from None
        return outcome

    def _look_for_workers(self) -> bool:
        """Say so if nobody works; return whether it was said."""
        if self._client.status != "running" or self._client.ncores():
            return False
        self._note(f"the Dask scheduler at {self._address} has no workers: waiting for some")
        return True


def _greet(address: str) -> None:
    """Connect to `address` and leave: a client that cannot takes half a minute to give up."""
    connect = need("distributed.comm").connect

    async def come_and_go() -> None:
        (await connect(address, timeout=_CONNECT_TIMEOUT)).abort()

    # In a thread of its own: this one may have an event loop that runs, as notebooks do.
    with ThreadPoolExecutor(1) as helper:
        helper.submit(asyncio.run, come_and_go()).result()
