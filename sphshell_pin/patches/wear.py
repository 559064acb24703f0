"""Wear by Preston's law: what the patches of a run took off the shells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.arrays import Array
from sphshell_pin.atomic import atomic_file
from sphshell_pin.checks import check_positive, read_only
from sphshell_pin.dynamics.result.result_scene import scene_of
from sphshell_pin.errors import ResultError
from sphshell_pin.offered import offered
from sphshell_pin.patches.ellipse import stroke
from sphshell_pin.patches.foundation import Overlap, overlap_of
from sphshell_pin.patches.placed import Longs, PlacedPatches, patches_on
from sphshell_pin.patches.sampling import Grid, Samples, divide
from sphshell_pin.patches.taxels import same_shell
from sphshell_pin.summary import Fact, Summarized

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.pairs import ContactPair
    from sphshell_pin.dynamics.scene.scene import Scene
    from sphshell_pin.shell.shell import Shell

# Samples over the smaller half axis of a patch, unless a resolution is given.
_PER_HALF_AXIS = 5.0
_MOST_PLACES = 3e6  # along all strokes
# A patch wears what faces it within 72 degrees and is no farther from its plane than this share of
# its larger half axis.
_FACING, _FAR = 0.3, 1.0


@dataclass(frozen=True, repr=False)
class WearMap(Summarized):
    """What was removed from one shell, on small pieces of it where contacts passed.

    Attributes
    ----------
    shell : the Shell
    corners : (k, 4, 3) of the pieces [m], in the shell's frame
    points : (k, 3), their centers [m]
    triangle : (k,) the shell's triangle that each is a part of
    areas : (k,) [m^2]
    depth : (k,) removed, along the normal [m]
    resolution : longest side of a piece [m]
    unresolved : share of the volume that passed between the centers, and was given to the nearest
    """

    shell: Shell
    corners: Array
    points: Array
    triangle: Longs
    areas: Array
    depth: Array
    resolution: float
    unresolved: float

    def _facts(self) -> list[Fact]:
        return [
            Fact("shell", self.shell.name),
            Fact("pieces", len(self.depth)),
            Fact("removed volume", self.volume, "m^3"),
            Fact("largest depth", float(self.depth.max(initial=0.0)), "m"),
            Fact("longest side of a piece", self.resolution, "m", brief=False),
            Fact("share between the pieces' centers", self.unresolved, brief=False),
        ]

    @property
    def volume(self) -> float:
        """Removed volume [m^3]: the coefficient times the sum of force, slip and time."""
        return float(self.depth @ self.areas)

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the arrays to a compressed .npz file; return its path."""
        return _save(path, self.arrays())

    def arrays(self) -> dict[str, Array | Longs]:
        """Return corners, points, triangle, areas and depth by name."""
        names = ("corners", "points", "triangle", "areas", "depth")
        return {name: getattr(self, name) for name in names}

    def plot(self) -> Figure:
        """Return a picture of it; MissingExtra without matplotlib."""
        figure: Figure = offered("sphshell_pin.plot.wear:plot_wear")([self])
        return figure


def wear_maps(
    result: Result,
    coefficient: float,
    scene: Scene | None = None,
    *,
    resolution: float | None = None,
) -> tuple[WearMap, ...]:
    """Return what each shell lost by Preston's law: depth = coefficient x pressure x slip x time.

    Between two recorded rows a patch moves on a straight line, and force times slip changes
    linearly: the pressure that a place of the shell feels is integrated exactly along that stroke.
    Strokes are therefore smooth, whatever the time between rows, as long as the path is straight
    between them to a small share of a half axis. Each stroke is scaled so that the volume it
    removes is that of Preston's law for its force, at any resolution.

    The slip is that of the contact point: a sphere that only spins about the normal removes
    nothing. The shell keeps its shape: wear does not act back on the contacts.

    Parameters
    ----------
    result : of a run with record=("patch",)
    coefficient : Preston's [1/Pa]
    scene : by default the one that ran, or that of the scenario the result came from
    resolution : largest side of the pieces on which the depth is given [m]; by default a fifth
        of the median smaller half axis

    Raises
    ------
    ResultError
        There are no patches, or no scene.
    InvalidParameter
        The coefficient or the resolution is not positive, or that needs too many pieces.
    """
    coefficient = check_positive("coefficient", coefficient, "1/Pa")
    if resolution is not None:
        resolution = check_positive("resolution", resolution, "m")
    scene = scene_of(result, scene)
    result.patches  # noqa: B018  # which may have none, before the work begins
    maps = []
    seen: set[int] = set()
    for k, pair in enumerate(scene.pairs):
        if k in seen or pair.shell is None:
            continue
        alike = same_shell(scene, pair)
        seen |= set(alike)
        patches = patches_on(result, scene, alike, pair.joint_j, pair.placement_j)
        if len(patches.row):
            overlap = overlap_of(result, scene, patches)
            t = np.asarray(result.t)
            maps.append(_map(t, pair, patches, overlap, coefficient, resolution))
    return tuple(maps)


def _map(
    t: Array,
    pair: ContactPair,
    patches: PlacedPatches,
    overlap: Overlap | None,
    coefficient: float,
    resolution: float | None,
) -> WearMap:
    shell = pair.shell
    assert shell is not None
    fine = resolution or float(np.median(patches.half_axes[:, 1])) / _PER_HALF_AXIS
    strokes = strokes_of(t, patches)
    largest = float(patches.half_axes.max())
    places = _along(patches.points, strokes, largest)
    samples = divide(shell, places, 1.1 * largest + fine, fine, curved=pair.method == "smooth")
    if not len(samples.areas):
        raise ResultError("the result", f"has no contact near shell '{shell.name}': is it another?")
    removed, lost = deposit(samples, patches, strokes, shell, overlap)
    volume = float(removed @ samples.areas)
    if not np.isfinite(volume):
        raise ResultError("the result", "has strokes or forces that overflow: is it damaged?")
    return WearMap(
        shell,
        read_only(samples.corners),
        read_only(samples.points),
        read_only(samples.triangle),
        read_only(samples.areas),
        read_only(coefficient * removed),
        fine,
        lost / volume if volume else 0.0,
    )


def _save(path: str | PathLike[str], arrays: dict[str, Array | Longs]) -> Path:
    with atomic_file(Path(path)) as stream:
        np.savez_compressed(stream, allow_pickle=False, **arrays)
    return Path(path)


def save_wear(maps: Sequence[WearMap], folder: str | PathLike[str], *, figure: bool = True) -> None:
    """Write wear.npz, the arrays of all maps, and with `figure` wear.png into `folder`.

    Of several maps the names of the arrays begin with that of the shell. Raises MissingExtra
    without matplotlib.
    """
    arrays: dict[str, Array | Longs] = {}
    for one in maps:
        prefix = "" if len(maps) == 1 else f"{one.shell.name}."
        arrays |= {f"{prefix}{name}": array for name, array in one.arrays().items()}
    _save(Path(folder) / "wear.npz", arrays)
    if figure:
        drawn = offered("sphshell_pin.plot.wear:plot_wear")(maps)
        offered("sphshell_pin.plot.figure:write_figure")(Path(folder) / "wear.png", drawn)


@dataclass(frozen=True)
class Strokes:
    """Motions of patches from entry `first` to entry `last` (k,), which are one at ends of touch.

    `begin` and `end` (k,) are force times slip [W] at the two, `time` [s] how long it takes.
    """

    first: Longs
    last: Longs
    begin: Array
    end: Array
    time: Array


def strokes_of(t: Array, patches: PlacedPatches) -> Strokes:
    """Return the strokes between the rows `t` (n,) [s]: each contact goes on by its id.

    Where it has no next or previous row, it stays for half the time to that. So the sum of all is
    that of force, slip and time with the trapezoid rule over rows.
    """
    order = np.lexsort((patches.row, patches.contact_id, patches.pair))
    pair, contact, row = (getattr(patches, name)[order] for name in ("pair", "contact_id", "row"))
    goes_on = (np.diff(pair) == 0) & (np.diff(contact) == 0) & (np.diff(row) == 1)
    first, last = order[:-1][goes_on], order[1:][goes_on]
    power = patches.force * patches.slip
    gap = np.append(np.diff(t), 0.0)
    alone = []
    for there, step in ((np.append(goes_on, False), 0), (np.append(False, goes_on), -1)):
        at = order[~there]
        time = np.append(0.0, gap)[patches.row[at] + 1 + step]
        alone.append((at, 0.5 * time))
    at = np.concatenate([first, *(one[0] for one in alone)])
    to = np.concatenate([last, *(one[0] for one in alone)])
    time = np.concatenate([gap[patches.row[first]], *(one[1] for one in alone)])
    return Strokes(at, to, power[at], power[to], time)


def _along(points: Array, strokes: Strokes, step: float) -> Array:
    """Return places along the strokes, no farther apart than `step` [m]."""
    begin, end = points[strokes.first], points[strokes.last]
    counts = np.ceil(np.linalg.norm(end - begin, axis=1) / step) + 1
    if not counts.sum() < _MOST_PLACES:
        raise ResultError(
            "the result", "has strokes that are far longer than its patches: is it damaged?"
        )
    pieces = counts.astype(np.int64)
    which = np.repeat(np.arange(len(pieces)), pieces)
    at = np.arange(len(which)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    share = (at / np.maximum(pieces[which] - 1, 1))[:, None]
    return np.asarray(begin[which] + share * (end - begin)[which])


def deposit(
    samples: Samples,
    patches: PlacedPatches,
    strokes: Strokes,
    shell: Shell,
    overlap: Overlap | None = None,
) -> tuple[Array, float]:
    """Return the work of slip on the samples [J/m^2], and what of it [J] the nearest ones got."""
    grid = Grid(samples.points, float(patches.half_axes.max()))
    part = np.asarray(shell.element_patch)[np.asarray(shell.triangle_element)[samples.triangle]]
    removed, lost = np.zeros(len(samples.areas)), 0.0
    for k in np.flatnonzero((strokes.begin != 0.0) | (strokes.end != 0.0)):
        i, j = strokes.first[k], strokes.last[k]
        begin, end = strokes.begin[k], strokes.end[k]
        work = 0.5 * (begin + end) * strokes.time[k]
        if work == 0.0:
            continue
        half = 0.5 * (patches.half_axes[i] + patches.half_axes[j])
        normal = _unit(patches.normals[i] + patches.normals[j], patches.normals[i])
        a, b = patches.points[i], patches.points[j]
        # An overlap is no ellipse about the contact: it may reach farther.
        whole = overlap is not None and overlap.holds[i]
        reach = 2.0 * half[0] if whole else half[0]
        near = grid.within(np.minimum(a, b) - reach, np.maximum(a, b) + reach)
        facing = samples.normals[near] @ normal
        near = near[(facing if shell.is_closed else np.abs(facing)) > _FACING]
        if overlap is not None and whole:
            near = near[part[near] == shell.element_patch[patches.element[i]]]
            shape = overlap.stroke(samples.points[near], i, j, half[1], begin, end)
        else:
            seen = samples.points[near] - a
            plane = _axes(patches, i, j, normal) / half
            shape = stroke(seen @ plane, (b - a) @ plane, begin, end)
            shape[np.abs(seen @ normal) > _FAR * half[0] + np.linalg.norm(b - a)] = 0.0
        total = float(shape @ samples.areas[near])
        if total * work > 0.0:
            removed[near] += shape * (work / total)
        else:
            close = int(np.argmin(((samples.points - 0.5 * (a + b)) ** 2).sum(axis=1)))
            removed[close] += work / samples.areas[close]
            lost += work
    return removed, lost


def _axes(patches: PlacedPatches, i: int, j: int, normal: Array) -> Array:
    """Return the mean directions (3, 2) of the half axes of two patches."""
    # Axes have no sign.
    other = patches.axes[j] * (1.0 if patches.axes[i] @ patches.axes[j] >= 0.0 else -1.0)
    axis = patches.axes[i] + other
    axis = _unit(axis - normal * (normal @ axis), np.cross(normal, patches.axes[i]))
    return np.stack([axis, np.cross(normal, axis)], axis=1)


def _unit(vector: Array, other: Array) -> Array:
    """Return the direction of `vector`, or that of `other` where it has none."""
    chosen = vector if np.linalg.norm(vector) > 1e-9 else other
    return np.asarray(chosen / np.linalg.norm(chosen))
