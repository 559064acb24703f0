"""Shells with what wear took off them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.plot.figure import only_say, reading_unit
from sphshell_pin.plot.on_shell import FINE, Picture, color_scale, shell_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sphshell_pin.patches.wear import WearMap

TITLE = "Wear by Preston's law"
COLORS = "viridis"
LEAST = 2e-3  # of the largest depth: less is bare
MOST_PIECES = 60_000  # of the picture: of more, neighbors are drawn as one


def plot_wear(maps: Sequence[WearMap]) -> Figure:
    """Return a Figure of each map: the shell, with the removed depth in colors.

    A shell is seen as its contact map is: from before the worn places. Raises MissingExtra without
    matplotlib.
    """
    shown = [one for one in maps if one.depth.max(initial=0.0) > 0.0]
    if not shown:
        return only_say(TITLE, "Nothing was worn off.")
    figure, axes = shell_figure(TITLE, len(shown))
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    largest = max(float(one.depth.max()) for one in shown)
    factor, unit = reading_unit(largest, "m")
    scale = color_scale(largest * factor, COLORS)
    for axis, one in zip(axes, shown, strict=True):
        worn = one.depth > LEAST * one.depth.max()
        corners, depth = one.corners[worn], one.depth[worn]
        normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
        middle = (depth[:, None] * normals).sum(axis=0)
        if np.linalg.norm(middle) < 1e-9 * (depth * np.linalg.norm(normals, axis=1)).sum():
            middle = normals[np.argmax(depth)]
        triangles = np.asarray(one.shell.triangles)[np.unique(one.triangle[worn])]
        touched = np.asarray(one.shell.vertices)[triangles].reshape(-1, 3)
        picture = Picture.of(axis, one.shell, middle, touched)
        picture.draw_shell(one.shell)
        step = -(-len(corners) // MOST_PIECES)
        # What stands for several is as large as they are.
        center = corners[::step].mean(axis=1, keepdims=True)
        drawn = center + np.sqrt(step) * (corners[::step] - center)
        colors = scale.to_rgba(depth[::step] * factor)
        picture.axis.add_collection3d(
            Poly3DCollection(
                drawn * picture.factor,
                facecolors=colors,
                edgecolors=colors,
                linewidths=0.3 if np.ptp(corners[:, :, 0]) > FINE * picture.size else 2.0,
                zorder=2,
            ),
            autolim=False,
        )
        volume = one.volume * 1e9
        axis.set_title(f"{one.shell.name}: {volume:.3g} mm³ removed", fontsize=10)
    figure.colorbar(scale, ax=axes, label=f"removed depth [{unit}]", shrink=0.8)
    return figure
