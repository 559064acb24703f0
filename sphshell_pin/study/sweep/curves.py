"""Curves of the runs of a sweep over one grid of times, from which bands are computed."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.errors import InvalidParameter, NameNotFound
from sphshell_pin.scenario import Built
from sphshell_pin.study.quantities import quantities_of
from sphshell_pin.study.sweep.job import Outcome
from sphshell_pin.study.sweep.table import Columns

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
    def times(self) -> Array:
        """The grid (steps + 1,) [s]."""
        return np.linspace(0.0, self.duration, self.steps + 1)

    def of(self, built: Built, result: Result) -> bytes:
        """Return the curves (k, m) of a run, as little-endian float64.

        They are interpolated linearly between the rows, and NaN after the last one. Forces [N] of
        a pair are sums over its contacts, the depth [m] is the largest. A sensor's value is that
        of its last reading, NaN before the first.
        """
        known = quantities_of(built, "sensors.")
        values = np.array([known[name].at(result, self.times) for name in self.names], "<f8")
        # The last row may miss the end of the grid by the rounding of its steps.
        values[:, self.times > float(result.t[-1]) * (1 + 1e-9)] = np.nan
        return values.tobytes()


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
    known = quantities_of(built, "sensors.")
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
