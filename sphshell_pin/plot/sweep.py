"""Pictures of a sweep: curves over one varied number, heat maps over two."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.tables import column
from sphshell_pin.errors import InvalidParameter, NameNotFound
from sphshell_pin.plot.figure import finish_axis, new_figure, say
from sphshell_pin.scenario.running.figures import PAIR_UNITS, RUN_FIGURES

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MOST_PANELS = 6
MOST_CURVES = 12
# Values that grow by one factor, to this accuracy, get a logarithmic axis.
_EVEN = 1e-3


def plot_sweep(table: pd.DataFrame, figure: str) -> Figure:
    """Return a matplotlib Figure of one column of a sweep's `table` over what was varied.

    One varied number gives curves, two give a heat map; of varied words (or truths, or lists) each
    combination gets a curve or a panel of its own. Failed runs are gaps in a curve, grey in a map.
    Rows may be left out of the table before; a key that then has one value counts as not varied.

    Raises
    ------
    NameNotFound
        The table has no such figure.
    InvalidParameter
        Too many keys vary for one picture.
    MissingExtra
        matplotlib is not installed.
    """
    names = [str(name) for name in table.columns]
    keys = names[1 : names.index("status")]
    known = [name for name in names[names.index("error") + 1 :] if name != "settings"]
    if figure not in known:
        raise NameNotFound("figure", figure, "the table", known, see="its columns")
    numbers, words = drawable_keys(table[keys])
    groups = _groups(table, words)
    canvas = new_figure(7.5, 5.0, figure if len(numbers) == 2 else "")
    if len(numbers) == 2:
        _draw_maps(canvas, groups, numbers, figure)
    elif numbers:
        _draw_curves(canvas.subplots(), groups, numbers[0], figure)
    else:
        _draw_bars(canvas.subplots(), groups, figure)
    return canvas


def drawable_keys(varied: pd.DataFrame) -> tuple[list[str], list[str]]:
    """Return which of the `varied` columns are numbers, at most two, and which are not.

    Numbers that were varied together do not span a map: the first of them stands for all.

    Raises InvalidParameter where they are too many for one picture.
    """
    keys = [str(key) for key in varied.columns if varied[key].nunique() > 1]
    numbers = [key for key in keys if varied[key].dtype.kind in "if"]
    words = [key for key in keys if key not in numbers]
    if len(numbers) > 1:
        spanned = int(np.prod([varied[key].nunique() for key in numbers]))
        if len(varied[numbers].drop_duplicates()) < spanned:
            numbers = numbers[:1]
    panels = len(varied[words].drop_duplicates()) if words else 1
    if len(numbers) > 2:
        raise InvalidParameter(
            "vary", ", ".join(numbers), "are too many numbers for one picture: select rows first"
        )
    most = MOST_PANELS if len(numbers) == 2 else MOST_CURVES
    if panels > most:
        raise InvalidParameter(
            "vary", ", ".join(words), f"have more than {most} combinations: select rows first"
        )
    return numbers, words


def _groups(table: pd.DataFrame, words: list[str]) -> list[tuple[str, pd.DataFrame]]:
    """Return the rows of each combination of `words`, in the table's order, and what to call it."""
    if not words:
        return [("", table)]
    found = []
    for values, rows in table.groupby(words, sort=False):
        parts = [
            f"{key.rpartition('.')[2]} = {one}" for key, one in zip(words, values, strict=True)
        ]
        found.append((", ".join(parts), rows))
    return found


def _draw_curves(axis: Axes, groups: list[tuple[str, pd.DataFrame]], key: str, figure: str) -> None:
    for name, rows in groups:
        ordered = rows.sort_values(key)
        axis.plot(ordered[key], ordered[figure], "o-", markersize=4, label=name or None)
    every = np.unique(np.concatenate([rows[key].to_numpy(float) for _, rows in groups]))
    units = units_of(groups[0][1])
    axis.set(xlabel=column(key, units.get(key, "")))
    axis.set(ylabel=figure_label(figure, units), title=figure)
    if _grows_by_a_factor(every):
        axis.set_xscale("log")
    if not any(np.isfinite(rows[figure]).any() for _, rows in groups):
        say(axis, "No run has this figure.")
    finish_axis(axis, legend=len(groups) > 1)


def _draw_bars(axis: Axes, groups: list[tuple[str, pd.DataFrame]], figure: str) -> None:
    heights = [float(rows[figure].iloc[0]) for _, rows in groups]
    axis.bar([name or "run 0" for name, _ in groups], heights)
    axis.set(ylabel=figure_label(figure, units_of(groups[0][1])), title=figure)
    axis.tick_params(axis="x", labelrotation=30 if len(groups) > 3 else 0)


def _draw_maps(
    canvas: Figure, groups: list[tuple[str, pd.DataFrame]], keys: list[str], figure: str
) -> None:
    across = min(len(groups), 3)
    rows = -(-len(groups) // across)
    if len(groups) > 1:
        canvas.set_size_inches(2.0 + 4.5 * across, 1.0 + 4.0 * rows)
    axes = canvas.subplots(rows, across, squeeze=False).reshape(-1)
    y_key, x_key = keys
    units = units_of(groups[0][1])

    def label(key: str) -> str:
        return column(key, units.get(key, ""))

    drawn = np.concatenate([part[figure].to_numpy(float) for _, part in groups])
    finite = drawn[np.isfinite(drawn)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    for axis, (name, part) in zip(axes, groups, strict=False):
        grid = part.pivot(index=y_key, columns=x_key, values=figure)
        x, y = grid.columns.to_numpy(float), grid.index.to_numpy(float)
        mesh = axis.pcolormesh(
            _borders(x),
            _borders(y),
            np.ma.masked_invalid(grid.to_numpy(float)),
            vmin=low,
            vmax=high,
        )
        axis.set_facecolor("0.8")
        axis.set(xlabel=label(x_key), ylabel=label(y_key), title=name)
        if _grows_by_a_factor(x):
            axis.set_xscale("log")
        if _grows_by_a_factor(y):
            axis.set_yscale("log")
    for axis in axes[len(groups) :]:
        axis.set_axis_off()
    canvas.colorbar(mesh, ax=list(axes), label=figure_label(figure, units))


def _borders(values: Array) -> Array:
    """Return the borders (n + 1,) of cells around sorted `values` (n,)."""
    if _grows_by_a_factor(values):
        return np.asarray(np.exp(_borders_between(np.log(values))))
    return _borders_between(values)


def _borders_between(values: Array) -> Array:
    between = 0.5 * (values[1:] + values[:-1])
    first, last = 2 * values[0] - between[0], 2 * values[-1] - between[-1]
    return np.concatenate([[first], between, [last]])


def _grows_by_a_factor(values: Array) -> bool:
    if len(values) < 3 or values[0] <= 0.0:
        return False
    factors = values[1:] / values[:-1]
    return bool(np.ptp(factors) < _EVEN * factors.max())


def units_of(table: pd.DataFrame) -> Mapping[str, str]:
    """Return the units of the table's columns, as a sweep leaves them in its attrs."""
    units = table.attrs.get("units", {})
    return units if isinstance(units, dict) else {}


def figure_label(figure: str, units: Mapping[str, str] | None = None) -> str:
    """Return the last part of a figure's name, with its unit where that is known."""
    last = figure.rpartition(".")[2]
    if last.isdecimal():  # one of several numbers of a joint
        last = figure
    known = PAIR_UNITS.get(last, "") if figure.startswith("pairs.") else RUN_FIGURES.get(figure, "")
    return column(
        last if last == figure else last.replace("_", " "), (units or {}).get(figure, known)
    )
