"""Verdicts of the hard cases: a law, what it says, what came out; and the register of the cases."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

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
        error = math.inf if math.isnan(error) else float(error)
        return cls(
            "", what, error, aim=bound, tried=tried, law=law, expected=expected, measured=measured
        )

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


def failed(what: str, problem: BaseException) -> Verdict:
    """Return the verdict on a case that raised."""
    text = f"{type(problem).__name__}: {str(problem).splitlines()[0] if str(problem) else ''}"
    return Verdict.on(what, "", "runs to its end", "a figure", text, math.inf, 0.0)


def verdicts_table(verdicts: Sequence[Verdict]) -> Table:
    """Return verdicts, each with what was tried and its law."""
    return Table(
        "hard_cases",
        "All verdicts.",
        (
            *columns("case", "tried: what is tried", "law"),
            Column("expected", "expected", seven_digits),
            Column("measured", "measured", seven_digits),
            Column("error", "error", "{:.1e}".format),
            Column("bound", "bound", "{:.0e}".format),
            Column("ok", "verdict", lambda ok: "ok" if ok else "FAILS"),
        ),
        [(v.what, v.tried, v.law, v.expected, v.measured, v.value, v.aim, v.ok) for v in verdicts],
    )


def seven_digits(value: float | str) -> str:
    """Return a figure of a verdict."""
    return value if isinstance(value, str) else f"{value:.7g}"


Verdicts = Iterator[Verdict]


@dataclass(frozen=True)
class Case:
    """A function that runs and yields verdicts; `slow`: more than a few seconds."""

    name: str
    run: Callable[[], Verdicts]
    slow: bool = False

    @property
    def module(self) -> str:
        """The module of its function."""
        return self.run.__module__

    def verdicts(self) -> list[Verdict]:
        """Return its verdicts; an error of its run is one, too."""
        try:
            return list(self.run())
        except Exception as problem:
            return [failed(self.name, problem)]


# In the order of the page. A module's docstring is the text above its table.
CASES: Register[Case] = Register(
    "tests.hard_cases",
    (
        "analytic_impact",
        "analytic_rolling",
        "analytic_surfaces",
        "analytic_energy",
        "impacts",
        "under_stiff",
        "extremes",
        "resting",
        "starts",
    ),
    Case,
)
case = CASES.case
