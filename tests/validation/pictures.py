"""The pictures of the cases: published points, our lines over them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from sphshell_pin.plot.figure import new_figure, png

INK = "#1c2024"
COLORS, MARKS = ("#2160b8", "#c26a00", "#14804a", "#7340b0", "#b8262f"), ("o", "s", "^", "D", "v")
STYLE = Path(__file__).with_name("pictures.mplstyle")
Series = tuple[str, ArrayLike, ArrayLike]
"""A name, x (n,) and y (n,)."""


@dataclass(frozen=True)
class Panel:
    """One diagram: `published` series are marks, `ours` are lines, `theory` are dashed ones.

    `equal`: x and y have one scale.
    """

    x: str
    y: str
    published: Sequence[Series] = ()
    ours: Sequence[Series] = ()
    theory: Sequence[Series] = ()
    logarithmic: bool = False
    equal: bool = False


def draw(panels: Sequence[Panel]) -> bytes:
    """Return the panels side by side as a PNG file."""
    wide = 2 if len(panels) == 4 else len(panels)
    tall = len(panels) // wide
    figure = new_figure(max(4.6, 3.9 * wide), 3.3 * tall)
    from matplotlib import rc_context

    dashed = {"color": INK, "linewidth": 1.0, "linestyle": (0, (4, 3))}
    marked = {"color": INK, "linestyle": "", "markerfacecolor": "none", "markersize": 4.5}
    with rc_context(fname=STYLE):
        axes = figure.subplots(tall, wide, squeeze=False).flat
        for axis, panel in zip(axes, panels, strict=True):
            for k, (label, x, y) in enumerate(panel.ours):
                axis.plot(x, y, color=COLORS[k % len(COLORS)], label=label)
            for label, x, y in panel.theory:
                axis.plot(x, y, label=label, **dashed)
            for k, (label, x, y) in enumerate(panel.published):
                marker = MARKS[k % len(MARKS)]
                axis.plot(np.asarray(x), np.asarray(y), marker=marker, label=label, **marked)
            if panel.logarithmic:
                axis.set(xscale="log", yscale="log")
            if panel.equal:
                axis.set_aspect("equal", "datalim")
            axis.set(xlabel=panel.x, ylabel=panel.y)
            axis.legend(fontsize=7.5, edgecolor="none", framealpha=0.85)
        return png(figure, 160)
