"""Readings of sensors: the latest ones, as controllers get them, and all of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array, Ints
from sphshell_pin.base.checks import read_only
from sphshell_pin.base.summary import Fact, Summarized
from sphshell_pin.errors import NameNotFound, import_extra

if TYPE_CHECKING:
    import pandas as pd


class Readings(dict[str, Array | float | bool]):
    """The latest reading of each sensor by its name; NameNotFound lists the names."""

    def __missing__(self, name: str) -> Array:
        """Raise NameNotFound."""
        raise NameNotFound("sensor", name, "the simulation", list(self))


@dataclass(frozen=True, repr=False)
class SensorLog(Summarized):
    """The readings of one sensor in a run, m of them.

    `t` (m,) when each arrived, `sampled` (m,) when it was taken [s]; `values` (m, k); `columns`
    names the k values, with their units. Readings that were under way at the end are left out.
    """

    t: Array
    sampled: Array
    values: Array
    columns: tuple[str, ...]

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for array in (self.t, self.sampled, self.values):
            read_only(array)

    def __len__(self) -> int:
        """Return the number of readings."""
        return len(self.t)

    def _facts(self) -> list[Fact]:
        return [Fact("readings", len(self)), Fact("of", ", ".join(self.columns))]

    def at(self, t: float) -> Array:
        """Return the last reading (k,) that had arrived at time `t` [s]; nan before the first."""
        row = int(np.searchsorted(self.t, t, side="right")) - 1
        return self.values[row] if row >= 0 else np.full(len(self.columns), np.nan)

    def to_dataframe(self) -> pd.DataFrame:
        """Return a pandas DataFrame, one row a reading, units in the names.

        Raises MissingExtra without pandas.
        """
        pandas = import_extra("pandas", "tables", "SensorLog.to_dataframe")
        columns = {"t [s]": self.t, "sampled [s]": self.sampled}
        columns |= dict(zip(self.columns, self.values.T, strict=True))
        return pandas.DataFrame(columns)


def split_logs(
    columns: Mapping[str, tuple[str, ...]], which: Ints, t: Array, sampled: Array, values: Array
) -> dict[str, SensorLog]:
    """Return the log of each sensor; the arguments are `joined_logs`'."""
    if not columns:
        return {}
    widths = np.array([len(one) for one in columns.values()], dtype=int)
    begin = np.cumsum(widths[which]) - widths[which]
    logs = {}
    for k, (name, titles) in enumerate(columns.items()):
        rows = np.flatnonzero(which == k)
        at = begin[rows][:, None] + np.arange(len(titles))
        logs[name] = SensorLog(t[rows], sampled[rows], values[at], titles)
    return logs


def joined_logs(sensors: Mapping[str, SensorLog]) -> tuple[Ints, Array, Array, Array]:
    """Return all readings, one sensor after the other.

    They are: the number of the sensor, when each arrived and when it was taken (s,) [s], and the
    values of all, those of one reading side by side (w,).
    """
    logs = list(sensors.values())
    which = np.repeat(np.arange(len(logs), dtype=np.int32), [len(log) for log in logs])
    empty = [np.zeros(0)]
    return (
        which,
        np.concatenate([log.t for log in logs] or empty),
        np.concatenate([log.sampled for log in logs] or empty),
        np.concatenate([log.values.ravel() for log in logs] or empty),
    )


def sensor_columns(sensors: Mapping[str, SensorLog]) -> dict[str, Array]:
    """Return all readings as columns by the time of their arrival (for CSV).

    One row for each time at which any has arrived; nan where another sensor has none.
    """
    times = np.unique(np.concatenate([log.t for log in sensors.values()] or [np.zeros(0)]))
    columns = {"t [s]": times}
    for name, log in sensors.items():
        rows = np.searchsorted(times, log.t)
        for column, values in zip(log.columns, log.values.T, strict=True):
            whole = np.full(len(times), np.nan)
            whole[rows] = values
            columns[f"{name}.{column}"] = whole
    return columns
