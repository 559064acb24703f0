"""What was measured: findings with their bounds, tables, and sections of them.

The report states its results in these, and so do the validation, the hard cases and the other
engines of a checkout. A table is a csv file, an HTML table on the page and a Markdown table in the
documents.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.tables import csv_text

Sense = Literal["<=", ">="]
Progress = Callable[[float], None]
"""Called with the share of a section that is done, 0 to 1."""
Value = str | float | None

TIMES = "\u00d7"  # the unit of ratios
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Spread(NamedTuple):
    """Median and quartiles of a figure over the rounds."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, figures: Sequence[float] | Array) -> Spread:
        """Return the spread of figures (rounds,)."""
        return cls(*np.percentile(figures, [50, 25, 75]).tolist())


@dataclass(frozen=True)
class Finding:
    """One figure, with its quartiles over the rounds and its aim where there are such.

    `sense` says on which side of `aim` it should be.
    """

    key: str
    what: str
    value: float
    unit: str = ""
    low: float | None = None
    high: float | None = None
    aim: float | None = None
    sense: Sense = "<="

    @classmethod
    def of_rounds(
        cls, key: str, what: str, ratios: Array, aim: float | None = None, sense: Sense = "<="
    ) -> Finding:
        """Return the median of the ratios (rounds,) of every round, with its quartiles."""
        median, low, high = Spread.of(ratios)
        return cls(key, what, median, TIMES, low, high, aim, sense)

    @property
    def met(self) -> bool | None:
        """Whether the aim is met; None without an aim, and where nothing was measured (NaN)."""
        if self.aim is None or math.isnan(self.value):
            return None
        return bool(self.value <= self.aim if self.sense == "<=" else self.value >= self.aim)

    @property
    def verdict(self) -> str:
        """`met`, `missed` or `not measured`; empty without an aim."""
        words = {True: "met", False: "missed", None: "not measured"}
        return "" if self.aim is None else words[self.met]

    @property
    def text(self) -> str:
        """The figure with its unit, in as many digits as show on which side of the aim it is."""
        text = with_unit(self.value, self.unit)
        if self.aim is None or self.met is not False or text != with_unit(self.aim, self.unit):
            return text
        several = (f"{self.value:.{digits}g}" for digits in range(4, 18))
        return f"{next(one for one in several if float(one) != self.aim)} {self.unit}".strip()

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
    """A column of a table: name in the file, heading on the page, how a cell is shown.

    Without `show`, a key that ends in "_s" is of times [s], which are shown in microseconds.
    """

    key: str
    heading: str
    show: Callable[..., str] | None = None

    def cell(self, value: Value) -> str:
        """Return what the page shows."""
        if self.show is not None:
            return self.show(value)
        if isinstance(value, str):
            return value
        times = self.key.endswith("_s") and not self.key.endswith("_per_s")
        return microseconds(value) if times else number(value)


def columns(*names: str) -> tuple[Column, ...]:
    """Return columns of keys, or of texts "key: heading"; else the heading is the key.

    A text may state several, with "; " between them.
    """
    parts = (name.partition(": ") for text in names for name in text.split("; "))
    return tuple(Column(key, heading or key.replace("_", " ")) for key, _, heading in parts)


@dataclass(frozen=True)
class Table:
    """Rows of values, written as NAME.csv with all digits."""

    name: str
    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Value]]

    @property
    def cells(self) -> list[list[str]]:
        """The rows as the page shows them."""
        return [
            [column.cell(value) for column, value in zip(self.columns, row, strict=True)]
            for row in self.rows
        ]

    def csv(self) -> str:
        """Return the table as csv, with all digits."""
        keys = [column.key for column in self.columns]
        cells = np.array(self.rows, dtype=object).reshape(-1, len(keys))
        return csv_text(dict(zip(keys, cells.T, strict=True)))

    def markdown(self) -> str:
        """Return the table as Markdown."""
        lines = [[c.heading for c in self.columns], ["---"] * len(self.columns), *self.cells]
        return "".join(
            f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |\n"
            for line in lines
        )


@dataclass(frozen=True)
class Section:
    """One section of the page; `error` where it could not be measured, in one sentence."""

    key: str
    title: str
    text: str = ""
    findings: list[Finding] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    error: str | None = None
    seconds: float = 0.0  # that measuring it took


def about(doc: str | None) -> str:
    """Return the second paragraph of a docstring, as one line: what a section says of itself."""
    return " ".join("".join((doc or "").split("\n\n")[1:2]).split())


def findings_table(findings: Sequence[Finding]) -> Table:
    """Return findings as a table; its verdict is empty for a finding without an aim."""
    return Table(
        "findings",
        "Findings.",
        columns("finding", "figure", "quartiles", "aim", "verdict"),
        [(f.what, f.text, f.spread_text, f.aim_text, f.verdict) for f in findings],
    )


TIME_COLUMNS = "median_s: median [us]; low_s: lower quartile; high_s: upper quartile"
"""Columns for the `Spread` of times [s]."""


def times_table(
    name: str, caption: str, label: str, times: Mapping[str, Array], base: str, heading: str
) -> Table:
    """Return times [s] (rounds,) by their names: quartiles, and the median over those of `base`.

    `label` is the column of the names; `heading` is that of the ratios, as "key: heading".
    """
    rows = [(what, *Spread.of(t), float(np.median(t / times[base]))) for what, t in times.items()]
    return Table(name, caption, columns(label, TIME_COLUMNS, f"{heading} [{TIMES}]"), rows)


def number(value: float | None) -> str:
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
        return f"{digits}{TIMES}10{str(int(exponent)).translate(_RAISED)}"
    if size >= 1e3:
        return f"{value:,.0f}".replace(",", "\u202f")
    return f"{value:.3g}"


def with_unit(value: float, unit: str) -> str:
    """Return a number and its unit; the times sign is one, for ratios."""
    return f"{number(value)} {unit}".strip() if math.isfinite(value) else "not measured"


def microseconds(seconds: float | None) -> str:
    """Return a time in microseconds; below a nanosecond it is shown as 0."""
    return "" if seconds is None else number(seconds * 1e6 if abs(seconds) >= 1e-9 else 0.0)
