"""Options of all constructors and queries of a shell, and their checks."""

import math
import numbers
import os

from sphshell_pin.errors import InvalidParameter, InvalidShell

CREASE_ANGLE = math.radians(30.0)
"""Edges that turn by less are smooth [rad]."""

SIDES = ("both", "outside", "inside")

SIZES = (1e-12, 1e15)
"""Diagonals of a shell's box [m]: the search tree holds squares of shares of it in single precision
(1e-38 to 3e38), down to elements of a millionth of it."""


def check_options(crease_angle: float, side: str) -> None:
    """Raise InvalidParameter unless crease_angle [rad] is in 0..pi and side a known one."""
    if not isinstance(side, str) or side not in SIDES:
        raise InvalidParameter("side", side, f"must be one of: {', '.join(SIDES)}")
    try:
        fits = 0.0 <= float(crease_angle) <= math.pi
    except (TypeError, ValueError, OverflowError):
        fits = False
    if not fits:
        raise InvalidParameter("crease_angle", crease_angle, "must lie between 0 and pi [rad]")


def check_size(size: float) -> None:
    """Raise InvalidShell unless the search tree can hold a box with this diagonal [m]."""
    least, most = SIZES
    if not least <= size <= most:
        raise InvalidShell(
            f"the shell's box has a diagonal of {size:.3g} m: it must be between {least:g} and "
            f"{most:g} m, as the search tree is in single precision; choose another unit"
        )


def thread_count(threads: int | None) -> int:
    """Return how many threads to use, all processors if None; InvalidParameter unless >= 1."""
    if threads is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    number = isinstance(threads, numbers.Real) and not isinstance(threads, bool)
    if not number or threads != threads // 1 or threads < 1:
        raise InvalidParameter("threads", threads, "must be a whole number of at least 1")
    return int(threads)
