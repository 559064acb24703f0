"""A shell with its elements colored, in matplotlib's three-dimensional axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sphshell_pin.base.arrays import Array, Longs, Mask
from sphshell_pin.plot.figure import INK, new_figure, reading_unit
from sphshell_pin.view.contact_path import ContactPath, contact_paths, spaced

if TYPE_CHECKING:
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D

    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.scene import Scene
    from sphshell_pin.shell.shell import Shell

BARE = np.array([0.80, 0.86, 0.845, 1.0])  # an element that nothing touched
EDGE = (0.35, 0.45, 0.43, 0.55)
MOST_OUTLINED = 4_000
MOST_PAINTED = 30_000
FINE = 0.012  # an element of this share of the picture is no wider than a line
CONTEXT = 2.2  # width of the picture in widths of what was touched
MOST_STEPS = 5_000  # of a path, over the size of its picture
LABEL_BOX = {"boxstyle": "round,pad=0.2", "fc": "white", "ec": "none", "alpha": 0.7}


@dataclass(frozen=True)
class PathGroup:
    """The paths on one shell, in its frame."""

    shell: Shell
    paths: list[ContactPath]


def group_paths(result: Result, scene: Scene) -> list[PathGroup]:
    """Return the paths of `result`, those on one shell together."""
    groups: dict[object, PathGroup] = {}
    for path in contact_paths(result, scene):
        if path.on_shell:
            (side,) = scene.pairs[path.pair].shells
            groups.setdefault(side.key, PathGroup(side.shell, [])).paths.append(path)
    return list(groups.values())


def eye_direction(normal: Array) -> Array:
    """Return the unit vector (3,) to the eye: before a surface of this mean `normal` (3,).

    A little from the side, so that the picture has depth.
    """
    normal = normal / np.linalg.norm(normal)
    z = np.array([0.0, 0.0, 1.0])
    if abs(normal[2]) > 0.8:
        toward = normal + np.array([0.25, -0.7, 0.0])
    else:
        toward = normal + 0.35 * (z - normal[2] * normal) + 0.3 * np.cross(z, normal)
    return np.asarray(toward / np.linalg.norm(toward))


@dataclass(frozen=True)
class Picture:
    """One axis with a shell on it, seen from `toward` (3,); `factor` converts meters to its unit.

    The picture reaches from `low` to `high` (3,) [m].
    """

    axis: Axes3D
    toward: Array
    low: Array
    high: Array
    factor: float

    @classmethod
    def of(cls, axis: Axes3D, shell: Shell, normal: Array, touched: Array) -> Picture:
        """Prepare `axis` for all of `shell`, or of a much larger one what is about `touched`.

        normal : mean contact normal (3,)
        touched : points (k, 3) [m]
        """
        box = np.vstack((touched, np.asarray(shell.box)))
        low, high = box.min(axis=0), box.max(axis=0)
        least, most = touched.min(axis=0), touched.max(axis=0)
        half = 0.5 * CONTEXT * float((most - least).max())
        if 0.0 < 2.0 * half < 0.6 * float((high - low).max()):
            middle = 0.5 * (least + most)
            low, high = np.maximum(low, middle - half), np.minimum(high, middle + half)
        size = float((high - low).max()) or 1e-3
        # A flat or straight thing, too, has a box.
        room = np.maximum(0.0, 0.12 * size - (high - low))
        low, high = low - 0.5 * room, high + 0.5 * room
        factor, unit = reading_unit(size, "m")
        toward = eye_direction(normal)
        axis.view_init(
            elev=np.rad2deg(np.arcsin(toward[2])), azim=np.rad2deg(np.arctan2(toward[1], toward[0]))
        )
        for k, name in enumerate("xyz"):
            getattr(axis, f"set_{name}lim")(low[k] * factor, high[k] * factor)
            getattr(axis, f"set_{name}label")(f"{name} of the shell [{unit}]", fontsize=8)
            ticks = max(1, round(4.0 * (high[k] - low[k]) / size))
            axis.locator_params(name, nbins=ticks)
            getattr(axis, f"{name}axis").set_pane_color((1.0, 1.0, 1.0, 0.0))
        axis.tick_params(labelsize=7)
        axis.set_box_aspect(high - low, zoom=0.84)  # leaves room for the labels
        return cls(axis, toward, low, high, factor)

    @property
    def size(self) -> float:
        """Largest extent [m]."""
        return float((self.high - self.low).max())

    def draw_shell(self, shell: Shell, values: Array, colors: Array) -> bool:
        """Draw `shell`, its elements in `colors` (m, 4) where `values` (m,) are positive.

        Return whether the colored elements were too small to be seen: they are then widened, the
        largest values on top.
        """
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

        corners = element_corners(shell)
        near = (corners.max(axis=1) >= self.low) & (corners.min(axis=1) <= self.high)
        inside = np.flatnonzero(near.all(axis=1))
        kept, corners = _fewer(corners[inside], values[inside] <= 0.0)
        kept = inside[kept]
        bare = values[kept] <= 0.0
        faces = np.tile(BARE, (len(kept), 1))
        faces[~bare] = colors[kept][~bare]
        plain = faces.copy()
        # The color of an element is a value: it is shaded less.
        shade = self._shade(corners)
        faces[:, :3] *= np.where(bare, shade, 0.75 + 0.25 * shade)[:, None]
        edges = EDGE if len(kept) <= MOST_OUTLINED else faces
        shown = Poly3DCollection(
            corners * self.factor, facecolors=faces, edgecolors=edges, linewidths=0.4, zorder=1
        )
        self.axis.add_collection3d(shown, autolim=False)
        sizes = np.ptp(corners[~bare], axis=1).max(axis=1)
        fine = len(sizes) > 0 and float(np.median(sizes)) < FINE * self.size
        if fine:
            order = np.flatnonzero(~bare)[np.argsort(values[kept][~bare])]
            look = {"facecolors": plain[order], "edgecolors": plain[order], "linewidths": 3.5}
            self.axis.add_collection3d(
                Poly3DCollection(corners[order] * self.factor, zorder=2, **look), autolim=False
            )
        return fine

    def kept(self, points: Array) -> Longs:
        """Return the indices of those points of a path (k, 3) [m] that differ in the picture."""
        return spaced(points, self.size / MOST_STEPS)

    def mark_start(self, point: Array, name: str) -> None:
        """Draw a dot where a pair touched first, `point` (3,) [m]."""
        place = point * self.factor
        self.axis.plot(*place[:, None], marker="o", markersize=5, color=INK, zorder=7)
        if name:
            self.axis.text(*place, f"  {name}", fontsize=8, bbox=LABEL_BOX, zorder=6)

    def _shade(self, corners: Array) -> Array:
        """Return the brightness (m,) of elements, lit from above the eye, equal on both sides."""
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        normals *= np.where(normals @ self.toward < 0.0, -1.0, 1.0)[:, None]
        light = self.toward + np.array([0.0, 0.0, 0.5])
        return np.asarray(0.6 + 0.4 * np.clip(normals @ light / np.linalg.norm(light), 0.0, 1.0))


def shell_figure(title: str, count: int) -> tuple[Figure, list[Axes3D]]:
    """Return a figure called `title` and `count` axes in it, two in a row."""
    columns = min(count, 2)
    rows = -(-count // columns)
    figure = new_figure(2.7 + 5.1 * columns, 0.8 + 5.4 * rows, title)
    look: dict[str, Any] = {"projection": "3d", "proj_type": "ortho", "computed_zorder": False}
    return figure, [figure.add_subplot(rows, columns, k + 1, **look) for k in range(count)]


def color_scale(largest: float, colors: str) -> ScalarMappable:
    """Return the scale from 0 to `largest`, to 1 if that is 0, in the `colors` of matplotlib."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return ScalarMappable(Normalize(0.0, largest or 1.0), colormaps[colors])


def element_corners(shell: Shell) -> Array:
    """Return the corners of each element (m, 4, 3) [m], a triangle's last one twice."""
    elements = np.asarray(shell.elements, dtype=np.int64)
    last = elements[:, min(3, elements.shape[1] - 1)]
    whole = np.column_stack((elements[:, :3], np.where(last < 0, elements[:, 2], last)))
    return np.asarray(np.asarray(shell.vertices, dtype=float)[whole])


def _fewer(corners: Array, bare: Mask) -> tuple[Longs, Array]:
    """Return the numbers (k,) and corners (k, 4, 3) of the elements to paint.

    Of very many `bare` ones (m,) some are left out, and the others enlarged to take their place.
    """
    share = max(1, -(-int(np.count_nonzero(bare)) // MOST_PAINTED))
    kept = np.sort(np.concatenate((np.flatnonzero(bare)[::share], np.flatnonzero(~bare))))
    middle = corners[kept].mean(axis=1, keepdims=True)
    scale = 1.5 * np.sqrt(share) if share > 1 else 1.0
    size = np.where(bare[kept], scale, 1.0)[:, None, None]
    return kept, middle + size * (corners[kept] - middle)
