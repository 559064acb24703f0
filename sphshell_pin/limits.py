"""Limits that a child process sets itself before it reads what may ask for too much."""

from __future__ import annotations

import resource
from contextlib import suppress
from pathlib import Path


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
