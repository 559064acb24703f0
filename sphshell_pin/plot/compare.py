"""Results over each other: forces, depths and trajectories, and beside them their differences."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.plot.figure import count, finish_axis, label_axis, new_figure, say
from sphshell_pin.plot.over_time import thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sphshell_pin.study.compare import Comparison, Curve, CurveDifference

MOST_CURVES = 6
FIRST_COLOR = "#101418"
COLORS = ("#d4202a", "#2f6fde", "#2a9d5c", "#f08a00", "#8a4fbf", "#0f9aa8")


def plot_compare(comparison: Comparison) -> Figure:
    """Return a Figure of all runs: each curve over time, and beside it what is off the first.

    Drawn are the normal forces, then the curves that differ most as a share of their range, six of
    all.

    Raises MissingExtra without matplotlib.
    """
    names, left_out = _chosen(comparison)
    first, *others = comparison.runs
    figure = new_figure(12.5, 1.4 + 1.75 * max(len(names), 1))
    axes = figure.subplots(max(len(names), 1), 2, sharex=True, squeeze=False)
    if not names:
        say(axes[0, 0], "no contact, and nothing that moves")
    for name, (over, beside) in zip(names, axes, strict=False):
        drawn: dict[str, Curve | CurveDifference] = {
            run.label: run.curves[name] for run in comparison.runs if name in run.curves
        }
        _draw(over, _quantity(name), drawn, comparison)
        over.set_title(name, fontsize=10, loc="left")
        away = {o.label: one for o in comparison.others for one in o.curves if one.name == name}
        _draw(beside, "difference", {**away}, comparison)
        beside.set_title(f"{name}, less that of {first.label}", fontsize=10, loc="left")
    finish_axis(axes[0, 0], legend=bool(names))
    figure.align_ylabels()
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    more = f" ({count(left_out, 'curve', 'curves')} left out)" if left_out else ""
    labels = ", ".join(run.label for run in others)
    figure.suptitle(f"{labels} beside {first.label}{more}", fontsize=12)
    return figure


def _chosen(comparison: Comparison) -> tuple[list[str], int]:
    """Return the names of the curves to draw, and how many that move are left out."""
    every: dict[str, list[Curve]] = {}
    for run in comparison.runs:
        for name, curve in run.curves.items():
            every.setdefault(name, []).append(curve)
    away = {
        name: 0.0 for name, curves in every.items() if any(np.ptp(one.values) for one in curves)
    }
    for one in (one for other in comparison.others for one in other.curves if one.name in away):
        extent = float(np.ptp(np.concatenate([curve.values for curve in every[one.name]])))
        away[one.name] = max(away[one.name], one.largest / extent)
    # Forces first; of equal differences in the runs' order.
    names = sorted(away, key=lambda name: (not name.endswith(".normal_force"), -away[name]))
    return names[:MOST_CURVES], len(names[MOST_CURVES:])


def _quantity(name: str) -> str:
    kind, _, rest = name.partition(".")
    return "position" if kind == "q" else rest.rpartition(".")[2].replace("_", " ")


def _draw(
    axis: Axes, quantity: str, curves: dict[str, Curve | CurveDifference], comparison: Comparison
) -> None:
    """Draw `curves` by the label of their run, in a unit that fits the largest."""
    axis.margins(x=0.01)
    finish_axis(axis)
    if not curves:
        say(axis, "of one run alone, or at no time of both")
        return
    largest = max(float(np.abs(one.values).max(initial=0.0)) for one in curves.values())
    factor = label_axis(axis, quantity, next(iter(curves.values())).unit, largest)
    for number, run in enumerate(comparison.runs):
        if run.label in curves:
            t, values = thinned(curves[run.label].t, curves[run.label].values * factor)
            color = FIRST_COLOR if number == 0 else COLORS[(number - 1) % len(COLORS)]
            width = 1.2 if number else 2.2
            axis.plot(t, values, color=color, linewidth=width, label=run.label)
