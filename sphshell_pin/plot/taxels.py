"""Tactile images: some rows side by side, and films."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.atomic import atomic_path, write_whole
from sphshell_pin.errors import InvalidParameter, MissingExtra, ResultError
from sphshell_pin.plot.figure import new_figure, reading_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sphshell_pin.patches.taxels import TaxelImages

COLORS = "inferno"
SUFFIXES = (".gif", ".mp4")
LARGE = 320  # pixels of a film's longer side, at least


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


def write_film(path: Path, images: TaxelImages, *, fps: float, speed: float) -> Path:
    """Write a film of a grid's images at `path`: .gif, or .mp4 where the program ffmpeg is there.

    `fps` frames a second, of which each shows `speed` / `fps` seconds of simulated time.

    Raises InvalidParameter unless the images are those of a grid, for another suffix, and for an
    `fps` or `speed` that is not positive; MissingExtra without
    matplotlib, ResultError without ffmpeg.
    """
    if path.suffix not in SUFFIXES:
        raise InvalidParameter("path", str(path), f"must end in {' or '.join(SUFFIXES)}")
    for name, value in (("fps", fps), ("speed", speed)):
        if not (np.isfinite(value) and value > 0.0):
            raise InvalidParameter(name, value, "must be positive")
    frames = _frames(images, fps, speed)
    if path.suffix == ".gif":
        return _write_gif(path, frames, fps)
    return _write_mp4(path, frames, fps)


def _grid(images: TaxelImages) -> NDArray[np.float64]:
    if images.forces.ndim != 3:
        raise InvalidParameter(
            "images",
            f"({', '.join(map(str, images.forces.shape))})",
            "must be of a TaxelGrid: elements and faces have no order in a picture",
            given="of shape",
        )
    return images.forces


def _frames(images: TaxelImages, fps: float, speed: float) -> NDArray[np.uint8]:
    """Return colors (frames, height, width, 3), latitude up."""
    forces = _grid(images)
    try:
        from matplotlib import colormaps
    except ImportError as missing:
        raise MissingExtra("matplotlib", "view", "a film of taxels") from missing
    wanted = np.arange(images.t[0], images.t[-1] + 1e-9, speed / fps)
    rows = np.minimum(np.searchsorted(images.t, wanted), len(images.t) - 1)
    share = forces[rows][:, ::-1] / (forces.max() or 1.0)
    colors = (colormaps[COLORS](np.maximum(share, 0.0))[..., :3] * 255.0).astype(np.uint8)
    # Films of odd sizes are refused by some players.
    times = 2 * (-(-LARGE // max(forces.shape[1:])) // 2 + 1)
    return np.asarray(colors.repeat(times, axis=1).repeat(times, axis=2))


def _write_gif(path: Path, frames: NDArray[np.uint8], fps: float) -> Path:
    try:
        from PIL import Image
    except ImportError as missing:
        raise MissingExtra("pillow", "view", "a film of taxels as .gif") from missing
    pictures = [Image.fromarray(frame) for frame in frames]
    stream = io.BytesIO()
    pictures[0].save(
        stream,
        format="gif",
        save_all=True,
        append_images=pictures[1:],
        duration=max(20, round(1000.0 / fps)),
        loop=0,
    )
    return write_whole(path, stream.getvalue())


def _write_mp4(path: Path, frames: NDArray[np.uint8], fps: float) -> Path:
    from matplotlib.animation import FFMpegWriter

    if not FFMpegWriter.isAvailable():
        raise ResultError(
            path, "a film as .mp4 needs the program ffmpeg, which is not there: write a .gif"
        )
    from matplotlib.figure import Figure

    height, width = frames.shape[1:3]
    figure = Figure(figsize=(width / 100, height / 100), dpi=100)
    image = figure.figimage(frames[0], origin="upper")
    writer = FFMpegWriter(fps=fps)  # type: ignore[arg-type]  # as ffmpeg has it
    with atomic_path(path, ".mp4") as aside, writer.saving(figure, str(aside), dpi=100):
        for frame in frames:
            image.set_data(frame)
            writer.grab_frame()
    return path
