"""What the pictures of the report share: colors, labels, guide lines."""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.plot.figure import new_figure
from sphshell_pin.study.report.contents import superscript

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, FAINT, RULE, PAPER = "#1c2024", "#656d77", "#e2e3df", "#ffffff"
BLUE, GREEN, ORANGE, RED, VIOLET, GREY = (
    "#2160b8", "#14804a", "#c26a00", "#b8262f", "#7340b0", "#69737f",
)  # fmt: skip
SMALL, TEXT = 8.0, 9.0
DASHED = (0, (4, 3))
_STYLE: dict[str, object] = {
    "font.size": TEXT,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": FAINT,
    "axes.titlesize": TEXT + 0.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "grid.color": RULE,
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "xtick.minor.size": 0,
    "ytick.minor.size": 0,
    "lines.linewidth": 1.6,
    "lines.markersize": 4,
}


@contextlib.contextmanager
def canvas(width: float, height: float) -> Iterator[Figure]:
    """Give an empty figure of these inches; draw and write it inside."""
    figure = new_figure(width, height)
    from matplotlib import rc_context

    with rc_context(_STYLE):  # type: ignore[arg-type]
        yield figure


def png_of(figure: Figure) -> bytes:
    """Return the figure as a png file."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=160)
    return stream.getvalue()


def power_of_ten(value: float, _: object = None) -> str:
    """Return the label of a power of ten."""
    exponent = math.log10(value) if value > 0 else 0.0
    if abs(exponent - round(exponent)) > 1e-6:
        return ""
    if -2 <= exponent <= 2:
        return f"{value:g}"
    return f"10{superscript(round(exponent))}"


def many(value: float, _: object = None) -> str:
    """Return the label of a count: 100, 10 k, 1 M."""
    for size, letter in ((1e6, " M"), (1e3, " k")):
        if value >= size:
            return f"{value / size:g}{letter}"
    return f"{value:g}"


def logarithmic(axis: Axes, *, counts: bool = False, every: tuple[int, int] = (1, 1)) -> None:
    """Make both scales logarithmic; `counts` are along x; label every so many decades."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axis.set_xscale("log")
    axis.set_yscale("log")
    for one, form, step in (
        (axis.xaxis, many if counts else power_of_ten, every[0]),
        (axis.yaxis, power_of_ten, every[1]),
    ):
        one.set_major_locator(LogLocator(base=10.0**step, numticks=20))
        one.set_major_formatter(FuncFormatter(form))
        one.set_minor_locator(NullLocator())
    axis.grid(visible=True, which="major")


def label_ends(
    axis: Axes, ends: Sequence[tuple[float, float, str, str]], *, gap: float = 0.075
) -> None:
    """Write names beside the ends of lines: (x, y, name, color); moved apart by `gap` of height.

    The axis keeps the limits that it has now.
    """
    axis.set_xlim(axis.get_xlim())
    axis.set_ylim(axis.get_ylim())
    to_axes = (axis.transData + axis.transAxes.inverted()).transform
    places = [to_axes((x, y)) for x, y, _, _ in ends]
    order = sorted(range(len(ends)), key=lambda k: (places[k][1], -k))
    heights = spread_apart([float(places[k][1]) for k in order], gap)
    for k, height in zip(order, heights, strict=True):
        _, _, name, color = ends[k]
        axis.annotate(
            name, (min(places[k][0], 1.0), height), xycoords="axes fraction", xytext=(6, 0),
            textcoords="offset points", color=color, fontsize=SMALL, va="center",
            annotation_clip=False,
            bbox={"facecolor": PAPER, "edgecolor": "none", "alpha": 0.75, "pad": 0.6},
        )  # fmt: skip


def spread_apart(heights: Sequence[float], gap: float) -> list[float]:
    """Return ascending heights moved so that neighbors are at least `gap` apart."""
    moved = np.array(heights, dtype=float)
    for _ in range(200):  # pushes both neighbors of each pair that is too close
        short = np.maximum(gap - np.diff(moved), 0.0)
        if not short.any():
            break
        push = 0.5 * (short + 1e-9 * (short > 0))
        moved[:-1] -= push
        moved[1:] += push
    return [float(one) for one in moved]


def guide(axis: Axes, start: tuple[float, float], stop: float, exponent: float, name: str) -> None:
    """Draw a line y ~ x^exponent from `start` to x = `stop`, with its name behind its end."""
    x = np.array([start[0], stop])
    y = start[1] * (x / start[0]) ** exponent
    axis.plot(x, y, color=FAINT, linewidth=0.9, linestyle=DASHED)
    axis.annotate(
        name, (x[1], y[1]), xytext=(3, 0), textcoords="offset points", color=FAINT,
        fontsize=SMALL - 0.5, ha="left", va="center",
    )  # fmt: skip
