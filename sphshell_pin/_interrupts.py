"""Ctrl-C while libraries load: some of them crash on it, others swallow it.

The package imports this first of all, and this imports next to nothing, so that the command line
does not print tracebacks of libraries when it is interrupted at its start.
"""

from __future__ import annotations

import os
import signal
import sys

TYPE_CHECKING = False  # as in typing, which takes its time
if TYPE_CHECKING:
    from typing import Any


def end_at_once(*_: object) -> None:
    """End the process: the handler of Ctrl-C while a command has nothing to lose."""
    os.write(2, b"interrupted\n")
    os._exit(130)  # as shells have it


class interrupts_heard:  # noqa: N801
    """Let Ctrl-C raise KeyboardInterrupt inside the block, where it would end the process."""

    def __enter__(self) -> None:
        self._before = signal.getsignal(signal.SIGINT)
        if self._before is end_at_once:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def __exit__(self, *_: object) -> None:
        if self._before is end_at_once:
            signal.signal(signal.SIGINT, end_at_once)


class interrupts_delayed:  # noqa: N801
    """Put Ctrl-C off until the end of the block, which imports a library that cannot bear it.

    Boost.Python crashes where an exception comes between its registrations, and trimesh takes
    KeyboardInterrupt for a package that is missing. Outside the main thread there is none.
    """

    def __enter__(self) -> None:
        self._pressed = False
        self._before = signal.getsignal(signal.SIGINT)
        if self._before is not end_at_once and callable(self._before):
            _try_to_set(self._note)

    def __exit__(self, *_: object) -> None:
        if signal.getsignal(signal.SIGINT) == self._note:
            _try_to_set(self._before)  # hears first what was pressed until now
        if self._pressed:
            signal.raise_signal(signal.SIGINT)

    def _note(self, *_: object) -> None:
        self._pressed = True


def _try_to_set(handler: Any) -> bool:
    try:
        signal.signal(signal.SIGINT, handler)
    except ValueError:  # not in the main thread
        return False
    return True


# The script of the command line has no line of its own before it imports the package. What ignores
# Ctrl-C goes on ignoring it.
if (
    os.path.basename(sys.argv[0] if sys.argv else "") in ("sphshell-pin", "sphshell-pin.exe")
    and signal.getsignal(signal.SIGINT) is signal.default_int_handler
):
    _try_to_set(end_at_once)
