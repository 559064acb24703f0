"""What a case of the validation is, and how all of them become a page.

A module of MODULES holds the cases of one subject. A case is a function with the decorator `case`,
and a table of cases.toml with its source; it runs the scenes and returns an Outcome: error figures
with their bounds, and a picture. What it is compared with lies in tests/data/validation, a csv file
for each source; the lines of such a file that begin with "#" say where the numbers come from and
how they were read, and stand on the page.
"""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

import sphshell_pin
from sphshell_pin.arrays import Array
from sphshell_pin.cases.contents import Finding, Picture, Progress, Section, Table
from sphshell_pin.cases.register import Register
from sphshell_pin.errors import NameNotFound, ResultError
from sphshell_pin.regular_file import read_text
from sphshell_pin.study.report.making import Part, Report, Tell, make_report
from sphshell_pin.study.report.page import Heading

MODULES = (
    "kharaz",
    "chung_ooi_normal",
    "chung_ooi_spin",
    "pressed",
    "ellipses",
    "finger_pad",
    "cam",
    "rolling",
    "restitution",
    "leaving",
    "carried",
    "tippe_top",
    "rattleback",
    "tosses",
)
"""In the order of the page."""
HEADING = Heading(
    "sphshell_pin: against published experiments",
    "Every case states its source, and takes its parameters from there: nothing is fitted to what "
    "it is judged by. A figure is our distance from what was published, its aim the scatter of "
    "those data. Where a figure is out of its aim, the case says which physics the theory leaves "
    "out.",
)
DATA = Path("tests", "data", "validation")
STATED: dict[str, Any] = tomllib.loads(
    Path(__file__).with_name("cases.toml").read_text(encoding="utf-8")
)
NOT_FOUND: list[str] = STATED.pop("not_found")
"""What could not be compared, as its numbers were not found: none is made up."""
ABSENT = (
    "the published data belong to the checkout (tests/data/validation), and this package is "
    "installed without it: run the validation from a checkout"
)


@dataclass(frozen=True)
class Outcome:
    """What a case found: `findings` with bounds, the first of which stands for the case.

    `explained` names, by the key of a finding that is out of its bound, the physics that the theory
    leaves out.
    """

    findings: Sequence[Finding]
    pictures: Sequence[Picture]
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()
    explained: Mapping[str, str] = field(default_factory=dict)

    @property
    def unexplained(self) -> list[Finding]:
        """The findings that are out of their bounds without an explanation."""
        return [f for f in self.findings if f.met is False and f.key not in self.explained]


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

    def section(self, *, quick: bool = False, progress: Progress | None = None) -> Section:
        """Run the case and return its section of the page."""
        found = self.run()
        first, *others = found.findings
        stated = [f"{heading}: {text}" for heading, text in self.texts.items()]
        return Section(
            self.key,
            self.title,
            # The one on top of the page stands there without its section.
            findings=[replace(first, what=f"{self.title}: {first.what}"), *others],
            pictures=list(found.pictures),
            tables=list(found.tables),
            notes=[*stated, *found.notes, *explanations(found)],
        )


def within(aim: float, *errors: tuple[str, str, float], unit: str = "") -> list[Finding]:
    """Return findings of errors (key, what, error), of which only the size counts."""
    return [Finding(key, what, abs(float(error)), unit, aim=aim) for key, what, error in errors]


def explanations(found: Outcome) -> list[str]:
    """Return why findings are out of their bounds, a text for those that have the same reason."""
    reasons: dict[str, list[str]] = {}
    for finding in found.findings:
        if finding.met is False and finding.key in found.explained:
            reasons.setdefault(found.explained[finding.key], []).append(finding.what)
    return [f"Out of bounds: {'; '.join(names)}. {text}" for text, names in reasons.items()]


# What a case states of itself is in cases.toml.
CASES = Register(__package__, MODULES, lambda key, run: Case(key=key, run=run, **STATED[key]))
case, collect = CASES.case, CASES.collect


def make_validation(
    out: Path, *, quick: bool = False, command: str = "", tell: Tell | None = None
) -> Report:
    """Run the cases and write their page, tables and pictures to the folder `out`.

    Raises
    ------
    MissingExtra
        Without matplotlib (the extra `view`).
    ResultError
        Where the folder cannot be written, or the data are not there.
    """
    data_folder()  # raises now what each case would raise
    parts = [
        Part(known.key, known.title, known.section, (1.0, 10.0 if known.slow else 1.0), False)
        for known in collect(quick=quick)
    ]
    return make_report(out, quick=quick, command=command, tell=tell, parts=parts, heading=HEADING)


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


def data_folder() -> Path:
    """Return the folder of the published data; ResultError where the package has no checkout."""
    folder = Path(sphshell_pin.__file__).parent.parent / DATA
    if not folder.is_dir():
        raise ResultError(folder, ABSENT)
    return folder


def read(name: str) -> Data:
    """Return the data of the file `name`.csv."""
    path = data_folder() / f"{name}.csv"
    lines = read_text(path).splitlines()
    origin = " ".join(line.lstrip("# ").rstrip() for line in lines if line.startswith("#"))
    head, *rows = csv.reader(line for line in lines if line and not line.startswith("#"))
    return Data(name, origin, {one: [row[k] for row in rows] for k, one in enumerate(head)})
