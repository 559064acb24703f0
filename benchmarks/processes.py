"""Work in a process of its own: for its memory, or because it may crash or hang."""

import math
import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


class ProcessLost(Exception):
    """The process crashed, or took too long and was ended; the message says which."""


class OwnProcess:
    """A fresh interpreter that calls functions of modules; it starts anew after it was lost."""

    def __init__(self, begin: Callable[[], object] | None = None) -> None:
        self._begin = begin
        self._pool: ProcessPoolExecutor | None = None

    def call(
        self, timeout: float | None, function: Callable[P, T], *args: P.args, **named: P.kwargs
    ) -> T:
        """Return what `function` returns there, within `timeout` [s], or raise what it raises.

        Raises ProcessLost, too.
        """
        if self._pool is None:
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(1, context, self._begin)
        try:
            return self._pool.submit(function, *args, **named).result(timeout)
        except BrokenProcessPool:
            self.close()
            raise ProcessLost("the process crashed") from None
        except TimeoutError:
            self.close()
            raise ProcessLost(f"took longer than {timeout:.0f} s") from None
        except BaseException as error:
            if not isinstance(error, Exception):
                self.close()
            raise

    def close(self) -> None:
        """End the process at once."""
        if self._pool is not None:
            for process in list((self._pool._processes or {}).values()):
                process.kill()
            self._pool.shutdown(wait=True, cancel_futures=True)
            self._pool = None


def resident() -> tuple[float, float]:
    """Return the memory of this process now and at its highest [bytes]; NaN where unknown."""
    try:
        text = Path("/proc/self/status").read_text(encoding="ascii")
    except OSError:
        return math.nan, math.nan
    rows = dict(line.split(":", 1) for line in text.splitlines())
    return 1024 * float(rows["VmRSS"].split()[0]), 1024 * float(rows["VmHWM"].split()[0])
