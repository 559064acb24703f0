"""Every command does the same where nobody takes what it prints."""

from __future__ import annotations

import functools
import importlib
import os
import shutil
import signal
import sys
import time
import tomllib
from pathlib import Path

import pytest
import typer

from sphshell_pin.cli import app, main
from sphshell_pin.cli.common import echo, progress_bar, say
from sphshell_pin.scenario import build
from sphshell_pin.scenario.running.run import simulate
from sphshell_pin.study import report
from sphshell_pin.study.report.contents import Finding, Section
from sphshell_pin.study.report.making import Part
from tests.scenario.files import DROP, write
from tests.texts import DATA, text_of

MESH = DATA / "corpus" / "trimesh_joined_tetrahedra.obj"
WORDS = tomllib.loads(text_of("commands.toml").replace("MESH", str(MESH)))


def heard() -> None:
    """Leave the streams as they are."""


def closed() -> None:
    for descriptor in range(3):
        os.close(descriptor)


def full_in_ascii() -> None:
    for descriptor, name in ((1, "stdout"), (2, "stderr")):
        os.dup2(os.open("/dev/full", os.O_WRONLY), descriptor)
        setattr(sys, name, os.fdopen(descriptor, "w", encoding="ascii", closefd=False))


def end_of(name: str, redirect, place: Path) -> tuple[int, set[str]]:
    """Return the exit code of a command in a process of its own, and the files it has written."""
    child = os.fork()
    if child == 0:
        code = 99
        try:
            os.chdir(place)
            signal.signal(signal.SIGALRM, signal.default_int_handler)
            redirect()
            sys.argv = ["sphshell-pin", name, *WORDS[name].split()]
            main()
        except SystemExit as end:
            code = int(end.code or 0)
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status), {str(one) for one in place.rglob("*")}


@pytest.fixture(scope="module")
def home(tmp_path_factory) -> Path:
    home = tmp_path_factory.mktemp("home")
    text = DROP.replace("duration = 0.05", 'duration = 0.05\nrecord = ["patch"]')
    result, _ = simulate(build(write(home, text)))
    (home / "results").mkdir()
    result.save(home / "results" / "run.npz")
    rows = [f"{t},{q}" for t, q in zip(result.t[::5], result.q[::5, 2], strict=True)]
    (home / "drop.csv").write_text("\n".join(["t [s],q.root_joint.2 [m]", *rows]))
    return home


@pytest.mark.browser  # `render` opens one, where there is one
@pytest.mark.parametrize("name", WORDS)
def test_no_command_needs_somebody_who_takes_what_it_prints(name, home, monkeypatch):
    found = Section("x", "é", findings=[Finding("a", "a", 1.0)])
    parts = [Part("x", "é", lambda **_: found, (1.0, 1.0))]
    monkeypatch.setattr(report, "make_report", functools.partial(report.make_report, parts=parts))

    def ended_by_ctrl_c(url: str) -> None:
        echo(url)
        signal.setitimer(signal.ITIMER_REAL, 0.2)

    if name == "view":
        common = importlib.import_module("sphshell_pin.cli.common")
        monkeypatch.setattr(common, "echo", ended_by_ctrl_c)
    ends = {}
    for redirect in (heard, closed, full_in_ascii):
        place = home.with_name("é")
        shutil.copytree(home, place)
        ends[redirect.__name__] = end_of(name, redirect, place)
        shutil.rmtree(place)
    assert ends == dict.fromkeys(ends, ends["heard"])
    assert ends["heard"][0] == 0 or name in ("render", "view")


def test_these_are_all_commands():
    assert {*typer.main.get_command(app).commands} == {*WORDS}


def test_on_a_pipe_lines_say_that_work_goes_on(capsys):
    with progress_bar("searching", line_every=0.01, total=None):
        time.sleep(0.2)
    assert capsys.readouterr().err.splitlines()[:2] == ["searching: 0.01 s", "searching: 0.02 s"]
    time.sleep(0.05)
    assert not capsys.readouterr().err.splitlines()[1:]  # one may be on its way


def test_a_long_line_stays_one_on_a_pipe(capsys):
    say(f"{'word ' * 100}end", bold="This")
    assert capsys.readouterr().out.count("\n") == 1
