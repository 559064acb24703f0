"""What a hard case returns, and the register of the cases.

A module of cases:

    \"\"\"Heading of its table.  What the cases share follows as text above the table.\"\"\"

    @case("ball on a plate")
    def at_rest() -> Verdicts:
        yield compare("at rest", "ball of 1 kg", "depth = m g / k", expected, measured, 1e-9)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Verdict:
    """One figure: what was tried, the law in words or symbols, and how far it is from it.

    `error` is what `bound` bounds: mostly |measured / expected - 1|. Where `expected` is a text
    ("no gain", "none passed"), `measured` may be one, too.
    """

    case: str
    tried: str
    law: str
    expected: float | str
    measured: float | str
    error: float
    bound: float

    @property
    def ok(self) -> bool:
        """A NaN is not."""
        return self.error <= self.bound


Verdicts = Iterator[Verdict]


@dataclass(frozen=True)
class Case:
    """A function that runs and judges; `slow`: more than a few seconds."""

    name: str
    judge: Callable[[], Verdicts]
    slow: bool

    @property
    def module(self) -> str:
        return self.judge.__module__

    def run(self) -> list[Verdict]:
        return list(self.judge())


CASES: list[Case] = []


def case(
    name: str, *, slow: bool = False
) -> Callable[[Callable[[], Verdicts]], Callable[[], Verdicts]]:
    """Register a function that yields verdicts as a case, in the order of the module."""

    def register(judge: Callable[[], Verdicts]) -> Callable[[], Verdicts]:
        if any(name == known.name for known in CASES):
            raise ValueError(f"two cases are called {name!r}")
        CASES.append(Case(name, judge, slow))
        return judge

    return register


def compare(
    name: str,
    tried: str,
    law: str,
    expected: float,
    measured: float,
    bound: float,
    *,
    scale: float | None = None,
) -> Verdict:
    """Return the verdict on |measured - expected| / scale; the scale is |expected| by default."""
    error = abs(measured - expected) / (abs(expected) if scale is None else scale)
    return Verdict(name, tried, law, expected, measured, error, bound)


def at_most(name: str, tried: str, law: str, measured: float, bound: float) -> Verdict:
    """Return the verdict on a figure that should be zero: its size is the error."""
    return Verdict(name, tried, law, 0.0, measured, abs(measured), bound)


def failed(name: str, problem: BaseException) -> Verdict:
    """Return the verdict on a case that raised."""
    text = f"{type(problem).__name__}: {str(problem).splitlines()[0] if str(problem) else ''}"
    return Verdict(name, "", "runs to its end", "a figure", text, math.nan, 0.0)
