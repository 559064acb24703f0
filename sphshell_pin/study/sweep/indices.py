"""What a table of sampled runs says: quantiles, Sobol indices with intervals."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import InvalidParameter, NameNotFound, import_extra
from sphshell_pin.study.sweep.points import DRAWN, A, B, swapped

if TYPE_CHECKING:
    import pandas as pd


DESIGN = "design"
"""The column that says what each run of a sampled sweep is for."""
QUANTILES = (5, 25, 50, 75, 95)
"""In percent."""
RESAMPLES = 999
# Values that differ by the rounding of a sum of some dozen terms are the same.
_ROUNDING = 64 * np.finfo(float).eps
_BATCH = 16  # resamples at a time: 8 bytes * n (d + 2) each


def varied_keys(table: pd.DataFrame) -> list[str]:
    """Return the names of the columns that were varied."""
    names = [str(name) for name in table.columns]
    return names[1 : names.index("status")]


def figures_of(table: pd.DataFrame) -> list[str]:
    """Return the figures of a table."""
    names = [str(name) for name in table.columns]
    return [name for name in names[names.index("error") + 1 :] if name not in (DESIGN, "settings")]


def quantiles(table: pd.DataFrame) -> pd.DataFrame:
    """Return the quantiles of each input and each figure of a sampled `table`.

    Returns
    -------
    pandas.DataFrame : a row for each input and figure, by its name: columns 5, 25, 50, 75, 95
        [%, inputs as the file states them, figures in SI units], `mean`, and `runs`, how many have
        the figure; failed runs are left out.

    Raises
    ------
    InvalidParameter
        The table is not that of a sweep with `sample`.
    """
    names = varied_keys(table) + figures_of(table)
    rows = _rows(table, DRAWN, "a sample: make the sweep with dist")[names]
    found = rows.quantile([one / 100 for one in QUANTILES]).T.set_axis(list(QUANTILES), axis=1)
    return found.assign(mean=rows.mean(), runs=rows.count())


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
    if not isinstance(confidence, float) or not 0.0 < confidence < 1.0:
        raise InvalidParameter("confidence", confidence, "must lie between 0 and 1")
    keys = varied_keys(table)
    wanted = [A, B, *map(swapped, keys)]
    every = _rows(table, wanted, "Sobol indices: make the sweep with indices").sort_values("run")
    rows = {one: every[every[DESIGN] == one] for one in wanted}
    n = len(rows[A])
    if n & (n - 1) or any(len(one) != n for one in rows.values()):
        raise InvalidParameter("table", None, "rows: Sobol indices need all of a sweep", "lacks")
    _check_complete(every, figure, "Sobol indices")
    values = np.array([rows[one][figure].to_numpy(float) for one in wanted])
    if np.ptp(values) <= _ROUNDING * np.abs(values).max():
        raise InvalidParameter(
            "figure",
            figure,
            f"is {values.flat[0]:.6g} in all runs: without a variance it has no Sobol indices",
        )
    from scipy import stats

    found = stats.bootstrap(
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
    pandas = import_extra("pandas", "sweep", "Sobol indices")
    return pandas.DataFrame(columns, index=keys)


def _rows(table: pd.DataFrame, parts: Iterable[str], purpose: str) -> pd.DataFrame:
    """Return the rows of a sampled table that are `parts` of its design."""
    if DESIGN not in table.columns:
        must = "no column 'design': it is not that of a sweep with dist"
        raise InvalidParameter("table", None, must, "has")
    rows = table[table[DESIGN].isin(list(parts))]
    if rows.empty:
        raise InvalidParameter("table", None, f"no runs for {purpose}", "has")
    return rows


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
    from scipy import stats

    found = stats.sobol_indices(func=functions, n=n)
    both = np.stack([found.first_order, found.total_order]).reshape(2, -1, d)
    return np.moveaxis(both, 1, -1).reshape(2, d, *many)
