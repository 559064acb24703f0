"""Pictures of sampled runs: histogram, Sobol indices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.plot.figure import count, finish_axis, new_figure, say
from sphshell_pin.plot.sweep import label_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_BINS = 60
_MOST_INPUTS = 20


def plot_uncertainty(
    table: pd.DataFrame, figure: str, indices: pd.DataFrame | None = None
) -> Figure:
    """Return a matplotlib Figure of how uncertain a figure of a sampled `table` is, and why.

    It has a histogram with quantiles and, if given, `indices`, as
    `sphshell_pin.study.sweep.sobol_indices` returns them. Of more than 20 inputs those with the
    largest total index are drawn.

    Raises
    ------
    MissingExtra
        matplotlib is not installed.
    """
    count = 1 if indices is None else 2
    canvas = new_figure(max(7.0, 5.4 * count), 5.5, figure)
    first, *others = canvas.subplots(1, count, squeeze=False)[0]
    first.set_xlabel(label_of(table, figure))
    rows = table[table["design"].isin(["sample", "A", "B"])]
    _draw_histogram(first, rows[figure].to_numpy(float))
    if indices is not None:
        _draw_indices(others[0], indices)
    return canvas


def _draw_histogram(axis: Axes, values: Array) -> None:
    known = values[np.isfinite(values)]
    axis.set_ylabel("runs")
    gaps = len(values) - len(known)
    title = count(len(known), "run", "runs")
    axis.set_title(f"{title} ({gaps} without this figure left out)" if gaps else title, fontsize=10)
    if not len(known):
        say(axis, "No run has this figure.")
        return
    edges = np.histogram_bin_edges(known, "auto")
    bins = edges.tolist() if len(edges) <= _MOST_BINS else _MOST_BINS
    axis.hist(known, bins=bins, color="#9db8e8", edgecolor="white", linewidth=0.5)
    for percent, style in {5: ":", 50: "-", 95: ":"}.items():
        at = float(np.percentile(known, percent))
        axis.axvline(at, color="C0", linestyle=style, label=f"{percent} %: {at:.4g}")
    finish_axis(axis, legend=True)


def _draw_indices(axis: Axes, found: pd.DataFrame) -> None:
    """Draw a bar of each kind for each input, the largest total at the top."""
    shown = found.sort_values("total", ascending=False, kind="stable")[:_MOST_INPUTS]
    places = np.arange(len(shown))[::-1]
    kinds = {"first": "first order: alone", "total": "total: with all others"}
    for i, (kind, label) in enumerate(kinds.items()):
        ends = [shown[kind] - shown[f"{kind}_low"], shown[f"{kind}_high"] - shown[kind]]
        at, error = places + 0.2 - 0.4 * i, np.maximum(ends, 0.0)
        axis.barh(at, shown[kind], height=0.38, xerr=error, capsize=2.5, label=label)
    axis.set_yticks(places, [str(key) for key in shown.index], fontsize=8)
    axis.set_xlabel("share of the variance")
    axis.set_title("Sobol indices with 95 % intervals", fontsize=10)
    finish_axis(axis)
    # Bars fill the axis: the legend lies outside.
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, fontsize=8, frameon=False)
