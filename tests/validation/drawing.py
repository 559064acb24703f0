"""What the pictures of reports share: colors, sizes, style."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import TYPE_CHECKING

from sphshell_pin.plot.figure import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK, FAINT, RULE = "#1c2024", "#656d77", "#e2e3df"
BLUE, GREEN, ORANGE, RED, VIOLET = "#2160b8", "#14804a", "#c26a00", "#b8262f", "#7340b0"
SMALL, TEXT = 8.0, 9.0
_STYLE: dict[str, object] = {
    "font.size": TEXT,
    "axes.edgecolor": FAINT,
    "axes.titlesize": TEXT + 0.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": RULE,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
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
