"""The process in which OpenCASCADE runs: it reads jobs from one pipe and answers on another."""

import ctypes
import fcntl
import gc
import importlib.util
import os
import pickle
import re
import resource
import select
import signal
import sys
import traceback
import warnings
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from sphshell_pin.base.limits import limit_memory
from sphshell_pin.errors import SphshellError
from sphshell_pin.shell.cad.messages import pack
from sphshell_pin.shell.cad.options import require_kernel

IDLE = 90.0
"""A child without a job ends after this time [s]."""

MOST_WRITTEN = 1 << 20
"""Most of its standard error, which is a file [bytes]."""

GRACE = 10.0
"""How much longer than the time limit a child may live that its parent has not ended [s]."""


def serve(source: int, target: int) -> None:
    """Answer jobs from one pipe to the other until they close, or none comes for a while."""
    # OpenCASCADE holds the interpreter's lock, so no thread of Python could end the process.
    for one in (signal.SIGIO, signal.SIGALRM):
        signal.signal(one, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, (signal.SIGIO, signal.SIGALRM))
    requests, answers = Connection(source, writable=False), Connection(target, readable=False)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (MOST_WRITTEN, MOST_WRITTEN))
    _load_display_libraries()
    # Until the first job has loaded OpenCASCADE: all of that stays, and to search it for garbage
    # takes a sixth of the time.
    gc.disable()
    while requests.poll(IDLE):
        try:
            message = requests.recv_bytes()
        except EOFError:
            break
        _end_with_parent(source, True)
        answer = _answer(message)
        _end_with_parent(source, False)
        answers.send_bytes(answer)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    # The destructors of OpenCASCADE's libraries have nothing to save.
    os._exit(0)


def _load_display_libraries() -> None:
    """Load stand-ins for the libraries of a display that OpenCASCADE needs and this machine lacks.

    A library that is loaded already serves all that ask for its name. The stand-ins define what is
    named in tables; functions that are only called are looked up when they are, which is never.
    """
    core = importlib.util.find_spec("sphshell_pin._core")  # which need not be loaded
    folder = Path(core.origin if core and core.origin else "").parent / "no_display"
    for library in sorted(folder.glob("*.so.*")):
        try:
            ctypes.CDLL(library.name)
        except OSError:
            with suppress(OSError):
                ctypes.CDLL(str(library))
                sys.setdlopenflags(os.RTLD_LAZY)


def _end_with_parent(pipe: int, wanted: bool) -> None:
    """Let the system end this process, by SIGIO, when the parent's end of `pipe` closes.

    During a job only: the parent sends nothing then. A system that cannot do it leaves it to the
    timer.
    """
    with suppress(OSError):
        flags = fcntl.fcntl(pipe, fcntl.F_GETFL)
        fcntl.fcntl(pipe, fcntl.F_SETFL, flags | os.O_ASYNC if wanted else flags & ~os.O_ASYNC)
    if wanted and select.select([pipe], [], [], 0.0)[0]:  # it closed before
        os._exit(0)


def _answer(message: bytes) -> bytes:
    """Read one file; return what `process.run_in_child` reads, and the warnings."""
    arguments, purpose, folder, time_limit, memory_limit = pickle.loads(message)

    content: object = None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        try:
            signal.setitimer(signal.ITIMER_REAL, time_limit + GRACE)
            require_kernel(purpose)
            from sphshell_pin.shell.cad.jobs import read

            if not gc.isenabled():
                gc.freeze()
                gc.enable()
            if folder:
                os.chdir(folder)
            limit_memory(memory_limit)
            kind, content = "done", read(*arguments)
        except SphshellError as error:
            kind, content = "error", error.with_traceback(None)
        except Exception as error:
            kind = "failed"
            if _of_memory(error):
                kind = "memory"
            else:
                reason = " ".join(str(error).split()) or type(error).__name__
                content = reason, traceback.format_exc()
    limit_memory(None)
    return pack((kind, content, [one.message for one in caught]))


def _of_memory(error: BaseException | None) -> bool:
    """Whether an exception, or one that it came from, says that no memory was left."""
    while error is not None:
        if isinstance(error, MemoryError) or type(error).__name__ == "Standard_OutOfMemory":
            return True
        # Fault of a library that is loaded within the limit, in the words of the loader.
        if isinstance(error, ImportError) and re.search(
            "failed to map|allocate memory", str(error)
        ):
            return True
        error = error.__cause__ or error.__context__
    return False
