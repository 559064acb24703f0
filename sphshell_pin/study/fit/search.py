"""The search for the values of parameters at which runs come nearest to the data."""

import math
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy import optimize, stats

import sphshell_pin as sp
from sphshell_pin import errors
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.sensing.sensors import Sensor
from sphshell_pin.scenario.format.build import Built, rebuild
from sphshell_pin.scenario.format.reading import change_scenario, look_up
from sphshell_pin.scenario.format.sliders import meaning
from sphshell_pin.study.fit.data import Series
from sphshell_pin.study.fit.parameters import TIE, Free
from sphshell_pin.study.fit.report import Fit, Fitted, patterned, remarks_on
from sphshell_pin.study.quantities import quantities_of, row_step

Progress = Callable[[int, float], object]

# Tolerance for integrators with a fixed step: differences see rounding and the kinks at touches.
_FIXED_STEP_TOLERANCE, _LEAST_TOLERANCE = 1e-9, 1e-12
# Weights that are estimated change the values, which change the weights.
_MOST_ROUNDS, _SAME_SIGMA = 6, 0.02
# How far the first step may go in x.
_FIRST_STEP = 0.5
# Parts of the data that are fitted one after the other, and how far each may move x.
_SHARES, _REACH = (1 / 16, 1 / 8, 1 / 4, 1 / 2), 1.0


@dataclass(frozen=True)
class Trial:
    """An experiment ready to run: its scenario as `built`, and its data."""

    built: Built
    data: Sequence[Series] = ()

    def measure(
        self,
        t: Array,
        changes: Mapping[str, str] | None = None,
        wanted: Collection[str] | None = None,
    ) -> dict[str, tuple[str, Array]]:
        """Return unit and values (n,) at the times `t` (n,) of what `quantities_of` finds."""
        with warnings.catch_warnings():
            # Said of the fitted values.
            for kind in (errors.WeakLawWarning, errors.SetupWarning, errors.UnitWarning):
                warnings.simplefilter("ignore", kind)
            built = rebuild(self.built, changes or {}, anew=True)
            sensors = [_quiet(sensor) for sensor in built.simulation.sensors]
            run, step = built.scenario.run, row_step(t) or None
            result = sp.Simulation(built.scene, built.simulation.integrator, sensors).run(
                built.q0, built.v0, float(t[-1]), built.controller, run.control_dt, record_dt=step
            )
        return quantities_of(result, built.scene, t, wanted)

    def until(self, share: float) -> "Trial":
        """Return the experiment with the first `share` of its times."""
        t = np.unique(np.concatenate([one.t for one in self.data]))
        end = t[: int(share * len(t))].max(initial=-1.0)
        return replace(self, data=[one.until(end) for one in self.data if one.t[0] <= end])

    def predict(self, changes: Mapping[str, str]) -> Array:
        """Return what a run with `changes` says of all data (N,)."""
        t = np.unique(np.concatenate([one.t for one in self.data]))
        found, parts = self.measure(t, changes, {one.name for one in self.data}), []
        for one in self.data:
            parts.append(found[one.name][1][np.searchsorted(t, one.t)])
            for row in np.flatnonzero(np.isnan(parts[-1])):
                raise errors.DataError(
                    one.experiment,
                    f"no reading of '{one.name}' has arrived at {one.t[row]:.6g} s: the sensor's "
                    "first one comes later",
                )
        return np.concatenate(parts)


class Search:
    """The least squares of all experiments: one function of x (p,) to weighted residuals (N,)."""

    def __init__(
        self, trials: Sequence[Trial], free: Sequence[Free], progress: Progress | None
    ) -> None:
        self.trials, self.free, self.count = trials, tuple(free), 0
        self.start, self.low, self.high = (
            np.array([one.to_x(getattr(one, end)) for one in free])
            for end in ("start", "low", "high")
        )
        self.x, self.converged = self.start, False
        self._progress, self._misfit, self._known = progress, math.nan, dict[bytes, Array]()
        self._series = [one for trial in trials for one in trial.data]
        self.measured = np.concatenate([one.measured for one in self._series])
        ends = np.cumsum([len(one.t) for one in self._series])
        self._parts = np.split(np.arange(len(self.measured)), ends[:-1])
        found = [getattr(one.built.simulation.integrator, "rtol", 0.0) for one in trials]
        self.tolerance = max([one or _FIXED_STEP_TOLERANCE for one in found] + [_LEAST_TOLERANCE])
        self.sigma = self._pooled(np.concatenate([one.fitted for one in self._series]))

    def run(self) -> None:
        """Search; weights that are not given are estimated from the residuals, and it goes on."""
        try:
            self._known[self.x.tobytes()] = self._run(self.x)
        except errors.SphshellError as fault:
            fault.add_note("this is the run at the start values")
            raise
        self._settle()
        if patterned(self._compared()):
            # It may be where one pulse of the run lies on another one of the data. Both ends are
            # judged by their likelihood: weights of its own make every end look good.
            ends = [self._end()]
            self.x = self._grown()
            if np.isfinite(self._values(self.x)).all():
                self._settle()
                ends.append(self._end())
            _, self.x, self.sigma, self.converged = min(ends, key=lambda end: end[0])

    def _settle(self) -> None:
        """Search from where it is, until weights that are estimated from residuals stay."""
        for _ in range(_MOST_ROUNDS):
            self._minimize()
            before, self.sigma = self.sigma, self._pooled(self._values(self.x))
            # The weight of all data together changes nothing.
            if np.ptp(self.sigma / before) < _SAME_SIGMA:
                break

    def _grown(self) -> Array:
        """Return x (p,) after fits to growing parts of the data: no pulse is ever far from its own.

        The first part begins from the start, each other one from where the one before ended.
        """
        x = self.start
        for share in _SHARES:
            trials = [one for one in (trial.until(share) for trial in self.trials) if one.data]
            if sum(len(one.t) for trial in trials for one in trial.data) > len(x):
                part = Search(trials, self.free, self._count_run)
                part.x, part.low = x, np.maximum(self.low, x - _REACH)
                part.high = np.minimum(self.high, x + _REACH)
                if np.isfinite(part._values(x)).all():
                    part._settle()
                    x = part.x
        return x

    def _end(self) -> tuple[float, Array, Array, bool]:
        """Return the negative log-likelihood at x, less a constant, x, sigma, and `converged`."""
        unlikely = np.sum(np.log(self.sigma) + 0.5 * self._residuals(self.x) ** 2)
        return float(unlikely), self.x, self.sigma, self.converged

    def _compared(self) -> tuple[Series, ...]:
        """Return the data with what the run at x says of them."""
        values = self._values(self.x)
        return tuple(
            replace(one, fitted=values[part], sigma=self.sigma[part])
            for one, part in zip(self._series, self._parts, strict=True)
        )

    def report(self, scenario: str, level: float) -> Fit:
        """Return the fit at the values found."""
        # Central differences over one step and over twice the step: what they differ by, and what
        # the tolerance of a run does to them, is their error.
        step = float(np.cbrt(3.0 * self.tolerance))
        jacobian = self._derivatives(self.x, step, sides=2)
        rounding = self.tolerance * np.abs(self._values(self.x)) / self.sigma / step
        further = self._derivatives(self.x, 2.0 * step, sides=2)
        error = np.maximum(np.abs(jacobian - further), rounding[:, None])
        # What cannot be felt stays where it was.
        felt = np.linalg.norm(jacobian, axis=0) > 2.0 * np.linalg.norm(error, axis=0)
        back = np.where(felt, self.x, self.start)
        if np.sum(self._residuals(back) ** 2) <= (1 + 1e-6) * np.sum(self._residuals(self.x) ** 2):
            self.x = back
        dof = len(self.measured) - len(self.free)
        factor = float(stats.t.ppf(0.5 + 0.5 * level, dof))
        covariance, blind = covariance_of(jacobian, error)
        # At a bound the residuals would be least beyond it. Where the interval about that place
        # does not reach back, the bound speaks against the data: the value is held there.
        at_bound = felt & ((self.x <= self.low) | (self.x >= self.high))
        beyond = at_bound * np.linalg.lstsq(jacobian, self._residuals(self.x), rcond=None)[0]
        held = at_bound & (np.abs(beyond) > factor * np.sqrt(np.diag(covariance)))
        if held.any():
            covariance, blind = covariance_of(np.where(held, 0.0, jacobian), error)
        deviations = np.where(held, np.nan, np.sqrt(np.diag(covariance)))
        with np.errstate(invalid="ignore"):
            correlation = covariance / np.outer(deviations, deviations)
        correlation[~np.isfinite(deviations)] = correlation[:, ~np.isfinite(deviations)] = np.nan
        np.fill_diagonal(correlation, 1.0)
        # The unit of a stiffness follows from the exponent that was found.
        built = self.trials[0].built
        changed = change_scenario(built.scenario, self._changes(self.x), built.path)
        found = [look_up(changed, one.keys[0], built.path) for one in self.free]
        units = [meaning(changed, one).unit for one in found]
        columns = self.free, units, self.x.tolist(), beyond.tolist(), (factor * deviations).tolist()
        fitted = tuple(_fitted(*one) for one in zip(*columns, strict=True))
        series = self._compared()
        remarks = remarks_on(fitted, correlation, blind, series, dof)
        if not self.converged:
            remarks.insert(0, "the search ended before the residuals were least: start nearer")
        outcome = tuple(remarks), dof, level, self.count, self.converged
        return Fit(scenario, fitted, correlation, series, *outcome)

    def _values(self, x: Array) -> Array:
        """Return the predicted values (N,) at x, trial by trial; nan where a run fails."""
        key = x.tobytes()
        if key not in self._known:
            try:
                self._known[key] = self._run(x)
            except errors.Interrupted:
                raise
            except errors.SphshellError:
                self._known[key] = np.full(len(self.measured), np.nan)
        return self._known[key]

    def _changes(self, x: Array) -> dict[str, str]:
        pairs = zip(self.free, x.tolist(), strict=True)
        return {key: one.text(value) for one, value in pairs for key in one.keys}

    def _run(self, x: Array) -> Array:
        changes, parts = self._changes(x), []
        for trial in self.trials:
            parts.append(trial.predict(changes))
            self._count_run(0, self._misfit)
        return np.concatenate(parts)

    def _count_run(self, _: int, misfit: float) -> None:
        """Count a run, of this search or of a part of it."""
        self.count += 1
        if self._progress is not None:
            self._progress(self.count, misfit)

    def _residuals(self, x: Array) -> Array:
        # Where a run fails they are nan: the search then takes a shorter step.
        residuals = (self.measured - self._values(x)) / self.sigma
        self._misfit = float(np.sqrt(np.mean(residuals**2)))
        return np.asarray(residuals)

    def _minimize(self) -> None:
        """Make the residuals least from where the search is."""
        start, step = self.x, 2.0 * math.sqrt(self.tolerance)
        # Differences smaller than the error of a run say nothing.
        least = max(1e-8, self.tolerance)
        # From 0, TRF's first step has the length of x_scale: half of the value.
        found = optimize.least_squares(
            lambda x: self._residuals(start + x),
            np.zeros(len(start)),
            jac=lambda x: -self._derivatives(start + x, step, sides=1),
            bounds=(self.low - start, self.high - start),
            x_scale=_FIRST_STEP,
            ftol=least,
            xtol=least,
            gtol=1e-12,
            max_nfev=100,
        )
        # TRF stays inside: it says which bounds it was driven to.
        mask, inside = np.asarray(found.active_mask), start + np.asarray(found.x)
        ends = np.where(mask < 0, self.low, np.where(mask > 0, self.high, inside))
        self.x = ends if np.isfinite(self._values(ends)).all() else inside
        self.converged = bool(found.status > 0)

    def _derivatives(self, x: Array, step: float, sides: int) -> Array:
        """Return the derivatives (N, p) of the weighted predicted values, differences of `sides`.

        A side beyond a bound, or whose run fails, is left out; where both fail they are 0.
        """
        here, columns = (0.0, self._values(x)), []
        for k in range(len(x)):
            found: list[tuple[float, Array]] = []
            for signed in (step, -step):
                other = x.copy()
                other[k] += signed
                if len(found) < sides and self.low[k] <= other[k] <= self.high[k]:
                    values = self._values(other)
                    found += [(float(other[k] - x[k]), values)] if np.isfinite(values).all() else []
            (a, above), (b, below) = (*found, here, (step, here[1]))[:2]
            columns.append((above - below) / (a - b) / self.sigma)
        return np.column_stack(columns)

    def _pooled(self, values: Array) -> Array:
        """Return the given sigma, else the rms of the residuals of all columns of one name."""
        count, out = len(self.measured), np.concatenate([one.sigma for one in self._series])
        for name in {one.name for one in self._series if not one.given}:
            pairs = zip(self._series, self._parts, strict=True)
            same = np.concatenate(
                [part for one, part in pairs if one.name == name and not one.given]
            )
            squares = np.mean((self.measured - values)[same] ** 2) * count
            # Data without noise are as exact as a run.
            least = self.tolerance * float(np.abs(self.measured[same]).max())
            out[same] = max(math.sqrt(squares / (count - len(self.free))), least) or 1.0
        return np.asarray(out)


def covariance_of(jacobian: Array, error: Array) -> tuple[Array, list[list[int]]]:
    """Return what the Jacobian (N, p) of weighted residuals determines; `error` is its own error.

    That is the covariance (p, p), infinite on the diagonal of what it does not determine, and the
    members of each direction along which it says nothing. A column that is not longer than twice
    its error says nothing. The others are brought to one length (van der Sluis, Numer. Math. 14
    (1969) 14). By Weyl's theorem a singular value below the norm of the error may be 0; by Wedin's
    its vector is known to an angle of the error over the gap to the other singular values, and a
    parameter that takes part in it by more is not determined.
    Source of both: Stewart and Sun, Matrix Perturbation Theory (1990), IV.4 and V.4.
    """
    lengths = np.linalg.norm(jacobian, axis=0)
    felt = np.flatnonzero(lengths > 2.0 * np.linalg.norm(error, axis=0))
    covariance = np.diag(np.full(jacobian.shape[1], math.inf))
    if not len(felt):
        return covariance, []
    scale = lengths[felt]
    _, values, vectors = np.linalg.svd(jacobian[:, felt] / scale, full_matrices=False)
    rounding = float(np.finfo(float).eps) * len(jacobian) * float(values[0])
    floor = max(float(np.linalg.norm(error[:, felt] / scale, 2)), rounding)
    seen = values > floor
    inner = (vectors[seen].T / values[seen] ** 2) @ vectors[seen] / np.outer(scale, scale)
    angle = floor / float(values[seen].min()) if seen.any() else 0.0
    members = [np.flatnonzero(np.abs(one) > angle) for one in vectors[~seen]]
    for some in members:
        inner[some, some] = math.inf
    covariance[np.ix_(felt, felt)] = inner
    return covariance, [felt[some].tolist() for some in members]


def _quiet(sensor: Sensor) -> Sensor:
    """Return a sensor without noise: the data have their own."""
    noise = [one.name for one in fields(sensor) if one.name.endswith("noise")]
    return replace(sensor, **dict.fromkeys(noise, 0.0))  # type: ignore[arg-type]


def _fitted(one: Free, unit: str, x: float, beyond: float, half: float) -> Fitted:
    """Return a parameter with its interval, `half` to both sides of x + `beyond`; nan if held.

    It is not determined if that interval leaves its order of magnitude open: if it reaches from one
    bound to the other, or, for one that is not negative, to 0 by its slope at the value.
    """
    name, value = TIE.join(one.keys), float(one.text(x))
    if not math.isfinite(half):
        held = math.isnan(half)
        return Fitted(name, unit, one.start, value, -half, half, held, held)
    low, high = one.to_value(x + beyond - half), one.to_value(x + beyond + half)
    # One that must be positive is searched by its logarithm: its relative deviation is that of x.
    from_zero = half < 1.0 if one.log else one.low != 0.0 or low > 0.0
    determined = from_zero and not (low <= one.low and high >= one.high)
    low, high = max(low, one.low), min(high, one.high)
    return Fitted(name, unit, one.start, value, low, high, determined)
