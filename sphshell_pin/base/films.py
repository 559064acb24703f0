"""Pictures in a row as one file, .mp4, by the ffmpeg of imageio-ffmpeg."""

import contextlib
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from sphshell_pin.base.arrays import Bytes
from sphshell_pin.base.atomic import atomic_path
from sphshell_pin.errors import ResultError, SphshellError, import_extra

H264 = (
    *("-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart"),
    # The colors that players expect of films; stated, so that they show those of the pictures.
    *("-vf", "scale=out_color_matrix=bt709:out_range=tv", "-colorspace", "bt709"),
    *("-color_primaries", "bt709", "-color_trc", "bt709"),
)

Pixels = Bytes
"""Colors (height, width, 3) of one picture."""


def write_film(path: Path, frames: Iterable[Pixels], size: tuple[int, int], fps: float) -> Path:
    """Write `frames` of a `size` (width, height), shown at `fps` [1/s], as the .mp4 film at `path`.

    The frames may be made one by one. The film has H.264 of a constant quality in the pixel format
    that every player takes (yuv420p), with its header first.

    Raises MissingExtra without the package that writes it, ResultError if the file cannot be
    written; then the file is as it was.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return _write_mp4(path, iter(frames), size, fps)
    except OSError as fault:
        if isinstance(fault, SphshellError):
            raise
        raise ResultError(path, f"cannot be written: {fault.strerror or fault}") from fault


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
