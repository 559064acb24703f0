"""An empty figure, what every picture shares, and the units of its axes."""

from __future__ import annotations

import functools
import io
import math
from pathlib import Path
from typing import TYPE_CHECKING

from sphshell_pin.base.atomic import write_whole
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.errors import import_extra

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NO_CONTACT = "No contact in this run."
RESOLUTION = 130  # dots per inch of the files
INK = "#101418"
_PREFIXES = {3: "k", 0: "", -3: "m", -6: "µ", -9: "n"}


def new_figure(width: float, height: float, title: str = "") -> Figure:
    """Return an empty Figure of `width` by `height` inches with a `title`, made without pyplot.

    Raises MissingExtra without matplotlib.
    """
    matplotlib = import_extra("matplotlib.figure", "view", "a figure")
    figure: Figure = matplotlib.Figure(figsize=(width, height), layout="constrained")
    if title:
        figure.suptitle(title, fontsize=12)
    # A notebook shows it where it is the value of a cell, whatever backend it has.
    figure._repr_png_ = functools.partial(png, figure, 100)  # type: ignore[attr-defined]
    return figure


def png(figure: Figure, dpi: int = RESOLUTION) -> bytes:
    """Return `figure` as a .png file."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    stream = io.BytesIO()
    # Its places are found once and it is drawn once, where `savefig` does both twice.
    layout, own_dpi = figure.get_layout_engine(), figure.get_dpi()
    try:
        figure.set_dpi(dpi)
        if layout is not None:
            layout.execute(figure)
        figure.set_layout_engine("none")
        canvas = FigureCanvasAgg(figure)
        canvas.print_png(stream, pil_kwargs={"compress_level": 1})  # type: ignore[no-untyped-call]
    finally:
        figure.set_layout_engine(layout)
        figure.set_dpi(own_dpi)
    return stream.getvalue()


def write_figure(path: StrPath, figure: Figure) -> Path:
    """Write `figure` as a .png file, whole or not at all; ResultError if it cannot be written."""
    return write_whole(path, png(figure))


def reading_unit(largest: float, base: str) -> tuple[float, str]:
    """Return factor and name of the unit in which `largest` [base: m, N, s, J] reads well."""
    if not 0.0 < largest < math.inf:
        return 1.0, base
    exponent = max(-9, 3 * math.floor((math.log10(largest) + 1.0) / 3.0))
    if base == "m" and 0.1 <= largest < 1.0:
        exponent = -3  # 300 mm, but 0.3 N
    if exponent > 0:
        exponent = 3 if base in ("N", "J") and largest >= 1e4 else 0
    return 10.0**-exponent, _PREFIXES[exponent] + base


def label_axis(axis: Axes, quantity: str, base: str, largest: float) -> float:
    """Label the y axis with `quantity` and the unit for `largest` [base]; return its factor."""
    factor, unit = reading_unit(largest, base)
    axis.set_ylabel(f"{quantity} [{unit}]")
    return factor


def finish_axis(axis: Axes, *, legend: bool = False) -> None:
    """Draw the grid that all figures have, and a `legend`."""
    axis.grid(True, alpha=0.3, linewidth=0.6)
    if legend:
        axis.legend(loc="best", fontsize=8, framealpha=0.85)


def say(axis: Axes, sentence: str) -> None:
    """Write `sentence` in the middle of an empty `axis`."""
    axis.text(
        0.5, 0.5, sentence, transform=axis.transAxes, ha="center", va="center", color="#555555"
    )
    axis.set_yticks([])


def only_say(title: str, sentence: str) -> Figure:
    """Return a figure of nothing but a `sentence`."""
    figure = new_figure(9.0, 5.0, title)
    say(figure.subplots(), sentence)
    return figure


def count(number: int, one: str, many: str) -> str:
    """Return `number` with the word for one or for many."""
    return f"{number} {one if number == 1 else many}"
