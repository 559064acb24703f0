"""Pictures of sampled runs: histogram, tornado, Sobol indices."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.tables import column
from sphshell_pin.plot.figure import count, finish_axis, new_figure, say
from sphshell_pin.plot.sweep import figure_label, units_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


LOW_COLOR, HIGH_COLOR = "#2f6fde", "#d4202a"
_MOST_BINS = 60
_MOST_INPUTS = 20


def plot_uncertainty(
    figure: str,
    values: Array | None = None,
    tornado: pd.DataFrame | None = None,
    indices: pd.DataFrame | None = None,
    units: Mapping[str, str] | None = None,
) -> Figure:
    """Return a matplotlib Figure of how uncertain a figure of a run is, and why.

    Parameters
    ----------
    figure : its name.
    values : (n,) of a sample [SI units], for a histogram with quantiles; NaN where a run failed.
    tornado : the figure with each input at its quantiles; see
        `sphshell_pin.study.sweep.tornado`.
    indices : as `sphshell_pin.study.sweep.sobol_indices` returns them.
    units : by name, of the figure and the inputs: attrs["units"] of the sweep's table; by default
        those that `tornado` has kept.

    Of more than 20 inputs those with the largest change or total index are drawn.

    Raises
    ------
    MissingExtra
        matplotlib is not installed.
    """
    parts = [one is not None for one in (values, tornado, indices)]
    inputs = max((len(one) for one in (tornado, indices) if one is not None), default=0)
    height = max(4.2, 1.6 + 0.42 * min(inputs, _MOST_INPUTS))
    canvas = new_figure(max(7.0, 5.4 * sum(parts)), height, figure)
    if units is None:
        units = {} if tornado is None else units_of(tornado)
    axes = iter(canvas.subplots(1, max(sum(parts), 1), squeeze=False)[0])
    if values is not None:
        _draw_histogram(next(axes), np.asarray(values, dtype=float), figure, units)
    if tornado is not None:
        _draw_tornado(next(axes), tornado, figure, units)
    if indices is not None:
        _draw_indices(next(axes), indices)
    return canvas


def _draw_histogram(axis: Axes, values: Array, figure: str, units: Mapping[str, str]) -> None:
    known = values[np.isfinite(values)]
    axis.set(xlabel=figure_label(figure, units), ylabel="runs")
    gaps = len(values) - len(known)
    title = count(len(known), "run", "runs")
    axis.set_title(f"{title} ({gaps} without this figure left out)" if gaps else title, fontsize=10)
    if not len(known):
        say(axis, "No run has this figure.")
        return
    axis.hist(known, bins=_bins(known), color="#9db8e8", edgecolor="white", linewidth=0.5)
    for percent, style in {5: ":", 50: "-", 95: ":"}.items():
        at = float(np.percentile(known, percent))
        label = f"{'median' if percent == 50 else f'{percent} %'}: {at:.4g}"
        axis.axvline(at, color=LOW_COLOR, linestyle=style, linewidth=1.4, label=label)
    finish_axis(axis, legend=True)


def _bins(values: Array) -> list[float] | int:
    """Return the edges of bins: one for each of a few whole numbers, else evenly spaced."""
    low, high = float(values.min()), float(values.max())
    if np.all(values == np.round(values)) and high - low < _MOST_BINS:
        return [float(one) for one in np.arange(low - 0.5, high + 1.0)]
    edges = [float(one) for one in np.histogram_bin_edges(values, "auto")]
    return edges if len(edges) <= _MOST_BINS + 1 else _MOST_BINS


def _draw_tornado(axis: Axes, tornado: pd.DataFrame, figure: str, units: Mapping[str, str]) -> None:
    shown = tornado.iloc[:_MOST_INPUTS]
    median = float(shown["median"].iloc[0])
    places = np.arange(len(shown))[::-1]
    # Each half as high as its row: both may lie on one side of the median.
    for kind, percent, color, shift in (("low", 5, LOW_COLOR, 0.2), ("high", 95, HIGH_COLOR, -0.2)):
        ends = shown[kind].to_numpy(float)
        axis.barh(
            places + shift,
            ends - median,
            left=median,
            height=0.38,
            color=color,
            label=f"input at its {percent} % quantile",
        )
        inputs = shown[f"{kind}_value"].to_numpy(float)
        for place, end, value in zip(places, ends, inputs, strict=True):
            right = end >= median
            axis.annotate(
                f"{value:.3g}",
                (end, place + shift),
                xytext=(3 if right else -3, 0),
                textcoords="offset points",
                ha="left" if right else "right",
                va="center",
                fontsize=7,
            )
    axis.margins(x=0.15)
    axis.set_xlabel(figure_label(figure, units))
    names = [column(str(key), units.get(key, "")) for key in shown.index]
    title = "one input at a time, others at their medians"
    _finish_bars(axis, median, names, title, len(tornado))


def _draw_indices(axis: Axes, indices: pd.DataFrame) -> None:
    shown = indices.sort_values("total", ascending=False, kind="stable").iloc[:_MOST_INPUTS]
    places = np.arange(len(shown))[::-1]
    for kind, label, color, shift in (
        ("first", "first order: alone", "#f08a00", 0.2),
        ("total", "total: with all others", "#6b7280", -0.2),
    ):
        values = shown[kind].to_numpy(float)
        ends = [values - shown[f"{kind}_low"], shown[f"{kind}_high"] - values]
        axis.barh(
            places + shift,
            values,
            height=0.38,
            color=color,
            label=label,
            xerr=np.maximum(np.array(ends, dtype=float), 0.0),
            error_kw={"elinewidth": 1.0, "capsize": 2.5, "ecolor": "#101418"},
        )
    axis.set_xlabel("share of the variance")
    title = "Sobol indices with 95 % intervals"
    _finish_bars(axis, 0.0, [str(key) for key in shown.index], title, len(indices))


def _finish_bars(axis: Axes, start: float, names: list[str], title: str, inputs: int) -> None:
    """Name the bars from `start` on, from the top down, and say of how many `inputs` they are."""
    axis.axvline(start, color="#444444", linewidth=1.0)
    axis.set_yticks(np.arange(len(names))[::-1], names, fontsize=8)
    of = f" ({_MOST_INPUTS} of {inputs})" if inputs > _MOST_INPUTS else ""
    axis.set_title(title + of, fontsize=10)
    finish_axis(axis)
    # Bars fill the axis: the legend lies outside.
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, fontsize=8, frameon=False)
