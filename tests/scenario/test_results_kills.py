"""What is left when a process ends at any of its file operations: whole old or whole new files."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.atomic import AtomicFolder, atomic_file, folder as atomic_folder
from sphshell_pin.errors import ResultError
from sphshell_pin.scenario import build, run, run_built
from tests.scenario.files import write
from tests.scenario.operations import contents, counted, fill, interrupt, killed_at

OTHERS = {"notes.txt": b"mine", "stopped/run.npz": b"stopped early"}


@pytest.fixture
def place():
    """A folder in memory, where nothing waits for a disk."""
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(dir=memory) as folder:
        yield Path(folder)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two runs as they were computed, called "old" and "new"."""
    path = write(tmp_path_factory.mktemp("scenario"))
    both = {}
    for name, duration in (("old", "0.02"), ("new", "0.03")):
        built = build(path, {"run.duration": duration})
        both[name] = built, run.simulate(built)
    return both


@pytest.fixture
def results(runs, place, monkeypatch):
    """Writes the results of one of the runs; drawings are stand-ins, for speed."""
    drawn = SimpleNamespace(savefig=lambda stream, **_: stream.write(b"picture" * 99))
    for name in ("plot_force_and_depth", "plot_energy", "plot_contact_path", "plot_contact_map"):
        monkeypatch.setattr(f"sphshell_pin.plot.{name}", lambda *_: drawn)
    monkeypatch.setattr("sphshell_pin.view.recording.render_recording", lambda *_, **__: "<html>")

    def write_results(name):
        built, computed = runs[name]
        monkeypatch.setattr(run, "simulate", lambda *_: computed)
        return run_built(built, place / "out", recording=name == "old")

    return write_results


def missing(*_):
    raise OSError(38, "Function not implemented")


def put_others(folder):
    for name, text in OTHERS.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(text)


def check_whole(folder):
    """The files that the summary lists are there with the contents that it says, and no others."""
    found = contents(folder)
    summary = json.loads(found.pop("summary.json"))
    assert summary["complete"]
    assert {
        name: f"sha256:{hashlib.sha256(data).hexdigest()}" for name, data in found.items()
    } == summary["files"] | {
        name: f"sha256:{hashlib.sha256(data).hexdigest()}"
        for name, data in OTHERS.items()
        if name in found
    }


def test_a_summary_lists_the_files_with_their_contents(results, place):
    results("old")
    check_whole(place / "out")
    assert len(json.loads((place / "out" / "summary.json").read_text())["files"]) == 7


def test_killed_at_any_operation_the_folder_is_old_or_new(results, place):
    out, kept = place / "out", place / "kept"
    results("old")
    put_others(out)
    shutil.copytree(out, kept)
    old = contents(out)
    results("new")
    new = contents(out)
    assert set(old) - set(new) == {"recording.html"}
    seen = []
    n = 1
    while True:
        shutil.rmtree(out)
        shutil.copytree(kept, out)
        if not killed_at(n, lambda: results("new")):
            break
        left = contents(out)
        assert left in (old, new), n
        seen.append(left == new)
        results("new")  # the next run clears away what is left
        assert contents(out) == new, n
        assert sorted(os.listdir(place)) == ["kept", "out"], n
        n += 1
    assert n > 60
    assert seen == sorted(seen)
    assert True in seen
