"""Picture of a fit: what was measured, what the fitted scenario says, and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.plot.figure import INK, finish_axis, new_figure, reading_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sphshell_pin.study.fit.data import Series
    from sphshell_pin.study.fit.report import Fit

MOST_PANELS = 6
_PREFIXED = ("N", "m", "J")


def plot_fit(fit: Fit) -> Figure:
    """Return a figure of a fit: a panel for each measured quantity, its residuals below.

    Experiments of one value each are drawn over their numbers. Of more than MOST_PANELS quantities
    the first are drawn.
    """
    panels: dict[str, list[Series]] = {}
    for one in fit.series:
        panels.setdefault(one.name, []).append(one)
    shown = list(panels.items())[:MOST_PANELS]
    figure = new_figure(1.5 + 4.5 * len(shown), 5.0)
    grid = figure.subplots(
        2, len(shown), squeeze=False, sharex="col", gridspec_kw={"height_ratios": [3, 1]}
    )
    for (name, series), axis, below in zip(shown, *grid, strict=True):
        axis.set_title(name, fontsize=9)
        _draw(axis, below, series)
    left = len(panels) - len(shown)
    more = f", {left} more columns are not drawn" if left else ""
    figure.suptitle(f"Fit of {Path(fit.scenario).name}: {len(fit.parameters)} parameters{more}")
    return figure


def _draw(axis: Axes, below: Axes, series: Sequence[Series]) -> None:
    largest = max(float(np.abs(one.measured).max(initial=0.0)) for one in series)
    factor, unit = 1.0, series[0].unit
    if unit in _PREFIXED:
        factor, unit = reading_unit(largest, unit)
    numbered = all(len(one.t) == 1 for one in series)
    below.axhspan(-2.0, 2.0, color="#4c956c", alpha=0.15, linewidth=0)
    for k, one in enumerate(series):
        t = np.array([k + 1.0]) if numbered else one.t
        label = {} if k else {"fitted": "fitted", "measured": "measured"}
        style = "_" if numbered else "-"
        axis.plot(t, factor * one.fitted, style, color="#d1495b", label=label.get("fitted"))
        axis.plot(t, factor * one.measured, ".", color=INK, alpha=0.7, label=label.get("measured"))
        below.plot(t, one.residuals / one.sigma, ".", color=INK, markersize=3, alpha=0.7)
    axis.set_ylabel(f"[{unit or '1'}]")
    below.set(xlabel="experiment" if numbered else "time [s]")
    below.set_ylabel("residual\n/ sigma", fontsize=8)
    finish_axis(axis, legend=True)
    finish_axis(below)
