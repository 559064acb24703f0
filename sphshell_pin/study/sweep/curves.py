"""Curves of the runs of a sweep over one grid of times, from which bands are computed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.dynamics.result.pair_series import PairSeries
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.errors import InvalidParameter, NameNotFound
from sphshell_pin.scenario import Built
from sphshell_pin.scenario.format.bodies import joint_spans
from sphshell_pin.study.sweep.job import Outcome
from sphshell_pin.study.sweep.table import Columns

FloatArray = NDArray[np.float64]

PAIR_CURVES = {"normal_force": "normal", "friction_force": "friction", "depth": "depth"}
STEPS = 200
MOST_STEPS = 100_000
MOST_VALUES = 200_000_000
"""Numbers of all curves of a sweep: 8 bytes each in the journal and in memory."""


@dataclass(frozen=True)
class Curves:
    """Which curves a run records, and at which times."""

    names: tuple[str, ...]
    duration: float
    steps: int
    """Steps of equal length from 0 to `duration` [s]."""

    @property
    def times(self) -> FloatArray:
        """The grid (steps + 1,) [s]."""
        return np.linspace(0.0, self.duration, self.steps + 1)

    def of(self, built: Built, result: Result) -> bytes:
        """Return the curves (k, m) of a run, as little-endian float64.

        They are interpolated linearly between the rows, and NaN after the last one. Forces [N] of
        a pair are sums over its contacts, the depth [m] is the largest. A sensor's value is that
        of its last reading, NaN before the first.
        """
        values = [_measure(built, result, name, self.times) for name in self.names]
        return np.array(values, dtype="<f8").tobytes()


def curves_of(built: Built, names: Sequence[str], steps: int | None, runs: int) -> Curves | None:
    """Return what `runs` runs record; None where `names` is empty.

    `steps` are 200 by default, or fewer where the rows of a run are farther apart.

    Raises
    ------
    NameNotFound
        The scenario has no such curve.
    InvalidParameter
        `steps` is no whole number, or closer than rows; a curve is given twice, or they have too
        many values.
    """
    if isinstance(names, str):
        names = [names]
    if not names:
        return None
    known = curve_names(built)
    for name in names:
        if name not in known:
            raise NameNotFound("curve", name, "a run of this scenario", known)
        if list(names).count(name) > 1:
            raise InvalidParameter("bands", name, "is given twice: leave one of the two out")
    duration, apart = built.scenario.run.duration, built.scenario.run.record_dt or 0.0
    most = max(1, math.floor(duration / apart * (1 + 1e-9))) if apart else MOST_STEPS
    if steps is None:
        steps = min(STEPS, most)
    if isinstance(steps, bool) or not isinstance(steps, int) or not 1 <= steps <= MOST_STEPS:
        raise InvalidParameter("band_steps", steps, f"must be a whole number, 1 to {MOST_STEPS}")
    if steps > most:
        raise InvalidParameter(
            "band_steps",
            steps,
            f"must be {most} or less, as rows are run.record_dt = {apart:g} s apart: make that "
            "smaller, or the steps fewer",
        )
    total = runs * len(names) * (steps + 1)
    if total > MOST_VALUES:
        raise InvalidParameter(
            "bands",
            total,
            f"values ({runs} runs, {len(names)} curves, {steps + 1} times) are too many: "
            f"{MOST_VALUES} at most; take fewer band_steps",
        )
    return Curves(tuple(names), duration, steps)


def curve_names(built: Built) -> list[str]:
    """Return the curves that a run of this scenario can record."""
    names = [f"pairs.{pair.name}.{one}" for pair in built.scene.pairs for one in PAIR_CURVES]
    names += [
        f"sensors.{sensor.name}.{_label(column)}"
        for sensor in built.simulation.sensors
        for column in sensor.columns(built.scene)
    ]
    return names + list(_coordinates(built))


def columns_of_curves(curves: Curves, outcomes: Mapping[int, Outcome]) -> Columns:
    """Return the curves of all runs that have them: `run`, `t` [s], one column for each curve.

    Each run has a row for each time, in their order.
    """
    runs = sorted(number for number, one in outcomes.items() if one.curves)
    shape = (len(curves.names), curves.steps + 1)
    values = [np.frombuffer(outcomes[i].curves, dtype="<f8").reshape(shape) for i in runs]
    columns: Columns = {
        "run": np.repeat(np.array(runs, dtype=np.int64), shape[1]),
        "t": np.tile(curves.times, len(runs)),
    }
    for k, name in enumerate(curves.names):
        columns[name] = np.array([one[k] for one in values], dtype=np.float64).ravel()
    return columns


def _measure(built: Built, result: Result, name: str, times: FloatArray) -> FloatArray:
    kind, _, rest = name.partition(".")
    if kind == "sensors":
        return _of_sensor(result, rest, times)
    if kind == "pairs":
        pair, _, one = rest.rpartition(".")
        series = PairSeries.of(result, list(result.pairs).index(pair))
        values = getattr(series, PAIR_CURVES[one])
    else:
        letter, index = _coordinates(built)[name]
        values = (result.q if letter == "q" else result.v)[:, index]
    t = np.asarray(result.t, dtype=float)
    # The last row may miss the end of the grid by the rounding of its steps.
    ends = np.isclose(times, t[-1], rtol=1e-9, atol=0.0)
    at = np.where(ends, t[-1], times)
    return np.asarray(np.interp(at, t, values, left=np.nan, right=np.nan))


def _coordinates(built: Built) -> dict[str, tuple[str, int]]:
    """Return the coordinates of all joints, by the names that their last values have as figures."""
    model = built.scene.model
    found = {}
    for joint in list(model.names)[1:]:
        for letter, span in zip("qv", joint_spans(model, joint), strict=True):
            count = span.stop - span.start
            for i in range(count):
                name = f"{letter}.{joint}" + (f".{i}" if count > 1 else "")
                found[name] = letter, span.start + i
    return found


def _of_sensor(result: Result, rest: str, times: FloatArray) -> FloatArray:
    name, _, label = rest.rpartition(".")
    log = result.sensors[name]
    values = np.asarray(log.values[:, [_label(one) for one in log.columns].index(label)], float)
    last = np.searchsorted(np.asarray(log.t), times, side="right") - 1
    found = np.full(len(times), np.nan)
    found[last >= 0] = values[last[last >= 0]]
    found[times > float(result.t[-1]) * (1 + 1e-9)] = np.nan
    return found


def _label(column: str) -> str:
    """Return the name of a sensor's column without its unit."""
    return column.partition(" ")[0]
