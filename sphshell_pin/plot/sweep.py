"""Pictures of a sweep: curves over one varied number, heat maps over two."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.tables import column
from sphshell_pin.errors import InvalidParameter, NameNotFound
from sphshell_pin.plot.figure import finish_axis, new_figure, say

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_CURVES = 12
# Values that grow by one factor, to this accuracy, get a logarithmic axis.
_EVEN = 1e-3
_MOST_TICKS = 8


def plot_sweep(table: pd.DataFrame, figure: str) -> Figure:
    """Return a matplotlib Figure of one column of a sweep's `table` over what was varied.

    One varied number gives curves, one for each combination of varied words (or truths, or lists),
    two give a heat map, words alone bars. Failed runs are gaps in a curve, grey in a map. Rows may
    be left out of the table before; a key that then has one value counts as not varied.

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
    known = [name for name in names[names.index("error") + 1 :] if name != "settings"]
    if figure not in known:
        raise NameNotFound("figure", figure, "the table", known, see="its columns")
    numbers, words = _drawable_keys(table[names[1 : names.index("status")]])
    canvas = new_figure(7.5, 5.0)
    axis = canvas.subplots()
    axis.set(title=figure)
    if numbers:
        across = numbers[1:] + words
        rows = table.set_index([numbers[0], *across])[figure].sort_index()
        curves = (
            rows.unstack(across[0] if len(across) == 1 else across) if across else rows.to_frame()
        )
    if len(numbers) == 2:
        _draw_map(axis, curves, table)
    elif numbers:
        _draw_curves(axis, curves)
        axis.set(xlabel=label_of(table, numbers[0]), ylabel=label_of(table, figure))
        finish_axis(axis, legend=bool(words))
    else:
        bars = table[figure].to_numpy(float)
        axis.bar(table[words].astype(str).agg(", ".join, axis=1) if words else ["run 0"], bars)
        axis.set(ylabel=label_of(table, figure))
    return canvas


def label_of(table: pd.DataFrame, name: str) -> str:
    """Return the name of a column with its unit, as a sweep leaves it in the table's attrs."""
    return column(name, table.attrs.get("units", {}).get(name, ""))


def _drawable_keys(varied: pd.DataFrame) -> tuple[list[str], list[str]]:
    """Return which of the `varied` columns are numbers, at most two, and which are not.

    Numbers that were varied together do not span a map: the first of them stands for all.
    """
    keys = [str(key) for key in varied.columns if varied[key].nunique() > 1]
    numbers = [key for key in keys if varied[key].dtype.kind in "if"]
    words = [key for key in keys if key not in numbers]
    if len(numbers) > 1:
        spanned = int(np.prod([varied[key].nunique() for key in numbers]))
        if len(varied[numbers].drop_duplicates()) < spanned:
            numbers = numbers[:1]
    if len(numbers) > 2 or (len(numbers) == 2 and words):
        must = "are too many keys for one picture: select rows first"
        raise InvalidParameter("vary", ", ".join(numbers + words), must)
    if words and len(varied[words].drop_duplicates()) > MOST_CURVES:
        must = f"have more than {MOST_CURVES} combinations: select rows first"
        raise InvalidParameter("vary", ", ".join(words), must)
    return numbers, words


def _draw_curves(axis: Axes, curves: pd.DataFrame) -> None:
    x = curves.index.to_numpy(float)
    for name in curves.columns:
        values = name if isinstance(name, tuple) else (name,)
        keys = (str(key).rpartition(".")[2] for key in curves.columns.names)
        label = ", ".join(f"{key} = {one}" for key, one in zip(keys, values, strict=True))
        axis.plot(x, curves[name], "o-", markersize=4, label=label)
    factors = x[1:] / x[:-1] if x[0] > 0.0 else x[:0]
    if len(factors) > 1 and np.ptp(factors) < _EVEN * factors.max():
        axis.set_xscale("log")
    if not curves.notna().any(axis=None):
        say(axis, "No run has this figure.")


def _draw_map(axis: Axes, grid: pd.DataFrame, table: pd.DataFrame) -> None:
    """Draw cells of one size, whatever the steps between the values are."""
    mesh = axis.pcolormesh(np.ma.masked_invalid(grid.to_numpy(float)))
    axis.set_facecolor("0.8")
    for side, values in ((axis.xaxis, grid.columns), (axis.yaxis, grid.index)):
        ticks = np.arange(0, len(values), 1 + (len(values) - 1) // _MOST_TICKS)
        side.set_ticks(ticks + 0.5, [f"{values[i]:.4g}" for i in ticks])
        side.set_label_text(label_of(table, str(values.name or values.names[0])))
    axis.figure.colorbar(mesh, ax=axis, label=label_of(table, axis.get_title()))
