"""Ctrl-C while libraries load: some of them crash on it, others swallow it."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

COMMAND = "sphshell-pin"


def end_at_once(*_: Any) -> None:
    """End the process: the handler of Ctrl-C while a command has nothing to lose."""
    os.write(2, b"interrupted\n")
    os._exit(130)  # as shells have it


def end_command_at_once() -> None:
    """Let Ctrl-C end the process at once, if it is that of the command line.

    Its script imports this package first of all. What ignores Ctrl-C goes on ignoring it.
    """
    name = os.path.basename(sys.argv[0]) if sys.argv else ""
    usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if usual and _may_set() and name.removesuffix(".exe") == COMMAND:
        signal.signal(signal.SIGINT, end_at_once)


@contextmanager
def interrupts_heard() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt inside the block, where it would end the process."""
    before = signal.getsignal(signal.SIGINT)
    if before is not end_at_once:
        yield
        return
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, end_at_once)


@contextmanager
def interrupts_delayed() -> Iterator[None]:
    """Put Ctrl-C off until the end of the block, which imports a library that cannot bear it.

    Boost.Python crashes where an exception comes between its registrations, and trimesh takes
    KeyboardInterrupt for a package that is missing.
    """
    before = signal.getsignal(signal.SIGINT)
    if before is end_at_once or not callable(before) or not _may_set():
        yield
        return
    pressed: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: pressed.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if pressed:
            signal.raise_signal(signal.SIGINT)


def _may_set() -> bool:
    return threading.current_thread() is threading.main_thread()
