"""Figures of the readings of sensors over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sphshell_pin.plot.figure import finish_axis, new_figure, say
from sphshell_pin.plot.series import thinned

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sphshell_pin.dynamics.result.result import Result

NO_SENSORS = "no sensors"


def plot_sensors(result: Result) -> Figure:
    """Return a Figure of the readings over the time of their arrival, one sensor below the other.

    Forces and torques have an axis each. Raises MissingExtra without matplotlib.
    """
    parts = [
        (name, unit)
        for name, log in result.sensors.items()
        for unit in dict.fromkeys(column.partition(" ")[2] for column in log.columns)
    ]
    figure = new_figure(10.0, 1.2 + 2.2 * max(len(parts), 1), "Sensors")
    axes = figure.subplots(max(len(parts), 1), 1, sharex=True, squeeze=False)[:, 0]
    axes[-1].set_xlabel("time [s]")
    if not parts:
        say(axes[0], NO_SENSORS)
    for (name, unit), axis in zip(parts, axes, strict=False):
        log = result.sensors[name]
        for column, values in zip(log.columns, log.values.T, strict=True):
            label, _, of = column.partition(" ")
            if of == unit:
                axis.plot(*thinned(log.t, values), label=label, drawstyle="steps-post", lw=1.0)
        axis.set_title(name, fontsize=10, loc="left")
        axis.set_ylabel(unit or "1: closed")
        finish_axis(axis, legend=len(log.columns) > 1)
    return figure
