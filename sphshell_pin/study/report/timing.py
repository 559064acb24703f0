"""Ratios on a noisy machine: contestants take turns, each round gives one ratio."""

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from typing import TypeVar

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report.contents import Progress

K = TypeVar("K")


def silent(share: float) -> None:
    """Tell nobody how far it is."""


def part(progress: Progress, first: float, last: float) -> Progress:
    """Return the progress of a part of the work, from share `first` to `last` of the whole."""
    return lambda share: progress(first + (last - first) * share)


def one_core() -> None:
    """Keep this process, libraries' threads included, on one core."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


@contextlib.contextmanager
def on_one_core() -> Iterator[None]:
    """Keep this thread and its child processes on one core for a while."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    one_core()
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def take_turns(
    contestants: dict[K, Callable[[], float]], rounds: int, progress: Progress = silent
) -> dict[K, Array]:
    """Run every contestant once a round; return the times of each, (rounds,).

    A contestant times itself and returns seconds per unit of its work.
    """
    times: dict[K, list[float]] = {name: [] for name in contestants}
    for run in contestants.values():
        run()  # warm up
    progress(1 / (rounds + 1))
    for turn in range(rounds):
        for name, run in contestants.items():
            times[name].append(run())
        progress((turn + 2) / (rounds + 1))
    return {name: np.array(t) for name, t in times.items()}


def per_center(ask: Callable[[], object], count: int) -> Callable[[], float]:
    """Return what asks about all centers and returns the seconds of one of them."""

    def run() -> float:
        start = time.perf_counter()
        ask()
        return (time.perf_counter() - start) / count

    return run
