"""Results over each other: forces, depths and states, and beside them their differences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.plot.figure import finish_axis, label_axis, new_figure, say
from sphshell_pin.plot.over_time import thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sphshell_pin.study.compare import Curve, Difference, Measured

MOST_CURVES = 6
COLORS = ("#101418", "#d4202a", "#2f6fde", "#2a9d5c", "#f08a00", "#8a4fbf", "#0f9aa8")


def plot_compare(runs: Sequence[Measured], differences: Sequence[Difference]) -> Figure:
    """Return a Figure of `runs`: curves over time, and beside each what is off the first run.

    Drawn are the normal forces, then the curves that differ most as a share of their range, six of
    all.

    Raises MissingExtra without matplotlib.
    """
    away: dict[str, float] = {}
    for one in (one for other in differences for one in other.curves):
        share = one.of_range if np.isfinite(one.of_range) else float(one.largest > 0.0)
        away[one.name] = max(away.get(one.name, 0.0), share)
    order = sorted(away, key=lambda name: (not name.endswith(".normal_force"), -away[name]))
    names = order[:MOST_CURVES]
    figure = new_figure(12.5, 1.4 + 1.75 * max(len(names), 1))
    axes = figure.subplots(max(len(names), 1), 2, sharex=True, squeeze=False)
    if not names:
        say(axes[0, 0], "no curve of both at one time")
    off = [{one.name: one.difference for one in other.curves} for other in differences]
    for name, (over, beside) in zip(names, axes, strict=False):
        _draw(over, name, [run.curves.get(name) for run in runs], runs)
        away_of = [None, *(one.get(name) for one in off)]
        _draw(beside, f"{name}, less that of {runs[0].label}", away_of, runs)
    finish_axis(axes[0, 0], legend=bool(names))
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    labels = ", ".join(run.label for run in runs[1:])
    figure.suptitle(f"{labels} beside {runs[0].label}", fontsize=12)
    return figure


def _draw(axis: Axes, title: str, curves: Sequence[Curve | None], runs: Sequence[Measured]) -> None:
    """Draw the curve of each run, in a unit that fits the largest."""
    there = [one for one in curves if one is not None]
    largest = max(float(np.abs(one.values).max(initial=0.0)) for one in there)
    factor = label_axis(axis, "", there[0].unit, largest)
    for number, (run, curve) in enumerate(zip(runs, curves, strict=True)):
        if curve is not None:
            t, values = thinned(curve.t, curve.values * factor)
            look = {"color": COLORS[number % len(COLORS)], "linewidth": 1.2 if number else 2.2}
            axis.plot(t, values, label=run.label, **look)  # type: ignore[arg-type]
    axis.set_title(title, fontsize=10, loc="left")
    axis.margins(x=0.01)
    finish_axis(axis)
