"""Pictures in a row as .gif and .mp4."""

import numpy as np
import pytest

from sphshell_pin.base.films import write_film
from sphshell_pin.errors import MissingExtra, ResultError

COLORS = np.array([[200, 30, 40], [30, 180, 60], [40, 60, 210], [240, 240, 240]], np.uint8)


def frames():
    return [np.tile(color, (48, 64, 1)) for color in COLORS]


def test_mp4_keeps_number_size_and_colors(tmp_path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    file = write_film(tmp_path / "new" / "film.mp4", iter(frames()), 12.5, frames()[:1])
    read = ffmpeg.read_frames(str(file))
    about = next(read)
    assert (about["size"], about["fps"], about["codec"]) == ((64, 48), 12.5, "h264")
    shown = [np.frombuffer(one, np.uint8).reshape(48, 64, 3) for one in read]
    assert len(shown) == 4
    # This ffmpeg converts back by the matrix that the file states.
    for frame, color in zip(shown, COLORS, strict=True):
        assert np.abs(frame.astype(int) - color).max() <= 6


def test_gif_keeps_colors_and_adds_up_hundredths_of_a_second(tmp_path):
    image = pytest.importorskip("PIL.Image")
    file = write_film(tmp_path / "film.gif", iter(frames()), 30.0, frames())
    with image.open(file) as opened:
        assert opened.n_frames == 4
        durations = []
        for k, color in enumerate(COLORS):
            opened.seek(k)
            durations.append(opened.info["duration"])
            pixels = np.asarray(opened.convert("RGB")).astype(int)
            assert np.abs(pixels - color).max() <= 8
    assert durations == [30, 40, 30, 30]  # 4 frames at 30 per second are 0.13 s


def test_a_failing_ffmpeg_is_reported_and_leaves_the_old_file(tmp_path, monkeypatch):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\necho 'no such codec' >&2\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setattr(ffmpeg, "get_ffmpeg_exe", lambda: str(program))
    film = tmp_path / "film.mp4"
    film.write_bytes(b"old")
    many = frames() * 200  # more than a pipe holds
    with pytest.raises(ResultError, match=r"film\.mp4: ffmpeg could not write it: no such codec"):
        write_film(film, iter(many), 30.0, many[:1])
    assert film.read_bytes() == b"old"
    assert sorted(one.name for one in tmp_path.iterdir()) == ["ffmpeg", "film.mp4"]


def test_without_the_package_one_sentence_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingExtra, match=r"sphshell-pin\[video\]"):
        write_film(tmp_path / "film.mp4", iter(frames()), 30.0, frames()[:1])
    assert list(tmp_path.iterdir()) == []
