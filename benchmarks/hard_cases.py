"""The hard cases of tests/hard_cases, which belong to a checkout, in processes of their own.

Runs that are compared with a closed form, or with a bound that physics sets: impacts, rolling,
surfaces, energy, impact tests, under-stiff laws, extreme numbers, rest on slopes. Each verdict has
a bound for its error.
"""

from __future__ import annotations

import functools
import importlib
import math
import multiprocessing
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from pathlib import Path

import sphshell_pin
from sphshell_pin.benchmarks.timing import silent
from sphshell_pin.cases import drawing
from sphshell_pin.cases.contents import (
    Finding,
    Picture,
    Progress,
    Section,
    Verdict,
    about,
    verdicts_table,
)
from sphshell_pin.cases.register import Case

MOST_PROCESSES = 4


@dataclass(frozen=True)
class Found:
    """The verdicts of all cases that ran, and the seconds they took."""

    rows: list[Verdict]
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
    rows: dict[int, list[Verdict]] = {}
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
def _chosen(quick: bool, only: str | None) -> list[Case]:
    collect = importlib.import_module("tests.hard_cases.__main__").collect
    return list(collect(quick=quick, only=only))


def _count(quick: bool, only: str | None) -> int:
    return len(_chosen(quick, only))


def _run(number: int, quick: bool, only: str | None) -> tuple[int, list[Verdict]]:
    """Return the verdicts of a case; the group is the heading of its module."""
    case = _chosen(quick, only)[number]
    text = importlib.import_module(case.module).__doc__ or case.module
    group = text.strip().partition(".")[0]
    return number, [replace(verdict, group=group) for verdict in case.verdicts()]


KEY, TITLE = "hard_cases", "Hard cases"
TEXT = about(__doc__)
ABSENT = """\
The hard cases are part of the checkout (tests/hard_cases), and this package is installed without
it: run the report from a checkout to have them here."""
LEAST = 1e-16  # errors below, zero among them, are drawn here


def section(*, quick: bool, progress: Progress) -> Section:
    """Run the cases where there is a checkout, and return the section."""
    root = checkout()
    if root is None:
        absent = ABSENT.replace("\n", " ")
        without = "hard cases (this package is no checkout)"
        return Section(KEY, TITLE, TEXT, notes=[absent], unmeasured=[without])
    return assemble(measure(root, quick=quick, progress=progress), quick=quick)


def assemble(found: Found, *, quick: bool) -> Section:
    """Return the section of the verdicts."""
    missed = [row for row in found.rows if not row.ok]
    held = len(found.rows) - len(missed)
    return Section(
        KEY,
        TITLE,
        TEXT,
        findings=[
            Finding(
                "hard_cases",
                f"verdicts of {found.cases} hard cases that are out of bounds",
                float(len(missed)),
                aim=0.0,
                headline=True,
                shown=f"{len(missed)} of {len(found.rows)}",
            )
        ],
        pictures=[picture(found.rows)] if found.rows else [],
        tables=[verdicts_table(found.rows)],
        notes=[
            f"{held} of {len(found.rows)} verdicts are within their bounds, in "
            f"{found.seconds:.0f} s."
            + (" The slow cases were left out (--quick)." if quick else ""),
            *(f"Out of bounds: {row.what}, {row.tried}: {row.measured}." for row in missed),
        ],
        unmeasured=["the slow ones of the hard cases (left out by --quick)"] if quick else [],
    )


def picture(rows: list[Verdict]) -> Picture:
    """Draw each verdict as a dot: its error over its bound, in the row of its group."""
    groups = list(dict.fromkeys(row.group for row in rows))
    with drawing.canvas(7.8, 0.3 * len(groups) + 0.9) as figure:
        axis = figure.subplots()
        axis.set_xscale("log")
        for k, row in enumerate(rows):
            bound = row.aim or 0.0
            share = row.value / bound if bound > 0 else (0.0 if row.ok else math.inf)
            x = min(max(share, LEAST), 1e3) if math.isfinite(share) else 1e3
            jitter = 0.5 * ((k * 0.618034) % 1 - 0.5)
            color = drawing.BLUE if row.ok else drawing.RED
            axis.plot(x, groups.index(row.group) + jitter, "o", color=color, alpha=0.55, ms=3.4)
        axis.axvline(1.0, color=drawing.INK, linewidth=1.0)
        axis.annotate(
            "bound", (1.0, -0.6), xytext=(4, 0), textcoords="offset points", fontsize=drawing.SMALL,
            va="bottom", annotation_clip=False,
        )  # fmt: skip
        axis.set_yticks(range(len(groups)), groups)
        axis.set_ylim(len(groups) - 0.4, -0.6)
        axis.set_xlim(LEAST / 2, 1e1 if all(row.ok for row in rows) else 2e3)
        from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

        axis.xaxis.set_major_locator(LogLocator(base=1e4, numticks=10))
        axis.xaxis.set_major_formatter(FuncFormatter(drawing.power_of_ten))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.tick_params(axis="y", length=0)
        axis.grid(visible=True, axis="x")
        axis.set_xlabel("error / bound")
        png = drawing.png_of(figure)
    return Picture(
        "hard_cases",
        png,
        f"Error over bound of {len(rows)} verdicts in {len(groups)} groups.",
        "A dot is a verdict: its error over what bounds it; no error at all is at the left edge.",
    )
