"""The shell with its elements colored by what the contacts did to each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.result.result_scene import scene_of
from sphshell_pin.errors import NameNotFound
from sphshell_pin.plot import on_shell
from sphshell_pin.plot.figure import INK, NO_CONTACT, only_say, reading_unit

if TYPE_CHECKING:
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.scene import Scene
    from sphshell_pin.patches.placed import PlacedPatches
    from sphshell_pin.shell.shell import Shell

PATCH_COLORS = "viridis"
MOST = 40  # ellipses in one picture
_CIRCLE = np.linspace(0.0, 2.0 * np.pi, 33)


def patches_of(result: Result, scene: Scene, group: on_shell.PathGroup) -> PlacedPatches | None:
    """Return the patches on the shell of `group` in its frame, those that press."""
    from sphshell_pin.patches.placed import patches_on

    if result.patch_rows is None:
        return None
    pairs = [path.pair for path in group.paths]
    pair = scene.pairs[pairs[0]]
    patches = patches_on(result, scene, pairs, pair.joint_j, pair.placement_j)
    return patches.select(patches.force > 0.0)


def peak_pressure(patches: PlacedPatches) -> Array:
    """Return the peak of Hertz's pressure of each patch (k,) [Pa]."""
    return np.asarray(1.5 * patches.force / (np.pi * patches.half_axes.prod(axis=1)))


def draw_patches(
    picture: on_shell.Picture, patches: PlacedPatches, normal: Array, scale: ScalarMappable
) -> None:
    """Draw some ellipses on the side that `normal` (3,) shows, apart from each other, true to size.

    `scale` has the colors of the peak pressures [MPa].
    """
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    seen = np.flatnonzero(patches.normals @ normal > 0.0)
    if not len(seen):
        return
    peak = peak_pressure(patches)
    kept: list[int] = []
    extent = float(np.ptp(patches.points[seen], axis=0).max())
    for k in seen.tolist():
        near = patches.points[kept] - patches.points[k]
        apart = max(1.5 * float(patches.half_axes[k, 0]), extent / MOST)
        if not kept or float((near**2).sum(axis=1).min()) > apart**2:
            kept.append(k)
    kept = [kept[k] for k in np.unique(np.linspace(0, len(kept) - 1, MOST).astype(int))]
    ellipses = []
    for k in kept:
        axis = patches.axes[k]
        across = np.cross(patches.normals[k], axis)
        a, b = patches.half_axes[k]
        ring = a * np.cos(_CIRCLE)[:, None] * axis + b * np.sin(_CIRCLE)[:, None] * across
        ellipses.append((patches.points[k] + ring) * picture.factor)
    colors = scale.to_rgba(peak[kept] * 1e-6)
    shown = Poly3DCollection(ellipses, facecolors=colors, edgecolors=INK, linewidths=0.6, zorder=5)
    picture.axis.add_collection3d(shown, autolim=False)


QUANTITIES = {
    "impulse": ("normal impulse on each element", "N", " s"),
    "time": ("time in contact of each element", "s", ""),
    "peak": ("peak normal force on each element", "N", ""),
}
"""What an element can be colored by: its name, base unit, and what follows the unit."""
COLORS = "plasma"
BEHIND = -0.1  # cosine between normal and line of sight of a contact that has a picture of its own
MOST_VIEWS = 6
MISSED = 0.15  # share of the impulse, time or peak between the recorded rows that is worth a word


@dataclass(frozen=True)
class _View:
    """One picture: a shell, what its elements took (m,), and what is seen along `normal` (3,).

    That are the contacts' `paths`, (k, 3) each, by name where a pair touched first (3,) [m], and
    the patches, if they were recorded.
    """

    shell: Shell
    values: Array
    paths: list[Array]
    starts: dict[str, Array]
    normal: Array
    title: str
    patches: PlacedPatches | None = None


def plot_contact_map(
    result: Result, scene: Scene | None = None, quantity: str = "impulse"
) -> Figure:
    """Return a Figure of each shell that was touched, its elements colored by `quantity`.

    "impulse" is the normal force over time [N s], "time" the time in contact [s], "peak" the
    largest normal force [N] of each element, as the recorded rows have them. The dark line is the
    path of the contact, the dot its first touch; of recorded patches some are drawn, true to size
    and colored by their peak pressure. A shell that is touched from opposite sides has
    two pictures; of one much larger than the path the part about the path is shown.

    `scene` is by default the scene that ran, or that of the scenario the result came from. Raises
    NameNotFound for another quantity, ResultError without a scene, MissingExtra without matplotlib.
    """
    if quantity not in QUANTITIES:
        raise NameNotFound("quantity", quantity, "a contact map", QUANTITIES)
    scene = scene_of(result, scene)
    groups = [group for group in on_shell.group_paths(result, scene) if group.shell is not None]
    views = [
        view
        for group in groups
        for view in _views(result, group, quantity, patches_of(result, scene, group))
    ][:MOST_VIEWS]
    if not views:
        reason = "No shell was touched." if len(result.contacts.t) else NO_CONTACT
        return only_say("Contact map", reason)
    title = f"Contact map{_caution(result, groups, quantity)}"
    figure, axes = on_shell.shell_figure(title, len(views))
    label, base, after = QUANTITIES[quantity]
    largest = max(float(view.values.max()) for view in views)
    factor, unit = reading_unit(largest, base)
    scale = on_shell.color_scale(largest * factor, COLORS)
    peaks = [
        peak_pressure(view.patches).max(initial=0.0) for view in views if view.patches is not None
    ]
    pressure = on_shell.color_scale(max(peaks, default=0.0) * 1e-6, PATCH_COLORS)
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
        if view.patches is not None:
            draw_patches(picture, view.patches, view.normal, pressure)
        for name, start in view.starts.items():
            picture.mark_start(start, name if len(result.pairs) > 1 else "")
        axis.set_title(view.title, fontsize=10)
    figure.colorbar(scale, ax=axes, label=f"{label} [{unit}{after}]", shrink=0.8)
    if peaks:
        figure.colorbar(pressure, ax=axes, label="peak pressure of patches [MPa]", shrink=0.8)
    return figure


def element_values(result: Result, pairs: list[int], elements: int, quantity: str) -> Array:
    """Return what each of a shell's `elements` took from `pairs`, (elements,): see QUANTITIES."""
    log = result.contacts
    own = np.isin(log.pair, pairs) & (np.asarray(log.element) >= 0)
    element = np.asarray(log.element, dtype=np.int64)[own]
    row = np.asarray(log.row, dtype=np.int64)[own]
    force = np.asarray(log.normal_force, dtype=float)[own]
    # Each row stands for half the time to its neighbors.
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


def _caution(result: Result, groups: list[on_shell.PathGroup], quantity: str) -> str:
    """Say so where the recorded rows missed much of what the contacts did, else nothing."""
    figures = result.stats.pairs
    seen, done = 0.0, 0.0
    for pair in (path.pair for group in groups for path in group.paths):
        done_by_pair = figures.get(str(result.pairs[pair]))
        if done_by_pair is None:
            continue
        one = element_values(result, [pair], int(np.max(result.contacts.element)) + 1, quantity)
        if quantity == "peak":
            seen, done = max(seen, float(one.max())), max(done, done_by_pair.peak_force)
        else:
            seen += float(one.sum())
            force = done_by_pair.mean_force if quantity == "impulse" else 1.0
            done += force * done_by_pair.contact_time
    # Contacts that share a row are in touch at once, which the time counts for each.
    away = done - seen if quantity == "time" else abs(done - seen)
    if away <= MISSED * done or done <= 0.0:
        return ""
    return f"\nthe recorded rows hold {seen / done:.0%} of it: record more often (record_dt)"


def _views(
    result: Result, group: on_shell.PathGroup, quantity: str, patches: PlacedPatches | None
) -> list[_View]:
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
        views.append(_View(shell, shown, paths, starts, side * first, title, patches))
    return views
