"""Pictures of sampled runs: histogram, tornado, Sobol indices."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
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
    table: pd.DataFrame,
    figure: str,
    tornado: pd.DataFrame | None = None,
    indices: pd.DataFrame | None = None,
) -> Figure:
    """Return a matplotlib Figure of how uncertain a figure of a sampled `table` is, and why.

    It has a histogram with quantiles if the table has a sample, and what is given: `tornado` and
    `indices`, as `sphshell_pin.study.sweep.tornado` and `sobol_indices` return them. Of more than
    20 inputs those with the largest change or total index are drawn.

    Raises
    ------
    MissingExtra
        matplotlib is not installed.
    """
    panels: list[Callable[[Axes], None]] = []
    rows = table[table["design"].isin(["sample", "A", "B"])]
    if len(rows):
        panels.append(partial(_draw_histogram, values=rows[figure].to_numpy(float)))
    if tornado is not None:
        panels.append(partial(_draw_tornado, found=tornado, table=table))
    if indices is not None:
        panels.append(partial(_draw_indices, found=indices))
    canvas = new_figure(max(7.0, 5.4 * len(panels)), 5.5, figure)
    for draw, axis in zip(
        panels, canvas.subplots(1, len(panels) or 1, squeeze=False)[0], strict=False
    ):
        axis.set_xlabel(label_of(table, figure))
        draw(axis)
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


def _draw_tornado(axis: Axes, found: pd.DataFrame, table: pd.DataFrame) -> None:
    median = float(found["median"].iloc[0])
    names = [label_of(table, str(key)) for key in found.index]
    ends = {f"input at its {p} % quantile": found[kind] for kind, p in (("low", 5), ("high", 95))}
    _draw_bars(axis, names, ends, start=median)
    axis.set_title("one input at a time, others at their medians", fontsize=10)


def _draw_indices(axis: Axes, found: pd.DataFrame) -> None:
    shown = found.sort_values("total", ascending=False, kind="stable")
    kinds = {"first": "first order: alone", "total": "total: with all others"}
    errors = [
        np.maximum([shown[kind] - shown[f"{kind}_low"], shown[f"{kind}_high"] - shown[kind]], 0.0)
        for kind in kinds
    ]
    ends = {label: shown[kind] for kind, label in kinds.items()}
    _draw_bars(axis, [str(key) for key in shown.index], ends, errors=errors)
    axis.set_xlabel("share of the variance")
    axis.set_title("Sobol indices with 95 % intervals", fontsize=10)


def _draw_bars(
    axis: Axes,
    names: list[str],
    ends: dict[str, pd.Series],
    *,
    start: float = 0.0,
    errors: list[Array] | None = None,
) -> None:
    """Draw a bar of each kind for each name, from `start` to its end, from the top down."""
    most = _MOST_INPUTS
    places = np.arange(len(names[:most]))[::-1]
    for i, (label, values) in enumerate(ends.items()):
        widths = values.to_numpy(float)[:most] - start
        error = None if errors is None else errors[i][:, :most]
        at = places + 0.2 - 0.4 * i
        axis.barh(at, widths, left=start, height=0.38, xerr=error, capsize=2.5, label=label)
    axis.axvline(start, color="#444444", linewidth=1.0)
    axis.set_yticks(places, names[:most], fontsize=8)
    finish_axis(axis)
    # Bars fill the axis: the legend lies outside.
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, fontsize=8, frameon=False)
