"""Tactile images: some rows side by side, and films."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array, Bytes
from sphshell_pin.base.atomic import write_whole
from sphshell_pin.base.checks import check_positive
from sphshell_pin.errors import InvalidParameter, import_extra
from sphshell_pin.plot.figure import new_figure, reading_unit

if TYPE_CHECKING:
    from os import PathLike

    from matplotlib.figure import Figure

    from sphshell_pin.patches.taxels import TaxelImages

COLORS = "inferno"
LARGE = 320  # pixels of a film's longer side, at least
MOST_FRAMES = 100_000


def plot_taxels(images: TaxelImages, rows: Sequence[int]) -> Figure:
    """Return a Figure of the images of a grid at some of its `rows`, one beside the other.

    Latitude points up, longitude to the right: the grid as seen from outside the sphere, with
    its `up` on top.

    Raises InvalidParameter unless the images are those of a grid, MissingExtra without matplotlib.
    """
    forces = _grid(images)
    figure = new_figure(2.2 * len(rows) + 0.9, 2.7)
    factor, unit = reading_unit(float(forces[list(rows)].max()), "N")
    axes = np.atleast_1d(figure.subplots(1, len(rows)))
    largest = float(forces[list(rows)].max()) * factor or 1.0
    for axis, row in zip(axes, rows, strict=True):
        drawn = axis.imshow(
            forces[row] * factor, origin="lower", cmap=COLORS, vmin=0.0, vmax=largest
        )
        axis.set_title(f"t = {images.t[row] * 1e3:.0f} ms", fontsize=9)
        axis.set_xticks([])
        axis.set_yticks([])
    figure.colorbar(drawn, ax=list(axes), label=f"force on a taxel [{unit}]", shrink=0.8)
    return figure


def save_film(
    path: str | PathLike[str], images: TaxelImages, *, fps: float = 30, speed: float = 1.0
) -> Path:
    """Write a film of a grid's images at `path`, a .gif.

    `fps` frames a second, of which each shows `speed` / `fps` seconds of simulated time.

    Raises InvalidParameter unless the images are those of a grid, and for an `fps` or `speed` that
    is not positive or makes more than MOST_FRAMES; MissingExtra without matplotlib, ResultError
    where the file cannot be written.
    """
    if Path(path).suffix.lower() != ".gif":
        raise InvalidParameter("path", str(path), "must end in .gif")
    fps, speed = check_positive("fps", fps), check_positive("speed", speed)
    image = import_extra("PIL.Image", "view", "a film of taxels", "pillow")
    frames = _frames(images, fps, speed)
    times = -(-LARGE // max(frames.shape[1:3]))
    first, *others = (
        image.fromarray(np.asarray(one.repeat(times, axis=0).repeat(times, axis=1)))
        for one in frames
    )
    stream, duration = io.BytesIO(), 1000 / fps
    more = {"save_all": True, "append_images": others, "duration": duration, "loop": 0}
    first.save(stream, "gif", **more)
    return write_whole(path, stream.getvalue())


def _grid(images: TaxelImages) -> Array:
    if images.forces.ndim != 3:
        raise InvalidParameter(
            "images",
            f"({', '.join(map(str, images.forces.shape))})",
            "must be of a TaxelGrid: elements and faces have no order in a picture",
            given="of shape",
        )
    return images.forces


def _frames(images: TaxelImages, fps: float, speed: float) -> Bytes:
    """Return colors (frames, rows, columns, 3) of the taxels, latitude up."""
    forces = _grid(images)
    matplotlib = import_extra("matplotlib", "view", "a film of taxels")
    with np.errstate(over="ignore", invalid="ignore"):  # of times that no run has
        count = np.divide(images.t[-1] - images.t[0] + 1e-9, speed / fps)
    if not 0.0 <= count < MOST_FRAMES:
        why = f"gives {count:.2g} frames, of 1 to {MOST_FRAMES}, at {fps:g} frames a second"
        raise InvalidParameter("speed", speed, why)
    wanted = images.t[0] + np.arange(int(count) + 1) * (speed / fps)
    rows = np.minimum(np.searchsorted(images.t, wanted), len(images.t) - 1)
    share = forces[rows][:, ::-1] / (forces.max() or 1.0)
    colors = matplotlib.colormaps[COLORS](np.maximum(share, 0.0))[..., :3] * 255.0
    return np.asarray(colors, np.uint8)
