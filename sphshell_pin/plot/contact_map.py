"""The shell with its elements coloured by what the contacts did to each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.errors import NameNotFound, ResultError
from sphshell_pin.plot.figure import NO_CONTACT, new_figure, say
from sphshell_pin.plot.relief import (
    Eye,
    Frame,
    draw_inset,
    draw_path,
    draw_relief,
    draw_scale,
    draw_start,
    element_corners,
)
from sphshell_pin.plot.series import FloatArray
from sphshell_pin.view.path_axes import PathGroup, group_paths, reading_unit

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result import Result
    from sphshell_pin.dynamics.scene import Scene
    from sphshell_pin.shell.shell import Shell

QUANTITIES = {
    "impulse": ("normal impulse on each element", "N", " s"),
    "time": ("time in contact of each element", "s", ""),
    "peak": ("peak normal force on each element", "N", ""),
}
"""What an element can be coloured by: its name, base unit, and what follows the unit."""
COLORS = "plasma"
BEHIND = -0.1  # cosine between normal and line of sight of a contact that has a picture of its own
MOST_VIEWS = 6
MISSED = 0.15  # share of the impulse, time or peak between the recorded rows that is worth a word


@dataclass(frozen=True)
class _View:
    """One picture: a shell, what its elements took (m,), and what `eye` sees on it.

    That are the contacts' `paths`, (k, 3) each, and by name where a pair touched first (3,) [m].
    """

    shell: Shell
    values: FloatArray
    paths: list[FloatArray]
    starts: dict[str, FloatArray]
    eye: Eye
    title: str

    @property
    def frame(self) -> Frame:
        """What the picture shows: all that was touched."""
        elements = np.asarray(self.shell.elements)[self.values > 0.0]
        corners = np.asarray(self.shell.vertices)[np.unique(elements[elements >= 0])]
        return Frame.around(np.vstack((corners, *self.paths)), self.shell, self.eye)


def plot_contact_map(result: Result, scene: Scene | None = None, quantity: str = "impulse") -> Any:
    """Return a Figure of each shell that was touched, its elements coloured by `quantity`.

    "impulse" is the normal force over time [N s], "time" the time in contact [s], "peak" the
    largest normal force [N] of each element, as the recorded rows have them. The dark line is the
    path of the contact, the dot its first touch. A shell that is touched from opposite sides has
    two pictures; one much larger than the path is shown in part, with the whole beside it.

    `scene` is by default the scene that ran. Raises NameNotFound for another quantity, ResultError
    without a scene, MissingExtra without matplotlib.
    """
    if quantity not in QUANTITIES:
        raise NameNotFound("quantity", quantity, "a contact map", QUANTITIES)
    scene = result.scene if scene is None else scene
    if scene is None:
        raise ResultError("the result", "has no scene to draw a map of: give scene=...")
    groups = [group for group in group_paths(result, scene) if group.shell is not None]
    views = [view for group in groups for view in _views(result, group, quantity)][:MOST_VIEWS]
    if not views:
        figure = new_figure(9.0, 5.0)
        say(
            figure.subplots(), NO_CONTACT if not len(result.contacts.t) else "No shell was touched."
        )
        figure.suptitle("Contact map", fontsize=12)
        return figure
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    label, base, after = QUANTITIES[quantity]
    largest = max(float(view.values.max()) for view in views)
    factor, unit = reading_unit(largest, base)
    scale = ScalarMappable(Normalize(0.0, largest * factor or 1.0), colormaps[COLORS])
    frames = [view.frame for view in views]
    columns = min(len(views), 2)
    rows = -(-len(views) // columns)
    # Tall shells stand side by side without wide gaps.
    width = 5.2 * min(1.3, max(0.5, *(frame.aspect for frame in frames)))
    figure = new_figure(2.4 + width * columns, 0.8 + 5.4 * rows, "compressed")
    axes = figure.subplots(rows, columns, squeeze=False).reshape(-1)
    for axis, view, frame in zip(axes, views, frames, strict=False):
        colors = np.full((len(view.values), 4), np.nan)
        took = view.values > 0.0
        colors[took] = scale.to_rgba(view.values[took] * factor)
        draw_relief(axis, view.shell, view.values, colors, view.eye, frame)
        # Where elements are as fine as a line, their colours are the path.
        if not frame.shows_fine(view.eye.flat(element_corners(view.shell)[took])):
            for path in view.paths:
                draw_path(axis, path, view.eye, frame)
        for name, start in view.starts.items():
            draw_start(axis, start, view.eye, name if len(result.pairs) > 1 else "")
        if frame.cut:
            draw_inset(axis, view.shell, view.eye, frame)
        draw_scale(axis, view.eye)
        axis.set_title(view.title, fontsize=10)
    for axis in axes[len(views) :]:
        axis.set_axis_off()
    figure.colorbar(scale, ax=axes.tolist(), label=f"{label} [{unit}{after}]", shrink=0.8)
    figure.suptitle(f"Contact map{_caution(result, groups, quantity)}", fontsize=12)
    return figure


def element_values(result: Result, pairs: list[int], elements: int, quantity: str) -> FloatArray:
    """Return what each of a shell's `elements` took from `pairs`, (elements,): see QUANTITIES."""
    log = result.contacts
    own = np.isin(log.pair, pairs) & (np.asarray(log.element) >= 0)
    element = np.asarray(log.element, dtype=np.int64)[own]
    row = np.asarray(log.row, dtype=np.int64)[own]
    force = np.asarray(log.normal_force, dtype=float)[own]
    # Each row stands for half the time to its neighbours.
    half = 0.5 * np.diff(np.asarray(result.t, dtype=float))
    share = np.append(half, 0.0) + np.append(0.0, half)
    values = np.zeros(elements)
    if quantity == "impulse":
        np.add.at(values, element, force * share[row])
    elif quantity == "peak":
        np.maximum.at(values, element, force)
    else:
        once = np.unique(np.column_stack((element, row)), axis=0)
        np.add.at(values, once[:, 0], share[once[:, 1]])
    return values


def _caution(result: Result, groups: list[PathGroup], quantity: str) -> str:
    """Say so where the recorded rows missed much of what the contacts did, else nothing."""
    figures = result.stats.pairs
    seen, done = 0.0, 0.0
    for pair in (path.pair for group in groups for path in group.paths):
        told = figures.get(str(result.pairs[pair]))
        if told is None:
            continue
        one = element_values(result, [pair], int(np.max(result.contacts.element)) + 1, quantity)
        if quantity == "peak":
            seen, done = max(seen, float(one.max())), max(done, told.peak_force)
        else:
            seen += float(one.sum())
            force = told.mean_force if quantity == "impulse" else 1.0
            done += force * told.contact_time
    # Contacts that share a row are in touch at once, which the time counts for each.
    away = done - seen if quantity == "time" else abs(done - seen)
    if away <= MISSED * done or done <= 0.0:
        return ""
    return f"\nthe recorded rows hold {seen / done:.0%} of it: record more often (record_dt)"


def _views(result: Result, group: PathGroup, quantity: str) -> list[_View]:
    """Return the pictures of one shell: one, or two if it is touched from opposite sides."""
    shell = group.shell
    assert shell is not None
    values = element_values(
        result, [path.pair for path in group.paths], len(shell.elements), quantity
    )
    normals = np.concatenate([path.normals for path in group.paths])
    force = np.concatenate([path.force for path in group.paths])
    first = np.average(normals, axis=0, weights=np.maximum(force, 0.0) + 1e-12)
    if np.linalg.norm(first) < 0.2:
        first = normals[np.argmax(force)]
    facing = _element_normals(shell) @ (first / np.linalg.norm(first))
    views = []
    for side, where in ((1.0, ""), (-1.0, ", the other side")):
        eye = Eye.before(side * first)
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
        # Of a sheet without thickness both sides are the same elements.
        behind = (side * facing < BEHIND) if shell.is_closed else np.zeros(len(values), bool)
        shown = np.where(behind, 0.0, values)
        views.append(_View(shell, shown, paths, starts, eye, shell.name + where))
    return views


def _element_normals(shell: Shell) -> NDArray[np.float64]:
    """Return a unit normal for each element (m, 3), outward where the shell is closed."""
    a, b, c = (np.asarray(shell.vertices)[np.asarray(shell.elements)[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    unit: FloatArray = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    return unit
