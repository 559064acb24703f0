"""Pictures in a row as one file: .gif by Pillow, .mp4 by the ffmpeg of imageio-ffmpeg."""

import contextlib
import itertools
import subprocess
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from sphshell_pin.base.arrays import Bytes
from sphshell_pin.base.atomic import atomic_file, atomic_path
from sphshell_pin.errors import InvalidParameter, ResultError, SphshellError, import_extra

SUFFIXES = (".gif", ".mp4")
COLORS = 256  # of a .gif
SHADES = 176  # of them, those of large areas; the others are for what is small, such as arrows
H264 = (
    *("-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart"),
    # The colors that players expect of films; stated, so that they show those of the pictures.
    *("-vf", "scale=out_color_matrix=bt709:out_range=tv", "-colorspace", "bt709"),
    *("-color_primaries", "bt709", "-color_trc", "bt709"),
)

Pixels = Bytes
"""Colors (height, width, 3) of one picture."""


def check_film(path: Path, size: tuple[int, int], fps: float) -> None:
    """Raise InvalidParameter where no film of `size` (width, height) [pixels] can be at `path`.

    The colors of a .mp4 are stored for squares of two by two pixels; the pictures of a .gif last
    whole hundredths of a second, two at least, as players take fewer for ten.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InvalidParameter("path", str(path), f"must end in {' or '.join(SUFFIXES)}")
    if path.suffix.lower() == ".mp4" and (size[0] % 2 or size[1] % 2):
        raise InvalidParameter(
            "size", f"{size[0]}x{size[1]}", "must be even in both directions for a .mp4"
        )
    if path.suffix.lower() == ".gif" and fps > 50.0:
        raise InvalidParameter("fps", fps, "must be at most 50 for a .gif")


def write_film(path: Path, frames: Iterable[Pixels], fps: float, samples: Sequence[Pixels]) -> Path:
    """Write `frames`, shown at `fps` [1/s], as the film at `path`, .gif or .mp4; return the path.

    The frames may be made one by one. The .mp4 has H.264 of a constant quality in the pixel format
    that every player takes (yuv420p), with its header first. `samples` are some of the pictures:
    from them the colors of a .gif are chosen.

    Raises what `check_film` does, MissingExtra without the package that writes it, ResultError if
    the file cannot be written; then the file is as it was.
    """
    size = samples[0].shape[1], samples[0].shape[0]
    check_film(path, size, fps)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix.lower() == ".gif":
            return _write_gif(path, iter(frames), fps, samples)
        return _write_mp4(path, iter(frames), size, fps)
    except OSError as fault:
        if isinstance(fault, SphshellError):
            raise
        raise ResultError(path, f"cannot be written: {fault.strerror or fault}") from fault


def _write_gif(path: Path, frames: Iterator[Pixels], fps: float, samples: Sequence[Pixels]) -> Path:
    Image = import_extra("PIL.Image", "view", "a film as .gif", "pillow")

    # The same colors in all pictures: what stands still does not flicker, and takes no space.
    sheet = Image.fromarray(np.concatenate(samples))
    colors: list[int] = []
    for method, count in (
        (Image.Quantize.MEDIANCUT, SHADES),
        (Image.Quantize.FASTOCTREE, COLORS - SHADES),
    ):
        colors += (sheet.quantize(count, method=method).getpalette() or [])[: 3 * count]
    palette = Image.new("P", (1, 1))
    palette.putpalette(colors)

    dither = Image.Dither.NONE
    pictures = [Image.fromarray(one).quantize(palette=palette, dither=dither) for one in frames]
    ends = [round(100.0 * k / fps) for k in range(len(pictures) + 1)]
    durations = [10 * (end - start) for start, end in itertools.pairwise(ends)]
    with atomic_file(path) as file:
        pictures[0].save(
            file,
            format="gif",
            save_all=True,
            append_images=pictures[1:],
            duration=durations,
            loop=0,
        )
    return path


def _write_mp4(path: Path, frames: Iterator[Pixels], size: tuple[int, int], fps: float) -> Path:
    package = import_extra("imageio_ffmpeg", "video", "a film as .mp4", "imageio-ffmpeg")
    try:
        program = package.get_ffmpeg_exe()
    except RuntimeError as missing:
        raise ResultError(path, f"a film as .mp4 needs ffmpeg: {missing}") from missing

    with atomic_path(path, ".mp4") as aside, tempfile.TemporaryFile() as complaints:
        command = [program, "-y", "-loglevel", "error"]
        command += ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}"]
        command += ["-r", f"{fps:.6g}", "-i", "-", *H264, str(aside)]
        ffmpeg = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=complaints,
            process_group=0,  # Ctrl-C is for this process
        )
        try:
            assert ffmpeg.stdin is not None
            # A pipe breaks where ffmpeg has ended; it says why.
            with contextlib.suppress(BrokenPipeError), ffmpeg.stdin as pipe:
                for frame in frames:
                    pipe.write(frame.tobytes())
            failed = ffmpeg.wait() != 0
        except BaseException:
            ffmpeg.kill()
            ffmpeg.wait()
            raise
        if failed:
            complaints.seek(0)
            said = complaints.read().decode(errors="replace").split("\n")
            why = next((line for line in reversed(said) if line.strip()), "it does not say why")
            raise ResultError(path, f"ffmpeg could not write it: {why.strip()}")
    return path
