"""The search for the values of parameters at which runs come nearest to the data."""

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy import optimize, stats

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array, Longs
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
from sphshell_pin.study.fit.report import Fit, Fitted, Series, is_noise, remarks_on
from sphshell_pin.study.quantities import row_step

Progress = Callable[[int, float], object]

# Tolerance for integrators with a fixed step: differences see rounding and the kinks at touches.
_FIXED_STEP_TOLERANCE, _LEAST_TOLERANCE = 1e-9, 1e-12
# Weights that are estimated change the values, which change the weights.
_MOST_ROUNDS, _SAME_SIGMA = 6, 0.02
# Derivatives: an error that no longer matters, and how often a step is halved to come to it.
_SMALL_ERROR, _MOST_HALVINGS = 0.01, 8
# Parts of the experiments' time that are fitted one after the other where all at once fail.
_STAGES = (0.125, 0.25, 0.5)
# A value feels the parameters if its derivative is so large a part of the largest.
_FELT = 1e-3
# How far the first step may go in x.
_FIRST_STEP = 0.5


@dataclass(frozen=True)
class Trial:
    """An experiment ready to run: its scenario as `built`, and its data."""

    built: Built
    data: Measured


class Search:
    """The least squares of all experiments: one function of x (p,) to weighted residuals (N,)."""

    def __init__(
        self, trials: Sequence[Trial], free: Sequence[Free], progress: Progress | None
    ) -> None:
        self.trials, self.free, self.count = trials, tuple(free), 0
        self.x, self.low, self.high = (
            np.array([one.to_x(getattr(one, end)) for one in free])
            for end in ("start", "low", "high")
        )
        self.converged = False
        self._progress = progress
        self._failure: SphshellError | None = None
        self._misfit = math.nan
        self._known: dict[bytes, Array | None] = {}
        columns = [(trial, column) for trial in trials for column in trial.data.columns]
        ends = np.cumsum([len(column.values) for _, column in columns]).tolist()
        self._parts = [slice(*pair) for pair in zip([0, *ends], ends, strict=False)]
        self._series = [
            Series(
                trial.data.name,
                column.name,
                column.quantity.unit,
                trial.data.t[column.rows],
                column.values,
                np.full(len(column.values), np.nan),
                np.ones(len(column.values)) if column.sigma is None else column.sigma,
                column.sigma is not None,
            )
            for trial, column in columns
        ]
        self.measured = np.concatenate([one.measured for one in self._series])
        integrators = [trial.built.simulation.integrator for trial in trials]
        found = [getattr(one, "rtol", _FIXED_STEP_TOLERANCE) for one in integrators]
        self.tolerance = float(max(*found, _LEAST_TOLERANCE))
        middles = [np.full_like(one.measured, one.measured.mean()) for one in self._series]
        self.sigma = self._pooled(np.concatenate(middles))

    def run(self) -> None:
        """Search; weights that are not given are estimated from the residuals, and it goes on."""
        if self._predict(self.x) is None:
            assert self._failure is not None
            self._failure.add_note("this is the run at the start values")
            raise self._failure
        start, sigma = self.x, self.sigma
        self._settle()
        shown = [one for one in self.series() if one.rms > 0.0]
        if all(is_noise(one, len(shown)) for one in shown):
            return
        # Where the run's touches miss the data's, the residuals may have another least place.
        best = self.x, self.sigma, self.converged
        scatter, self.x, self.sigma = self._scatter(), start, sigma
        for share in _STAGES:
            self._minimize(self._until(share))
        self._settle()
        if not self._scatter() < scatter:
            self.x, self.sigma, self.converged = best

    def report(self, scenario: str, level: float) -> Fit:
        """Return the fit at the values found."""
        jacobian, error = self._final_derivatives()
        # What cannot be felt stays where it was.
        felt = np.linalg.norm(jacobian, axis=0) > 2.0 * np.linalg.norm(error, axis=0)
        back = np.where(felt, self.x, [one.to_x(one.start) for one in self.free])
        before, after = self._residuals(self.x), self._residuals(back)
        if after @ after <= (1.0 + 1e-6) * (before @ before):
            self.x = back
        dof = len(self.measured) - len(self.free)
        factor = float(stats.t.ppf(0.5 + 0.5 * level, dof))
        covariance, blind = covariance_of(jacobian, error)
        # At a bound the residuals would be least beyond it. Where the interval about that place
        # does not reach back, the bound speaks against the data: the value is held there.
        at_bound = felt & ((self.x <= self.low) | (self.x >= self.high))
        beyond = at_bound * np.linalg.lstsq(jacobian, self._residuals(self.x), rcond=None)[0]
        held = at_bound & (np.abs(beyond) > factor * np.sqrt(np.diag(covariance)))
        free = np.flatnonzero(~held)
        if held.any():
            covariance[np.ix_(free, free)], blind = covariance_of(jacobian[:, free], error[:, free])
            covariance[held, held] = np.nan
        deviations = np.sqrt(np.diag(covariance))
        columns = self.free, self.x.tolist(), beyond.tolist(), (factor * deviations).tolist()
        fitted = tuple(_fitted(*one) for one in zip(*columns, strict=True))
        with np.errstate(invalid="ignore", divide="ignore"):
            correlation = covariance / np.outer(deviations, deviations)
        lost = ~np.isfinite(deviations)
        correlation[lost], correlation[:, lost] = np.nan, np.nan
        np.fill_diagonal(correlation, 1.0)
        series = self.series()
        together = [free[members].tolist() for members in blind]
        remarks = remarks_on(fitted, correlation, together, series, dof, self.tolerance)
        if not self.converged:
            remarks.insert(0, "the search ended before the residuals were least: start nearer")
        return Fit(
            scenario,
            fitted,
            correlation,
            series,
            tuple(remarks),
            dof,
            level,
            self.count,
            self.converged,
        )

    def series(self) -> tuple[Series, ...]:
        """Return all measured columns beside what the scenario says at x."""
        values = self._predict(self.x)
        assert values is not None
        return tuple(
            replace(one, fitted=values[part], sigma=self.sigma[part])
            for one, part in zip(self._series, self._parts, strict=True)
        )

    def _predict(self, x: Array) -> Array | None:
        """Return the predicted values (N,) at x, experiment by experiment; None where one fails."""
        key = x.tobytes()
        if key not in self._known:
            try:
                self._known[key] = np.concatenate([self._run(trial, x) for trial in self.trials])
            except Interrupted:
                raise
            except SphshellError as failure:
                self._failure = failure
                self._known[key] = None
        return self._known[key]

    def _run(self, trial: Trial, x: Array) -> Array:
        texts = {
            key: one.text(value)
            for one, value in zip(self.free, x.tolist(), strict=True)
            for key in one.keys
        }
        t = trial.data.t
        with warnings.catch_warnings():
            for kind in (WeakLawWarning, SetupWarning, UnitWarning):  # said of the fitted values
                warnings.simplefilter("ignore", kind)
            built = rebuild(trial.built, texts, anew=True)
            sensors = [_quiet(sensor) for sensor in built.simulation.sensors]
            result = sp.Simulation(built.scene, built.simulation.integrator, sensors).run(
                built.q0,
                built.v0,
                float(t[-1]),
                built.controller,
                built.scenario.run.control_dt,
                record_dt=row_step(t) or None,
            )
        self.count += 1
        if self._progress is not None:
            self._progress(self.count, self._misfit)
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

    def _residuals(self, x: Array) -> Array:
        values = self._predict(x)
        if values is None:
            # The search then takes a shorter step.
            return np.full(len(self.measured), np.nan)
        residuals = (self.measured - values) / self.sigma
        self._misfit = float(np.sqrt(np.mean(residuals**2)))
        return np.asarray(residuals)

    def _settle(self) -> None:
        """Go to the least residuals from where the search is, with weights that fit them."""
        for _ in range(_MOST_ROUNDS):
            self._minimize()
            before, self.sigma = self.sigma, self._pooled(self._predict(self.x))
            ratio = self.sigma / before
            # The weight of all data together changes nothing.
            if np.ptp(ratio) < _SAME_SIGMA:
                break

    def _minimize(self, use: Array | float = 1.0) -> None:
        """Make the residuals least, each times `use`."""
        start, step = self.x, 2.0 * math.sqrt(self.tolerance)
        # Differences smaller than the error of a run say nothing.
        least = max(1e-8, self.tolerance)
        # From 0, TRF's first step has the length of x_scale: half of the value.
        found = optimize.least_squares(
            lambda x: use * self._residuals(start + x),
            np.zeros(len(start)),
            jac=lambda x: -self._derivatives(start + x, step) * np.reshape(use, (-1, 1)),
            bounds=(self.low - start, self.high - start),
            x_scale=_FIRST_STEP,
            ftol=least,
            xtol=least,
            gtol=1e-12,
            max_nfev=100,
        )
        inside = start + np.asarray(found.x)
        # TRF stays inside: it says which bounds it was driven to.
        mask = np.asarray(found.active_mask)
        self.x = np.where(mask < 0, self.low, np.where(mask > 0, self.high, inside))
        if self._predict(self.x) is None:
            self.x = inside
        self.converged = bool(found.status > 0)

    def _derivatives(self, x: Array, step: float) -> Array:
        """Return the derivatives (N, p) of the weighted predicted values: one-sided differences."""
        return np.column_stack([self._slope(x, k, step, sides=1) for k in range(len(x))])

    def _slope(self, x: Array, k: int, step: float, sides: int = 2) -> Array:
        """Return the derivatives (N,) of the weighted predicted values by x[k].

        A side beyond a bound, or whose run fails, is left out; where both fail they are 0.
        """
        found: list[tuple[float, Array]] = []
        for signed in (step, -step):
            other = x.copy()
            other[k] += signed
            inside = len(found) < sides and self.low[k] <= other[k] <= self.high[k]
            if inside and (values := self._predict(other)) is not None:
                found.append((float(other[k]), values))
        here = self._predict(x)
        assert here is not None
        (above, one), (below, another) = (*found, (float(x[k]), here), (float(x[k]) - step, here))[
            :2
        ]
        return np.asarray((one - another) / (above - below) / self.sigma)

    def _final_derivatives(self) -> tuple[Array, Array]:
        """Return the weighted derivatives (N, p) at the solution, and their error.

        The error is by how much differences over one step and over twice the step differ, and a
        column's step is halved as long as that makes it less. It is no less than what the tolerance
        of a run does to a difference.
        """
        derivatives, errors = [], []
        values = self._predict(self.x)
        assert values is not None
        rounding = self.tolerance * np.abs(values) / self.sigma
        for k in range(len(self.x)):
            step = float(np.cbrt(3.0 * self.tolerance))
            near = self._slope(self.x, k, step)
            error = near - self._slope(self.x, k, 2.0 * step)
            for _ in range(_MOST_HALVINGS):
                nearer = self._slope(self.x, k, 0.5 * step)
                if not np.linalg.norm(nearer - near) < np.linalg.norm(error):
                    break
                near, error, step = nearer, nearer - near, 0.5 * step
                if np.linalg.norm(error) <= _SMALL_ERROR * np.linalg.norm(near):
                    break
            derivatives.append(near)
            errors.append(np.maximum(np.abs(error), rounding / step))
        return np.column_stack(derivatives), np.column_stack(errors)

    def _until(self, share: float) -> Array:
        """Return 1 for the first values that feel the parameters, a `share` of them, else 0 (N,).

        Values before these are taken, too: the parameters do nothing to them.
        """
        derivatives = self._derivatives(self.x, 2.0 * math.sqrt(self.tolerance))
        felt = np.linalg.norm(derivatives, axis=1)
        times = np.concatenate([one.t for one in self._series])
        last = np.quantile(times[felt > _FELT * felt.max(initial=1e-300)], share)
        return np.asarray(times <= last, dtype=float)

    def _scatter(self) -> float:
        """Return how likely the residuals are, whatever sigma weights them: less is better."""
        values = self._predict(self.x)
        sigma = self._pooled(values)
        weighted = (self.measured - values) / sigma
        return float(np.sum(np.log(sigma)) + 0.5 * weighted @ weighted)

    def _pooled(self, values: Array | None) -> Array:
        """Return the given sigma, else the rms of the residuals of all columns of one name."""
        assert values is not None
        count = len(self.measured)
        factor = count / (count - len(self.free))
        names = np.repeat([one.name for one in self._series], [len(one.t) for one in self._series])
        given = np.repeat([one.given for one in self._series], [len(one.t) for one in self._series])
        out = np.concatenate([one.sigma for one in self._series])
        for name in set(names[~given]):
            same = names == name
            # Data without noise are as exact as a run.
            least = self.tolerance * float(np.abs(self.measured[same]).max())
            rms = math.sqrt(factor * float(np.mean((self.measured - values)[same] ** 2)))
            out[same & ~given] = max(rms, least) or 1.0
        return np.asarray(out)


def covariance_of(jacobian: Array, error: Array) -> tuple[Array, list[Longs]]:
    """Return what the Jacobian (N, p) of weighted residuals determines; `error` is its own error.

    That is the covariance (p, p), infinite on the diagonal of what it does not determine, and the
    members of each direction along which it says nothing. A column that is not longer than twice
    its error says nothing. The others are brought to one length (van der Sluis, Numer. Math. 14
    (1969) 14). By Weyl's theorem a singular value below the norm of the error may be 0; by Wedin's
    its vector is known to an angle of the error over the gap to the other singular values, and a
    parameter that takes part in it by more is not determined.

    Source of both: Stewart and Sun, Matrix Perturbation Theory (1990), IV.4 and V.4.
    """
    count = jacobian.shape[1]
    lengths = np.linalg.norm(jacobian, axis=0)
    felt = np.flatnonzero(lengths > 2.0 * np.linalg.norm(error, axis=0))
    covariance = np.diag(np.full(count, math.inf))
    if not len(felt):
        return covariance, []
    scale = lengths[felt]
    rows = np.zeros((max(len(felt) - len(jacobian), 0), len(felt)))
    _, values, vectors = np.linalg.svd(
        np.vstack((jacobian[:, felt] / scale, rows)), full_matrices=False
    )
    floor = max(
        float(np.linalg.norm(error[:, felt] / scale, 2)),
        float(np.finfo(float).eps) * max(jacobian.shape) * float(values[0]),
    )
    seen = values > floor
    inner = (vectors[seen].T / values[seen] ** 2) @ vectors[seen] / np.outer(scale, scale)
    angle = floor / float(values[seen].min()) if seen.any() else 0.0
    members = [np.flatnonzero(np.abs(one) > angle) for one in vectors[~seen]]
    for some in members:
        inner[some, some] = math.inf
    covariance[np.ix_(felt, felt)] = inner
    return covariance, [felt[some] for some in members]


def _quiet(sensor: Sensor) -> Sensor:
    """Return a sensor without noise: the data have their own."""
    noise = [one.name for one in fields(sensor) if one.name.endswith("noise")]
    return replace(sensor, **dict.fromkeys(noise, 0.0)) if noise else sensor  # type: ignore[arg-type]


def _fitted(one: Free, x: float, beyond: float, half: float) -> Fitted:
    """Return a parameter with its interval, `half` to both sides of x + `beyond`; nan if held.

    It is not determined if that interval leaves its order of magnitude open: if it reaches from one
    bound to the other, or, for one that is not negative, to 0 by its slope at the value.
    """
    value = float(one.text(x))
    if math.isnan(half):
        return Fitted(one.name, one.unit, one.start, value, math.nan, math.nan, True, True)
    if math.isinf(half):
        return Fitted(one.name, one.unit, one.start, value, -math.inf, math.inf, False)
    low, high = one.to_value(x + beyond - half), one.to_value(x + beyond + half)
    # One that must be positive is searched by its logarithm: its relative deviation is that of x.
    from_zero = half < 1.0 if one.log else one.low != 0.0 or low > 0.0
    determined = from_zero and not (low <= one.low and high >= one.high)
    low, high = max(low, one.low), min(high, one.high)
    return Fitted(one.name, one.unit, one.start, value, low, high, determined)
