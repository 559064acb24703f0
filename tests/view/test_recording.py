import sys

import numpy as np
import pytest

from sphshell_pin.errors import InvalidParameter, MissingExtra, ResultError
from sphshell_pin.view import write_recording
from sphshell_pin.view.contact_path import ContactRows
from sphshell_pin.view.recording import choose_rows
from tests.view import stand_ins
from tests.view.test_page import unpacked


def rows_of(t, log=(), fps=10.0, speed=1.0):
    rows = ContactRows.of(stand_ins.contact_log(log))
    return choose_rows(np.asarray(t, dtype=float), rows, fps, speed)


def moved(page):
    """The clips of a page: the paths of what moves, and their tracks."""
    commands = [one for one in unpacked(page) if one["type"] == "set_animation"]
    return [clip for one in commands for clip in one["animations"]]


def test_each_frame_shows_the_nearest_recorded_row():
    t = np.sort(np.random.default_rng(1).uniform(2.0, 5.0, 500))
    rows, times = rows_of(t, fps=30.0)
    nearest = np.abs(t[None, :] - (t[0] + times)[:, None]).argmin(axis=1)
    np.testing.assert_array_equal(t[rows], t[nearest])
    assert times[-1] == pytest.approx(t[-1] - t[0])
    slow, times = rows_of(t, fps=30.0, speed=0.1)
    assert times[-1] == pytest.approx(10.0 * (t[-1] - t[0]))
    assert slow[-1] == len(t) - 1


def test_a_touch_between_two_frames_is_shown_at_its_peak():
    t = np.linspace(0.0, 1.0, 1001)
    touch = [{"row": row, "normal_force": force} for row, force in ((341, 2.0), (342, 9.0))]
    rows, _ = rows_of(t, touch)
    assert rows[3] == 342
    assert np.count_nonzero(rows == 342) == 1


def test_the_page_holds_the_run(tmp_path):
    scene, result = stand_ins.ball_on_plate()
    path = write_recording(tmp_path / "new" / "run.html", result, scene, title="Ball <on> plate")
    assert path == tmp_path / "new" / "run.html"
    assert [file.name for file in path.parent.iterdir()] == ["run.html"]
    assert path.stat().st_size < 1_200_000
    page = path.read_text()
    assert "Ball &lt;on&gt; plate" in page
    assert "normal force on the sphere, 200 mm = 5 N" in page
    clips = {one["path"]: {track["name"] for track in one["clip"]["tracks"]} for one in moved(page)}
    assert ".position" in clips["/meshcat/spheres/0_ball"]
    assert {".position", ".scale"} <= clips["/meshcat/contacts/normal_0/shaft"]
    trails = [path for path in clips if path.startswith("/meshcat/shells/0_plate/trail")]
    assert trails
    assert all(clips[path] == {".visible"} for path in trails)


def test_a_run_that_diverged_is_shown_up_to_its_end(tmp_path):
    scene, result = stand_ins.ball_on_plate()
    result.q[-5:] = np.nan
    result.contacts.normal_force[-1] = np.inf
    result.contacts.point_world[-2] = np.nan
    path = write_recording(tmp_path / "run.html", result, scene)
    clips = [one["clip"] for one in moved(path.read_text())]
    assert [clip["duration"] for clip in clips] == pytest.approx(len(clips) * [result.t[-6]])
    for track in (one for clip in clips for one in clip["tracks"] if one["type"] != "bool"):
        assert np.isfinite(np.frombuffer(track["values"].data, "<f4")).all()
    result.q[:] = np.nan
    with pytest.raises(ResultError, match="finite"):
        write_recording(tmp_path / "run.html", result, scene)


def test_a_run_without_contact_says_so(tmp_path):
    model = stand_ins.ball_model()
    scene = stand_ins.a_scene(model, stand_ins.contact_pair(model, "ball", 0.05, stand_ins.plate()))
    q = [stand_ins.ball_configuration([0, 0, height]) for height in (1.0, 0.9, 0.8)]
    path = write_recording(tmp_path / "run.html", stand_ins.a_result([0, 0.1, 0.2], q), scene)
    assert "no contact in this run" in path.read_text()


def test_without_meshcat_one_sentence_says_how_to_get_it(tmp_path, monkeypatch):
    scene, result = stand_ins.ball_on_plate()
    monkeypatch.setitem(sys.modules, "meshcat", None)
    with pytest.raises(MissingExtra, match=r"sphshell-pin\[view\]"):
        write_recording(tmp_path / "run.html", result, scene)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("name", "value"), [("fps", 0.0), ("fps", np.nan), ("speed", -1.0)])
def test_a_pace_that_is_not_positive_is_refused(tmp_path, name, value):
    scene, result = stand_ins.ball_on_plate()
    with pytest.raises(InvalidParameter, match=name):
        write_recording(tmp_path / "run.html", result, scene, **{name: value})
