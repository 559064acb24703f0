"""The path of the contacts on their shells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.result.result_scene import find_scene
from sphshell_pin.plot.figure import NO_CONTACT, only_say, reading_unit
from sphshell_pin.plot.on_shell import PathGroup, Picture, group_paths, shell_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.scene import Scene


MOST_NAMES = 8  # beside the paths with the largest forces


def plot_contact_path(result: Result, scene: Scene | None = None) -> Figure:
    """Return a Figure of the contact points' path colored by normal force.

    There is one picture per shell of `scene` (default: the scene that ran, or that of the scenario
    the result came from), in the shell's frame and on its elements, seen from the side of the
    contact normals. Without a scene the picture is one of the world.
    """
    groups = group_paths(result, find_scene(result, scene))
    if not groups:
        return only_say("Path of the contact", NO_CONTACT)
    forces = np.concatenate([path.force for group in groups for path in group.paths])
    low, high = color_limits(forces)
    factor, unit = reading_unit(high, "N")
    figure, axes = shell_figure("Path of the contact", len(groups))
    for axis, group in zip(axes, groups, strict=True):
        lines = _draw(axis, group, [str(name) for name in result.pairs], factor)
        lines.set_clim(low * factor, high * factor)
    extend = "max" if forces.max() > high else "neither"
    figure.colorbar(lines, ax=axes, label=f"normal force [{unit}]", shrink=0.8, extend=extend)
    return figure


def color_limits(forces: Array) -> tuple[float, float]:
    """Return the range of `forces` (k,) [N] that gets the colors.

    It ends below an impact far above the rest, and starts at zero unless that would leave only a
    few colors to tell forces apart.
    """
    high, low = float(forces.max()), float(forces.min())
    usual = float(np.percentile(forces, 98.0, method="lower"))
    if high > 1.5 * usual > 0.0:
        high = usual
    return (low if 0.5 * high < low < high else 0.0), high or 1.0


def _draw(axis: Axes3D, group: PathGroup, names: list[str], factor: float) -> Line3DCollection:
    """Draw the paths of one shell; `factor` scales forces."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    normals = np.concatenate([path.normals for path in group.paths])
    normal = normals.mean(axis=0) if group.shell is not None else np.array([0.0, 0.0, 1.0])
    if np.linalg.norm(normal) < 0.1:
        normal = normals[0]
    picture = Picture.of(axis, group.shell, normal, group.points)
    if group.shell is not None:
        picture.draw_shell(group.shell)
    segments, colors = [], []
    strongest = sorted(group.paths, key=lambda path: -float(path.force.max()))[:MOST_NAMES]
    for path in group.paths:
        for run in path.runs:
            kept = run[picture.kept(path.points[run])]
            # A touch that lasts one row is a segment without length: its round ends make a dot.
            ends = np.stack((kept[:-1], kept[1:]), axis=1) if len(kept) > 1 else kept[[[0, 0]]]
            segments.append(path.points[ends] * picture.factor)
            colors.append(path.force[ends].mean(axis=1))
        hidden = group.shell is not None and float(path.normals[0] @ picture.toward) < 0.0
        name = names[path.pair] if any(path is one for one in strongest) else ""
        picture.mark_start(path.points[0], name, hidden=hidden)
    lines = Line3DCollection(
        np.concatenate(segments), cmap="turbo", linewidths=2.4, capstyle="round", zorder=3
    )
    lines.set_array(np.concatenate(colors) * factor)
    axis.add_collection3d(lines, autolim=False)
    where = "in the world" if group.shell is None else f"on {group.shell.name}"
    axis.set_title(f"{where} (dot: first touch)", fontsize=10)
    return lines
