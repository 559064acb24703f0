"""Figures of a Result: forces and depth, the energy audit, the path of the contact on the shell.

Figures are made without pyplot: no window, no global state, any thread.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.errors import MissingExtra, ResultError
from sphshell_pin.view.path_axes import draw_paths, group_paths, reading_unit

if TYPE_CHECKING:
    from os import PathLike

    from sphshell_pin.dynamics.result import Result
    from sphshell_pin.dynamics.scene import Scene

FloatArray = NDArray[np.float64]

NORMAL_COLOR = "#d4202a"
FRICTION_COLOR = "#f08a00"
DEPTH_COLOR = "#2f6fde"
COUNT_COLOR = "#6b7280"
COUNT_SHARE = 4.0  # the number of contacts takes up a quarter of its axis
NO_CONTACT = "No contact in this run."
MOST_POINTS = 20_000
MOST_PAIRS = 8
RESOLUTION = 130  # dots per inch of the files


def plot_result(result: Result) -> Any:
    """Return one overview matplotlib Figure: force, depth, energy and its residual over time.

    Raises MissingExtra without matplotlib.
    """
    figure = _figure(11.0, 7.0)
    axes = figure.subplots(2, 2, sharex=True)
    series = [PairSeries.of(result, index) for index in range(len(result.pairs))]
    touched = [pair for pair in series if pair.touches]
    _draw_overview_forces(axes[0, 0], result, touched)
    _draw_depths(axes[1, 0], result, touched)
    _draw_energies(axes[0, 1], result)
    _draw_residual(axes[1, 1], result)
    for axis in axes[1]:
        axis.set_xlabel("time [s]")
    figure.suptitle(_headline(result), fontsize=11)
    return figure


def save_figures(
    result: Result, folder: str | PathLike[str], scene: Scene | None = None
) -> list[Path]:
    """Write force_and_depth.png, energy.png and contact_path.png into `folder`; return their paths.

    The contact path is drawn on the outline of its shell as `scene` has it (default: the scene that
    ran; a loaded result has none, then the path is drawn in the world). Raises MissingExtra without
    matplotlib, ResultError if a file cannot be written.
    """
    figures = {
        "force_and_depth.png": plot_force_and_depth(result),
        "energy.png": plot_energy(result),
        "contact_path.png": plot_contact_path(result, scene),
    }
    paths = []
    for name, figure in figures.items():
        path = Path(folder) / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            figure.savefig(path, dpi=RESOLUTION)
        except OSError as fault:
            raise ResultError(path, f"cannot be written ({fault.strerror})") from fault
        paths.append(path)
    return paths


def plot_force_and_depth(result: Result) -> Any:
    """Return a Figure of normal and friction force and of depth over time, one pair after another.

    Of more than eight pairs in touch, the eight with the largest peak force are drawn.
    """
    series = [PairSeries.of(result, index) for index in range(len(result.pairs))]
    touched = sorted((pair for pair in series if pair.touches), key=lambda pair: -pair.peak)
    shown = [pair for pair in series if pair in touched[:MOST_PAIRS]]
    if len(shown) <= 1:
        figure = _figure(9.0, 6.5)
        axes = figure.subplots(2, 1, sharex=True).reshape(1, 2)
    else:
        figure = _figure(12.0, 1.2 + 2.1 * len(shown))
        axes = figure.subplots(len(shown), 2, sharex=True, squeeze=False)
    if not shown:
        for axis, quantity in zip(axes[0], ("force", "largest depth"), strict=True):
            _say(axis, NO_CONTACT)
            axis.set_ylabel(quantity)
    largest = max((pair.peak for pair in shown), default=0.0)
    for pair, (force, depth) in zip(shown, axes, strict=False):
        _draw_forces(force, result, pair, largest)
        _draw_depths(depth, result, [pair])
        force.set_title(_pair_title(result, pair), fontsize=10, loc="left")
    for axis in axes[-1, -1:] if len(shown) <= 1 else axes[-1]:
        axis.set_xlabel("time [s]")
    left_out = len(touched) - len(shown)
    note = (
        f" ({_count(left_out, 'pair', 'pairs')} with smaller forces left out)" if left_out else ""
    )
    figure.suptitle(f"Contact force and depth{note}", fontsize=12)
    return figure


def plot_energy(result: Result) -> Any:
    """Return a Figure of the energy audit and of its residual over time."""
    figure = _figure(9.0, 6.5)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    _draw_energies(upper, result)
    _draw_residual(lower, result)
    lower.set_xlabel("time [s]")
    figure.suptitle("Energy audit", fontsize=12)
    return figure


def plot_contact_path(result: Result, scene: Scene | None = None) -> Any:
    """Return a Figure of the contact points' path coloured by normal force.

    There is one picture per shell of `scene` (default: the scene that ran), in the shell's frame
    and on its outline, seen along the shell's axis nearest to the contact normals. A loaded result
    has no scene: without one, the picture is one of the world.
    """
    groups = group_paths(result, result.scene if scene is None else scene)
    if not groups:
        figure = _figure(9.0, 5.0)
        _say(figure.subplots(), NO_CONTACT)
        figure.suptitle("Path of the contact", fontsize=12)
        return figure
    columns = min(len(groups), 2)
    rows = -(-len(groups) // columns)
    figure = _figure(3.0 + 5.0 * columns, 0.8 + 5.5 * rows, "compressed")
    axes = figure.subplots(rows, columns, squeeze=False).reshape(-1)
    forces = np.concatenate([path.force for group in groups for path in group.paths])
    low, high = _color_limits(forces)
    factor, unit = reading_unit(high, "N")
    limits = (low * factor, high * factor)
    names = [str(name) for name in result.pairs]
    lines = None
    for axis, group in zip(axes, groups, strict=False):
        lines = draw_paths(axis, group, names, factor, limits)
    for axis in axes[len(groups) :]:
        axis.set_axis_off()
    extend = "max" if forces.max() > high else "neither"
    label = f"normal force [{unit}]"
    figure.colorbar(lines, ax=axes.tolist(), label=label, shrink=0.8, extend=extend)
    figure.suptitle("Path of the contact", fontsize=12)
    return figure


def _color_limits(forces: FloatArray) -> tuple[float, float]:
    """Return the range of `forces` (k,) [N] that gets the colours.

    It ends below an impact far above the rest, and starts at zero unless that would leave only a
    few colours to tell forces apart.
    """
    high, low = float(forces.max()), float(forces.min())
    usual = float(np.percentile(forces, 98.0, method="lower"))
    if high > 1.5 * usual > 0.0:
        high = usual
    return (low if 0.5 * high < low < high else 0.0), high or 1.0


@dataclass(frozen=True)
class PairSeries:
    """Forces [N] and depth [m] of one pair at every recorded row, zero where nothing touches.

    Where a row has several contacts (`count`), the forces are their sums, the depth the largest:
    neighbours that take over a share of the load let the depth dip while the force stays.
    """

    name: str
    normal: FloatArray
    friction: FloatArray
    depth: FloatArray
    count: FloatArray

    @property
    def touches(self) -> bool:
        """Whether the pair is ever in contact."""
        return bool(np.any(self.depth > 0.0) or np.any(self.normal > 0.0))

    @property
    def peak(self) -> float:
        """Largest normal force [N]."""
        return float(self.normal.max(initial=0.0))

    @classmethod
    def of(cls, result: Result, pair: int) -> PairSeries:
        """Join the contacts of pair number `pair`: normal forces add, friction as vectors."""
        log, rows = result.contacts, len(result.t)
        own = np.asarray(log.pair) == pair
        row = np.asarray(log.row, dtype=np.int64)[own]
        normal = np.zeros(rows)
        np.add.at(normal, row, np.asarray(log.normal_force, dtype=float)[own])
        friction = np.zeros((rows, 3))
        np.add.at(friction, row, np.asarray(log.friction_force_world, dtype=float)[own])
        depth = np.zeros(rows)
        np.maximum.at(depth, row, np.asarray(log.depth, dtype=float)[own])
        count = np.bincount(row, minlength=rows).astype(np.float64)
        size = np.linalg.norm(friction, axis=1)
        return cls(str(result.pairs[pair]), normal, size, depth, count)


def _figure(
    width: float, height: float, layout: Literal["constrained", "compressed"] = "constrained"
) -> Any:
    try:
        from matplotlib.figure import Figure
    except ImportError as missing:
        raise MissingExtra("matplotlib", "view", "a figure") from missing
    return Figure(figsize=(width, height), layout=layout)


def _say(axis: Any, sentence: str) -> None:
    axis.text(
        0.5, 0.5, sentence, transform=axis.transAxes, ha="center", va="center", color="#555555"
    )
    axis.set_yticks([])


def _thinned(t: FloatArray, *columns: FloatArray) -> tuple[FloatArray, ...]:
    """Thin long series without losing a peak: keep each bin's extremes of every column."""
    if len(t) <= MOST_POINTS:
        return (t, *columns)
    edges = np.linspace(0, len(t), MOST_POINTS // (2 * len(columns)) + 1).astype(int)
    kept = {0, len(t) - 1}
    for start, end in pairwise(edges):
        for column in columns:
            kept.add(start + int(np.argmin(column[start:end])))
            kept.add(start + int(np.argmax(column[start:end])))
    rows = np.array(sorted(kept))
    return (t[rows], *(column[rows] for column in columns))


def _line(axis: Any, t: FloatArray, values: FloatArray, **look: Any) -> None:
    axis.plot(*_thinned(t, values), **look)


def _finish(axis: Any, legend: bool = True) -> None:
    axis.grid(True, alpha=0.3, linewidth=0.6)
    axis.margins(x=0.01)
    if legend:
        axis.legend(loc="best", fontsize=8, framealpha=0.85)


def _headline(result: Result) -> str:
    stats = result.stats
    parts = [f"{float(result.t[-1] - result.t[0]):g} s simulated"] if len(result.t) else []
    if "dt" in stats and "integrator" in stats:
        parts.append(f"{stats['integrator']}, dt = {float(stats['dt']):g} s")
    if "steps" in stats:
        parts.append(f"{int(stats['steps'])} steps")
    return ", ".join(parts)


def _pair_title(result: Result, pair: PairSeries) -> str:
    stats = result.stats.get("pairs", {}).get(pair.name)
    if not stats:
        return pair.name
    touches = _count(int(stats["touches"]), "touch", "touches")
    return (
        f"{pair.name}: {float(stats['contact_time']):.3g} s in contact, {touches}, "
        f"peak {float(stats['peak_force']):.4g} N, mean {float(stats['mean_force']):.4g} N"
    )


def _count(number: int, one: str, many: str) -> str:
    return f"{number} {one if number == 1 else many}"


def _draw_forces(axis: Any, result: Result, pair: PairSeries, largest: float) -> None:
    factor, unit = reading_unit(largest, "N")
    t = np.asarray(result.t)
    _line(axis, t, pair.normal * factor, color=NORMAL_COLOR, linewidth=1.2, label="normal")
    if np.any(pair.friction > 0.0):
        _line(
            axis, t, pair.friction * factor, color=FRICTION_COLOR, linewidth=1.2, label="friction"
        )
    axis.set_ylabel(f"force [{unit}]")
    _finish(axis)


def _draw_overview_forces(axis: Any, result: Result, touched: list[PairSeries]) -> None:
    if len(touched) == 1:
        _draw_forces(axis, result, touched[0], touched[0].peak)
        axis.set_title(f"force of {touched[0].name}", fontsize=10)
        return
    curves = {pair.name: pair.normal for pair in touched}
    _draw_curves(axis, result, curves, "normal force", "N", NORMAL_COLOR)


def _draw_depths(axis: Any, result: Result, touched: list[PairSeries]) -> None:
    curves = {pair.name: pair.depth for pair in touched}
    _draw_curves(axis, result, curves, "largest depth", "m", DEPTH_COLOR)
    if touched:
        axis.set_ylim(bottom=0.0)
    if len(touched) == 1 and touched[0].count.max() > 1.0:
        _draw_count(axis, result, touched[0])


def _draw_curves(
    axis: Any,
    result: Result,
    curves: dict[str, FloatArray],
    quantity: str,
    symbol: str,
    color: str,
) -> None:
    """Draw a quantity of every pair, by name; that of a single pair in `color`."""
    if not curves:
        _say(axis, NO_CONTACT)
        axis.set_ylabel(quantity)
        return
    factor, unit = reading_unit(max(float(values.max()) for values in curves.values()), symbol)
    for name, values in curves.items():
        look = {"color": color} if len(curves) == 1 else {"label": name}
        _line(axis, np.asarray(result.t), values * factor, linewidth=1.1, **look)
    axis.set_ylabel(f"{quantity} [{unit}]")
    _finish(axis, legend=len(curves) > 1)


def _draw_count(axis: Any, result: Result, pair: PairSeries) -> None:
    """Draw, at the foot of `axis`, how many contacts share the load."""
    beside = axis.twinx()
    t, count = _thinned(np.asarray(result.t), pair.count)
    beside.fill_between(t, count, step="mid", color=COUNT_COLOR, alpha=0.15, linewidth=0.0)
    # A line of its own: an area as narrow as a row would not be seen.
    beside.step(t, count, where="mid", color=COUNT_COLOR, linewidth=0.7)
    beside.margins(x=0.01)
    most = int(pair.count.max())
    beside.set_ylim(0.0, COUNT_SHARE * most)
    beside.set_yticks(range(0, most + 1, -(-most // 4)))
    beside.tick_params(colors=COUNT_COLOR, labelsize=8)
    beside.set_ylabel("contacts at once", color=COUNT_COLOR, loc="bottom", fontsize=9)
    # The depth is drawn on top.
    axis.set_zorder(beside.get_zorder() + 1)
    axis.patch.set_visible(False)


def _draw_energies(axis: Any, result: Result) -> None:
    energy = result.energy
    potential = np.asarray(energy.potential, dtype=float)
    curves = {
        "kinetic": (np.asarray(energy.kinetic), "-"),
        # Only differences of potential energy mean anything.
        "potential (change)": (potential - potential[:1], "-"),
        "elastic": (np.asarray(energy.elastic), "-"),
        "lost to damping": (np.asarray(energy.damping_loss), "--"),
        "lost to friction": (np.asarray(energy.friction_loss), "--"),
        "work of the controller": (np.asarray(energy.control_work), ":"),
    }
    largest = max(float(np.abs(values).max(initial=0.0)) for values, _ in curves.values())
    factor, unit = reading_unit(largest, "J")
    for label, (values, style) in curves.items():
        if np.any(values != 0.0):
            _line(
                axis,
                np.asarray(result.t),
                values * factor,
                linestyle=style,
                linewidth=1.2,
                label=label,
            )
    axis.set_ylabel(f"energy [{unit}]")
    _finish(axis, legend=bool(axis.get_legend_handles_labels()[0]))


def _draw_residual(axis: Any, result: Result) -> None:
    residual = np.asarray(result.energy.residual, dtype=float)
    factor, unit = reading_unit(float(np.abs(residual).max(initial=0.0)), "J")
    _line(axis, np.asarray(result.t), residual * factor, color="#444444", linewidth=1.0)
    axis.set_ylabel(f"residual [{unit}]")
    exchanged = float(result.energy.exchanged)
    if exchanged > 0.0 and len(residual):
        share = float(np.abs(residual).max()) / exchanged
        axis.set_title(
            f"largest residual {share:.2g} of the {exchanged:.3g} J exchanged", fontsize=9
        )
    _finish(axis, legend=False)
