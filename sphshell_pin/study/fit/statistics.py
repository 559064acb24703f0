"""What the data determine: covariance, intervals, and tests of the residuals."""

import math
from dataclasses import dataclass

import numpy as np

from sphshell_pin.base.arrays import Array

# Share of cases in which a test says of noise that it is none.
FALSE_ALARM = 0.01


@dataclass(frozen=True)
class Spread:
    """Spread of p parameters x: `covariance` (p, p), infinite on the diagonal of undetermined ones.

    `blind` (k, p) are changes of x, of length 1, along which the data say nothing.
    """

    covariance: Array
    blind: Array

    @property
    def deviations(self) -> Array:
        """Standard deviations (p,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def correlation(self) -> Array:
        """Correlation (p, p); nan for what the data do not determine."""
        deviations = self.deviations
        with np.errstate(invalid="ignore", divide="ignore"):
            out = self.covariance / np.outer(deviations, deviations)
        out[~np.isfinite(deviations), :] = np.nan
        out[:, ~np.isfinite(deviations)] = np.nan
        np.fill_diagonal(out, 1.0)
        return np.asarray(out)


def spread_of(jacobian: Array, error: Array) -> Spread:
    """Return what the Jacobian (N, p) of weighted residuals determines; `error` is its own error.

    A column that is not longer than twice its error says nothing of its parameter. The others are
    brought to one length, which leaves the condition about as good as any lengths can (van der
    Sluis, Numer. Math. 14 (1969) 14). By Weyl's theorem a singular value below the norm of the
    error may be 0: the data say nothing along its vector. By Wedin's theorem such
    vectors are known to an angle of the error over the gap to the other singular values; a
    parameter that takes part in one by more than that is not determined.

    Source of both: Stewart and Sun, Matrix Perturbation Theory (1990), IV.4 and V.4.
    """
    count = jacobian.shape[1]
    lengths = np.linalg.norm(jacobian, axis=0)
    felt = lengths > 2.0 * np.linalg.norm(error, axis=0)
    covariance = np.zeros((count, count))
    blind = np.eye(count)[~felt]
    if felt.any():
        scale = lengths[felt]
        inner, directions = _spread(jacobian[:, felt] / scale, error[:, felt] / scale)
        covariance[np.ix_(felt, felt)] = inner / np.outer(scale, scale)
        whole = np.zeros((len(directions), count))
        whole[:, felt] = directions / scale
        whole /= np.linalg.norm(whole, axis=1, keepdims=True)
        blind = np.vstack((blind, whole))
    covariance[~felt, ~felt] = math.inf
    return Spread(covariance, blind)


def _spread(jacobian: Array, error: Array) -> tuple[Array, Array]:
    """Return covariance and blind directions of columns of one length."""
    count = jacobian.shape[1]
    if len(jacobian) < count:
        jacobian = np.vstack((jacobian, np.zeros((count - len(jacobian), count))))
    _, values, vectors = np.linalg.svd(jacobian, full_matrices=False)
    rounding = float(np.finfo(float).eps) * max(jacobian.shape) * float(values[0])
    floor = max(float(np.linalg.norm(error, 2)), rounding)
    seen = values > floor
    covariance = (vectors[seen].T / values[seen] ** 2) @ vectors[seen]
    blind = vectors[~seen]
    if len(blind):
        angle = floor / float(values[seen].min()) if seen.any() else 0.0
        lost = np.flatnonzero(np.linalg.norm(blind, axis=0) > angle)
        covariance[lost, lost] = math.inf
    return np.asarray(covariance), blind


def student_factor(dof: int, level: float) -> float:
    """Return half the width of the interval of `level`, in standard deviations (Student's t)."""
    from scipy import stats

    return float(stats.t.ppf(0.5 + 0.5 * level, dof)) if dof > 0 else math.inf


@dataclass(frozen=True)
class Serial:
    """Durbin and Watson's ratio of residuals, and whether it is one of independent ones.

    `correlation` is that of neighbors; `inflation` is by how much intervals are too narrow.
    """

    ratio: float
    independent: bool

    @property
    def correlation(self) -> float:
        """Correlation of a residual with the one before it."""
        return 1.0 - 0.5 * self.ratio

    @property
    def inflation(self) -> float:
        """Widths of honest intervals over those of independent residuals, of a first-order chain.

        The variance of a mean of such a chain is (1 + r) / (1 - r) times that of independent
        values (Bayley and Hammersley, J. R. Statist. Soc. Suppl. 8 (1946) 184).
        """
        r = min(max(self.correlation, 0.0), 0.999)
        return math.sqrt((1 + r) / (1 - r))


def serial_of(residuals: Array, tests: int = 1) -> Serial:
    """Test residuals (n,) in order of time; `tests` is how many columns are tested.

    Of independent normal residuals the ratio of von Neumann, sum (r_i - r_(i-1))^2 / sum r_i^2 has
    the mean 2 and the variance 4 (n - 2) / (n^2 - 1) (Ann. Math. Statist. 12 (1941) 367); it is
    nearly normal. A false alarm in any column has the probability FALSE_ALARM at most.
    """
    from scipy import stats

    n, power = len(residuals), float(residuals @ residuals)
    if n < 4 or not power > 0.0:
        return Serial(2.0, True)
    ratio = float(np.sum(np.diff(residuals) ** 2)) / power
    deviation = math.sqrt(4.0 * (n - 2) / (n**2 - 1.0))
    limit = float(stats.norm.isf(0.5 * FALSE_ALARM / tests))
    return Serial(ratio, abs(ratio - 2.0) <= limit * deviation)


def variance_is(squares: float, dof: int) -> bool:
    """Whether the sum of `squares` of residuals over given deviations is as these say.

    It is then distributed as chi squared with `dof` degrees of freedom.
    """
    from scipy import stats

    low, high = stats.chi2.ppf([0.5 * FALSE_ALARM, 1 - 0.5 * FALSE_ALARM], dof)
    return bool(low <= squares <= high)
