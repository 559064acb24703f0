"""Picture of a fit: what was measured, what the fitted scenario says, and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.plot.figure import INK, finish_axis, new_figure, reading_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sphshell_pin.study.fit.report import Fit, Series

MOST_PANELS = 6
_PREFIXED = ("N", "m", "J")


def plot_fit(fit: Fit) -> Figure:
    """Return a figure of a fit: a column of panels for each measured column, residuals below.

    One column that several experiments measured has a panel for each; of more than MOST_PANELS the
    first are drawn. Experiments of one value each are drawn together, over their numbers.
    """
    panels = _panels(fit.series)
    shown = panels[:MOST_PANELS]
    across = min(len(shown), 3)
    down = -(-len(shown) // across)
    figure = new_figure(1.5 + 4.5 * across, 0.8 + 4.2 * down)
    grid = figure.subplots(
        2 * down, across, squeeze=False, gridspec_kw={"height_ratios": [3, 1] * down}
    )
    for k, panel in enumerate(shown):
        row, column = divmod(k, across)
        _draw(grid[2 * row, column], grid[2 * row + 1, column], panel)
    for k in range(len(shown), across * down):
        row, column = divmod(k, across)
        grid[2 * row, column].axis("off")
        grid[2 * row + 1, column].axis("off")
    left = len(panels) - len(shown)
    more = f", {left} more columns are not drawn" if left else ""
    figure.suptitle(f"Fit of {_file_name(fit.scenario)}: {len(fit.parameters)} parameters{more}")
    return figure


def _panels(series: Sequence[Series]) -> list[list[Series]]:
    """Return what each panel shows: a series, or all of one name that have a value each."""
    single: dict[str, list[Series]] = {}
    panels: list[list[Series]] = []
    for one in series:
        if len(one.t) > 1:
            panels.append([one])
            continue
        if one.name not in single:
            single[one.name] = []
            panels.append(single[one.name])
        single[one.name].append(one)
    return panels


def _draw(axis: Axes, below: Axes, panel: Sequence[Series]) -> None:
    first = panel[0]
    t, measured, fitted, sigma = (
        np.concatenate([getattr(one, part) for one in panel])
        for part in ("t", "measured", "fitted", "sigma")
    )
    largest = float(np.abs(measured).max(initial=0.0))
    factor, unit = 1.0, first.unit
    if unit in _PREFIXED:
        factor, unit = reading_unit(largest, unit)
    if len(panel) > 1:
        t = np.arange(1, len(t) + 1, dtype=float)
        below.set_xlabel("experiment")
        axis.plot(t, factor * fitted, "_", color="#d1495b", markersize=12, label="fitted")
        axis.set_title(first.name, fontsize=9)
    else:
        below.set_xlabel("time [s]")
        axis.plot(t, factor * fitted, color="#d1495b", linewidth=1.2, label="fitted", zorder=3)
        axis.set_title(f"{first.name}, {first.experiment}", fontsize=9)
    axis.plot(t, factor * measured, ".", color=INK, markersize=3, alpha=0.7, label="measured")
    axis.set_ylabel(f"[{unit or '1'}]")
    axis.tick_params(labelbottom=False)
    below.axhspan(-2.0, 2.0, color="#4c956c", alpha=0.15, linewidth=0)
    below.plot(t, (measured - fitted) / sigma, ".", color=INK, markersize=3, alpha=0.7)
    below.set_ylabel("residual\n/ sigma", fontsize=8)
    finish_axis(axis, legend=True)
    finish_axis(below)
    below.sharex(axis)


def _file_name(scenario: str) -> str:
    return scenario.replace("\\", "/").rpartition("/")[2]
