"""The process in which OpenCASCADE runs: it reads jobs from one pipe and answers on another."""

from __future__ import annotations

import fcntl
import os
import resource
import select
import signal
import sys
import traceback
import warnings
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from sphshell_pin.errors import SphshellError
from sphshell_pin.shell.cad.messages import ALIVE, pack, unpack
from sphshell_pin.shell.cad.options import require_kernel

IDLE = 90.0
"""A child without a job ends after this time [s]."""

GRACE = 10.0
"""How much longer than the limit a child may live whose parent has not ended it [s]."""


def serve(life: int) -> None:
    """Answer jobs until the parent closes the pipes, or has none for a while.

    life : pipe on which nothing is ever sent; it closes when the parent ends
    """
    _end_with(life)
    requests, answers = Connection(os.dup(0), writable=False), Connection(os.dup(1), readable=False)
    # OpenCASCADE writes reports to the standard output.
    nothing = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1):
        os.dup2(nothing, number)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    while requests.poll(IDLE):
        try:
            request = unpack(requests.recv_bytes())
        except EOFError:
            break
        answers.send_bytes(_answer(answers, *request))
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    # The destructors of OpenCASCADE's libraries have nothing to save.
    os._exit(0)


def _answer(
    answers: Connection,
    job: str,
    arguments: tuple[Any, ...],
    purpose: str,
    folder: str,
    time_limit: float,
    memory_limit: float,
) -> bytes:
    """Do one job; return its result or its fault, with the warnings."""

    def alive() -> None:
        signal.setitimer(signal.ITIMER_REAL, time_limit + GRACE)
        answers.send_bytes(ALIVE)

    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("default")
        try:
            signal.setitimer(signal.ITIMER_REAL, time_limit + GRACE)
            require_kernel(purpose)
            from sphshell_pin.shell.cad.jobs import JOBS

            if folder:
                os.chdir(folder)
            _limit_memory(memory_limit)
            answer: tuple[Any, ...] = ("done", JOBS[job](alive, *arguments))
        except SphshellError as error:
            named = tuple((name, _sendable(value)) for name, value in vars(error).items())
            answer = ("fault", type(error).__name__, str(error), named)
        except Exception as error:
            if _of_memory(error):
                answer = ("memory",)
            else:
                reason = " ".join(str(error).split()) or type(error).__name__
                answer = ("broken", reason, traceback.format_exc())
    _limit_memory(None)
    return pack((*answer, tuple((one.category.__name__, str(one.message)) for one in told)))


def _end_with(pipe: int) -> None:
    """Let the system end this process when the other end of `pipe` closes, or the timer runs out.

    OpenCASCADE holds the interpreter's lock, so no thread of Python could see to it.
    """
    signals = (signal.SIGIO, signal.SIGALRM)
    for number in signals:
        signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, signals)
    with suppress(OSError):  # a system that cannot leaves it to the timer
        fcntl.fcntl(pipe, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | os.O_ASYNC)
    if select.select([pipe], [], [], 0.0)[0]:  # it closed before
        os._exit(0)


def _limit_memory(limit: float | None) -> None:
    """Let the address space grow by `limit` more [bytes]; None lifts the limit.

    macOS takes the limit but does not enforce it.
    """
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    soft = hard
    if limit is not None:
        try:
            pages = int(Path("/proc/self/statm").read_text().split()[0])
        except OSError:
            pages = 0
        soft = pages * resource.getpagesize() + int(limit)
        soft = soft if hard == resource.RLIM_INFINITY else min(soft, hard)
    try:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
    except (OSError, ValueError, OverflowError):
        return


def _of_memory(error: BaseException | None) -> bool:
    """Whether an exception, or one that it came from, says that no memory was left."""
    while error is not None:
        if isinstance(error, MemoryError) or type(error).__name__ == "Standard_OutOfMemory":
            return True
        error = error.__cause__ or error.__context__
    return False


def _sendable(value: Any) -> Any:
    known = isinstance(value, (str, int, float, tuple, list, Path, type(None)))
    return value if known else str(value)


if __name__ == "__main__":
    sys.exit("this module is started by sphshell_pin.shell.cad.process")
