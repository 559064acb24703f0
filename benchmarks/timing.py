"""Ratios on a noisy machine: contestants take turns, each round gives one ratio."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable

import numpy as np


def one_core() -> None:
    """Keep this process, libraries' threads included, on one core."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def take_turns(contestants: dict[str, Callable[[], float]], rounds: int) -> dict[str, np.ndarray]:
    """Run every contestant once a round; return the times of each, (rounds,).

    A contestant times itself and returns seconds per unit of its work.
    """
    times: dict[str, list[float]] = {name: [] for name in contestants}
    for run in contestants.values():
        run()  # warm up
    for _ in range(rounds):
        for name, run in contestants.items():
            times[name].append(run())
    return {name: np.array(t) for name, t in times.items()}


def ratio(a: np.ndarray, b: np.ndarray) -> str:
    """Median of a / b round by round, with the quartiles."""
    low, middle, high = np.percentile(a / b, [25, 50, 75])
    return f"{middle:7.2f} [{low:.2f}, {high:.2f}]"


def median_us(times: np.ndarray) -> str:
    """Median in microseconds."""
    return f"{np.median(times) * 1e6:9.3f} us"


def machine() -> str:
    """One line on what this runs on."""
    import coal
    import pinocchio

    import sphshell_pin

    return (
        f"{platform.machine()}, Python {platform.python_version()}, NumPy {np.__version__}, "
        f"Pinocchio {pinocchio.__version__}, Coal {coal.__version__}, "
        f"sphshell_pin {sphshell_pin.__version__}; one core, medians [quartiles] of rounds in turn"
    )
