"""Run the hard cases of tests/hard_cases in processes of their own; they belong to a checkout."""

from __future__ import annotations

import functools
import importlib
import multiprocessing
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from pathlib import Path

import sphshell_pin
from sphshell_pin.benchmarks.timing import Progress, silent

MOST_PROCESSES = 4


@dataclass(frozen=True)
class Row:
    """One verdict: what was tried, the law, how far it is from it; `bound` bounds `error`."""

    group: str
    case: str
    tried: str
    law: str
    expected: float | str
    measured: float | str
    error: float
    bound: float
    ok: bool


@dataclass(frozen=True)
class Found:
    """The verdicts of all cases that ran, and the seconds they took."""

    rows: list[Row]
    cases: int
    seconds: float


def checkout() -> Path | None:
    """Return the root of the checkout from which the package runs; None where it is installed."""
    root = Path(sphshell_pin.__file__).parent.parent
    return root if (root / "tests" / "hard_cases" / "__main__.py").exists() else None


def measure(
    root: Path, *, quick: bool = False, only: str | None = None, progress: Progress = silent
) -> Found:
    """Run the cases of the checkout at `root`, on all cores; `quick` leaves out the slow ones."""
    start = time.perf_counter()
    # Fresh interpreters: a case may change this one, or end it.
    context = multiprocessing.get_context("spawn")
    rows: dict[int, list[Row]] = {}
    workers = min(MOST_PROCESSES, os.cpu_count() or 1)
    with ProcessPoolExecutor(workers, context, _begin, (str(root),)) as pool:
        try:
            count = pool.submit(_count, quick, only).result()
            futures = [pool.submit(_run, number, quick, only) for number in range(count)]
            for future in as_completed(futures):
                number, found = future.result()
                rows[number] = found
                progress(len(rows) / count)
        except BaseException as error:
            pool.shutdown(wait=False, cancel_futures=True)
            if isinstance(error, SystemExit | BrokenProcessPool):  # a case ended its process
                raise RuntimeError(f"the hard cases ended early: {error}") from None
            raise
    ordered = [row for number in sorted(rows) for row in rows[number]]
    return Found(ordered, count, time.perf_counter() - start)


def _begin(root: str) -> None:
    os.chdir(root)
    sys.path.insert(0, root)


@functools.cache
def _chosen(quick: bool, only: str | None) -> list:
    cases = importlib.import_module("tests.hard_cases.__main__")
    return [
        known
        for known in cases.collect()
        if not (quick and known.slow) and (not only or only in f"{known.module} {known.name}")
    ]


def _count(quick: bool, only: str | None) -> int:
    return len(_chosen(quick, only))


def _run(number: int, quick: bool, only: str | None) -> tuple[int, list[Row]]:
    """Return the verdicts of a case; the group is the heading of its module."""
    case = _chosen(quick, only)[number]
    cases = importlib.import_module("tests.hard_cases.__main__")
    text = importlib.import_module(case.module).__doc__ or case.module
    group = text.strip().partition(".")[0]
    return number, [Row(group, **asdict(v), ok=bool(v.ok)) for v in cases.run(case)]
