"""Pictures in a row as .mp4."""

import numpy as np
import pytest

from sphshell_pin.base.films import write_film
from sphshell_pin.errors import MissingExtra, ResultError

COLORS = np.array([[200, 30, 40], [30, 180, 60], [40, 60, 210], [240, 240, 240]], np.uint8)


def frames():
    return (np.tile(color, (48, 64, 1)) for color in COLORS)


def test_mp4_keeps_number_size_and_colors(tmp_path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    file = write_film(tmp_path / "new" / "film.mp4", frames(), (64, 48), 12.5)
    read = ffmpeg.read_frames(str(file))
    about = next(read)
    assert (about["size"], about["fps"], about["codec"]) == ((64, 48), 12.5, "h264")
    # This ffmpeg converts back by the matrix that the file states.
    for one, color in zip(read, COLORS, strict=True):
        frame = np.frombuffer(one, np.uint8).reshape(48, 64, 3)
        assert np.abs(frame.astype(int) - color).max() <= 6


def test_a_failing_ffmpeg_is_reported_and_leaves_the_old_file(tmp_path, monkeypatch):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\necho 'no such codec' >&2\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setattr(ffmpeg, "get_ffmpeg_exe", lambda: str(program))
    film = tmp_path / "film.mp4"
    film.write_bytes(b"old")
    many = (frame for _ in range(200) for frame in frames())  # more than a pipe holds
    with pytest.raises(ResultError, match=r"film\.mp4: ffmpeg could not write it: no such codec"):
        write_film(film, many, (64, 48), 30.0)
    assert film.read_bytes() == b"old"
    assert sorted(one.name for one in tmp_path.iterdir()) == ["ffmpeg", "film.mp4"]


def test_without_the_package_one_sentence_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingExtra, match=r"sphshell-pin\[video\]"):
        write_film(tmp_path / "film.mp4", frames(), (64, 48), 30.0)
    assert list(tmp_path.iterdir()) == []
