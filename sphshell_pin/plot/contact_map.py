"""The shell with its elements colored by what the contacts did to each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.result.result_scene import scene_of
from sphshell_pin.plot import on_shell
from sphshell_pin.plot.figure import INK, NO_CONTACT, only_say, reading_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.scene import Scene
    from sphshell_pin.shell.shell import Shell

COLORS = "plasma"
BEHIND = -0.1  # cosine between normal and line of sight of a contact that has a picture of its own
MOST_VIEWS = 6
MISSED = 0.15  # share of the impulse between the recorded rows that is worth a word


@dataclass(frozen=True)
class _View:
    """One picture: a shell, what its elements took (m,), and what is seen along `normal` (3,).

    That are the contacts' `paths`, (k, 3) each, and by name where a pair touched first (3,) [m].
    """

    shell: Shell
    values: Array
    paths: list[Array]
    starts: dict[str, Array]
    normal: Array
    title: str


def plot_contact_map(result: Result, scene: Scene | None = None) -> Figure:
    """Return a Figure of each shell that was touched, its elements colored by their impulse.

    That is the normal force over time [N s], as the recorded rows have it. The dark line is the
    path of the contact, the dot its first touch. A shell that is touched from opposite sides has
    two pictures; of one much larger than the path the part about the path is shown.

    `scene` is by default the scene that ran, or that of the scenario the result came from. Raises
    ResultError without a scene, MissingExtra without matplotlib.
    """
    scene = scene_of(result, scene)
    groups = on_shell.group_paths(result, scene)
    views = [view for group in groups for view in _views(result, group)][:MOST_VIEWS]
    if not views:
        reason = "No shell was touched." if len(result.contacts.t) else NO_CONTACT
        return only_say("Contact map", reason)
    title = f"Contact map{_caution(result, groups)}"
    figure, axes = on_shell.shell_figure(title, len(views))
    largest = max(float(view.values.max()) for view in views)
    factor, unit = reading_unit(largest, "N")
    scale = on_shell.color_scale(largest * factor, COLORS)
    for axis, view in zip(axes, views, strict=True):
        touched = on_shell.element_corners(view.shell)[view.values > 0.0].reshape(-1, 3)
        near = np.vstack((touched, *view.paths))
        picture = on_shell.Picture.of(axis, view.shell, view.normal, near)
        fine = picture.draw_shell(view.shell, view.values, scale.to_rgba(view.values * factor))
        # Where elements are as fine as a line, their colors are the path.
        for path in [] if fine else view.paths:
            line = path[picture.kept(path)].T * picture.factor
            marker = {"marker": "o", "markersize": 2.0} if len(line.T) == 1 else {}
            axis.plot(*line, color="white", linewidth=2.6, solid_capstyle="round", zorder=3)
            axis.plot(*line, color=INK, linewidth=1.1, solid_capstyle="round", zorder=4, **marker)
        for name, start in view.starts.items():
            picture.mark_start(start, name if len(result.pairs) > 1 else "")
        axis.set_title(view.title, fontsize=10)
    label = f"normal impulse on each element [{unit} s]"
    figure.colorbar(scale, ax=axes, label=label, shrink=0.8)
    return figure


def element_impulses(result: Result, pairs: list[int], elements: int) -> Array:
    """Return the impulse that each of a shell's `elements` took from `pairs`, (elements,) [N s]."""
    log = result.contacts
    own = np.isin(log.pair, pairs) & (np.asarray(log.element) >= 0)
    element = np.asarray(log.element, dtype=np.int64)[own]
    row = np.asarray(log.row, dtype=np.int64)[own]
    force = np.asarray(log.normal_force, dtype=float)[own]
    # Each row stands for half the time to its neighbors.
    half = 0.5 * np.diff(np.asarray(result.t, dtype=float))
    share = np.append(half, 0.0) + np.append(0.0, half)
    values = np.zeros(elements)
    np.add.at(values, element, force * share[row])
    return values


def _caution(result: Result, groups: list[on_shell.PathGroup]) -> str:
    """Say so where the recorded rows missed much of what the contacts did, else nothing."""
    figures = result.stats.pairs
    seen, done = 0.0, 0.0
    for pair in (path.pair for group in groups for path in group.paths):
        done_by_pair = figures.get(str(result.pairs[pair]))
        if done_by_pair is None:
            continue
        one = element_impulses(result, [pair], int(np.max(result.contacts.element)) + 1)
        seen += float(one.sum())
        done += done_by_pair.mean_force * done_by_pair.contact_time
    if abs(done - seen) <= MISSED * done or done <= 0.0:
        return ""
    return f"\nthe recorded rows hold {seen / done:.0%} of it: record more often (record_dt)"


def _views(result: Result, group: on_shell.PathGroup) -> list[_View]:
    """Return the pictures of one shell: one, or two if it is touched from opposite sides."""
    shell = group.shell
    values = element_impulses(result, [path.pair for path in group.paths], len(shell.elements))
    normals = np.concatenate([path.normals for path in group.paths])
    force = np.concatenate([path.force for path in group.paths])
    first = np.average(normals, axis=0, weights=np.maximum(force, 0.0) + 1e-12)
    if np.linalg.norm(first) < 0.2:
        first = normals[np.argmax(force)]
    corners = on_shell.element_corners(shell)
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward /= np.maximum(np.linalg.norm(outward, axis=1), 1e-300)[:, None]
    facing = outward @ (first / np.linalg.norm(first))
    views = []
    for side, where in ((1.0, ""), (-1.0, ", the other side")):
        paths, starts = [], {}
        for path in group.paths:
            seen = side * (path.normals @ first) / np.linalg.norm(first) >= BEHIND
            for run in path.runs:
                if seen[run].any():
                    paths.append(path.points[run[seen[run]]])
            if seen[0]:
                starts[str(result.pairs[path.pair])] = path.points[0]
        if not paths:
            continue
        # Both sides of a sheet without thickness are the same elements.
        behind = (side * facing < BEHIND) if shell.is_closed else np.zeros(len(values), bool)
        shown = np.where(behind, 0.0, values)
        title = shell.name + where
        views.append(_View(shell, shown, paths, starts, side * first, title))
    return views
