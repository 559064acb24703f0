"""Measured data: read from csv files or columns, checked, and brought into SI units."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sphshell_pin.errors import DataError, InvalidParameter, NameNotFound
from sphshell_pin.study.fit.quantities import Quantity
from sphshell_pin.study.fit.units import factor_to_si

Array = NDArray[np.float64]
Source = str | PathLike[str] | Mapping[str, ArrayLike]

TIME, SIGMA = "t", ".sigma"
# A time may be so much beyond the end of a run, as a part of it, for having been rounded.
_ROUNDED = 1e-6
_HEADER = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]\s*)?", re.DOTALL)
_EXAMPLE = "t [s],pairs.tip.normal_force [N]"


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


_LARGEST = 1e70  # of data and 1 / sigma: the squares of their quotients do not overflow


@dataclass(frozen=True)
class Measured:
    """The data of one experiment: times `t` (n,) [s] and columns; `notes` say what is odd."""

    name: str
    t: Array
    columns: tuple[Column, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Table:
    """Columns by header; `lines` (n,) of the file, None where there is none."""

    source: str
    columns: dict[str, Array]
    lines: Sequence[int] | None

    def values(self, header: str) -> Array:
        """Return the values (n,) of a column; DataError for one that is infinite."""
        values = self.columns[header]
        for row in np.flatnonzero(np.isinf(values)):
            reason = f"'{values[row]}' in column '{header}' is not a finite number"
            if header.partition(" ")[0] != TIME:
                reason += "; put nan where nothing was measured"
            raise self.fault(reason, int(row))
        for row in np.flatnonzero(np.abs(values) > _LARGEST):
            reason = f"{values[row]:g} in column '{header}' is too large to compute with"
            raise self.fault(reason, int(row))
        return values

    def fault(self, reason: str, row: int | None = None) -> DataError:
        if row is None:
            return DataError(self.source, reason)
        if self.lines is None:
            return DataError(self.source, f"row {row}: {reason}")
        return DataError(self.source, reason, self.lines[row])


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
        table = _read_csv(Path(given))
        name = experiment.name or Path(given).stem
    else:
        name = experiment.name or f"experiment {number}"
        table = _take_columns(given, name)
    units: dict[str, tuple[str, str | None]] = {}
    for header in table.columns:
        found = _HEADER.fullmatch(header)
        assert found is not None
        label = found[1].strip()
        if label in units:
            raise table.fault(f"two columns are called '{label}'")
        units[label] = header, found[2]
    t = _times(table, units, duration)
    for label in only or ():
        if label not in units:
            has = [one for one in units if one != TIME]
            raise NameNotFound("column", label, table.source, has)
    columns = []
    for label in units:
        if label == TIME or (label.endswith(SIGMA) and label not in known):
            base = label.removesuffix(SIGMA)
            if label != TIME and base not in units:
                raise table.fault(f"column '{label}' has no column '{base}' to belong to")
            continue
        if only is not None and label not in only:
            continue
        if label not in known:
            unknown = NameNotFound("quantity", label, "a run of this scenario", known)
            raise table.fault(str(unknown))
        columns.append(_column(table, units, known[label], (sigma or {}).get(label)))
    if not columns:
        raise table.fault(f"has no column of data beside the time, as in '{_EXAMPLE}'")
    return Measured(name, t, tuple(columns), _gaps(name, t))


def _times(table: _Table, units: Mapping[str, tuple[str, str | None]], duration: float) -> Array:
    """Return the times [s], checked."""
    if TIME not in units:
        raise table.fault(
            f"has no column '{TIME} [s]'; its columns are: {', '.join(units) or 'none'}"
        )
    header, unit = units[TIME]
    t = table.values(header) * _factor(table, TIME, unit, "s")
    if not len(t):
        raise table.fault("has no rows of data")
    for row in np.flatnonzero(np.isnan(t)):
        raise table.fault("the time is missing", int(row))
    for row in np.flatnonzero(np.diff(t) <= 0.0) + 1:
        how = "is the same as" if t[row] == t[row - 1] else "is before"
        raise table.fault(
            f"time {t[row]:.9g} s {how} that of the row above, {t[row - 1]:.9g} s: times must "
            "increase",
            int(row),
        )
    for row in np.flatnonzero(t < 0.0):
        raise table.fault(
            f"time {t[row]:.9g} s is before the start of the run, which is at 0", int(row)
        )
    for row in np.flatnonzero(t > duration * (1 + _ROUNDED)):
        raise table.fault(
            f"time {t[row]:.9g} s is after the end of the run, {duration:.9g} s: cut the data, or "
            "set run.duration",
            int(row),
        )
    return np.minimum(t, duration)


def _column(
    table: _Table,
    units: Mapping[str, tuple[str, str | None]],
    quantity: Quantity,
    sigma: float | None,
) -> Column:
    name = quantity.name
    header, unit = units[name]
    values = table.values(header) * _factor(table, name, unit, quantity.unit)
    rows = np.flatnonzero(~np.isnan(values))
    if not len(rows):
        raise table.fault(f"column '{name}' has no value")
    given = None if sigma is None else np.full(len(rows), sigma)
    if name + SIGMA in units:
        header, unit = units[name + SIGMA]
        deviations = table.values(header) * _factor(table, name + SIGMA, unit, quantity.unit)
        for row in rows[~(deviations[rows] > 0.0)]:
            raise table.fault(
                f"'{name}{SIGMA}' must be positive wherever '{name}' has a value", int(row)
            )
        given = deviations[rows]
    if given is not None and not (given.min() >= 1 / _LARGEST and given.max() <= _LARGEST):
        raise table.fault(
            f"'{name}': standard deviations must be from {1 / _LARGEST:g} to {_LARGEST:g} "
            f"{quantity.unit}, to compute with them".rstrip()
        )
    return Column(quantity, rows, values[rows], given)


def _factor(table: _Table, name: str, given: str | None, unit: str) -> float:
    try:
        return factor_to_si(name, given, unit)
    except InvalidParameter as fault:
        raise table.fault(str(fault)) from None


def _gaps(name: str, t: Array) -> tuple[str, ...]:
    """Say of times that seem to be missing: a step that is a multiple of an otherwise even one."""
    steps = np.diff(t)
    if len(steps) < 3:
        return ()
    usual = float(np.median(steps))
    wide = np.flatnonzero(steps > 1.5 * usual)
    even = np.abs(steps - usual).max(where=steps <= 1.5 * usual, initial=0.0) < 0.25 * usual
    if not even or not len(wide):
        return ()
    k = int(wide[np.argmax(steps[wide])])
    missing = int(sum(np.rint(steps[wide] / usual) - 1))
    return (
        f"{name}: the time stamps have {len(wide)} gap{'s' * (len(wide) > 1)}, in which about "
        f"{missing} row{'s' * (missing > 1)} of {usual:.4g} s are missing; the longest is from "
        f"{t[k]:.6g} s to {t[k + 1]:.6g} s",
    )


def _take_columns(given: Mapping[str, ArrayLike], name: str) -> _Table:
    try:
        pairs = dict(given)
        # What is masked was not measured.
        columns = {
            str(key): np.ma.filled(np.ma.array(value, dtype=np.float64), math.nan)
            for key, value in pairs.items()
        }
    except (TypeError, ValueError) as fault:
        raise DataError(
            name, f"must be a csv file, or a mapping from headers to columns of numbers ({fault})"
        ) from None
    lengths = {key: one.shape for key, one in columns.items()}
    if len(set(lengths.values())) > 1 or any(len(shape) != 1 for shape in lengths.values()):
        shown = ", ".join(f"'{key}' {shape}" for key, shape in lengths.items())
        raise DataError(name, f"columns must be of one length, of shape (n,): {shown}")
    return _Table(name, columns, None)


def _read_csv(path: Path) -> _Table:
    source = str(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as fault:
        raise DataError(source, f"cannot be read: {fault.strerror}") from None
    except UnicodeDecodeError:
        raise DataError(source, "is not a text file in UTF-8") from None
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip(", \t") and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise DataError(source, f"is empty: it needs a header, as '{_EXAMPLE}', and rows")
    try:
        rows = [next(csv.reader([line], strict=True)) for _, line in lines]
    except csv.Error as fault:
        raise DataError(source, f"is not a csv file: {fault}") from None
    numbers = [number for number, _ in lines]
    head = [one.strip() for one in rows[0]]
    if len(head) == 1 and re.search(r"[;\t]", head[0]):
        reason = "columns must be separated by commas, and decimals written with a point"
        raise DataError(source, reason, numbers[0])
    if all(_number(one) is not None for one in head):
        reason = f"the first line must be a header, as '{_EXAMPLE}'"
        raise DataError(source, reason, numbers[0])
    for name in head:
        if head.count(name) > 1:
            raise DataError(source, f"two columns are called '{name}'", numbers[0])
    values = np.full((len(rows) - 1, len(head)), math.nan)
    for k, (number, row) in enumerate(zip(numbers[1:], rows[1:], strict=True)):
        if len(row) != len(head):
            reason = f"has {len(row)} values, the header has {len(head)} columns"
            raise DataError(source, reason, number)
        for i, cell in enumerate(row):
            if not cell.strip():
                continue
            value = _number(cell)
            if value is None or not math.isfinite(value):
                reason = f"'{cell.strip()}' in column '{head[i]}' is not a finite number"
                if head[i].partition(" ")[0] != TIME:
                    reason += "; leave the cell empty where nothing was measured"
                raise DataError(source, reason, number)
            values[k, i] = value
    return _Table(source, dict(zip(head, values.T, strict=True)), numbers[1:])


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
