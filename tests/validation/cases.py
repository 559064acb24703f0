"""What a case of the validation is.

A module of MODULES holds the cases of one subject. A case is a function with the decorator `case`,
and a table of cases.toml with its source; it runs the scenes and returns an Outcome: error figures
with their bounds, and the panels of a picture. What it is compared with lies in
tests/data/validation, a csv file for each source; the lines of such a file that begin with "#" say
where the numbers come from and how they were read, and stand on the page.
"""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.regular_file import read_text
from sphshell_pin.errors import NameNotFound
from sphshell_pin.study.report.contents import Finding, Table
from tests.register import Register
from tests.validation.pictures import Panel, Series

MODULES = (
    *("kharaz", "chung_ooi", "pressed", "ellipses", "finger_pad", "cam", "rolling"),
    *("restitution", "leaving", "carried", "tippe_top", "rattleback", "tosses"),
)
"""In the order of the page."""
Sense = Literal["<=", ">="]
DATA = Path(__file__).parents[1] / "data" / "validation"
STATED: dict[str, Any] = tomllib.loads(
    Path(__file__).with_name("cases.toml").read_text(encoding="utf-8")
)
NOT_FOUND: list[str] = STATED.pop("not_found")
"""What could not be compared, as its numbers were not found: none is made up."""
WHY: dict[str, str] = STATED.pop("explanations")
"""The physics that the theory leaves out, of figures that are out of their bounds."""


@dataclass(frozen=True)
class Figure(Finding):
    """A finding with its bound; `why`: the physics left out, where it may be out of its bound."""

    why: str = ""


@dataclass(frozen=True)
class Outcome:
    """What a case found: figures, the first of which stands for the case, and the picture."""

    findings: Sequence[Figure]
    panels: Sequence[Panel]
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()

    @property
    def unexplained(self) -> list[Figure]:
        """The figures that are out of their bounds without an explanation."""
        return [f for f in self.findings if f.met is False and not f.why]

    @property
    def explanations(self) -> list[str]:
        """Why figures are out of their bounds, a text for those that have the same reason."""
        reasons: dict[str, list[str]] = {}
        for one in self.findings:
            if one.met is False and one.why:
                reasons.setdefault(one.why, []).append(one.what)
        return [f"Out of bounds: {'; '.join(names)}. {text}" for text, names in reasons.items()]


@dataclass(frozen=True, kw_only=True)
class Case:
    """One comparison: `source` is a citation with its address, `files` are names of csv files.

    `bound` says where the bounds of the figures come from; `leaves_out` what the theory does not
    hold; `reading` how data were read that no file has.
    """

    key: str
    title: str
    source: str
    setting: str
    caption: str
    bound: str
    leaves_out: str
    run: Callable[[], Outcome]
    files: Sequence[str] = ()
    slow: bool = False
    reading: str = ""

    @property
    def data(self) -> str:
        """How the data were read, as their files say."""
        return " ".join(filter(None, [self.reading, *(read(name).origin for name in self.files)]))

    @property
    def texts(self) -> dict[str, str]:
        """The statements about the case, by their headings."""
        return {
            "Source": self.source,
            "Data": self.data,
            "Parameters": self.setting,
            "Bounds": self.bound,
            "Left out by the theory": self.leaves_out,
        }


def within(
    aim: float, *errors: tuple[str, float], unit: str = "", why: str = "", sense: Sense = "<="
) -> list[Figure]:
    """Return figures of errors (what, error), of which only the size counts."""
    more = {"aim": aim, "sense": sense, "why": why}
    return [Figure("", what, abs(float(error)), unit, **more) for what, error in errors]


# What a case states of itself is in cases.toml.
CASES = Register(__package__, MODULES, lambda key, run: Case(key=key, run=run, **STATED[key]))
case, collect = CASES.case, CASES.collect


@dataclass(frozen=True)
class Data:
    """A csv file: `origin` is its source and how it was read, `columns` its columns by name."""

    name: str
    origin: str
    columns: Mapping[str, Sequence[str]]

    def texts(self, column: str) -> list[str]:
        """Return a column as it is written."""
        if column not in self.columns:
            raise NameNotFound("column", column, self.name, self.columns)
        return list(self.columns[column])

    def __getitem__(self, column: str) -> Array:
        """Return a column (n,) of numbers."""
        return np.array(self.texts(column), dtype=float)

    @property
    def published(self) -> dict[str, float]:
        """The column "value" by the column "quantity"."""
        return dict(zip(self.texts("quantity"), self["value"].tolist(), strict=True))

    def where(self, column: str, value: str) -> Data:
        """Return the rows whose `column` is `value`."""
        chosen = [k for k, text in enumerate(self.texts(column)) if text == value]
        rows = {name: [cells[k] for k in chosen] for name, cells in self.columns.items()}
        return Data(self.name, self.origin, rows)

    def series(self, column: str, x: str, label: str = "{}") -> list[Series]:
        """Return `x` and the values of the rows of each of the texts in a column."""
        each = {text: self.where(column, text) for text in dict.fromkeys(self.texts(column))}
        return [(label.format(text), one[x], one["value"]) for text, one in each.items()]


def read(name: str) -> Data:
    """Return the data of the file `name`.csv."""
    path = DATA / f"{name}.csv"
    lines = read_text(path).splitlines()
    origin = " ".join(line.lstrip("# ").rstrip() for line in lines if line.startswith("#"))
    head, *rows = csv.reader(line for line in lines if line and not line.startswith("#"))
    return Data(name, origin, {one: [row[k] for row in rows] for k, one in enumerate(head)})
