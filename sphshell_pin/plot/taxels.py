"""Tactile images: some rows side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.errors import InvalidParameter
from sphshell_pin.plot.figure import new_figure, reading_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sphshell_pin.patches.taxels import TaxelImages

COLORS = "inferno"


def plot_taxels(images: TaxelImages, rows: Sequence[int]) -> Figure:
    """Return a Figure of the images of a grid at some of its `rows`, one beside the other.

    Latitude points up, longitude to the right: the grid as seen from outside the sphere, with
    its `up` on top.

    Raises InvalidParameter unless the images are those of a grid, MissingExtra without matplotlib.
    """
    forces = images.forces
    if forces.ndim != 3:
        raise InvalidParameter(
            "images",
            f"({', '.join(map(str, forces.shape))})",
            "must be of a TaxelGrid: elements and faces have no order in a picture",
            given="of shape",
        )
    figure = new_figure(2.2 * len(rows) + 0.9, 2.7)
    factor, unit = reading_unit(float(forces[list(rows)].max()), "N")
    axes = np.atleast_1d(figure.subplots(1, len(rows)))
    largest = float(forces[list(rows)].max()) * factor or 1.0
    for axis, row in zip(axes, rows, strict=True):
        drawn = axis.imshow(
            forces[row] * factor, origin="lower", cmap=COLORS, vmin=0.0, vmax=largest
        )
        axis.set_title(f"t = {images.t[row] * 1e3:.0f} ms", fontsize=9)
        axis.set_xticks([])
        axis.set_yticks([])
    figure.colorbar(drawn, ax=list(axes), label=f"force on a taxel [{unit}]", shrink=0.8)
    return figure
