"""A surface seen at a slant: elements painted from the back to the front, shaded, with a scale."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.plot.series import FloatArray
from sphshell_pin.view.contact_path import IndexArray, spaced
from sphshell_pin.view.path_axes import reading_unit

if TYPE_CHECKING:
    from sphshell_pin.shell.shell import Shell

BARE = np.array([0.80, 0.86, 0.845, 1.0])  # an element that nothing touched
EDGE = (0.35, 0.45, 0.43, 0.55)
INK = "#101418"
MOST_OUTLINED = 4_000
MOST_PAINTED = 60_000
FINE = 0.012  # an element of this share of the picture is no wider than a line
CONTEXT = 2.2  # width of the picture in widths of what was touched
AXIS_COLORS = ("#c0392b", "#2e8b57", "#2f6fde")


@dataclass(frozen=True)
class Eye:
    """Where one looks from: `right`, `up`, `toward` (3,) unit vectors in the shell's frame."""

    right: FloatArray
    up: FloatArray
    toward: FloatArray

    @classmethod
    def before(cls, normal: FloatArray) -> Eye:
        """Look at a surface of that mean `normal` (3,) from before it, a little from aside."""
        normal = normal / np.linalg.norm(normal)
        z = np.array([0.0, 0.0, 1.0])
        if abs(normal[2]) > 0.8:
            toward = normal + np.array([0.25, -0.7, 0.0])
        else:
            toward = normal + 0.35 * (z - normal[2] * normal) + 0.3 * np.cross(z, normal)
        toward /= np.linalg.norm(toward)
        right = np.cross(z, toward)
        right /= np.linalg.norm(right)
        return cls(right, np.cross(toward, right), toward)

    def flat(self, points: FloatArray) -> FloatArray:
        """Return where `points` (..., 3) stand in the picture (..., 2)."""
        return np.stack((points @ self.right, points @ self.up), axis=-1)


@dataclass(frozen=True)
class Frame:
    """The part of a picture that is shown: its least and largest corner (2,) [m]."""

    low: FloatArray
    high: FloatArray
    cut: bool
    """Whether some of the shell is outside."""

    @classmethod
    def around(cls, points: FloatArray, shell: Shell, eye: Eye) -> Frame:
        """Frame all of `shell`, or of a much larger one the surroundings of `points` (n, 3)."""
        whole = eye.flat(element_corners(shell)).reshape(-1, 2)
        low, high = whole.min(axis=0), whole.max(axis=0)
        near = eye.flat(points)
        half = 0.5 * CONTEXT * float(np.ptp(near, axis=0).max())
        cut = 0.0 < 2.0 * half < 0.6 * float((high - low).max())
        if cut:
            middle = 0.5 * (near.min(axis=0) + near.max(axis=0))
            low, high = middle - half, middle + half
        margin = 0.04 * float((high - low).max())
        low, high = low - margin, high + margin
        # Room for the scale and the axes.
        low[1] -= 0.1 * (high[1] - low[1])
        return cls(low, high, cut)

    @property
    def aspect(self) -> float:
        """Width over height."""
        width, height = self.high - self.low
        return float(width / height)

    def shows_fine(self, flat: FloatArray) -> bool:
        """Whether most of the elements `flat` (k, 4, 2) would vanish below a line."""
        sizes = np.ptp(flat, axis=1).max(axis=1)
        width = float((self.high - self.low).max())
        return len(sizes) > 0 and float(np.median(sizes)) < FINE * width


def draw_relief(
    axis: Any,
    shell: Shell,
    values: FloatArray,
    colors: FloatArray,
    eye: Eye,
    frame: Frame,
) -> None:
    """Draw `shell` with its elements in `colors` (m, 4), NaN where bare.

    Elements too small to be seen are widened, those with the largest `values` (m,) on top.
    """
    corners = element_corners(shell)
    flat = eye.flat(corners)
    inside = (flat.max(axis=1) > frame.low).all(axis=1)
    inside &= (flat.min(axis=1) < frame.high).all(axis=1)
    corners, colors, values = corners[inside], colors[inside], values[inside]
    kept, corners = _fewer(corners, np.isnan(colors[:, 0]))
    flat, colors, values = eye.flat(corners), colors[kept], values[kept]
    bare = np.isnan(colors[:, 0])
    shade = _shade(corners, eye)
    faces = np.where(bare[:, None], BARE, colors)
    # The colour of an element tells a value: it is shaded less.
    faces[:, :3] *= np.where(bare, shade, 0.75 + 0.25 * shade)[:, None]
    _paint(axis, corners, flat, faces, eye)
    if frame.shows_fine(flat[~bare]):
        _widen(axis, flat[~bare], colors[~bare], values[~bare])
    axis.set_aspect("equal")
    axis.set_xlim(frame.low[0], frame.high[0])
    axis.set_ylim(frame.low[1], frame.high[1])
    axis.set_xticks([])
    axis.set_yticks([])


def draw_path(axis: Any, points: FloatArray, eye: Eye, frame: Frame) -> None:
    """Draw a line along `points` (k, 3); one point is a small dot."""
    step = 1e-3 * float((frame.high - frame.low).max())
    flat = eye.flat(points[spaced(points, step)])
    marker = {"marker": "o", "markersize": 2.0} if len(flat) == 1 else {}
    axis.plot(*flat.T, color="white", linewidth=2.6, solid_capstyle="round", zorder=3)
    axis.plot(*flat.T, color=INK, linewidth=1.1, solid_capstyle="round", zorder=4, **marker)


def draw_start(axis: Any, point: FloatArray, eye: Eye, name: str) -> None:
    """Mark where a pair touched first, `point` (3,), and say which, unless `name` is empty."""
    place = eye.flat(point)
    axis.plot(*place, marker="o", markersize=5, color=INK, zorder=5)
    if name:
        axis.annotate(
            name,
            place,
            xytext=(6, 4),
            textcoords="offset points",
            fontsize=8,
            bbox={"boxstyle": "round,pad=0.2", "fc": "white", "ec": "none", "alpha": 0.7},
            zorder=6,
        )


def draw_inset(axis: Any, shell: Shell, eye: Eye, frame: Frame) -> None:
    """Draw the whole `shell` small in a corner of `axis`, and the `frame` that it shows."""
    inset = axis.inset_axes((0.73, 0.73, 0.26, 0.26))
    _, corners = _fewer(element_corners(shell), np.ones(len(shell.elements), bool))
    faces = np.tile(BARE, (len(corners), 1))
    faces[:, :3] *= _shade(corners, eye)[:, None]
    flat = eye.flat(corners)
    _paint(inset, corners, flat, faces, eye, outlined=False)
    (left, bottom), (right, top) = frame.low, frame.high
    outline = [left, right, right, left, left], [bottom, bottom, top, top, bottom]
    inset.plot(*outline, color="#d4202a", linewidth=1.0, zorder=5)
    inset.set_aspect("equal")
    inset.set_xticks([])
    inset.set_yticks([])


def draw_scale(axis: Any, eye: Eye) -> None:
    """Draw a bar of a round length, and the shell's axes, into the lower corners of `axis`."""
    (left, right), (bottom, top) = axis.get_xlim(), axis.get_ylim()
    width, height = right - left, top - bottom
    length = _round_length(0.25 * width)
    factor, unit = reading_unit(length, "m")
    x, y = right - 0.05 * width, bottom + 0.04 * height
    axis.plot([x - length, x], [y, y], color=INK, linewidth=2.5, zorder=6)
    axis.annotate(
        f"{length * factor:g} {unit}",
        (x, y),
        xytext=(0, 4),
        textcoords="offset points",
        ha="right",
        fontsize=9,
        zorder=6,
    )
    arm = 0.09 * min(width, height)
    origin = np.array([left + 1.7 * arm, bottom + 1.3 * arm])
    for name, color, direction in zip("xyz", AXIS_COLORS, eye.flat(np.eye(3)), strict=True):
        tip = origin + arm * direction
        axis.plot(*np.stack((origin, tip)).T, color=color, linewidth=1.6, zorder=6)
        place = origin + 1.35 * arm * direction
        look = {"color": color, "fontsize": 9, "zorder": 6, "ha": "center", "va": "center"}
        axis.text(*place, name, **look)


def element_corners(shell: Shell) -> FloatArray:
    """Return the corners of each element (m, 4, 3) [m], a triangle's last one twice."""
    elements = np.asarray(shell.elements, dtype=np.int64)
    if elements.shape[1] == 3:
        elements = elements[:, [0, 1, 2, 2]]
    last = np.where(elements[:, 3] < 0, elements[:, 2], elements[:, 3])
    whole = np.column_stack((elements[:, :3], last))
    corners: FloatArray = np.asarray(shell.vertices, dtype=float)[whole]
    return corners


def _fewer(corners: FloatArray, bare: NDArray[np.bool_]) -> tuple[IndexArray, FloatArray]:
    """Return the numbers (k,) and corners (k, 4, 3) of the elements to paint.

    Of very many `bare` ones (m,) some are left out, and the others enlarged to take their place.
    """
    share = -(-np.count_nonzero(bare) // MOST_PAINTED)
    if share <= 1:
        return np.arange(len(corners)), corners
    kept = np.sort(np.concatenate((np.flatnonzero(bare)[::share], np.flatnonzero(~bare))))
    middle = corners[kept].mean(axis=1, keepdims=True)
    size = np.where(bare[kept], 1.5 * np.sqrt(share), 1.0)[:, None, None]
    return kept, middle + size * (corners[kept] - middle)


def _shade(corners: FloatArray, eye: Eye) -> FloatArray:
    """Return the brightness (m,) of each element, lit from above the eye, equal on both sides."""
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    flat = np.linalg.norm(normals, axis=1) == 0.0
    normals[flat] = np.cross(
        corners[flat, 1] - corners[flat, 0], corners[flat, 2] - corners[flat, 0]
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    normals *= np.where(normals @ eye.toward < 0.0, -1.0, 1.0)[:, None]
    light = eye.toward + 0.5 * eye.up - 0.4 * eye.right
    shade: FloatArray = 0.6 + 0.4 * np.clip(normals @ light / np.linalg.norm(light), 0.0, 1.0)
    return shade


def _paint(
    axis: Any,
    corners: FloatArray,
    flat: FloatArray,
    faces: FloatArray,
    eye: Eye,
    *,
    outlined: bool = True,
) -> None:
    """Fill the elements, the farthest first."""
    from matplotlib.collections import PolyCollection

    order = np.argsort((corners @ eye.toward).mean(axis=1))
    painted: Any = flat[order]
    edges: Any = EDGE if outlined and len(flat) <= MOST_OUTLINED else faces[order]
    axis.add_collection(
        PolyCollection(painted, facecolors=faces[order], edgecolors=edges, linewidths=0.4),
        autolim=False,
    )
    axis.update_datalim(flat.reshape(-1, 2))
    axis.autoscale_view()


def _widen(axis: Any, flat: FloatArray, colors: FloatArray, values: FloatArray) -> None:
    """Draw elements again with edges of their own colour, about as wide as a path."""
    from matplotlib.collections import PolyCollection

    order = np.argsort(values)
    corners: Any = flat[order]
    look: Any = {"facecolors": colors[order], "edgecolors": colors[order], "linewidths": 3.5}
    axis.add_collection(PolyCollection(corners, zorder=2, **look), autolim=False)


def _round_length(about: float) -> float:
    """Return 1, 2 or 5 times a power of ten, not above `about`."""
    power = 10.0 ** np.floor(np.log10(about))
    return float(power * max(one for one in (1.0, 2.0, 5.0) if one * power <= about * (1 + 1e-9)))
