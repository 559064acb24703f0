"""A folder in the hands of one process: who else may write there, and what stays of others."""

import contextlib
import errno
import fcntl
import os
import shutil
import signal
import stat
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from unittest.mock import Mock

import pytest

from sphshell_pin.base.atomic import AtomicFolder, FolderInUse, atomic_file
from sphshell_pin.base.atomic.files import exchange
from sphshell_pin.errors import ResultError
from sphshell_pin.scenario import build, run_built
from sphshell_pin.scenario.running import run
from tests.command import call, succeed
from tests.scenario.files import write

LAST = "summary.json"


def put(folder, text, last=LAST):
    """Write a results folder of two files, and return what is in it."""
    with AtomicFolder(folder, last=last) as place:
        staging = place.staging()
        for name in ("a", last):
            (staging / name).write_text(text)
        place.replace(staging, ["a", "b", last])
    files = filter(Path.is_file, folder.iterdir())
    return {path.name: path.read_text(errors="replace") for path in files}


def test_a_second_run_is_told_who_writes_until_that_process_is_killed(
    no_pictures, tmp_path, monkeypatch
):
    path, out = write(tmp_path), tmp_path / "out"
    ready, tell = os.pipe()
    child = os.fork()
    if child == 0:
        with AtomicFolder(out, last=LAST):
            os.write(tell, b".")
            time.sleep(60)
        os._exit(0)
    os.read(ready, 1)
    with monkeypatch.context() as patch:
        patch.setattr(run, "simulate", lambda *_: pytest.fail("it ran"))
        told = call("run", path, "--out", out, "--no-recording")
    assert told.exit_code == 2
    assert f"{out}: process {child}, since 20" in told.stderr
    assert "give another folder with --out" in told.stderr
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    succeed("run", path, "--out", out, "--no-recording")
    assert sorted(os.listdir(tmp_path)) == ["drop.toml", "out"]


def test_a_full_disk_is_one_sentence_and_exit_code_2(tmp_path, monkeypatch):
    arguments = ["run", write(tmp_path), "--out", tmp_path / "out", "--no-recording"]
    succeed(*arguments)
    before = (tmp_path / "out" / LAST).read_bytes()
    # In the pictures, when the numbers are written already.
    full = Mock(side_effect=OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))
    monkeypatch.setattr("sphshell_pin.base.atomic.file.atomic_file", full)
    told = call(*arguments)
    assert told.exit_code == 2
    assert told.stderr.splitlines()[-1].endswith("cannot be written: No space left on device")
    assert (tmp_path / "out" / LAST).read_bytes() == before
    assert sorted(os.listdir(tmp_path)) == ["drop.toml", "out"]


def test_ctrl_c_while_pictures_are_drawn_keeps_the_numbers(tmp_path, monkeypatch):
    monkeypatch.setattr("sphshell_pin.plot.save_figures", Mock(side_effect=KeyboardInterrupt))
    told = call("run", write(tmp_path), "--out", tmp_path / "out")
    assert told.exit_code == 130
    assert f"the results are in {tmp_path / 'out'}" in told.stderr
    assert {*os.listdir(tmp_path / "out")} == {"run.npz", "contacts.csv", LAST}


def test_files_of_others_stay_the_same_files(tmp_path):
    out = tmp_path / "out"
    out.mkdir(mode=0o750)
    (out / "notes.txt").write_text("mine")
    (out / "link").symlink_to("notes.txt")
    with open(out / "log", "w") as log:
        before = os.stat(out / "notes.txt").st_ino
        found = put(out, "new")
        log.write("goes on")
    assert found == {"a": "new", LAST: "new", "notes.txt": "mine", "link": "mine", "log": ""}
    assert os.stat(out / "notes.txt").st_ino == before
    assert os.readlink(out / "link") == "notes.txt"
    assert (out / "log").read_text() == "goes on"
    assert stat.S_IMODE(os.stat(out).st_mode) == 0o750
    assert os.listdir(tmp_path) == ["out"]


def test_a_file_written_by_others_meanwhile_is_kept(tmp_path, monkeypatch):
    out = tmp_path / "out"
    put(out, "old")
    (out / "notes.txt").write_text("first")

    def late(one, other):
        (out / "late.txt").write_text("late")
        (out / "aside").write_text("second")
        os.replace(out / "aside", out / "notes.txt")
        exchange(one, other)

    monkeypatch.setattr("sphshell_pin.base.atomic.files.exchange", late)
    put(out, "new")
    assert (out / "late.txt").read_text() == "late"
    assert (out / "notes.txt").read_text() == "second"


@pytest.mark.parametrize("why", ["working directory", "mount point", "folders of others"])
def test_a_folder_that_must_stay_gets_its_files_one_by_one(why, tmp_path, monkeypatch):
    out = tmp_path / "out"
    put(out, "old")
    (out / "b").write_text("old")
    exchanged = "sphshell_pin.base.atomic.files.exchange"
    monkeypatch.setattr(exchanged, lambda *_: pytest.fail("it was exchanged"))
    if why == "working directory":
        monkeypatch.chdir(out)
    elif why == "mount point":
        monkeypatch.setattr(os.path, "ismount", lambda path: path == out)
    else:
        (out / "mine").mkdir()
        (out / "mine" / "notes.txt").write_text("mine")
    before = os.stat(out).st_ino
    assert put(out, "new") == {"a": "new", LAST: "new"}
    assert os.stat(out).st_ino == before
    assert why != "folders of others" or (out / "mine" / "notes.txt").read_text() == "mine"
    assert os.listdir(tmp_path) == ["out"]


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "far").mkdir()
    (tmp_path / "out").symlink_to("far")
    put(tmp_path / "out", "old")
    put(tmp_path / "out", "new")
    assert os.readlink(tmp_path / "out") == "far"
    assert (tmp_path / "far" / "a").read_text() == "new"
    (tmp_path / "file").symlink_to("far/a")
    with atomic_file(tmp_path / "file") as file:
        file.write(b"newest")
    assert os.readlink(tmp_path / "file") == "far/a"
    assert (tmp_path / "far" / "a").read_text() == "newest"


def test_two_that_write_one_file_take_turns(tmp_path):
    path = tmp_path / "file"

    def write_second():
        with atomic_file(path) as file:
            file.write(b"second")

    with ThreadPoolExecutor(1) as pool, atomic_file(path) as file:
        other = pool.submit(write_second)
        time.sleep(0.2)
        file.write(b"first")
    other.result()
    assert path.read_bytes() == b"second"


def test_a_file_keeps_its_rights(tmp_path):
    path = tmp_path / "file"
    path.touch(mode=0o600)
    with atomic_file(path) as file:
        file.write(b"new")
    assert path.read_bytes() == b"new"
    assert stat.S_IMODE(os.stat(path).st_mode) == 0o600
    with pytest.raises(IsADirectoryError), atomic_file(tmp_path):
        pass
    with atomic_file(os.devnull) as file:
        file.write(b"gone")
    assert stat.S_ISCHR(os.stat(os.devnull).st_mode)
    assert os.listdir(tmp_path) == ["file"]


def test_a_file_system_without_locks_will_do(tmp_path, monkeypatch):
    monkeypatch.setattr(fcntl, "flock", Mock(side_effect=OSError(errno.ENOLCK, "No locks")))
    put(tmp_path / "out", "old")
    assert put(tmp_path / "out", "new") == {"a": "new", LAST: "new"}
    with atomic_file(tmp_path / "file") as file:
        file.write(b"new")
    assert sorted(os.listdir(tmp_path)) == ["file", "out"]


def test_what_somebody_else_puts_beside_the_folder_is_left_alone(tmp_path):
    (tmp_path / "precious").write_text("precious")
    (tmp_path / ".out.lock").symlink_to("precious")
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "bad.html").touch()
    (tmp_path / ".out.writing").symlink_to("theirs")
    assert put(tmp_path / "out", "new") == {"a": "new", LAST: "new"}
    assert (tmp_path / "precious").read_text() == "precious"
    assert (tmp_path / "theirs" / "bad.html").exists()


def test_a_folder_called_like_a_result_is_told(no_pictures, tmp_path):
    built = build(write(tmp_path))
    (tmp_path / "out" / "energy.png" / "mine").mkdir(parents=True)
    with pytest.raises(ResultError, match=r"energy\.png there is a folder"):
        run_built(built, tmp_path / "out", recording=False)
    assert os.listdir(tmp_path / "out") == ["energy.png"]


def test_a_folder_made_in_vain_is_removed(tmp_path):
    out = tmp_path / "x" / "y"
    with contextlib.suppress(ZeroDivisionError), AtomicFolder(out, last=LAST):
        with pytest.raises(FolderInUse), AtomicFolder(out, last=LAST):
            pass
        assert out.is_dir()
        raise ZeroDivisionError
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("name", ["out", "x/y/out"])
def test_of_processes_that_meet_in_a_new_folder_one_wins_and_loses_nothing(name, tmp_path):
    out, rounds, processes = tmp_path / name, 30, 5

    def take_part(k):
        try:
            with AtomicFolder(out, last=LAST) as place:
                time.sleep(0.002)  # as if something were computed
                staging = place.staging()
                (staging / LAST).write_text(str(k))
                place.replace(staging, [LAST])
                return 0 if (out / LAST).read_text() == str(k) else 2
        except FolderInUse:
            return 1

    for _ in range(rounds):
        start, go = os.pipe()
        children = []
        for k in range(processes):
            child = os.fork()
            if child == 0:
                code = 3
                with contextlib.suppress(BaseException):
                    os.close(go)
                    os.read(start, 1)
                    code = take_part(k)
                os._exit(code)
            children.append(child)
        os.close(start)
        os.close(go)
        codes = [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]
        # Who comes after the winner has ended writes anew.
        assert set(codes) <= {0, 1}
        assert 0 in codes
        assert os.listdir(out) == [LAST]
        assert os.listdir(out.parent) == ["out"]
        shutil.rmtree(tmp_path / name.split("/")[0])
