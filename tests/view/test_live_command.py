"""sphshell-pin view: one sentence for every fault, a clean end, a page that is there."""

import signal
import subprocess
import sys
import time
import webbrowser

import pytest

from sphshell_pin.scenario import build
from sphshell_pin.scenario.running.run import simulate
from sphshell_pin.view.live import Live, opening
from tests.command import refused, succeed
from tests.programs import HEARS_CTRL_C
from tests.scenario.files import write
from tests.view.live_client import get
from tests.view.live_player import BallPlayer


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished")
    simulate(build(write(folder)))[0].save(folder / "run.npz")
    return folder


def test_it_serves_a_page_and_ctrl_c_ends_it(tmp_path):
    command = [sys.executable, "-c", HEARS_CTRL_C, "view", write(tmp_path), "--no-open"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert get(process.stdout.readline().split()[0])[0] == 200
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        rest, errors = process.communicate(timeout=20)
    finally:
        process.kill()
    assert (process.returncode, rest, errors) == (0, "", "")


def test_a_finished_run_is_a_recording_beside_it(finished):
    told = succeed("view", finished, "--no-open", "--faces", "--speed", "0.5")
    page = finished / "run.html"
    assert told.output.strip() == str(page)
    assert page.read_text(encoding="utf-8").startswith("<!")


def test_faults_are_one_sentence(tmp_path, finished):
    scenario = write(tmp_path)
    with Live(BallPlayer()) as live:
        for arguments, words in (
            (["no_such"], "fingertip_on_blade"),
            ([tmp_path / "no.npz"], "no.npz"),
            ([scenario, "--speed", "0"], "must be from 0.01 to 10"),
            ([scenario, "--port", "70000"], "65535"),
            ([scenario, "--port", live.server.port], "another port"),
            ([finished, "--set", "gravity.2=0"], "finished run"),
            ([tmp_path], "has no run.npz"),
        ):
            assert words in refused("view", *arguments, "--no-open")


def test_a_browser_is_opened_only_where_there_is_a_screen(monkeypatch, tmp_path):
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    opening.open_browser("http://x/?token=secret")
    assert opened == []
    monkeypatch.setenv("DISPLAY", ":0")
    opening.open_browser("http://x/?token=secret")
    # Everybody sees a program's arguments, nobody else the file.
    (file,) = tmp_path.iterdir()
    assert opened == [file.as_uri()]
    assert "url=http://x/?token=secret" in file.read_text()
    assert file.stat().st_mode & 0o077 == 0


def test_other_machines_are_let_in_with_a_warning_only(tmp_path, monkeypatch):
    monkeypatch.setattr(Live, "run", lambda live: live.stop())
    for host, warned in (("127.0.0.1", False), ("0.0.0.0", True), ("", True)):
        told = succeed("view", write(tmp_path), "--no-open", "--host", host)
        assert ("everybody" in told.stderr) is warned
