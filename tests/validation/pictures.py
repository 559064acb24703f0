"""What the pictures of the cases share: published points, our lines over them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sphshell_pin.plot.figure import png as png_of
from tests.validation import drawing

COLORS = (drawing.BLUE, drawing.ORANGE, drawing.GREEN, drawing.VIOLET, drawing.RED)
MARKS = ("o", "s", "^", "D", "v")
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
    with drawing.canvas(max(4.6, 3.9 * wide), 3.3 * tall) as figure:
        axes = figure.subplots(tall, wide, squeeze=False).flat
        for axis, panel in zip(axes, panels, strict=True):
            for k, (label, x, y) in enumerate(panel.ours):
                axis.plot(x, y, color=COLORS[k % len(COLORS)], label=label)
            for label, x, y in panel.theory:
                axis.plot(
                    x, y, color=drawing.INK, linewidth=1.0, linestyle=(0, (4, 3)), label=label
                )
            for k, (label, x, y) in enumerate(panel.published):
                axis.plot(
                    np.asarray(x), np.asarray(y), MARKS[k % len(MARKS)], label=label,
                    color=drawing.INK, markerfacecolor="none", markersize=4.5,
                )  # fmt: skip
            if panel.logarithmic:
                axis.set_xscale("log")
                axis.set_yscale("log")
            if panel.equal:
                axis.set_aspect("equal", "datalim")
            axis.set_xlabel(panel.x)
            axis.set_ylabel(panel.y)
            axis.grid(visible=True)
            axis.legend(fontsize=drawing.SMALL - 0.5, edgecolor="none", framealpha=0.85)
        return png_of(figure, 160)
