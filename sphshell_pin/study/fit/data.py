"""Measured data: read from csv files or columns, checked, and brought into SI units."""

import csv
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Self

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
_UNIT = re.compile(r"\[([^\[\]]*)\]$")
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
    """Header, unit and values (n,) of columns by name; `lines` (n,) of the file, if it is one."""

    source: str
    columns: dict[str, tuple[str, str | None, Array]]
    lines: Sequence[int] | None

    @classmethod
    def of(
        cls, source: str, columns: Iterable[tuple[str, Array]], lines: list[int] | None = None
    ) -> Self:
        """Return the table of headers and columns; DataError where two have one name."""
        table = cls(source, {}, lines)
        for header, values in columns:
            found = _UNIT.search(header.strip())
            unit = None if found is None else found[1]
            name = (header.strip() if found is None else header.strip()[: found.start()]).strip()
            if name in table.columns:
                raise table.fault(f"two columns are called '{name}'")
            table.columns[name] = header, unit, values
        return table

    def values(self, name: str, unit: str) -> Array:
        """Return the values (n,) of a column in the SI `unit`.

        DataError for one that is infinite or too large, and for a unit of another kind.
        """
        header, given, values = self.columns[name]
        for row in np.flatnonzero(np.isinf(values)):
            reason = f"'{values[row]}' in column '{header}' is not a finite number"
            if name != TIME:
                reason += "; put nan where nothing was measured"
            raise self.fault(reason, int(row))
        for row in np.flatnonzero(np.abs(values) > _LARGEST):
            reason = f"{values[row]:g} in column '{header}' is too large to compute with"
            raise self.fault(reason, int(row))
        try:
            return values * factor_to_si(name, given, unit)
        except InvalidParameter as fault:
            raise self.fault(str(fault)) from None

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
    return Measured(name, t, tuple(columns), _gaps(name, t))


def _times(table: _Table, duration: float) -> Array:
    """Return the times [s], checked."""
    if TIME not in table.columns:
        named = ", ".join(table.columns) or "none"
        raise table.fault(f"has no column '{TIME} [s]'; its columns are: {named}")
    t = table.values(TIME, "s")
    if not len(t):
        raise table.fault("has no rows of data")
    steps, must = np.diff(t, prepend=-np.inf), "times must increase"
    for wrong, reason in (
        (np.isnan(t), "the time is missing"),
        (steps == 0.0, "time {:.9g} s is the same as that of the row above, {:.9g} s: " + must),
        (steps < 0.0, "time {:.9g} s is before that of the row above, {:.9g} s: " + must),
        (t < 0.0, "time {:.9g} s is before the start of the run, which is at 0"),
        (
            t > duration * (1 + _ROUNDED),
            f"time {{:.9g}} s is after the end of the run, {duration:.9g} s: cut the data, or set "
            "run.duration",
        ),
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
        deviations = table.values(name + SIGMA, quantity.unit)
        for row in rows[~(deviations[rows] > 0.0)]:
            reason = f"'{name}{SIGMA}' must be positive wherever '{name}' has a value"
            raise table.fault(reason, int(row))
        given = deviations[rows]
    if given is not None and not (given.min() >= 1 / _LARGEST and given.max() <= _LARGEST):
        raise table.fault(
            f"'{name}': standard deviations must be from {1 / _LARGEST:g} to {_LARGEST:g} "
            f"{quantity.unit}, to compute with them".rstrip()
        )
    return Column(quantity, rows, values[rows], given)


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
    return _Table.of(name, columns.items())


def _read_csv(path: Path) -> _Table:
    source = str(path)
    try:
        text = read_text(path)
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
    values: list[Array] = []
    for number, row in zip(numbers[1:], rows[1:], strict=True):
        if len(row) != len(head):
            reason = f"has {len(row)} values, the header has {len(head)} columns"
            raise DataError(source, reason, number)
        values.append(np.full(len(head), math.nan))
        for i, cell in enumerate(row):
            if not cell.strip():
                continue
            value = _number(cell)
            if value is None:
                reason = f"'{cell.strip()}' in column '{head[i]}' is not a finite number"
                if head[i].partition(" ")[0] != TIME:
                    reason += "; leave the cell empty where nothing was measured"
                raise DataError(source, reason, number)
            values[-1][i] = value
    columns = np.reshape(values, (-1, len(head))).T
    return _Table.of(source, zip(head, columns, strict=True), numbers[1:])


def _number(text: str) -> float | None:
    try:
        return number_of(text)
    except ValueError:
        return None
