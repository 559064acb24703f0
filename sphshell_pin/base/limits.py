"""Child processes for what may crash or ask for too much: their start, limits and last words."""

import os
import resource
import sys
from contextlib import suppress
from multiprocessing import spawn
from pathlib import Path

from sphshell_pin.base import sandbox


def child_command(module: str) -> list[str]:
    """Return the command that runs `serve` of a module in a process of its own, confined."""
    python = os.fsdecode(spawn.get_executable() or sys.executable)
    return [python, "-P", sandbox.__file__, module, *map(str, sys.path)]


def last_line(errors: bytes) -> str:
    """Return the last line that a child wrote to its standard error."""
    lines = map(str.strip, errors.decode(errors="replace").split("\n"))
    return next(filter(None, reversed([*lines])), "no reason given")


def limit_memory(limit: float | None) -> None:
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
    with suppress(OSError, ValueError, OverflowError):
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
