"""Pictures and films of a run, drawn by a headless browser."""

import os
import signal

import numpy as np
import pytest

from sphshell_pin.errors import InvalidParameter, ResultError
from sphshell_pin.view import film
from sphshell_pin.view.film import render_film
from tests.command import succeed
from tests.scenario.files import write
from tests.tables import cases_of
from tests.view.stand_ins import ball_on_plate

Image = pytest.importorskip("PIL.Image")
SIZE = (160, 120)


@pytest.fixture(scope="module")
def run():
    return ball_on_plate()  # 3 s


@pytest.fixture
def rendered(request, run, tmp_path):
    """Draws the run into a file of the name."""
    request.getfixturevalue("browser")  # or the test is skipped
    scene, result = run

    def render(name, **options):
        return render_film(tmp_path / name, result, scene, **{"size": SIZE, **options})

    return render


def pixels(file):
    with Image.open(file) as image:
        return np.asarray(image.convert("RGB")).astype(int)


@pytest.mark.browser
def test_a_picture_has_its_time_and_size(rendered, tmp_path):
    near = {"size": (301, 177), "camera": "contact", "chart": False}
    start = pixels(rendered("new/start.png", time=0.0, **near))
    touching = pixels(rendered("touching.png", time=1.5, **near))
    assert start.shape == touching.shape == (177, 301, 3)
    # A red arrow is there, on a plate that is green.
    red = [np.sum(one[..., 0] > one[..., 1:].max(axis=2) + 100) for one in (start, touching)]
    assert (red[0] > 0, red[1] > 10) == (False, True)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["new", "touching.png"]
    assert pixels(rendered("dark.png", dark=True, chart=False)).mean() < 110 < touching.mean()


@pytest.mark.browser
def test_a_film_shows_the_pictures_in_their_order(rendered):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    frames = ffmpeg.read_frames(str(rendered("run.mp4", fps=2, span=(0.5, 2.5), chart=False)))
    about = next(frames)
    assert (about["size"], about["fps"]) == (SIZE, 2)
    assert about["pix_fmt"].startswith("yuv420p")
    drawn = [np.frombuffer(one, np.uint8).reshape(120, 160, 3).astype(int) for one in frames]
    assert len(drawn) == 5
    times = np.linspace(0.5, 2.5, 5)
    pictures = [pixels(rendered(f"{t}.png", time=t, chart=False)) for t in times]
    for k, one in enumerate(drawn):
        off = [np.abs(one - picture).mean() for picture in pictures]
        assert np.argmin(off) == k
        assert off[k] < 4.0


@pytest.mark.browser
def test_ctrl_c_leaves_nothing(rendered, tmp_path, keyboard):
    def press(done, _):
        if done == 2:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        rendered("run.mp4", fps=10, told=press)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "options", "told"),
    [
        *cases_of("wrong_films")["rows"],
        ("run.mp4", {"span": (-1.0, None)}, "span = -1.0 must be in the run"),
    ],
)
def test_what_cannot_be_drawn_is_refused_before_anything_starts(run, tmp_path, name, options, told):
    scene, result = run
    with pytest.raises(InvalidParameter, match=told):
        render_film(tmp_path / name, result, scene, **options)
    assert list(tmp_path.iterdir()) == []


def test_without_chromium_one_sentence_says_how_to_get_it(run, tmp_path, monkeypatch):
    pytest.importorskip("playwright")
    scene, result = run
    monkeypatch.setattr(film, "PROGRAMS", ())
    monkeypatch.setenv("PLAYWRIGHT_BROWSERS_PATH", str(tmp_path / "none"))
    with pytest.raises(ResultError, match="playwright install chromium"):
        render_film(tmp_path / "run.png", result, scene)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.browser
def test_the_command(request, tmp_path, no_pictures):
    request.getfixturevalue("browser")
    succeed("run", write(tmp_path), "--out", tmp_path / "out", "--no-recording")
    arguments = ["render", tmp_path / "out", "--size", "96x64", "--no-chart"]
    done = succeed(*arguments, "--out", tmp_path / "end.png")
    assert done.output.split() == [str(tmp_path / "end.png")]
    assert pixels(tmp_path / "end.png").shape == (64, 96, 3)
