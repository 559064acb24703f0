"""The path of the contacts on their shells."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sphshell_pin.plot.figure import NO_CONTACT, new_figure, say
from sphshell_pin.plot.series import FloatArray
from sphshell_pin.view.path_axes import draw_paths, group_paths, reading_unit

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result import Result
    from sphshell_pin.dynamics.scene import Scene


def plot_contact_path(result: Result, scene: Scene | None = None) -> Any:
    """Return a Figure of the contact points' path coloured by normal force.

    There is one picture per shell of `scene` (default: the scene that ran), in the shell's frame
    and on its outline, seen along the shell's axis nearest to the contact normals. A loaded result
    has no scene: without one, the picture is one of the world.
    """
    groups = group_paths(result, result.scene if scene is None else scene)
    if not groups:
        figure = new_figure(9.0, 5.0)
        say(figure.subplots(), NO_CONTACT)
        figure.suptitle("Path of the contact", fontsize=12)
        return figure
    columns = min(len(groups), 2)
    rows = -(-len(groups) // columns)
    figure = new_figure(3.0 + 5.0 * columns, 0.8 + 5.5 * rows, "compressed")
    axes = figure.subplots(rows, columns, squeeze=False).reshape(-1)
    forces = np.concatenate([path.force for group in groups for path in group.paths])
    low, high = color_limits(forces)
    factor, unit = reading_unit(high, "N")
    limits = (low * factor, high * factor)
    names = [str(name) for name in result.pairs]
    lines = None
    for axis, group in zip(axes, groups, strict=False):
        lines = draw_paths(axis, group, names, factor, limits)
    for axis in axes[len(groups) :]:
        axis.set_axis_off()
    extend = "max" if forces.max() > high else "neither"
    label = f"normal force [{unit}]"
    figure.colorbar(lines, ax=axes.tolist(), label=label, shrink=0.8, extend=extend)
    figure.suptitle("Path of the contact", fontsize=12)
    return figure


def color_limits(forces: FloatArray) -> tuple[float, float]:
    """Return the range of `forces` (k,) [N] that gets the colours.

    It ends below an impact far above the rest, and starts at zero unless that would leave only a
    few colours to tell forces apart.
    """
    high, low = float(forces.max()), float(forces.min())
    usual = float(np.percentile(forces, 98.0, method="lower"))
    if high > 1.5 * usual > 0.0:
        high = usual
    return (low if 0.5 * high < low < high else 0.0), high or 1.0
