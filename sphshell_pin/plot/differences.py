"""A map of the faces on which parts differ."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.plot.figure import reading_unit
from sphshell_pin.plot.on_shell import Picture, color_scale, shell_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sphshell_pin.shell.shell import Shell

EYE = np.array([0.6, -0.7, 0.5])


def plot_differences(title: str, parts: Sequence[tuple[str, Shell, Array]]) -> Figure:
    """Return a Figure of shells, each seen from two opposite sides.

    parts : name, shell, and by how much each of its elements differs in depth (m,) [m]; elements
        of 0 are gray

    Raises MissingExtra without matplotlib.
    """
    largest = max(float(values.max(initial=0.0)) for _, _, values in parts)
    factor, unit = reading_unit(largest, "m")
    scale = color_scale(largest * factor, "viridis_r")
    figure, axes = shell_figure(title, 2 * len(parts))
    for k, axis in enumerate(axes):
        name, shell, values = parts[k // 2]
        picture = Picture.of(axis, shell, EYE * (1 - 2 * (k % 2)), np.asarray(shell.box))
        picture.draw_shell(shell, values, scale.to_rgba(values * factor))
        axis.set_title(f"{name}, from {('one side', 'the other')[k % 2]}", fontsize=10)
    figure.colorbar(scale, ax=axes, label=f"largest difference of depth on a face [{unit}]")
    return figure
