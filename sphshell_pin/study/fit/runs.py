"""The runs of a fit: what the scenario says at values of the parameters, and its derivatives."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.sensing.sensors import Sensor
from sphshell_pin.errors import (
    DataError,
    Interrupted,
    SetupWarning,
    SphshellError,
    UnitWarning,
    WeakLawWarning,
)
from sphshell_pin.scenario.format.build import Built, rebuild
from sphshell_pin.study.fit.data import Measured
from sphshell_pin.study.fit.parameters import Free
from sphshell_pin.study.quantities import row_step

# Tolerance for integrators with a fixed step: differences see rounding and the kinks at touches.
_FIXED_STEP_TOLERANCE = 1e-9
_LEAST_TOLERANCE = 1e-12


@dataclass(frozen=True)
class Trial:
    """An experiment ready to run: its scenario as `built`, and its data."""

    built: Built
    data: Measured

    @cached_property
    def row_step(self) -> float:
        """Time between rows [s]."""
        return row_step(self.data.t)

    @property
    def size(self) -> int:
        """How many measured values there are."""
        return sum(len(column.values) for column in self.data.columns)


class Runs:
    """All experiments as one function of x: (N,) predicted values, experiment by experiment.

    `count` is how many runs were made, `progress` is called with it after each.
    """

    def __init__(
        self,
        trials: Sequence[Trial],
        free: Sequence[Free],
        progress: Callable[[int], object] | None = None,
    ) -> None:
        self.trials = tuple(trials)
        self.free = tuple(free)
        self.count = 0
        self.failure: SphshellError | None = None
        self._progress = progress
        self._known: dict[bytes, Array] = {}

    @property
    def tolerance(self) -> float:
        """Relative error of what is predicted: that of the integrators' steps."""
        found = [
            getattr(trial.built.simulation.integrator, "rtol", _FIXED_STEP_TOLERANCE)
            for trial in self.trials
        ]
        return float(max(*found, _LEAST_TOLERANCE))

    def predict(self, x: Array) -> Array | None:
        """Return the predicted values (N,) at x (p,); None where a run fails: see `failure`."""
        key = x.tobytes()
        if key not in self._known:
            try:
                found = np.concatenate([self._run(trial, x) for trial in self.trials])
            except Interrupted:
                raise
            except SphshellError as failure:
                self.failure = failure
                return None
            if len(self._known) > 8 + 4 * len(self.free):
                self._known.clear()
            self._known[key] = found
        return self._known[key]

    def result(self, trial: Trial, x: Array) -> sp.Result:
        """Return the result of one experiment at x."""
        texts = {
            key: one.text(value)
            for one, value in zip(self.free, x.tolist(), strict=True)
            for key in one.keys
        }
        with warnings.catch_warnings():
            for kind in (WeakLawWarning, SetupWarning, UnitWarning):  # said of the fitted values
                warnings.simplefilter("ignore", kind)
            built = rebuild(trial.built, texts, anew=True)
            run = built.scenario.run
            simulation = sp.Simulation(
                built.scene,
                built.simulation.integrator,
                [_quiet(sensor) for sensor in built.simulation.sensors],
            )
            self.count += 1
            result = simulation.run(
                built.q0,
                built.v0,
                float(trial.data.t[-1]),
                built.controller,
                run.control_dt,
                record_dt=trial.row_step or None,
            )
        if self._progress is not None:
            self._progress(self.count)
        return result

    def _run(self, trial: Trial, x: Array) -> Array:
        result, t = self.result(trial, x), trial.data.t
        parts = []
        for column in trial.data.columns:
            values = column.quantity.at(result, t[column.rows])
            for row in np.flatnonzero(np.isnan(values)):
                raise DataError(
                    trial.data.name,
                    f"no reading of '{column.name}' has arrived at {t[column.rows[row]]:.6g} s: "
                    "the sensor's first one comes later",
                )
            parts.append(values)
        return np.concatenate(parts)

    def derivatives(self, x: Array, low: Array, high: Array, step: float) -> Array:
        """Return the derivatives (N, p) of the predicted values by x: one-sided differences."""
        return np.column_stack(
            [self.slope(x, k, low, high, step, central=False) for k in range(len(x))]
        )

    def slope(
        self, x: Array, k: int, low: Array, high: Array, step: float, *, central: bool
    ) -> Array:
        """Return the derivatives (N,) of the predicted values by x[k], by differences of runs.

        x stays within `low` and `high` (p,). A side whose run fails is left out; where both fail
        the derivative is 0.
        """
        here = self.predict(x)
        assert here is not None
        sides = []
        for sign in (1.0, -1.0):
            other = x.copy()
            other[k] += sign * step
            values = self.predict(other) if low[k] <= other[k] <= high[k] else None
            if values is not None:
                sides.append((other[k], values))
                if not central:
                    break
        if len(sides) == 1:
            sides.append((x[k], here))
        if not sides:
            return np.zeros(len(here))
        (above, one), (below, another) = sides
        return np.asarray((one - another) / (above - below))


def forward_step(tolerance: float) -> float:
    """Return the step of a one-sided difference whose error is least: 2 sqrt(tolerance).

    The error is h/2 of the second derivative and 2 `tolerance` / h of rounding, both relative to
    values and derivatives of one size.
    """
    return float(2.0 * np.sqrt(tolerance))


def central_step(tolerance: float) -> float:
    """Return the step of a central difference whose error is least: cbrt(3 tolerance)."""
    return float(np.cbrt(3.0 * tolerance))


def _quiet(sensor: Sensor) -> Sensor:
    """Return a sensor without noise: the data have their own."""
    noise = [one.name for one in fields(sensor) if one.name.endswith("noise")]
    return replace(sensor, **dict.fromkeys(noise, 0.0)) if noise else sensor  # type: ignore[arg-type]
