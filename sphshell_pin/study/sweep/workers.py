"""Where the runs of a sweep are made: here, or by workers of Dask on this machine or a cluster.

Dask starts a worker that died anew, and gives its run to another one.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import CancelledError
from itertools import islice
from types import ModuleType
from typing import Any, TypeAlias
from unittest.mock import patch

from sphshell_pin.errors import SweepError
from sphshell_pin.study.sweep import worker
from sphshell_pin.study.sweep.job import FAILED, Job, Outcome, Run, need

# Classes of distributed, which has no types.
Client: TypeAlias = Any
Future: TypeAlias = Any

# So many runs are with the scheduler at a time: enough for any cluster, few enough to keep track.
_AHEAD = 1000
_CONNECT_TIMEOUT = 10.0
KILLED = "its worker process died each time it was tried"


def run_all(
    job: Job,
    runs: Sequence[Run],
    workers: int,
    scheduler: str | None,
    note: Callable[[str], object],
) -> Generator[Outcome, None, None]:
    """Yield the outcome of each run, as they come; closing the iterator ends what is under way.

    `workers` processes of this machine do the runs, 0 for this process alone, or those of the Dask
    `scheduler`. `note` is called with what a person who waits should know.

    Raises
    ------
    SweepError
        No scheduler answers or it went away, or a worker cannot be started or do any run.
    """
    if not runs or (scheduler is None and not workers):
        yield from (worker.run_one(job, run) for run in runs)
        return
    distributed, waiting = need("distributed"), iter(runs)
    where = f"the Dask scheduler at {scheduler}" if scheduler else "the scheduler on this machine"
    # New processes load the module that is called __main__: a script would begin its sweep again.
    no_script = patch.dict(sys.modules, __main__=ModuleType("__main__"))
    with no_script, contextlib.closing(_client(min(workers, len(runs)), scheduler)) as client:
        if not client.ncores():
            note(f"{where} has no workers: waiting for some")
        under_way: dict[str, Run] = {}

        def submit(count: int) -> list[Future]:
            some = [
                (client.submit(worker.run_one, job, run, pure=False), run)
                for run in islice(waiting, count)
            ]
            under_way.update((future.key, run) for future, run in some)
            return [future for future, _ in some]

        completed = distributed.as_completed(submit(_AHEAD), loop=client.loop)
        for future in completed:
            completed.update(submit(1))
            run = under_way.pop(future.key)
            try:
                yield future.result()
            except distributed.KilledWorker:
                yield Outcome(run.number, FAILED, KILLED, {})
            except SweepError:
                raise
            except (CancelledError, OSError):
                raise SweepError(f"{where} went away") from None
            except Exception as fault:
                raise SweepError(
                    f"the workers of {where} cannot do the runs, is the same sphshell-pin "
                    f"installed there? ({type(fault).__name__}: {' '.join(str(fault).split())})"
                ) from None


def _client(workers: int, scheduler: str | None) -> Client:
    client = need("distributed").Client
    if scheduler is None:
        try:
            return client(
                n_workers=workers,
                threads_per_worker=1,
                memory_limit=None,
                preload=worker.__name__,
                dashboard_address=None,
                silence_logs="CRITICAL",
                set_as_default=False,
            )
        except Exception as fault:
            raise SweepError(f"no worker process can be started: {fault}") from None
    try:
        return client(scheduler, timeout=_CONNECT_TIMEOUT, set_as_default=False)
    # Another server at that address may be misread in any way.
    except Exception as fault:
        raise SweepError(
            f"no Dask scheduler answers at {scheduler}: start one with dask scheduler, and give "
            f"the address that it prints ({' '.join(str(fault).split())})"
        ) from None
