"""Verdicts of the hard cases: a law, what it says, what came out; the cases, and their runs."""

from __future__ import annotations

import importlib
import math
import multiprocessing
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

from sphshell_pin.study.report.contents import Column, Finding, Table, columns
from tests.register import Register


@dataclass(frozen=True)
class Verdict(Finding):
    """A finding of a law: what was tried, the law in words or symbols, what it says, what came out.

    `value` is the error that `aim` bounds, mostly |measured / expected - 1|; infinite where there
    is no figure. Where `expected` is a text ("no gain", "none passed"), `measured` may be one, too.
    `group` is the heading of the case's module.
    """

    tried: str = ""
    law: str = ""
    expected: float | str = ""
    measured: float | str = ""
    group: str = ""

    @classmethod
    def on(cls, what, tried, law, expected, measured, error, bound):
        """Return the verdict on an error; one that is no number is out of every bound."""
        more = {"tried": tried, "law": law, "expected": expected, "measured": measured}
        return cls("", what, math.inf if math.isnan(error) else float(error), aim=bound, **more)

    @property
    def ok(self) -> bool:
        """Whether the error is within its bound."""
        return self.met is True


def compare(what, tried, law, expected, measured, bound, *, scale=None):
    """Return the verdict on |measured - expected| / scale; the scale is |expected| by default."""
    error = abs(measured - expected) / (abs(expected) if scale is None else scale)
    return Verdict.on(what, tried, law, expected, measured, error, bound)


def at_most(what: str, tried: str, law: str, measured: float, bound: float) -> Verdict:
    """Return the verdict on a figure that should be zero: its size is the error."""
    return Verdict.on(what, tried, law, 0.0, measured, abs(measured), bound)


def seven_digits(value: float | str) -> str:
    """Return a figure of a verdict."""
    return value if isinstance(value, str) else f"{value:.7g}"


COLUMNS = (
    *columns("case", "tried: what is tried", "law"),
    Column("expected", "expected", seven_digits),
    Column("measured", "measured", seven_digits),
    Column("error", "error", "{:.1e}".format),
    Column("bound", "bound", "{:.0e}".format),
    Column("ok", "verdict", lambda ok: "ok" if ok else "FAILS"),
)


def table(verdicts: Sequence[Verdict]) -> Table:
    """Return verdicts, each with what was tried and its law."""
    rows = [
        (v.what, v.tried, v.law, v.expected, v.measured, v.value, v.aim, v.ok) for v in verdicts
    ]
    return Table("hard_cases", "All verdicts.", COLUMNS, rows)


Verdicts = Iterator[Verdict]


@dataclass(frozen=True)
class Case:
    """A function that runs and yields verdicts; `slow`: more than a few seconds."""

    name: str
    run: Callable[[], Verdicts]
    slow: bool = False

    @property
    def about(self) -> tuple[str, str]:
        """The heading of its module's cases and the text above their table."""
        module = importlib.import_module(self.run.__module__)
        heading, _, text = (module.__doc__ or "").strip().partition(".")
        return heading, text.strip()


# In the order of the page. A module's docstring is the text above its table.
CASES: Register[Case] = Register(
    "tests.hard_cases",
    (
        *("analytic_impact", "analytic_rolling", "analytic_surfaces", "analytic_energy"),
        *("impacts", "under_stiff", "extremes", "resting", "starts"),
    ),
    Case,
)
case = CASES.case


def verdicts(number: int, quick: bool, only: str | None) -> list[Verdict]:
    """Return the verdicts of a case; an error of its run is one, too."""
    one = CASES.collect(quick=quick, only=only)[number]
    try:
        found = list(one.run())
    except Exception as problem:
        text = f"{type(problem).__name__}: {str(problem).partition(chr(10))[0]}"
        found = [Verdict.on(one.name, "", "runs to its end", "a figure", text, math.inf, 0.0)]
    return [replace(verdict, group=one.about[0]) for verdict in found]


def measure(quick: bool = False, only: str | None = None) -> list[Verdict]:
    """Run the cases in fresh interpreters, on all cores: a case may change its process."""
    count, found = len(CASES.collect(quick=quick, only=only)), []
    workers = min(4, os.cpu_count() or 1)
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
        runs = pool.map(verdicts, range(count), [quick] * count, [only] * count)
        for k, some in enumerate(runs, 1):
            found += some
            print(f"\r{k / count:.0%}", end="", file=sys.stderr, flush=True)
    return found
