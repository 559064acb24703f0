"""Measured data: read from csv files or columns, checked, and brought into SI units."""

import csv
import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.regular_file import read_text
from sphshell_pin.base.texts import number_of
from sphshell_pin.errors import DataError, InvalidParameter, NameNotFound
from sphshell_pin.study.fit.units import factor_to_si
from sphshell_pin.study.quantities import Quantity

Source = str | PathLike[str] | Mapping[str, ArrayLike]

TIME, SIGMA = "t", ".sigma"
# A time may be so much beyond the end of a run, as a part of it, for having been rounded.
_ROUNDED = 1e-6
_HEADER = re.compile(r"\s*(.*?)\s*(?:\[([^\[\]]*)\])?\s*")
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
class Column:
    """A measured quantity: `values` (m,) in its SI `unit` at the `rows` (m,) of the times.

    `sigma` (m,) are the standard deviations that were given; None: to be estimated.
    """

    quantity: Quantity
    rows: NDArray[np.intp]
    values: Array
    sigma: Array | None

    @property
    def name(self) -> str:
        """Name of the quantity."""
        return self.quantity.name


@dataclass(frozen=True)
class Measured:
    """The data of one experiment: times `t` (n,) [s] and columns."""

    name: str
    t: Array
    columns: tuple[Column, ...]


class _Table:
    """Columns (n,) by their headers; `lines` (n,) of the file, if it is one."""

    def __init__(
        self, source: str, columns: Sequence[tuple[str, Array]], lines: Sequence[int] | None = None
    ) -> None:
        self.source, self.lines = source, lines
        self.columns: dict[str, tuple[str, str | None, Array]] = {}
        for header, values in columns:
            found = _HEADER.fullmatch(header)
            assert found is not None
            if found[1] in self.columns:
                raise self.fault(f"two columns are called '{found[1]}'")
            self.columns[found[1]] = header.strip(), found[2], values

    def values(self, name: str, unit: str) -> Array:
        """Return the values (n,) of a column in the SI `unit`.

        DataError for one that is infinite or too large, and for a unit of another kind.
        """
        header, given, values = self.columns[name]
        hint = "" if name == TIME else "; put nan where nothing was measured"
        for wrong, reason in (
            (np.isinf(values), f"'{{}}' in column '{header}' is not a finite number{hint}"),
            (
                np.abs(values) > _LARGEST,
                f"{{:g}} in column '{header}' is too large to compute with",
            ),
        ):
            for row in np.flatnonzero(wrong):
                raise self.fault(reason.format(values[row]), int(row))
        try:
            return values * factor_to_si(name, given, unit)
        except InvalidParameter as fault:
            raise self.fault(str(fault)) from None

    def fault(self, reason: str, row: int | None = None) -> DataError:
        if row is None or self.lines is not None:
            line = None if row is None or self.lines is None else self.lines[row]
            return DataError(self.source, reason, line)
        return DataError(self.source, f"row {row}: {reason}")


def read_experiment(
    experiment: Experiment,
    number: int,
    known: Mapping[str, Quantity],
    duration: float,
    *,
    only: Collection[str] | None = None,
    sigma: Mapping[str, float] | None = None,
) -> Measured:
    """Return the checked data of an experiment whose run lasts `duration` [s].

    `known` are the quantities that can be measured, `only` the columns to take (None: all),
    `sigma` standard deviations by column, in SI.

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
    t = _times(table, duration)
    measured = [label for label in table.columns if label != TIME]
    for label in only or ():
        if label not in table.columns:
            raise NameNotFound("column", label, table.source, measured)
    columns = []
    for label in measured:
        base = label.removesuffix(SIGMA)
        if base != label and label not in known:
            if base not in table.columns:
                raise table.fault(f"column '{label}' has no column '{base}' to belong to")
        elif only is None or label in only:
            if label not in known:
                unknown = NameNotFound("quantity", label, "a run of this scenario", known)
                raise table.fault(str(unknown))
            columns.append(_column(table, known[label], (sigma or {}).get(label)))
    if not columns:
        raise table.fault(f"has no column of data beside the time, as in '{_EXAMPLE}'")
    return Measured(name, t, tuple(columns))


def _times(table: _Table, duration: float) -> Array:
    """Return the times [s], checked."""
    if TIME not in table.columns:
        named = ", ".join(table.columns) or "none"
        raise table.fault(f"has no column '{TIME} [s]'; its columns are: {named}")
    t = table.values(TIME, "s")
    if not len(t):
        raise table.fault("has no rows of data")
    steps, must = (
        np.diff(t, prepend=-np.inf),
        "that of the row above, {:.9g} s: times must increase",
    )
    end = f"the end of the run, {duration:.9g} s: cut the data, or set run.duration"
    for wrong, reason in (
        (np.isnan(t), "the time is missing"),
        (steps == 0.0, f"time {{:.9g}} s is the same as {must}"),
        (steps < 0.0, f"time {{:.9g}} s is before {must}"),
        (t < 0.0, "time {:.9g} s is before the start of the run, which is at 0"),
        (t > duration * (1 + _ROUNDED), f"time {{:.9g}} s is after {end}"),
    ):
        for row in np.flatnonzero(wrong):
            raise table.fault(reason.format(t[row], t[row - 1]), int(row))
    return np.minimum(t, duration)


def _column(table: _Table, quantity: Quantity, sigma: float | None) -> Column:
    name = quantity.name
    values = table.values(name, quantity.unit)
    rows = np.flatnonzero(~np.isnan(values))
    if not len(rows):
        raise table.fault(f"column '{name}' has no value")
    given = None if sigma is None else np.full(len(rows), sigma)
    if name + SIGMA in table.columns:
        given = table.values(name + SIGMA, quantity.unit)[rows]
        for row in rows[~(given > 0.0)]:
            reason = f"'{name}{SIGMA}' must be positive wherever '{name}' has a value"
            raise table.fault(reason, int(row))
    if given is not None and not (given.min() >= 1 / _LARGEST and given.max() <= _LARGEST):
        raise table.fault(
            f"'{name}': standard deviations must be from {1 / _LARGEST:g} to {_LARGEST:g} "
            f"{quantity.unit}, to compute with them".rstrip()
        )
    return Column(quantity, rows, values[rows], given)


def _take_columns(given: Mapping[str, ArrayLike], name: str) -> _Table:
    try:
        # What is masked was not measured.
        columns = {
            str(key): np.ma.filled(np.ma.array(value, dtype=np.float64), math.nan)
            for key, value in dict(given).items()
        }
    except (TypeError, ValueError) as fault:
        raise DataError(
            name, f"must be a csv file, or a mapping from headers to columns of numbers ({fault})"
        ) from None
    shapes = {one.shape for one in columns.values()}
    if len(shapes) > 1 or any(len(shape) != 1 for shape in shapes):
        shown = ", ".join(f"'{key}' {one.shape}" for key, one in columns.items())
        raise DataError(name, f"columns must be of one length, of shape (n,): {shown}")
    return _Table(name, list(columns.items()))


def _read_csv(path: Path) -> _Table:
    source = str(path)
    try:
        text = read_text(path)
    except OSError as fault:
        raise DataError(source, f"cannot be read: {fault.strerror}") from None
    except UnicodeDecodeError:
        raise DataError(source, "is not a text file in UTF-8") from None
    lines = {
        number: line
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip(", \t") and not line.lstrip().startswith("#")
    }
    if not lines:
        raise DataError(source, f"is empty: it needs a header, as '{_EXAMPLE}', and rows")
    try:
        rows = [next(csv.reader([line], strict=True)) for line in lines.values()]
    except csv.Error as fault:
        raise DataError(source, f"is not a csv file: {fault}") from None
    first, *numbers = lines
    head = [one.strip() for one in rows[0]]
    if len(head) == 1 and re.search(r"[;\t]", head[0]):
        reason = "columns must be separated by commas, and decimals written with a point"
        raise DataError(source, reason, first)
    if all(_number(one) is not None for one in head):
        raise DataError(source, f"the first line must be a header, as '{_EXAMPLE}'", first)
    values = []
    for number, row in zip(numbers, rows[1:], strict=True):
        if len(row) != len(head):
            reason = f"has {len(row)} values, the header has {len(head)} columns"
            raise DataError(source, reason, number)
        values.append([_number(cell) if cell.strip() else math.nan for cell in row])
        for cell, title, value in zip(row, head, values[-1], strict=True):
            if value is None:
                reason = f"'{cell.strip()}' in column '{title}' is not a finite number"
                if title.partition(" ")[0] != TIME:
                    reason += "; leave the cell empty where nothing was measured"
                raise DataError(source, reason, number)
    columns = np.array(values, dtype=float).reshape(-1, len(head)).T
    return _Table(source, list(zip(head, columns, strict=True)), numbers)


def _number(text: str) -> float | None:
    try:
        return number_of(text)
    except ValueError:
        return None
