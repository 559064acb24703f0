"""What the pictures of the report share: colours that follow the page, labels, guides, SVG."""

from __future__ import annotations

import contextlib
import io
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sphshell_pin.plot.figure import new_figure
from sphshell_pin.study.report.contents import superscript

# Stand-ins: the SVG names the page's colours instead, so that one picture serves light and dark.
INK, FAINT, RULE, PAPER = "#a100f0", "#a100f1", "#a100f2", "#a100f3"
SERIES = tuple(f"#a1000{k}" for k in range(1, 7))
BLUE, GREEN, ORANGE, RED, VIOLET, GREY = SERIES
_NAMES = {INK: "ink", FAINT: "faint", RULE: "rule", PAPER: "paper"} | {
    color: f"s{k}" for k, color in enumerate(SERIES, 1)
}
_COLOURED = ("color", "facecolor", "edgecolor", "markerfacecolor", "markeredgecolor")
SMALL, TEXT = 8.0, 9.0
_STYLE: Any = {
    "font.family": "sans-serif",
    "font.size": TEXT,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": FAINT,
    "axes.titlecolor": INK,
    "axes.titlesize": TEXT + 0.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.axisbelow": True,
    "grid.color": RULE,
    "grid.linewidth": 0.6,
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
    "svg.fonttype": "none",
}


@contextlib.contextmanager
def drawing(width: float, height: float) -> Iterator[Any]:
    """Give an empty figure of these inches; draw and write it inside."""
    figure = new_figure(width, height)
    from matplotlib import rc_context

    with rc_context(_STYLE):
        figure.patch.set_visible(False)
        yield figure


def pictured(figure: Any, name: str) -> tuple[str, str, bytes]:
    """Return the name, SVG and PNG of a picture."""
    svg = to_svg(figure, name)
    stream = io.BytesIO()
    _take_colours(figure)
    figure.patch.set_visible(True)
    figure.savefig(stream, format="png", dpi=160, facecolor="white")
    return name, svg, stream.getvalue()


def _take_colours(figure: Any) -> None:
    """Give a figure the light colours of the page in place of the stand-ins."""
    from matplotlib.artist import getp
    from matplotlib.colors import to_hex, to_rgba_array

    css = Path(__file__).with_name("page.css").read_text(encoding="utf-8")
    light: dict[str, str] = {}
    for variable, value in re.findall(r"--(\w+): (#\w+);", css):
        light.setdefault(variable, value)  # the light colours come first
    artists = figure.findobj()
    # The boxes behind texts are nobody's children.
    boxes = [one.get_bbox_patch() for one in artists if hasattr(one, "get_bbox_patch")]
    for artist in (*artists, *(box for box in boxes if box is not None)):
        for what in _COLOURED:
            if not (hasattr(artist, f"set_{what}") and hasattr(artist, f"get_{what}")):
                continue
            try:
                given = to_rgba_array(getp(artist, what))
            except (TypeError, ValueError):
                continue  # "none", "auto": not one of ours
            if not any(to_hex(one) in _NAMES for one in given):
                continue
            taken = to_rgba_array([light.get(_NAMES.get(to_hex(one), ""), one) for one in given])
            taken[:, 3] = given[:, 3]
            getattr(artist, f"set_{what}")(taken if len(taken) > 1 else tuple(taken[0]))


def to_svg(figure: Any, name: str) -> str:
    """Return the figure as an SVG element of a page, with the page's colours.

    `name` keeps its identifiers apart from those of other pictures.
    """
    from matplotlib import rc_context

    stream = io.StringIO()
    with rc_context({"svg.hashsalt": name}):
        figure.savefig(stream, format="svg", transparent=True, metadata={"Date": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'\sxmlns(:\w+)?="[^"]*"', "", text)
    text = re.sub(r'<g id="[^"]*"', "<g", text)
    text = re.sub(r"font: ([\d.]+)px [^;\"]*", r"font-size: \1px", text)
    text = re.sub(r'<svg ([^>]*?)(?:width|height)="[^"]*" ', r"<svg \1", text)
    text = re.sub(r'<svg ([^>]*?)(?:width|height)="[^"]*" ', r"<svg \1", text)
    for color, variable in _NAMES.items():
        text = text.replace(color, f"var(--{variable})")
    return re.sub(r">\s+<", "><", text).strip()


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


def logarithmic(axis: Any, *, counts: bool = False, every: tuple[int, int] = (1, 1)) -> None:
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
    axis: Any, ends: Sequence[tuple[float, float, str, str]], *, gap: float = 0.075
) -> None:
    """Write names beside the ends of lines: (x, y, name, colour); moved apart by `gap` of height.

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
    """Return ascending heights moved as little as needed to be `gap` apart."""
    groups: list[list[float]] = []
    for height in heights:
        groups.append([height, 1])
        while len(groups) > 1 and _touch(groups[-2], groups[-1], gap):
            (a, m), (b, n) = groups[-2:]
            groups[-2:] = [[(a * m + b * n) / (m + n), m + n]]
    return [middle + gap * (i - (n - 1) / 2) for middle, n in groups for i in range(round(n))]


def _touch(below: list[float], above: list[float], gap: float) -> bool:
    return above[0] - below[0] < gap * (below[1] + above[1]) / 2


def guide(axis: Any, start: tuple[float, float], stop: float, exponent: float, name: str) -> None:
    """Draw a line y ~ x^exponent from `start` to x = `stop`, with its name behind its end."""
    x = np.array([start[0], stop])
    y = start[1] * (x / start[0]) ** exponent
    axis.plot(x, y, color=FAINT, linewidth=0.9, linestyle=(0, (4, 3)))
    axis.annotate(
        name, (x[1], y[1]), xytext=(3, 0), textcoords="offset points", color=FAINT,
        fontsize=SMALL - 0.5, ha="left", va="center",
    )  # fmt: skip
