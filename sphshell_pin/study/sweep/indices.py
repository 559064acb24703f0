"""What a table of sampled runs says: quantiles, Sobol indices with intervals, the tornado."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import InvalidParameter, NameNotFound
from sphshell_pin.study.sweep.job import need
from sphshell_pin.study.sweep.sampling import DRAWN, HIGH, LOW, MEDIAN, A, B, at_quantile, swapped
from sphshell_pin.study.sweep.table import DESIGN, figures_of, varied_keys

if TYPE_CHECKING:
    import pandas as pd


QUANTILES = (5, 25, 50, 75, 95)
"""In percent."""
RESAMPLES = 999
# Values that differ by the rounding of a sum of some dozen terms are the same.
_ROUNDING = 64 * np.finfo(float).eps
_BATCH = 16  # resamples at a time: 8 bytes * n (d + 2) each


def drawn(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows that are a sample of the inputs' distributions.

    Raises InvalidParameter if the table is not that of a sweep with `sample`.
    """
    _check_design(table)
    rows = table[table[DESIGN].isin(DRAWN)]
    if rows.empty:
        raise InvalidParameter(
            "table", None, "no sample, only a tornado: make the sweep with sample = sobol", "has"
        )
    return rows


def quantiles(table: pd.DataFrame) -> pd.DataFrame:
    """Return the quantiles of each figure of a sampled `table`.

    Returns
    -------
    pandas.DataFrame : a row for each figure, by its name: columns 5, 25, 50, 75, 95 [%, SI units],
        `mean`, and `runs`, how many have the figure; failed runs are left out.

    Raises
    ------
    InvalidParameter
        The table is not that of a sweep with `sample`.
    """
    rows = drawn(table)
    found = {}
    for name in figures_of(table):
        values = rows[name].to_numpy(float)
        values = values[~np.isnan(values)]
        mean = float(np.mean(values)) if len(values) else np.nan
        found[name] = [*_quantiles(values), mean, len(values)]
    pandas = need("pandas")
    made = pandas.DataFrame.from_dict(found, orient="index", columns=[*QUANTILES, "mean", "runs"])
    return made.astype({"runs": int})


def sobol_indices(
    table: pd.DataFrame, figure: str, *, confidence: float = 0.95, seed: int = 0
) -> pd.DataFrame:
    """Return the Sobol indices of a figure, of a sweep with `indices`.

    The first-order index of an input is the share of the figure's variance that it causes alone;
    the total index adds all that it causes together with others. Estimators: Saltelli et al.
    (2010) and Jansen (1999) [scipy.stats.sobol_indices]; intervals: percentiles of a bootstrap
    over the points. They take the points for independent: those of a Sobol sequence are more
    evenly spread, so that the intervals are usually wider than need be.

    Parameters
    ----------
    table : of the sweep, with all its rows.
    figure : the figure's column.
    confidence : the share of intervals that should contain the index.
    seed : of the bootstrap.

    Returns
    -------
    pandas.DataFrame : a row for each input, by its key: columns `first`, `first_low`,
        `first_high`, `total`, `total_low`, `total_high`.

    Raises
    ------
    NameNotFound
        The table has no such figure.
    InvalidParameter
        The table is not that of a sweep with `indices`, a run has no such figure, or the figure is
        the same in all runs.
    """
    _check_design(table)
    if not isinstance(confidence, float) or not 0.0 < confidence < 1.0:
        raise InvalidParameter("confidence", confidence, "must lie between 0 and 1")
    table = table.sort_values("run")
    keys = varied_keys(table)
    wanted = [A, B, *map(swapped, keys)]
    if A not in set(table[DESIGN]):
        raise InvalidParameter(
            "table", None, "no runs for Sobol indices: make the sweep with indices", "has"
        )
    rows = {one: table[table[DESIGN] == one] for one in wanted}
    n = len(rows[A])
    if n & (n - 1) or any(len(one) != n for one in rows.values()):
        raise InvalidParameter("table", None, "rows: Sobol indices need all of a sweep", "lacks")
    _check_complete(table[table[DESIGN].isin(wanted)], figure, "Sobol indices")
    values = np.array([rows[one][figure].to_numpy(float) for one in wanted])
    if np.ptp(values) <= _ROUNDING * np.abs(values).max():
        raise InvalidParameter(
            "figure",
            figure,
            f"is {values.flat[0]:.6g} in all runs: without a variance it has no Sobol indices",
        )
    found = need("scipy.stats").bootstrap(
        (np.arange(n),),
        lambda points, axis: _estimate(values[:, points]),
        vectorized=True,
        n_resamples=RESAMPLES,
        batch=_BATCH,
        confidence_level=confidence,
        method="percentile",
        rng=seed,
    )
    low, high = found.confidence_interval
    columns: dict[str, Array] = {}
    for kind, *three in zip(("first", "total"), _estimate(values), low, high, strict=True):
        columns |= dict(zip((kind, f"{kind}_low", f"{kind}_high"), three, strict=True))
    return need("pandas").DataFrame(columns, index=keys)


def tornado(table: pd.DataFrame, figure: str) -> pd.DataFrame:
    """Return what a figure is with each input at its quantiles, of a sweep with `tornado`.

    Returns
    -------
    pandas.DataFrame : a row for each input, by its key, the one with the largest change first:
        columns `low_value`, `high_value` (the input's quantiles of 5 and 95 %), `low`, `median`,
        `high` (the figure there, all other inputs at their medians).

    Raises
    ------
    NameNotFound
        The table has no such figure.
    InvalidParameter
        The table is not that of a sweep with `tornado`, or one of its runs has no such figure.
    """
    _check_design(table)
    keys = varied_keys(table)
    parts = [MEDIAN, *(at_quantile(key, one) for key in keys for one in (LOW, HIGH))]
    rows = table[table[DESIGN].isin(parts)]
    if len(rows) != len(parts):
        raise InvalidParameter(
            "table", None, "no runs for a tornado: make the sweep with tornado", "has"
        )
    _check_complete(rows, figure, "a tornado")
    values = dict(zip(rows[DESIGN], rows[figure].to_numpy(float), strict=True))
    inputs = rows.set_index(DESIGN)
    lines = []
    for key in keys:
        low, high = (at_quantile(key, one) for one in (LOW, HIGH))
        ends = inputs.loc[low, key], inputs.loc[high, key]
        lines.append([*ends, values[low], values[MEDIAN], values[high]])
    columns = ["low_value", "high_value", "low", "median", "high"]
    found = need("pandas").DataFrame(lines, index=keys, columns=columns)
    found.attrs = dict(table.attrs)
    ends = found[["low", "median", "high"]]
    change = ends.max(axis=1) - ends.min(axis=1)
    return found.loc[change.sort_values(ascending=False, kind="stable").index]


def _quantiles(values: Array) -> list[float]:
    if not len(values):
        return [np.nan] * len(QUANTILES)
    with np.errstate(invalid="ignore"):  # between two infinities
        return [float(one) for one in np.percentile(values, QUANTILES)]


def _check_design(table: pd.DataFrame) -> None:
    if DESIGN not in table.columns:
        raise InvalidParameter(
            "table", None, "no column 'design': it is not that of a sweep with dist", "has"
        )


def _check_complete(rows: pd.DataFrame, figure: str, purpose: str) -> None:
    """Refuse a figure that some of `rows` lack."""
    known = figures_of(rows)
    if figure not in known:
        raise NameNotFound("figure", figure, "the table", known, see="its columns")
    values = rows[figure].to_numpy(float)
    gaps = ~np.isfinite(values)
    if gaps.any():
        first = rows[gaps].iloc[0]
        why = first["error"] or f"it is {first[figure]:g}"
        raise InvalidParameter(
            "figure",
            figure,
            f"has no finite value in {np.sum(gaps)} of {len(rows)} runs ({first[DESIGN]}, run "
            f"{first['run']}: {why}): {purpose} of the others would be wrong; narrow the "
            "distributions, or choose a figure that every run has",
        )


def _estimate(values: Array) -> Array:
    """Return first-order and total indices (2, d, ...) of the runs A, B, AB_1 ... (d + 2, ..., n).

    Resamples, between the first and the last axis, are to scipy several figures of the same runs.
    """
    d, many, n = len(values) - 2, values.shape[1:-1], values.shape[-1]
    a, b, *swaps = values.reshape(d + 2, -1, n)
    functions = {"f_A": a, "f_B": b, "f_AB": np.array(swaps)}
    found = need("scipy.stats").sobol_indices(func=functions, n=n)
    both = np.stack([found.first_order, found.total_order]).reshape(2, -1, d)
    return np.moveaxis(both, 1, -1).reshape(2, d, *many)
