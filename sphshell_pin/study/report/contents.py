"""What a report holds: sections of findings, pictures and tables."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, Literal

Progress = Callable[[float], None]  # told the share of a section that is done, 0 to 1


@dataclass(frozen=True)
class Finding:
    """One figure, with its quartiles over the rounds and its aim where there are such.

    `sense` says on which side of `aim` it should be; `shown` takes the place of the number in
    text; a `headline` stands at the top of the page too.
    """

    key: str
    what: str
    value: float
    unit: str = ""
    low: float | None = None
    high: float | None = None
    aim: float | None = None
    sense: Literal["<=", ">="] = "<="
    headline: bool = False
    shown: str | None = None

    @property
    def met(self) -> bool | None:
        """Whether the aim is met; None without an aim. NaN does not meet any."""
        if self.aim is None:
            return None
        return self.value <= self.aim if self.sense == "<=" else self.value >= self.aim

    @property
    def text(self) -> str:
        """The figure with its unit."""
        return self.shown if self.shown is not None else with_unit(self.value, self.unit)

    @property
    def aim_text(self) -> str:
        """The aim, as "at most 1.8"; empty without one."""
        if self.aim is None:
            return ""
        word = "at most" if self.sense == "<=" else "at least"
        return f"{word} {with_unit(self.aim, self.unit)}"

    @property
    def spread_text(self) -> str:
        """The quartiles, as "1.45 to 1.49"; empty without."""
        if self.low is None or self.high is None:
            return ""
        return f"{number(self.low)} to {number(self.high)}"


@dataclass(frozen=True)
class Column:
    """A column of a table: name in the file, heading on the page, how a cell is shown."""

    key: str
    heading: str
    show: Callable[[Any], str] | None = None

    def cell(self, value: Any) -> str:
        """Return what the page shows."""
        if self.show is not None:
            return self.show(value)
        return value if isinstance(value, str) else number(value)


@dataclass(frozen=True)
class Table:
    """Rows of values, written as NAME.csv with all digits; a `folded` one is shown on demand."""

    name: str
    caption: str
    columns: tuple[Column, ...]
    rows: list[tuple[Any, ...]]
    folded: bool = False


@dataclass(frozen=True)
class Picture:
    """An inline SVG, what it shows for those who cannot see it, and its caption.

    It is written as NAME.png, too.
    """

    name: str
    svg: str
    png: bytes
    description: str
    caption: str


@dataclass(frozen=True)
class Section:
    """One section of the page; `error` where it could not be measured, in one sentence."""

    key: str
    title: str
    text: str = ""
    findings: list[Finding] = field(default_factory=list)
    pictures: list[Picture] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    error: str | None = None
    seconds: float = 0.0  # that measuring it took


TIMES = "\u00d7"  # the unit of ratios


def benchmark(name: str) -> Any:
    """Return a module of the benchmarks, which are installed inside the package."""
    return import_module(f"sphshell_pin.benchmarks.{name}")


def number(value: Any) -> str:
    """Return a number with three digits, as people write it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}".replace(",", "\u202f")
    if not math.isfinite(value):
        return "-"
    size = abs(value)
    if size == 0:
        return "0"
    if size < 1e-3 or size >= 1e6:
        digits, _, exponent = f"{value:.1e}".partition("e")
        return f"{digits}\u00d710{superscript(int(exponent))}"
    if size >= 1e3:
        return f"{value:,.0f}".replace(",", "\u202f")
    return f"{value:.3g}"


def superscript(exponent: int) -> str:
    """Return an integer as superscript."""
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def with_unit(value: float, unit: str) -> str:
    """Return a number and its unit; the times sign is one, for ratios."""
    return f"{number(value)} {unit}".strip() if math.isfinite(value) else "not measured"


def microseconds(seconds: float) -> str:
    """Return a time in microseconds; below a nanosecond it is nothing."""
    return number(seconds * 1e6 if abs(seconds) >= 1e-9 else 0.0)
