"""The search for the values of parameters at which runs come nearest to the data."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sphshell_pin.base.arrays import Array, Mask
from sphshell_pin.study.fit.parameters import Free
from sphshell_pin.study.fit.remarks import remarks_on
from sphshell_pin.study.fit.report import Fit, Fitted, Series
from sphshell_pin.study.fit.runs import Runs, Trial, central_step, forward_step
from sphshell_pin.study.fit.statistics import Spread, serial_of, spread_of, student_factor

Progress = Callable[[int, float], object]

# Weights that are estimated change the values, which change the weights.
_MOST_ROUNDS = 6
_SAME_SIGMA = 0.02
# Derivatives: an error that no longer matters, and how often its step is halved to come to it.
_SMALL_ERROR, _MOST_HALVINGS = 0.01, 8
# Parts of the experiments' time that are fitted one after the other where all at once fail.
_STAGES = (0.125, 0.25, 0.5)
# A value feels the parameters if its slope is so large a part of the largest.
_FELT = 1e-3
# How far the first step may go in x.
_FIRST_STEP = 0.5


class _Part(NamedTuple):
    """One column of one experiment, of which nothing is fitted yet, and where it is among all."""

    trial: Trial
    at: slice
    data: Series


class Search:
    """The search for the values at which the weighted residuals are least."""

    def __init__(
        self, trials: Sequence[Trial], free: tuple[Free, ...], progress: Progress | None
    ) -> None:
        self.free = free
        self.runs = Runs(trials, free, self._tell)
        self.x = np.array([one.to_x(one.start) for one in free])
        self.low = np.array([one.to_x(one.low) for one in free])
        self.high = np.array([one.to_x(one.high) for one in free])
        self.converged = False
        self._progress = progress
        self._misfit = math.nan
        self.parts: list[_Part] = []
        begin = 0
        for trial in trials:
            for column in trial.data.columns:
                end = begin + len(column.values)
                unknown, given = np.full(len(column.values), np.nan), column.sigma is not None
                data = Series(
                    trial.data.name,
                    column.name,
                    column.quantity.unit,
                    trial.data.t[column.rows],
                    column.values,
                    fitted=unknown,
                    sigma=unknown if column.sigma is None else column.sigma,
                    given=given,
                )
                self.parts.append(_Part(trial, slice(begin, end), data))
                begin = end
        self.measured = np.concatenate([part.data.measured for part in self.parts])
        means = [np.full_like(part.data.measured, part.data.measured.mean()) for part in self.parts]
        self.sigma = self._pooled(self.measured - np.concatenate(means), 1.0)

    def run(self) -> None:
        """Search; weights that are not given are estimated from the residuals, and it goes on."""
        if self.runs.predict(self.x) is None:
            assert self.runs.failure is not None
            self.runs.failure.add_note("this is the run at the start values")
            raise self.runs.failure
        start, sigma = self.x, self.sigma
        self._settle()
        if self._systematic():
            # Where the run's touches miss the data's, the residuals may have another least place.
            best = self.x, self.sigma, self.converged, self._scatter()
            self.x, self.sigma = start, sigma
            for part in _STAGES:
                self._minimize(self._until(part))
            self._settle()
            if not self._scatter() < best[-1]:
                self.x, self.sigma, self.converged, _ = best

    def _settle(self) -> None:
        """Go to the least residuals from where the search is, with weights that fit them."""
        names = {part.data.name for part in self.parts if not part.data.given}
        some = any(part.data.given for part in self.parts)
        # The weight of all data together changes nothing.
        rounds = _MOST_ROUNDS if len(names) > 1 or (names and some) else 1
        for _ in range(rounds):
            self._minimize()
            before, self.sigma = self.sigma, self._estimated_sigma()
            if np.abs(self.sigma / before - 1.0).max() < _SAME_SIGMA:
                break

    def report(self, scenario: str, level: float) -> Fit:
        """Return the fit at the values found."""
        jacobian, error, still = self._final_derivatives()
        dof = len(self.measured) - len(self.free)
        factor = student_factor(dof, level)
        spread = spread_of(jacobian, error)
        middle, held = self._beyond(jacobian, factor * spread.deviations)
        if held.any():
            spread = _with_held(spread_of(jacobian[:, ~held], error[:, ~held]), held)
        self._leave_unfelt(spread, still)
        halves = factor * spread.deviations
        columns = self.free, self.x.tolist(), middle - halves, middle + halves, held.tolist()
        fitted = tuple(
            _fitted(one, x, (float(low), float(high)), held=bound)
            for one, x, low, high, bound in zip(*columns, strict=True)
        )
        series = self._series()
        remarks = remarks_on(
            fitted,
            self.free,
            spread,
            series,
            dof,
            self.runs.tolerance,
            still=still,
            converged=self.converged,
        )
        notes = [note for trial in self.runs.trials for note in trial.data.notes]
        return Fit(
            scenario,
            fitted,
            spread.correlation,
            series,
            (*notes, *remarks),
            dof,
            level,
            self.runs.count,
            self.converged,
        )

    def _systematic(self) -> bool:
        """Whether any column's residuals are not noise."""
        series = [one for one in self._series() if one.rms > 0.0]
        tests = [serial_of(one.residuals / one.sigma, len(series)) for one in series]
        return any(not one.independent and one.correlation > 0.0 for one in tests)

    def _scatter(self) -> float:
        """Return how likely the residuals are, whatever sigma weights them: less is better."""
        values = self.runs.predict(self.x)
        assert values is not None
        sigma = self._estimated_sigma()
        weighted = (self.measured - values) / sigma
        return float(np.sum(np.log(sigma)) + 0.5 * weighted @ weighted)

    def _leave_unfelt(self, spread: Spread, still: Mask) -> None:
        """Put parameters that change nothing that was measured back to where they started."""
        unfelt = still & (np.abs(spread.blind) == 1.0).any(axis=0)
        start = np.array([one.to_x(one.start) for one in self.free])
        x = np.where(unfelt, start, self.x)
        if unfelt.any() and self.runs.predict(x) is not None:
            self.x = x

    def _beyond(self, jacobian: Array, half: Array) -> tuple[Array, Mask]:
        """Return the middles (p,) of the intervals, and which parameters the bounds hold.

        Of a value at a bound the middle is where the residuals would be least without it. Where an
        interval of `half` width about it does not reach the bound, the bound speaks against the
        data: the value is held there.
        """
        at_bound = (self.x <= self.low) | (self.x >= self.high)
        if not at_bound.any():
            return self.x, at_bound
        step = np.linalg.lstsq(jacobian, self._residuals(self.x), rcond=None)[0]
        middle = np.where(at_bound, self.x + step, self.x)
        held = at_bound & ((middle + half < self.low) | (middle - half > self.high))
        return np.where(held, self.x, middle), held

    def _until(self, share: float) -> Array:
        """Return 1 for the first values that feel the parameters, a `share` of them, and 0 (N,).

        Values before these are taken, too: the parameters do nothing to them.
        """
        derivatives = self._derivatives(self.x)
        felt = np.linalg.norm(derivatives, axis=1)
        use = np.zeros(len(felt))
        for trial in self.runs.trials:
            parts = [part for part in self.parts if part.trial is trial]
            feels = [felt[part.at] > _FELT * felt.max() for part in parts]
            times = np.concatenate([one.data.t[f] for one, f in zip(parts, feels, strict=True)])
            if len(times):
                last = np.quantile(times, share)
                for part in parts:
                    use[part.at] = part.data.t <= last
        return use

    def _minimize(self, use: Array | float = 1.0) -> None:
        """Make the residuals least, each times `use`."""
        from scipy import optimize

        tolerance = self.runs.tolerance
        # A value at its bound would hold the search there.
        inner = np.clip(self.x, self.low + _inset(self.low), self.high - _inset(self.high))
        start = np.where(self.low < self.high, inner, self.x)
        # From 0, TRF's first step has the length of x_scale: half of the value.
        found = optimize.least_squares(
            lambda x: use * self._residuals(start + x),
            np.zeros(len(start)),
            jac=lambda x: -self._derivatives(start + x, use),
            bounds=(self.low - start, self.high - start),
            method="trf",
            x_scale=_FIRST_STEP,
            # Differences smaller than the error of a run say nothing.
            ftol=max(1e-8, tolerance),
            xtol=max(1e-8, tolerance),
            gtol=1e-12,
            max_nfev=100,
        )
        inside = start + np.asarray(found.x)
        # TRF stays inside: it says which bounds it was driven to.
        mask = np.asarray(found.active_mask)
        self.x = np.where(mask < 0, self.low, np.where(mask > 0, self.high, inside))
        if mask.any() and self.runs.predict(self.x) is None:
            self.x = inside
        self.converged = bool(found.status > 0)

    def _residuals(self, x: Array) -> Array:
        values = self.runs.predict(x)
        if values is None:
            # The search then takes a shorter step.
            return np.full(len(self.measured), np.nan)
        residuals = (self.measured - values) / self.sigma
        self._misfit = float(np.sqrt(np.mean(residuals**2)))
        return np.asarray(residuals)

    def _derivatives(self, x: Array, use: Array | float = 1.0) -> Array:
        """Return the derivatives (N, p) of the weighted predicted values, each times `use`."""
        derivatives = self.runs.derivatives(
            x, self.low, self.high, forward_step(self.runs.tolerance)
        )
        return np.asarray(derivatives * (use / self.sigma)[:, None])

    def _final_derivatives(self) -> tuple[Array, Array, Mask]:
        """Return the weighted derivatives (N, p) at the solution, their error, which x do nothing.

        The error is by how much differences over one step and over twice the step differ, and a
        column's step is halved as long as that makes it less. An error of truncation is a third of
        it; one of rounding, of which neither difference knows the other's, is about that much. It
        is no less than what the tolerance of a run does to a difference. An x (p,) of which no
        column's slope is longer than twice that does nothing; of any other, an error that is as
        long as the slope leaves open what it does.
        """
        derivatives, errors, still = [], [], []
        values = self.runs.predict(self.x)
        assert values is not None
        rounding = self.runs.tolerance * np.abs(values) / self.sigma
        for k in range(len(self.x)):
            step = central_step(self.runs.tolerance)
            near = self._slope(k, step)
            error = near - self._slope(k, 2.0 * step)
            for _ in range(_MOST_HALVINGS):
                if np.linalg.norm(error) <= _SMALL_ERROR * np.linalg.norm(near):
                    break
                step *= 0.5
                nearer = self._slope(k, step)
                less = nearer - near
                if not np.linalg.norm(less) < np.linalg.norm(error):
                    break
                near, error = nearer, less
            derivatives.append(near)
            least = rounding / step
            errors.append(np.maximum(np.abs(error), least))
            # Lengths of each column: one of large values would hide what another feels.
            lengths = [np.linalg.norm([near[one.at], least[one.at]], axis=1) for one in self.parts]
            still.append(all(length <= 2.0 * noise for length, noise in lengths))
        return np.column_stack(derivatives), np.column_stack(errors), np.array(still)

    def _slope(self, k: int, step: float) -> Array:
        return self.runs.slope(self.x, k, self.low, self.high, step, central=True) / self.sigma

    def _tell(self, count: int) -> None:
        if self._progress is not None:
            self._progress(count, self._misfit)

    def _estimated_sigma(self) -> Array:
        values = self.runs.predict(self.x)
        assert values is not None
        count = len(self.measured)
        return self._pooled(self.measured - values, count / (count - len(self.free)))

    def _pooled(self, deviations: Array, factor: float) -> Array:
        """Return the given sigma, else the rms of `deviations` of all columns of one name."""
        out = np.zeros(len(self.measured))
        for name in {part.data.name for part in self.parts}:
            parts = [part for part in self.parts if part.data.name == name]
            whole = np.concatenate([deviations[part.at] for part in parts])
            largest = max(float(np.abs(self.measured[part.at]).max()) for part in parts)
            # Data without noise are as exact as a run.
            least = self.runs.tolerance * largest
            pooled = max(math.sqrt(factor * float(np.mean(whole**2))), least) or 1.0
            for part in parts:
                out[part.at] = part.data.sigma if part.data.given else pooled
        return out

    def _series(self) -> tuple[Series, ...]:
        values = self.runs.predict(self.x)
        assert values is not None
        return tuple(
            replace(part.data, fitted=values[part.at], sigma=self.sigma[part.at])
            for part in self.parts
        )


def _inset(bound: Array) -> Array:
    """Return a small part of finite bounds."""
    return np.where(np.isfinite(bound), 1e-9 * np.maximum(1.0, np.abs(bound)), 0.0)


def _with_held(spread: Spread, held: Mask) -> Spread:
    """Return the spread of all parameters; those `held` at a bound have none."""
    if not held.any():
        return spread
    count, kept = len(held), np.flatnonzero(~held)
    covariance = np.zeros((count, count))
    covariance[np.ix_(kept, kept)] = spread.covariance
    covariance[held, held] = np.nan
    blind = np.zeros((len(spread.blind), count))
    blind[:, kept] = spread.blind
    return Spread(covariance, blind)


def _fitted(one: Free, x: float, span: tuple[float, float], *, held: bool) -> Fitted:
    """Return a parameter with its interval, `span` of x.

    It is not determined if that interval leaves its order of magnitude open: if it reaches from one
    bound to the other, or, for one that is not negative, to 0 by its slope at the value.
    """
    value, low, high = float(one.text(x)), -math.inf, math.inf
    if held:
        return Fitted(one.name, one.unit, one.start, value, math.nan, math.nan, True, True)
    if math.isinf(span[0]):
        return Fitted(one.name, one.unit, one.start, value, low, high, False)
    low, high = map(one.to_value, span)
    # One that must be positive is searched by its logarithm: its relative deviation is that of x.
    from_zero = 0.5 * (span[1] - span[0]) < 1.0 if one.log else one.low != 0.0 or low > 0.0
    determined = from_zero and not (low <= one.low and high >= one.high)
    low, high = max(low, one.low), min(high, one.high)
    return Fitted(one.name, one.unit, one.start, value, low, high, determined)
