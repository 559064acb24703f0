"""Figures over time: forces and depth, the energy audit, an overview of both."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.result.result_parts import PairSeries
from sphshell_pin.plot.figure import NO_CONTACT, count, finish_axis, label_axis, new_figure, say
from sphshell_pin.view.curves import extremes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sphshell_pin.dynamics.result.result import Result

MOST_POINTS = 20_000


def thinned(t: Array, *columns: Array) -> tuple[Array, ...]:
    """Thin long series without losing a peak: keep each bin's extremes of every column."""
    rows = extremes(MOST_POINTS // (2 * len(columns)), *columns)
    return (t[rows], *(column[rows] for column in columns))


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


FORCE_COLORS = {"normal": "#d4202a", "friction": "#f08a00"}
DEPTH_COLOR = "#2f6fde"
MOST_PAIRS = 8
CONTROLLED = ("Adaptive", "Implicit")  # integrators that choose their steps


def plot_overview(result: Result) -> Figure:
    """Return one Figure of force, depth, energy and its residual over time.

    Raises MissingExtra without matplotlib.
    """
    figure = new_figure(12.5, 7.0)
    axes = figure.subplots(2, 2, sharex=True)
    every = [pair for pair in _series(result) if pair.touches]
    touched = _largest(every)
    if len(touched) == 1:
        _draw_forces(axes[0, 0], result, touched[0], touched[0].peak)
        axes[0, 0].set_title(f"force of {touched[0].name}", fontsize=10)
    else:
        normal = {pair.name: pair.normal for pair in touched}
        _draw_curves(axes[0, 0], result, normal, "normal force", "N")
    _draw_depths(axes[1, 0], result, touched)
    _draw_energies(axes[0, 1], result)
    _draw_residual(axes[1, 1], result)
    for axis in axes[1]:
        axis.set_xlabel("time [s]")
    figure.suptitle(f"{_headline(result)}{_left_out(every, touched)}", fontsize=11)
    return figure


def plot_force_and_depth(result: Result) -> Figure:
    """Return a Figure of normal and friction force and of depth over time, one pair after another.

    Of more than eight pairs in touch, the eight with the largest peak force are drawn.
    """
    touched = [pair for pair in _series(result) if pair.touches]
    shown = _largest(touched)
    title = f"Contact force and depth{_left_out(touched, shown)}"
    if len(shown) <= 1:
        figure = new_figure(9.0, 6.5, title)
        axes = figure.subplots(2, 1, sharex=True).reshape(1, 2)
    else:
        figure = new_figure(12.0, 1.2 + 2.1 * len(shown), title)
        axes = figure.subplots(len(shown), 2, sharex=True, squeeze=False)
    for axis in axes[-1] if len(shown) > 1 else axes[-1, 1:]:
        axis.set_xlabel("time [s]")
    if not shown:
        for axis, quantity in zip(axes[0], ("force", "largest depth"), strict=True):
            say(axis, NO_CONTACT)
            axis.set_ylabel(quantity)
    for pair, (force, depth) in zip(shown, axes, strict=False):
        _draw_forces(force, result, pair, max(one.peak for one in shown))
        _draw_depths(depth, result, [pair])
        force.set_title(_pair_title(result, pair), fontsize=10, loc="left")
    return figure


def plot_energy(result: Result) -> Figure:
    """Return a Figure of the energy audit and of its residual over time."""
    figure = new_figure(10.0, 6.5, "Energy audit")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    _draw_energies(upper, result)
    _draw_residual(lower, result)
    lower.set_xlabel("time [s]")
    return figure


def _largest(touched: list[PairSeries]) -> list[PairSeries]:
    """Return the pairs with the largest peak force, MOST_PAIRS at most, in their order."""
    largest = sorted(touched, key=lambda pair: -pair.peak)[:MOST_PAIRS]
    return [pair for pair in touched if any(pair is one for one in largest)]


def _left_out(touched: list[PairSeries], shown: list[PairSeries]) -> str:
    left_out = len(touched) - len(shown)
    return f" ({count(left_out, 'pair', 'pairs')} with smaller forces left out)" if left_out else ""


def _series(result: Result) -> list[PairSeries]:
    return [PairSeries.of(result, index) for index in range(len(result.pairs))]


def _headline(result: Result) -> str:
    stats = result.stats
    parts = [f"{float(result.t[-1] - result.t[0]):g} s simulated"] if len(result.t) else []
    if stats.integrator:
        step = "mean dt" if stats.integrator in CONTROLLED else "dt"
        parts.append(f"{stats.integrator}, {step} = {stats.dt:.3g} s")
        parts.append(f"{stats.steps} steps")
    return ", ".join(parts)


def _pair_title(result: Result, pair: PairSeries) -> str:
    figures = result.stats.pairs.get(pair.name)
    if figures is None:
        return pair.name
    touches = count(figures.touches, "touch", "touches")
    peak = figures.peak_force
    # An impact may pass between two rows.
    unseen = " (between the recorded rows)" if peak > 1.2 * pair.peak else ""
    return (
        f"{pair.name}: {figures.contact_time:.3g} s in contact, {touches}, "
        f"peak {peak:.4g} N{unseen}, mean {figures.mean_force:.4g} N"
    )


def _plot(axis: Axes, result: Result, values: Array, **look: Any) -> None:
    """Draw `values` (n,), in the unit of the axis, over the time of `result`."""
    axis.plot(*thinned(np.asarray(result.t), values), linewidth=1.2, **look)
    axis.margins(x=0.01)


def _draw_forces(axis: Axes, result: Result, pair: PairSeries, largest: float) -> None:
    """Draw normal and friction force of `pair`, in the unit for forces up to `largest` [N]."""
    curves = {"normal": pair.normal}
    if np.any(pair.friction > 0.0):
        curves["friction"] = pair.friction
    factor = label_axis(axis, "force", "N", largest)
    for name, values in curves.items():
        _plot(axis, result, values * factor, label=name, color=FORCE_COLORS[name])
    finish_axis(axis, legend=True)


def _draw_depths(axis: Axes, result: Result, touched: list[PairSeries]) -> None:
    curves = {pair.name: pair.depth for pair in touched}
    _draw_curves(axis, result, curves, "largest depth", "m", DEPTH_COLOR)
    if touched:
        axis.set_ylim(bottom=0.0)


def _draw_curves(
    axis: Axes,
    result: Result,
    curves: dict[str, Array],
    quantity: str,
    base: str,
    color: str | None = None,
) -> None:
    """Draw a quantity [base] of every pair, by name; that of a single pair in `color`."""
    if not curves:
        say(axis, NO_CONTACT)
        axis.set_ylabel(quantity)
        return
    factor = label_axis(axis, quantity, base, max(float(one.max()) for one in curves.values()))
    alone = len(curves) == 1
    for name, values in curves.items():
        _plot(axis, result, values * factor, label=name, color=color if alone else None)
    finish_axis(axis, legend=not alone)


def _draw_energies(axis: Axes, result: Result) -> None:
    curves = _energy_curves(result)
    largest = max(float(np.abs(values).max(initial=0.0)) for values, _ in curves.values())
    factor = label_axis(axis, "energy", "J", largest)
    for label, (values, style) in curves.items():
        if np.any(values != 0.0):
            _plot(axis, result, values * factor, label=label, linestyle=style)
    finish_axis(axis)
    if axis.get_legend_handles_labels()[0]:
        # Beside the curves: these fill their axes, and cross wherever a legend might lie.
        axis.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=8, borderaxespad=0.0)


def _energy_curves(result: Result) -> dict[str, tuple[Array, str]]:
    """Return the parts of the energy (n,) [J] and their line styles, by label."""
    energy = result.energy
    kinetic = np.asarray(energy.kinetic, dtype=float)
    potential = np.asarray(energy.potential, dtype=float)
    rest = {
        # Only differences of potential energy mean anything.
        "potential (change)": (potential - potential[:1], "-"),
        "elastic": (np.asarray(energy.elastic), "-"),
        "lost to damping": (np.asarray(energy.damping_loss), "--"),
        "lost to friction": (np.asarray(energy.friction_loss), "--"),
        "work of the controller": (np.asarray(energy.control_work), ":"),
    }
    moved = max(float(np.abs(values).max(initial=0.0)) for values, _ in rest.values())
    moved = max(moved, float(np.ptp(kinetic)) if len(kinetic) else 0.0)
    # A body that keeps turning would press all other curves flat.
    if len(kinetic) and kinetic.min() > 3.0 * moved > 0.0:
        return {"kinetic (change)": (kinetic - kinetic[0], "-"), **rest}
    return {"kinetic": (kinetic, "-"), **rest}


def _draw_residual(axis: Axes, result: Result) -> None:
    residual = np.asarray(result.energy.residual, dtype=float)
    largest = float(np.abs(residual).max(initial=0.0))
    factor = label_axis(axis, "residual", "J", largest)
    _plot(axis, result, residual * factor, color="#444444")
    exchanged = float(result.energy.exchanged)
    if exchanged > 0.0 and len(residual):
        share = largest / exchanged
        axis.set_title(
            f"largest residual {share:.2g} of the {exchanged:.3g} J exchanged", fontsize=9
        )
    finish_axis(axis)
