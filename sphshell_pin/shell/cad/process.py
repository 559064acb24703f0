"""OpenCASCADE in a process of its own: a file on which it crashes or hangs ends only that process.

A child is started with the first CAD file; it imports OpenCASCADE, which takes a second, so it is
kept for a minute, for the next file. One that has read a damaged file is not used again. The
standard library's pools of processes run the caller's main module again, which a script without a
guard does not survive, and leave a worker behind that hangs.
"""

import atexit
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from sphshell_pin.base.limits import child_command, last_line
from sphshell_pin.errors import InvalidParameter, NameNotFound, ShellFileError, SphshellError
from sphshell_pin.shell.cad.messages import unpack
from sphshell_pin.shell.cad.options import CadOptions

TIME_LIMIT = 600.0
"""Time for a CAD file, unless stated [s]: several times what the finest tessellations take."""

MEMORY_LIMIT = 8e9
"""Memory for a CAD file, unless stated [bytes]."""

KEPT = 60.0
"""How long a child is kept for the next file [s]; it ends by itself some seconds later."""

ENDING = 2.0
"""How long a child that no longer answers is waited for [s]."""

LONGEST = 1e6
"""Larger time limits are replaced by this one, which the system's timers can hold [s]."""

LARGEST = 1 << 32
"""Size of an answer [bytes]; two million triangles take a tenth."""

CHILD = "sphshell_pin.shell.cad.child"
"""The module whose `serve` runs in the process."""

MOST_JOBS = 50
"""Jobs of one child: OpenCASCADE does not give all memory back."""

_ADVICE = (
    "the file is damaged, or triggers a defect of OpenCASCADE: check it in its CAD program, or "
    "export it anew"
)
_NO_ANSWER = f"gets no valid answer from OpenCASCADE: {_ADVICE}"


def run_in_child(
    arguments: tuple[object, ...],
    path: Path,
    purpose: str,
    options: CadOptions,
    heard: list[Warning] | None = None,
) -> Any:  # what `read` returns
    """Read a file by `jobs.read` in a child, and return its result.

    path : of the file that is read, for messages; purpose : what needs OpenCASCADE
    heard : receives the warnings that are given

    Raises
    ------
    SphshellError
        As `jobs.read` raises it.
    ShellFileError
        If OpenCASCADE crashes, or exceeds the time or memory limit of `options`.
    """
    time_limit = TIME_LIMIT if options.time_limit is None else min(options.time_limit, LONGEST)
    memory_limit = MEMORY_LIMIT if options.memory_limit is None else options.memory_limit
    try:
        folder = os.getcwd()
    except OSError:  # it was removed
        folder = ""
    request = pickle.dumps((arguments, purpose, folder, time_limit, memory_limit))
    child = _take()
    fine = False
    try:
        try:
            answer: Any = child.ask(request, time_limit)
        except EOFError:
            raise ShellFileError(path, child.why_ended(memory_limit)) from None
        except ValueError:
            raise ShellFileError(path, _NO_ANSWER) from None
        if answer is None:
            raise ShellFileError(
                path,
                f"takes OpenCASCADE more than the time limit of {time_limit:g} s: raise "
                "time_limit, take a larger chord_error or fewer faces, or mend the file",
            )
        kind, content, caught = answer
        for warning in caught:
            warn_caller(warning)
        if heard is not None:
            heard += caught
        if kind == "error":
            fine = isinstance(content, (InvalidParameter, NameNotFound))
            raise content
        if kind == "memory":
            raise ShellFileError(path, _short_of_memory(memory_limit))
        if kind == "failed":
            reason, trace = content
            cause = RuntimeError(f"in the CAD child:\n{trace}")
            raise ShellFileError(path, f"makes OpenCASCADE fail ({reason}): {_ADVICE}") from cause
        fine = True
        return content
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
        # The child ends when its standard input closes, even if this process is killed.
        self._process = subprocess.Popen(
            child_command(CHILD), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._requests = Connection(os.dup(self._process.stdin.fileno()), readable=False)
        self._answers = Connection(os.dup(self._process.stdout.fileno()), writable=False)
        self._process.stdin.close()
        self._process.stdout.close()
        self._jobs, self._since = 0, 0.0

    def ask(self, request: bytes, limit: float) -> object:
        """Return the answer, None if it takes more than `limit` [s].

        Raises EOFError if the child ends before, ValueError if the answer is damaged.
        """
        self._jobs += 1
        try:
            self._requests.send_bytes(request)
            if not self._answers.poll(limit):
                return None
            answer = self._answers.recv_bytes(LARGEST)
        except OSError as error:
            raise EOFError from error
        return unpack(answer)

    def why_ended(self, memory_limit: float) -> str:
        """Return why the child has ended, or no longer answers."""
        try:
            code = self._process.wait(ENDING)
        except subprocess.TimeoutExpired:
            return _NO_ANSWER
        self._errors.seek(0)
        last = last_line(self._errors.read())
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
        """Whether this process started it, and it runs and may read another file."""
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
        """End the process at once, unless this process is a fork of the one that started it."""
        self._requests.close()
        self._answers.close()
        self._errors.close()
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


def _short_of_memory(limit: float) -> str:
    return (
        f"takes OpenCASCADE more than the memory limit of {limit / 1e9:g} GB: raise memory_limit, "
        "take a larger chord_error or fewer faces, or mend the file"
    )


def warn_caller(warning: Warning) -> None:
    """Give a warning of the child to the line that called the package."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals["__name__"].startswith("sphshell_pin."):
        level, frame = level + 1, frame.f_back
    warnings.warn(warning, stacklevel=level)
