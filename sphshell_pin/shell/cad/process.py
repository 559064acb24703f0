"""OpenCASCADE in a process of its own: a file that makes it crash, hang or swell ends only that.

A child is started with the first CAD file; it imports OpenCASCADE, which takes a second, so it is
kept for a minute, for the next file. One that has met a damaged file is not used again.
"""

from __future__ import annotations

import atexit
import builtins
import fcntl
import os
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from multiprocessing import spawn
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from sphshell_pin import errors
from sphshell_pin.errors import InvalidParameter, NameNotFound, ShellFileError, SphshellError
from sphshell_pin.shell.cad.messages import ALIVE, pack, unpack
from sphshell_pin.shell.cad.options import CadOptions

TIME_LIMIT = 600.0
"""Of a CAD file, unless stated [s]: several times what the finest tessellations take."""

MEMORY_LIMIT = 8e9
"""Of a CAD file, unless stated [bytes]."""

KEPT = 60.0
"""How long a child is kept for the next file [s]; it ends by itself some seconds later."""

ENDING = 2.0
"""How long a child that answers no more is waited for [s]."""

LONGEST = 1e6
"""Larger limits of time are taken for this one, which the system's timers can hold [s]."""

LARGEST = 1 << 32
"""Of an answer [bytes]; two million triangles take a tenth."""

MOST_JOBS = 50
"""Of one child: OpenCASCADE does not give all memory back."""

_ADVICE = (
    "the file is damaged, or meets a defect of OpenCASCADE: check it in its CAD program, or export "
    "it anew"
)
_NO_ANSWER = f"gets no valid answer from OpenCASCADE: {_ADVICE}"

_START = """
import signal
signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's: it ends the child
import sys
sys.path[:] = sys.argv[2:]
from sphshell_pin.shell.cad.child import serve
serve(int(sys.argv[1]))
"""


def run_in_child(
    job: str, arguments: tuple[Any, ...], path: Path, purpose: str, options: CadOptions
) -> Any:
    """Do a job of `jobs.JOBS` in a child, and return its result.

    path : of the file that is read, for messages; purpose : what needs OpenCASCADE

    Raises
    ------
    SphshellError
        As the job raises it.
    ShellFileError
        If OpenCASCADE crashes, or goes beyond the limits of time or memory of `options`.
    """
    time_limit = TIME_LIMIT if options.time_limit is None else min(options.time_limit, LONGEST)
    memory_limit = MEMORY_LIMIT if options.memory_limit is None else options.memory_limit
    request = pack((job, arguments, purpose, _folder(), time_limit, memory_limit))
    child = _take()
    fine = False
    try:
        answer = child.ask(request, time_limit)
        if answer is None:
            raise ShellFileError(
                path,
                f"takes OpenCASCADE more than the time limit of {time_limit:g} s: raise "
                "time_limit, take a larger chord_error or fewer faces, or mend the file",
            )
        try:
            kind, *content, told = unpack(answer)
        except ValueError:
            raise ShellFileError(path, _NO_ANSWER) from None
        for category, text in told:
            _warn(category, text)
        if kind == "done":
            fine = True
            return content[0]
        if kind == "fault":
            fault = _fault(*content)
            fine = isinstance(fault, (InvalidParameter, NameNotFound))
            raise fault
        if kind == "memory":
            raise ShellFileError(path, _short_of_memory(memory_limit))
        reason, trace = content
        cause = RuntimeError(f"in the CAD child:\n{trace}")
        raise ShellFileError(path, f"makes OpenCASCADE fail ({reason}): {_ADVICE}") from cause
    except EOFError:
        why = child.why_ended(memory_limit)
        raise ShellFileError(path, why) from None
    finally:
        if fine:
            child.keep()
        else:
            child.end()


class _Child:
    """A process of `child.serve`."""

    def __init__(self) -> None:
        self.paths = [str(one) for one in sys.path]
        self.owner = os.getpid()
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 (closed with the child)
        # The child ends when the other end of this pipe closes, be it by SIGKILL.
        ends = os.pipe()
        # Not 0 to 2, which are free where this process has closed them: those are the child's own.
        life, self._life = (fcntl.fcntl(one, fcntl.F_DUPFD_CLOEXEC, 3) for one in ends)
        for one in ends:
            os.close(one)
        program = os.fsdecode(spawn.get_executable() or sys.executable)
        try:
            self._process = subprocess.Popen(
                [program, "-P", "-c", _START, str(life), *self.paths],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                pass_fds=[life],
            )
        except OSError:
            os.close(self._life)
            raise
        finally:
            os.close(life)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._requests = Connection(os.dup(self._process.stdin.fileno()), readable=False)
        self._answers = Connection(os.dup(self._process.stdout.fileno()), writable=False)
        self._process.stdin.close()
        self._process.stdout.close()
        self._jobs, self._since = 0, 0.0

    def ask(self, request: bytes, limit: float) -> bytes | None:
        """Return the answer, None if it takes more than `limit` [s].

        Raises EOFError if the child ends before.
        """
        self._jobs += 1
        try:
            self._requests.send_bytes(request)
            while self._answers.poll(limit):
                answer = self._answers.recv_bytes(LARGEST)
                if answer != ALIVE:
                    return answer
        except OSError as error:
            raise EOFError from error
        return None

    def why_ended(self, memory_limit: float) -> str:
        """Say why the child has ended, or answers no more."""
        try:
            code = self._process.wait(ENDING)
        except subprocess.TimeoutExpired:
            return _NO_ANSWER
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").split("\n")
        last = next((line.strip() for line in reversed(lines) if line.strip()), "no reason given")
        if "bad_alloc" in last or "MemoryError" in last:
            return _short_of_memory(memory_limit)
        if code < 0:
            name = signal.strsignal(-code) or "unknown"
            said = f"; {last}" if code == -signal.SIGABRT else ""
            return (
                f"makes OpenCASCADE crash (signal {-code}, {name.lower()}{said}): {_ADVICE}; it "
                f"may also need more than the memory limit of {memory_limit / 1e9:g} GB"
            )
        return (
            f"gets no valid answer from OpenCASCADE, whose process ended with code {code} ({last})"
        )

    def usable(self) -> bool:
        """Whether it is this process's own, runs, and may take another file."""
        return (
            self.owner == os.getpid()
            and self.paths == [str(one) for one in sys.path]
            and self._jobs < MOST_JOBS
            and time.monotonic() - self._since < KEPT
            and self._process.poll() is None
        )

    def keep(self) -> None:
        """Put the child where the next job finds it, unless another one is there."""
        self._since = time.monotonic()
        if _idle or not self.usable():
            self.end()
        else:
            _idle.append(self)

    def end(self) -> None:
        """End the process at once, unless it belongs to the process that this one was forked of."""
        self._requests.close()
        self._answers.close()
        self._errors.close()
        os.close(self._life)
        if self.owner == os.getpid():
            self._process.kill()
            self._process.wait()


_idle: list[_Child] = []


def _take() -> _Child:
    """Return a child that waits for work, or a new one."""
    while _idle:
        try:
            child = _idle.pop()
        except IndexError:  # another thread was faster
            break
        if child.usable():
            return child
        child.end()
    try:
        return _Child()
    except OSError as error:
        raise SphshellError(f"cannot start a process for OpenCASCADE: {error}") from error


@atexit.register
def _end_idle() -> None:
    while _idle:
        _idle.pop().end()


def _folder() -> str:
    """Return the folder that relative paths start from, "" if it is gone."""
    try:
        return os.getcwd()
    except OSError:
        return ""


def _short_of_memory(limit: float) -> str:
    return (
        f"takes OpenCASCADE more than the memory limit of {limit / 1e9:g} GB: raise memory_limit, "
        "take a larger chord_error or fewer faces, or mend the file"
    )


def _fault(name: str, text: str, named: tuple[tuple[str, Any], ...]) -> SphshellError:
    """Return an error of the package as it was in the child."""
    kind = getattr(errors, name, SphshellError)
    error: SphshellError = kind.__new__(kind, text)
    vars(error).update(named)
    return error


def _warn(name: str, text: str) -> None:
    """Give a warning of the child to the line that called the package."""
    kind = getattr(errors, name, None) or getattr(builtins, name, None)
    if not (isinstance(kind, type) and issubclass(kind, Warning)):
        kind = UserWarning
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals["__name__"].startswith("sphshell_pin."):
        level, frame = level + 1, frame.f_back
    warnings.warn(text, kind, stacklevel=level)
