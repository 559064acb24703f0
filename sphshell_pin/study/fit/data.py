"""Measured data: read from csv files or columns, checked, and brought into SI units."""

import csv
import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.regular_file import StrPath, read_text
from sphshell_pin.base.tables import quantity_of
from sphshell_pin.base.texts import number_of
from sphshell_pin.errors import DataError, InvalidParameter, NameNotFound
from sphshell_pin.study.fit.units import factor_to_si

Source = StrPath | Mapping[str, ArrayLike]

TIME, SIGMA = "t", ".sigma"
# A time may be so much beyond the end of a run, as a part of it, for having been rounded.
_ROUNDED = 1e-6
_EXAMPLE = "t [s],pairs.tip.normal_force [N]"
_LARGEST = 1e70  # of data and 1 / sigma: the squares of their quotients do not overflow


@dataclass(frozen=True)
class Experiment:
    """One measured run.

    `data` is a csv file, or columns by their headers ("t [s]": (n,), ...), where nan is no value;
    `changes` are values by dotted key that differ from the scenario's, as --set takes them;
    `name` is how reports and pictures call it.
    """

    data: Source
    changes: Mapping[str, object] = field(default_factory=dict)
    name: str = ""


@dataclass(frozen=True)
class Series:
    """One measured column of one experiment, and what the fitted scenario says: all (m,).

    `t` are times [s]; values are in the SI `unit`; `sigma` are the standard deviations that
    weighted them; `given` whether the data came with these.
    """

    experiment: str
    name: str
    unit: str
    t: Array
    measured: Array
    fitted: Array
    sigma: Array
    given: bool

    @property
    def residuals(self) -> Array:
        """Measured less fitted values (m,), in `unit`."""
        return self.measured - self.fitted

    @property
    def rms(self) -> float:
        """Root of the mean square of the residuals, in `unit`."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    def until(self, end: float) -> "Series":
        """Return the values at the times up to `end` [s]."""
        columns = ("t", "measured", "fitted", "sigma")
        return replace(self, **{one: getattr(self, one)[self.t <= end] for one in columns})


@dataclass(frozen=True)
class _Table:
    """Columns `values` (columns, rows) with their `titles`; `lines` (rows,) of the file."""

    source: str
    titles: Sequence[str]
    values: Array
    lines: Sequence[int] = ()

    @cached_property
    def names(self) -> dict[str, int]:
        """The numbers of the columns by the names in their titles."""
        out: dict[str, int] = {}
        for number, title in enumerate(self.titles):
            if out.setdefault(name := quantity_of(title)[0].strip(), number) != number:
                raise self.fault(f"two columns are called '{name}'")
        return out

    def column(self, name: str, unit: str) -> Array:
        """Return the values (n,) of a column in the SI `unit`."""
        title, values = self.titles[self.names[name]], self.values[self.names[name]]
        for row in np.flatnonzero(np.isinf(values)):
            raise self.not_finite(f"{values[row]:g}", title, int(row))
        too_large = f"{{:g}} in column '{title}' is too large to compute with"
        self.check(np.abs(values) > _LARGEST, values, too_large)
        given = quantity_of(title)[1] if "[" in title else None
        try:
            return np.asarray(values * factor_to_si(name, given, unit))
        except InvalidParameter as fault:
            raise self.fault(str(fault)) from None

    def check(self, wrong: NDArray[np.bool_], values: Array, reason: str) -> None:
        """Raise DataError for the first row that is `wrong`; {} in the reason is its value."""
        for row in np.flatnonzero(wrong):
            raise self.fault(reason.format(values[row], values[row - 1]), int(row))

    def not_finite(self, value: str, title: str, row: int) -> DataError:
        """Return the error of a `value` that is no number, and how to leave it out."""
        hint = "; leave the cell empty" if self.lines else "; put nan"
        hint = "" if quantity_of(title)[0] == TIME else f"{hint} where nothing was measured"
        return self.fault(f"'{value}' in column '{title}' is not a finite number{hint}", row)

    def fault(self, reason: str, row: int | None = None) -> DataError:
        if row is None or self.lines:
            return DataError(self.source, reason, None if row is None else self.lines[row])
        return DataError(self.source, f"row {row}: {reason}")


def read_experiment(
    experiment: Experiment,
    number: int,
    known: Mapping[str, str],
    duration: float,
    only: Collection[str] | None = None,
) -> list[Series]:
    """Return the checked columns of an experiment whose run lasts `duration` [s].

    `known` are the units of what can be measured, by name, `only` the columns to take (None: all).

    Raises
    ------
    DataError, NameNotFound
        What is wrong with the data, and where.
    """
    given = experiment.data
    if isinstance(given, str | PathLike):
        name, table = experiment.name or Path(given).stem, _read_csv(Path(given))
    else:
        name = experiment.name or f"experiment {number}"
        table = _take_columns(given, name)
    if TIME not in table.names:
        named = ", ".join(table.names) or "none"
        raise table.fault(f"has no column '{TIME} [s]'; its columns are: {named}")
    t = table.column(TIME, "s")
    if not len(t):
        raise table.fault("has no rows of data")
    steps = np.diff(t, prepend=-np.inf)
    must = "that of the row above, {:.9g} s: times must increase"
    end = f"the end of the run, {duration:.9g} s: cut the data, or set run.duration"
    table.check(np.isnan(t), t, "the time is missing")
    table.check(steps == 0.0, t, f"time {{:.9g}} s is the same as {must}")
    table.check(steps < 0.0, t, f"time {{:.9g}} s is before {must}")
    table.check(t < 0.0, t, "time {:.9g} s is before the start of the run, which is at 0")
    table.check(t > duration * (1 + _ROUNDED), t, f"time {{:.9g}} s is after {end}")
    measured = [label for label in table.names if label != TIME]
    for label in only or ():
        if label not in measured:
            raise NameNotFound("column", label, table.source, measured)
    series = []
    for label in measured:
        base = label.removesuffix(SIGMA)
        if base != label and label not in known:
            if base not in measured:
                raise table.fault(f"column '{label}' has no column '{base}' to belong to")
        elif only is None or label in only:
            if label not in known:
                unknown = NameNotFound("quantity", label, "a run of this scenario", known)
                raise table.fault(str(unknown))
            series.append(_series(table, name, label, known[label], np.minimum(t, duration)))
    if not series:
        raise table.fault(f"has no column of data beside the time, as in '{_EXAMPLE}'")
    return series


def _series(table: _Table, experiment: str, name: str, unit: str, t: Array) -> Series:
    values = table.column(name, unit)
    rows = np.flatnonzero(~np.isnan(values))
    if not len(rows):
        raise table.fault(f"column '{name}' has no value")
    sigma, given = np.ones(len(t)), name + SIGMA in table.names
    if given:
        sigma = table.column(name + SIGMA, unit)
        usable = np.isnan(values) | (sigma >= 1 / _LARGEST) & (sigma <= _LARGEST)
        must = f"must be positive wherever '{name}' has a value, and not too small to compute with"
        table.check(~usable, sigma, f"'{name}{SIGMA}' {must}")
    mean = np.full(len(rows), values[rows].mean())
    return Series(experiment, name, unit, t[rows], values[rows], mean, sigma[rows], given)


def _take_columns(given: Mapping[str, ArrayLike], name: str) -> _Table:
    try:
        # What is masked was not measured.
        columns = {
            str(key).strip(): np.ma.filled(np.ma.array(value, dtype=np.float64), math.nan)
            for key, value in given.items()
        }
    except (AttributeError, TypeError, ValueError, OverflowError):
        raise DataError(
            name, f"must be a csv file, or a mapping from headers to columns of numbers: {_EXAMPLE}"
        ) from None
    shapes = {one.shape for one in columns.values()}
    if len(shapes) > 1 or any(len(shape) != 1 for shape in shapes):
        shown = ", ".join(f"'{key}' {one.shape}" for key, one in columns.items())
        raise DataError(name, f"columns must be of one length, of shape (n,): {shown}")
    return _Table(name, list(columns), np.array(list(columns.values())))


def _read_csv(path: Path) -> _Table:
    source = str(path)
    try:
        text = read_text(path)
    except OSError as fault:
        raise DataError(source, f"cannot be read: {fault.strerror}") from None
    except UnicodeDecodeError:
        raise DataError(source, "is not a text file in UTF-8") from None
    numbered = enumerate(text.splitlines(), 1)
    lines = {
        k: one for k, one in numbered if one.strip(", \t") and not one.lstrip().startswith("#")
    }
    if not lines:
        raise DataError(source, f"is empty: it needs a header, as '{_EXAMPLE}', and rows")
    try:
        head, *rows = (next(csv.reader([line], strict=True)) for line in lines.values())
    except csv.Error as fault:
        raise DataError(source, f"is not a csv file: {fault}") from None
    first, *numbers = lines
    if len(head) == 1 and re.search(r"[;\t]", head[0]):
        reason = "columns must be separated by commas, and decimals written with a point"
        raise DataError(source, reason, first)
    if all(_number(one) is not None for one in head):
        raise DataError(source, f"the first line must be a header, as '{_EXAMPLE}'", first)
    titles = [re.sub(r"\s*(\[[^\[\]]*\])$", r" \1", one.strip()) for one in head]  # t[s] is t [s]
    table = _Table(source, titles, np.full((len(titles), len(rows)), math.nan), numbers)
    for k, row in enumerate(rows):
        if len(row) != len(head):
            raise table.fault(f"has {len(row)} values, the header has {len(head)} columns", k)
        for i, cell in enumerate(map(str.strip, row)):
            found = _number(cell) if cell else math.nan
            if found is None:
                raise table.not_finite(cell, titles[i], k)
            table.values[i, k] = found
    return table


def _number(text: str) -> float | None:
    try:
        return number_of(text)
    except ValueError:
        return None
