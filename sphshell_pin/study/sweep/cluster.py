"""The workers of a Dask cluster: a sweep is a client of its scheduler."""

import queue
import re
import socket
import uuid
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import CancelledError
from itertools import islice
from typing import Any, TypeAlias
from urllib.parse import urlsplit

from sphshell_pin.errors import InvalidParameter, SweepError
from sphshell_pin.study.sweep.job import FAILED, Job, Outcome, Run, need
from sphshell_pin.study.sweep.local import KILLED
from sphshell_pin.study.sweep.worker import run_one

# Classes of distributed, most of which has no types.
Client: TypeAlias = Any
Future: TypeAlias = Any

# So many runs are with the scheduler at a time: enough for any cluster, few enough to keep track.
_AHEAD = 1000
_PATIENCE = 5.0
"""After so long [s] without an outcome, check whether there are workers at all."""
_CONNECT_TIMEOUT = 10.0
_ADDRESS = re.compile(r"(\w+://)?\S+:\d+")


def run_on_cluster(
    job: Job,
    runs: Iterable[Run],
    address: str,
    note: Callable[[str], object],
    died: Callable[[int], object],
) -> Generator[Outcome, None, None]:
    """Yield the outcome of each run, as they come, from the Dask scheduler at `address`.

    The scheduler gives the runs of a worker that died to others, and gives up a run that was with
    too many dying workers, whether it caused their end or not. Such runs are tried once more at the
    end, each alone; `died` is called with their number. `note` is called with what a person who
    waits should know.

    Raises
    ------
    InvalidParameter
        `address` is none.
    SweepError
        No scheduler answers or it went away, or a worker cannot do any run.
    """
    if not _ADDRESS.fullmatch(address):
        raise InvalidParameter("scheduler", address, "must be an address like tcp://host:8786")
    client = _client(address)
    try:
        suspects: list[Run] = []
        for run, outcome in _submitted(client, job, runs, _AHEAD, address, note):
            if outcome is None:
                suspects.append(run)
            else:
                yield outcome
        died(len(suspects))
        for run, outcome in _submitted(client, job, suspects, 1, address, note):
            yield outcome or Outcome(run.number, FAILED, KILLED, {})
    finally:
        client.close()  # drops what the cluster still computes for this sweep


def _client(address: str) -> Client:
    distributed = need("distributed")
    try:
        # A client that cannot connect gives up after half a minute.
        parts = urlsplit(address if "//" in address else f"//{address}")  # no brackets of IPv6
        place = parts.hostname or "", parts.port or 0
        socket.create_connection(place, _CONNECT_TIMEOUT).close()
        return distributed.Client(address, timeout=_CONNECT_TIMEOUT, set_as_default=False)
    # Another server at that address may be misread in any way.
    except Exception as fault:
        raise SweepError(
            f"no Dask scheduler answers at {address}: start one with dask scheduler, and give "
            f"the address that it prints ({' '.join(str(fault).split())})"
        ) from None


def _submitted(
    client: Client,
    job: Job,
    runs: Iterable[Run],
    ahead: int,
    address: str,
    note: Callable[[str], object],
) -> Iterator[tuple[Run, Outcome | None]]:
    """Yield each run with its outcome; None where its workers died too often."""
    waiting = iter(runs)
    ended: queue.SimpleQueue[Future] = queue.SimpleQueue()
    under_way: dict[str, tuple[Run, Future]] = {}  # the scheduler drops a future that nobody holds

    def submit(count: int) -> None:
        for run in islice(waiting, count):
            key = f"sweep-{run.number}-{uuid.uuid4().hex}"
            future = client.submit(run_one, job, run, key=key, pure=False)
            under_way[key] = run, future
            future.add_done_callback(ended.put)

    submit(ahead)
    noted = False
    while under_way:
        try:
            future = ended.get(timeout=_PATIENCE)
        except queue.Empty:
            if not noted and client.status == "running" and not client.ncores():
                note(f"the Dask scheduler at {address} has no workers: waiting for some")
                noted = True
            continue
        run, _ = under_way.pop(future.key)
        submit(1)
        yield run, _outcome(future, address)


def _outcome(future: Future, address: str) -> Outcome | None:
    try:
        outcome: Outcome = future.result()
    except need("distributed").KilledWorker:
        return None
    except SweepError:
        raise
    except (CancelledError, OSError):
        raise SweepError(f"the Dask scheduler at {address} went away") from None
    except Exception as fault:
        raise SweepError(
            f"the workers at {address} cannot do the runs, is the same sphshell-pin "
            f"installed there? ({type(fault).__name__}: {' '.join(str(fault).split())})"
        ) from None
    return outcome
