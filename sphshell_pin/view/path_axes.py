"""The contact path on one matplotlib axis: on its shell's outline, coloured by force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sphshell_pin.view.contact_path import ContactPath, FloatArray, contact_paths, spaced

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result import Result
    from sphshell_pin.dynamics.scene import Scene
    from sphshell_pin.shell.shell import Shell

INK = "#101418"
MOST_STEPS = 20_000
MOST_FILLED = 60_000


@dataclass(frozen=True)
class PathGroup:
    """The paths that share one picture: those on one shell, or all others in the world."""

    shell: Shell | None
    paths: list[ContactPath]


def group_paths(result: Result, scene: Scene | None) -> list[PathGroup]:
    """Return the paths of `result`, those on one shell together."""
    groups: dict[Any, PathGroup] = {}
    for path in contact_paths(result, scene):
        key, shell = None, None
        if path.on_shell and scene is not None:
            pair = scene.pairs[path.pair]
            shell = pair.shell
            key = (id(shell), pair.joint_j, pair.placement_j.homogeneous.tobytes())
        groups.setdefault(key, PathGroup(shell, [])).paths.append(path)
    return list(groups.values())


def draw_paths(
    axis: Any, group: PathGroup, names: list[str], factor: float, limits: tuple[float, float]
) -> Any:
    """Draw one picture; `factor` scales forces and `limits` bound their colours."""
    from matplotlib.collections import LineCollection

    spread = np.concatenate([path.points for path in group.paths])
    if group.shell is not None:
        spread = np.vstack((spread, np.asarray(group.shell.box)))
        toward_eye = np.concatenate([path.normals for path in group.paths]).mean(axis=0)
    else:
        # Along the axis in which the path is shortest; from above, if that is undecided.
        toward_eye = np.eye(3)[2 - int(np.argmin(np.ptp(spread, axis=0)[::-1]))]
    first, second = _seen_axes(toward_eye)
    chosen = [first, second]
    size = float(np.ptp(spread, axis=0).max())
    length_factor, unit = reading_unit(size, "m")
    if group.shell is not None:
        _draw_shell(axis, group.shell, chosen, length_factor)
    starts = np.array([path.points[0][chosen] for path in group.paths])
    segments, colors = [], []
    for path in group.paths:
        flat = path.points[:, chosen] * length_factor
        for run in path.runs:
            kept = run[spaced(path.points[run], size / MOST_STEPS)] if size > 0.0 else run[:1]
            # A touch that lasts one row is a segment without length: its round ends make a dot.
            ends = np.stack((kept[:-1], kept[1:]), axis=1) if len(kept) > 1 else kept[[[0, 0]]]
            segments.append(flat[ends])
            colors.append(path.force[ends].mean(axis=1))
        hidden = group.shell is not None and float(path.normals[0] @ toward_eye) < 0.0
        _mark_start(axis, flat[0], names[path.pair], starts * length_factor, hidden=hidden)
    lines = LineCollection(
        list(np.concatenate(segments)), cmap="turbo", linewidths=2.4, capstyle="round", zorder=3
    )
    lines.set_array(np.concatenate(colors) * factor)
    lines.set_clim(*limits)
    axis.add_collection(lines)
    axis.autoscale_view()
    _widen(axis)
    axis.set_aspect("equal")
    frame = "world" if group.shell is None else "shell"
    axis.set_xlabel(f"{'xyz'[first]} of the {frame} [{unit}]")
    axis.set_ylabel(f"{'xyz'[second]} of the {frame} [{unit}]")
    where = "in the world" if group.shell is None else f"on {group.shell.name}"
    axis.set_title(f"{where} (dot: first touch)", fontsize=10)
    axis.grid(True, alpha=0.25, linewidth=0.6)
    return lines


def _mark_start(
    axis: Any, place: FloatArray, name: str, starts: FloatArray, *, hidden: bool
) -> None:
    """Draw a dot at `place` (2,) and write `name` beside it, away from the other `starts` (k, 2).

    A dot is hollow where the shell hides the touch.
    """
    fill = "white" if hidden else INK
    axis.plot(*place, marker="o", markersize=5, color=INK, markerfacecolor=fill, zorder=4)
    others = starts[(starts != place).any(axis=1)] - place
    level = np.abs(others[:, 1]) < 0.5 * np.abs(others[:, 0])
    right, left = others[level & (others[:, 0] > 0.0), 0], -others[level & (others[:, 0] < 0.0), 0]
    to_left = right.min(initial=np.inf) < left.min(initial=np.inf)
    axis.annotate(
        f"{name} (behind)" if hidden else name,
        place,
        xytext=(-6 if to_left else 6, 6),
        textcoords="offset points",
        ha="right" if to_left else "left",
        fontsize=8,
        bbox={"boxstyle": "round,pad=0.2", "fc": "white", "ec": "none", "alpha": 0.7},
        zorder=5,
    )


def _widen(axis: Any) -> None:
    """Give the narrow direction a third of the wide one, so that a straight path has a picture."""
    (left, right), (bottom, top) = axis.get_xlim(), axis.get_ylim()
    least = max(right - left, top - bottom) / 3.0
    if right - left < least:
        axis.set_xlim(0.5 * (left + right - least), 0.5 * (left + right + least))
    if top - bottom < least:
        axis.set_ylim(0.5 * (bottom + top - least), 0.5 * (bottom + top + least))


def reading_unit(largest: float, base: str) -> tuple[float, str]:
    """Return factor and name of the unit in which `largest` [base] reads well."""
    steps = {
        "m": ((1.0, 1.0, "m"), (1e-4, 1e3, "mm"), (1e-7, 1e6, "µm"), (0.0, 1e9, "nm")),
        "N": ((1e4, 1e-3, "kN"), (0.1, 1.0, "N"), (1e-4, 1e3, "mN"), (0.0, 1e6, "µN")),
        "s": ((0.1, 1.0, "s"), (1e-4, 1e3, "ms"), (0.0, 1e6, "µs")),
        "J": (
            (1e4, 1e-3, "kJ"),
            (0.1, 1.0, "J"),
            (1e-4, 1e3, "mJ"),
            (1e-7, 1e6, "µJ"),
            (0.0, 1e9, "nJ"),
        ),
    }
    for least, factor, name in steps[base]:
        if largest >= least and largest > 0.0:
            return factor, name
    return 1.0, base


def _seen_axes(normal: FloatArray) -> tuple[int, int]:
    """Return the axes that point right and up for an eye on the side of the mean `normal` (3,)."""
    along = int(np.argmax(np.abs(normal)))
    right, up = {0: (1, 2), 1: (2, 0), 2: (0, 1)}[along]
    return (up, right) if normal[along] < 0.0 else (right, up)


def _draw_shell(axis: Any, shell: Shell, chosen: list[int], factor: float) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    flat = np.asarray(shell.vertices)[:, chosen] * factor
    triangles = np.asarray(shell.triangles)
    if len(triangles) <= MOST_FILLED:
        fill = PolyCollection(
            list(flat[triangles]),
            facecolors="#dfe7e5",
            edgecolors="#dfe7e5",
            linewidths=0.4,
            zorder=1,
        )
        axis.add_collection(fill)
    edges = shell.edge_vertices
    sharp = edges[shell.edge_class != 0]
    if not len(sharp) and len(edges) <= MOST_FILLED:
        sharp = edges
    outline = LineCollection(flat[sharp], colors="#6f8f89", linewidths=0.7, zorder=2)
    axis.add_collection(outline)
    low, high = flat.min(axis=0), flat.max(axis=0)
    axis.update_datalim(np.array([low, high]))
