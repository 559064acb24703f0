"""What a fit comes to: values, intervals, correlation, residuals, and remarks on them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy import stats

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.atomic import write_whole
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.base.summary import Fact, Summarized
from sphshell_pin.base.texts import json_text
from sphshell_pin.scenario.format.reading import find_scenario
from sphshell_pin.study.fit.data import Series
from sphshell_pin.study.fit.parameters import TIE
from sphshell_pin.study.fit.writing import scenario_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# Share of cases in which a test says of noise that it is none.
FALSE_ALARM = 0.01
# A pair of which one explains so much of the variance of the other is told.
SHARED = 0.9
# Residuals of so small a part of a column's range are told no more: rows are interpolated.
_SMALL = 1e-4


@dataclass(frozen=True)
class Fitted:
    """A fitted parameter: `value`, and the interval from `low` to `high`, in its `unit`.

    `key` of several keys with one value is "KEY+KEY". The interval is infinite for a parameter of
    which the data say nothing, and nan for one that its bound holds off the data: `at_bound`.
    """

    key: str
    unit: str
    start: float
    value: float
    low: float
    high: float
    determined: bool
    at_bound: bool = False

    @property
    def interval(self) -> str:
        """The interval in words."""
        if self.at_bound:
            return "at its bound"
        if math.isinf(self.low) and math.isinf(self.high):
            return "not determined"
        return f"{self.low:.5g} to {self.high:.5g}"


@dataclass(frozen=True, repr=False)
class Fit(Summarized):
    """Parameters of a scenario that were fitted to data.

    Attributes
    ----------
    scenario : name or path of the scenario
    parameters : the fitted ones, in the order they were asked for
    correlation (p, p) : of the parameters on the scales they were fitted on; nan in the rows of
        those that the data do not determine
    series : each measured column of each experiment, with residuals
    remarks : sentences on what the data do not determine, on what is strongly correlated, on values
        at a bound, on residuals that are more than noise or not as large as given deviations
    dof : measured values less parameters
    level : probability of the intervals
    runs : how many runs were made
    converged : whether the search ended where no step makes the residuals smaller
    """

    scenario: str
    parameters: tuple[Fitted, ...]
    correlation: Array
    series: tuple[Series, ...]
    remarks: tuple[str, ...]
    dof: int
    level: float
    runs: int
    converged: bool

    @property
    def _title(self) -> str:
        return f"Fit of '{self.scenario}'"

    def _facts(self) -> list[Fact]:
        return [
            *(Fact(one.key, one.value, one.unit) for one in self.parameters),
            Fact("search", "converged" if self.converged else "stopped before it converged"),
            Fact("determined", self.determined),
        ]

    @property
    def values(self) -> dict[str, float]:
        """The fitted values by key."""
        return {one.key: one.value for one in self.parameters}

    @property
    def determined(self) -> bool:
        """Whether the data determine all parameters."""
        return all(one.determined for one in self.parameters)

    def __getitem__(self, key: str) -> Fitted:
        """Return the parameter with this key; a KeyError for another one."""
        return {one.key: one for one in self.parameters}[key]

    def plot(self) -> Figure:
        """Return a figure of data, fitted curves and residuals; MissingExtra without matplotlib."""
        from sphshell_pin.plot.fit import plot_fit

        return plot_fit(self)

    def write_scenario(self, path: StrPath, changes: Mapping[str, str] | None = None) -> Path:
        """Write the scenario's file with the fitted values, and `changes`, in place.

        Comments stay; names of files beside the scenario are written relative to the new place.

        Raises ResultError where it cannot be written.
        """
        return write_whole(path, self.scenario_text(Path(path).parent, changes).encode())

    def scenario_text(self, folder: Path, changes: Mapping[str, str] | None = None) -> str:
        """Return what `write_scenario` writes into a file in `folder`, values in nine digits."""
        texts = {
            key: repr(float(f"{one.value:.9g}"))
            for one in self.parameters
            for key in one.key.split(TIE)
        }
        return scenario_text(find_scenario(self.scenario), {**(changes or {}), **texts}, folder)

    def to_json(self) -> str:
        """Return everything but the values of the series, as JSON; null for infinite and nan."""
        series = [
            {
                "experiment": one.experiment,
                "column": one.name,
                "unit": one.unit,
                "values": len(one.t),
                "rms": one.rms,
                "sigma": float(np.sqrt(np.mean(one.sigma**2))),
                "sigma_given": one.given,
            }
            for one in self.series
        ]
        return json_text(
            {**vars(self), "parameters": [*map(vars, self.parameters)], "series": series}, indent=2
        )

    def __str__(self) -> str:
        """Return a line for each parameter and each column of data, then the remarks."""
        lines = [
            f"{one.key} = {one.value:.6g} {one.unit}".rstrip() + f"  {one.interval}"
            for one in self.parameters
        ]
        for one in self.series:
            rms = f"rms residual {one.rms:.4g} {one.unit}".rstrip()
            lines.append(f"{one.name} of {one.experiment}: {len(one.t)} values, {rms}")
        return "\n".join([*lines, *self.remarks])


def patterned(series: Sequence[Series]) -> list[Series]:
    """Return the columns whose residuals are more than noise: neighbours are alike.

    Products of neighbours have the mean 0 in independent noise, also where its size changes: their
    sum over the root of the sum of their squares is then nearly normal (White, Econometrica 48
    (1980) 817). In noise there is such a column in FALSE_ALARM of the fits.
    """
    limit, out = float(stats.norm.isf(FALSE_ALARM / len(series))), []
    for one in series:
        weighted, small = one.residuals / one.sigma, _SMALL * float(np.ptp(one.measured))
        products = weighted[1:] * weighted[:-1]
        if one.rms > small and products.sum() > limit * np.linalg.norm(products):
            out.append(one)
    return out


def remarks_on(
    fitted: Sequence[Fitted],
    correlation: Array,
    together: Sequence[Sequence[int]],
    series: Sequence[Series],
    dof: int,
) -> list[str]:
    """Return what is to be said of a fit; `together` are determined only together."""
    groups = [some for some in together if len(some) > 1]
    names = (" and ".join(fitted[k].key for k in some) for some in groups)
    out = [f"the data do not determine {one} separately" for one in names]
    for k, one in enumerate(fitted):
        if one.at_bound:
            out.append(
                f"{one.key} stands at its bound, {one.value:.6g} {one.unit}".rstrip()
                + ": it has no interval, and those of others hold for it so"
            )
        elif not one.determined and not any(k in some for some in groups):
            why = "what was measured feels it no more than the error of the runs"
            if math.isfinite(one.low) or math.isfinite(one.high):
                why = f"its interval, {one.interval} {one.unit}".rstrip()
                why += ", leaves its order of magnitude open"
            out.append(f"the data do not determine {one.key}: {why}")
        for i in np.flatnonzero(correlation[k, :k] ** 2 > SHARED).tolist():
            pair = f"{fitted[i].key} and {one.key}"
            out.append(f"{pair} are correlated, {correlation[k, i]:+.3f}")
    for column in patterned(series):
        rms = f"{column.rms:.3g} {column.unit}".rstrip()
        out.append(
            f"the fit does not explain {column.name} of {column.experiment}: its residuals, {rms}, "
            "follow a pattern, so intervals are too narrow. The scenario leaves something out, the "
            "noise is correlated, or the search ended in the wrong place: start elsewhere"
        )
    if all(one.given for one in series):
        squares = sum(float(np.sum((one.residuals / one.sigma) ** 2)) for one in series)
        low, high = stats.chi2.ppf([0.5 * FALSE_ALARM, 1 - 0.5 * FALSE_ALARM], dof)
        if not low <= squares <= high:
            out.append(
                f"the residuals are {math.sqrt(squares / dof):.3g} times the standard deviations "
                "that were given: these are wrong, or the scenario leaves something out"
            )
    return out
