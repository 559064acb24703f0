"""What is left when a process ends at any of its file operations: whole old or whole new files."""

import contextlib
import errno
import hashlib
import json
import os
import shutil
import tempfile
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock, patch

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.base.atomic import write_whole
from sphshell_pin.base.atomic.files import held_folder, write_folder
from sphshell_pin.errors import ResultError, ScenarioError, ShellFileError
from sphshell_pin.plot.figure import write_figure
from sphshell_pin.scenario import build, run_built
from sphshell_pin.scenario.running import run
from sphshell_pin.shell.converting import convert
from sphshell_pin.study.report import making
from sphshell_pin.study.report.contents import Column, Section, Table
from sphshell_pin.study.sweep.driver import write_table
from sphshell_pin.view.film import render_film
from tests import meshes
from tests.scenario.files import write
from tests.scenario.operations import contents, counted, fill, killed_at, visible
from tests.studies import mostly_studies

MESH = Path(__file__).parents[1] / "data" / "corpus" / "trimesh_joined_tetrahedra.obj"
OTHERS = {"notes.txt": b"mine", "sweep.parquet": b"of a sweep"}


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
    """Writes the results of one of the runs; pictures are stand-ins, for speed."""
    drawn = SimpleNamespace(savefig=lambda stream, **_: stream.write(b"picture" * 99))

    def two_pictures(_, folder, **__):
        return [write_figure(folder / name, drawn) for name in ("energy.png", "contact_map.png")]

    monkeypatch.setattr("sphshell_pin.plot.save_figures", two_pictures)
    monkeypatch.setattr("sphshell_pin.view.recording.render_recording", lambda *_, **__: "<html>")

    def write_results(name):
        built, computed = runs[name]
        monkeypatch.setattr(run, "simulate", lambda *_: computed)
        return run_built(built, place / "out", recording=name == "old")

    return write_results


def put_others(folder):
    for name, text in OTHERS.items():
        (folder / name).write_bytes(text)


def check_whole(folder):
    """The files that the summary lists are there with the contents that it says, and no others."""
    found = contents(folder)
    summary = json.loads(found.pop("summary.json"))
    assert summary["complete"]
    assert {
        name: f"sha256:{hashlib.sha256(data).hexdigest()}"
        for name, data in found.items()
        if name not in OTHERS
    } == summary["files"]


def ends(place, keep, write, act=None, *, once=True):
    """Yield n, once `write` has ended at its n-th file operation in a fresh copy of `keep`.

    It is killed there; with `act` it goes on in this process, which does that.
    """
    n, ended = 1, True
    while ended:
        for one in place.iterdir():
            shutil.rmtree(one) if one.is_dir() else one.unlink()
        shutil.copytree(keep, place, dirs_exist_ok=True)
        if act is None:
            ended = killed_at(n, write)
        else:
            with (
                contextlib.suppress(ResultError, ShellFileError, ScenarioError, KeyboardInterrupt),
                counted(n, act, once=once) as heard,
            ):
                write()
            ended = len(heard) >= n
        if ended:
            yield n
        n += 1


@pytest.fixture
def two_runs(results, place, tmp_path):
    """What the place holds before and after a new run into the folder of an old one."""
    results("old")
    put_others(place / "out")
    keep, before = shutil.copytree(place, tmp_path / "keep"), contents(place)
    assert any("recording.html" in note for note in results("new").notes)
    after = contents(place)
    assert set(before) - set(after) == {"out/recording.html"}
    check_whole(place / "out")
    return keep, before, after


def check_every_end(place, keep, write, before, after, act):
    """Whatever operation `write` ends at, all is old or all is new, and the next one writes."""
    seen = []
    for n in ends(place, keep, write, act, once=False):
        left = contents(place) if act else visible(place)
        assert left in (before, after), n
        seen.append(left == after)
        write()
        assert contents(place) == after, n
    assert seen[0] is False
    assert act or seen == sorted(seen)
    return seen


@pytest.mark.parametrize("act", [None, fill])
def test_killed_at_any_operation_a_run_leaves_old_or_new_results(act, two_runs, results, place):
    seen = check_every_end(place, two_runs[0], lambda: results("new"), *two_runs[1:], act)
    assert act or True in seen
    assert os.listdir(place) == ["out"]


@pytest.mark.parametrize("act", mostly_studies([None, fill], lambda act: act is fill))
def test_where_names_cannot_be_exchanged_no_summary_stands_beside_mixed_files(
    act, two_runs, results, place, monkeypatch
):
    def missing(*_):
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr("sphshell_pin.base.atomic.files.exchange", missing)
    keep, before, after = two_runs
    out = place / "out"
    for n in ends(place, keep, lambda: results("new"), act, once=False):
        assert visible(place) in (before, after) or not (out / "summary.json").exists(), n
        assert all((out / name).read_bytes() == text for name, text in OTHERS.items()), n
        results("new")
        assert contents(place) == after, n
        assert os.listdir(place) == ["out"], n


def of_report(title):
    table = Table(title, "", (Column("a", "a"),), [(1.0,)])
    report = making.Report([Section("x", title, tables=[table])], {})

    def write_report(place):
        with held_folder(place / "report", making.DATA) as folder:
            making._write(report, place / "report", folder)

    return write_report


def of_sweep(seed):
    pandas = pytest.importorskip("pandas")
    table = pandas.DataFrame({"run": np.arange(9), "a": np.random.default_rng(seed).random(9)})
    return lambda place: write_table(place / "table.parquet", table)


def of_fit(value):
    made = {"fit.json": value.encode(), "s.fitted.toml": f"# {value}".encode()}
    return lambda place: write_folder(place / "fit", made, ["fit.json", "s.fitted.toml"])


def of_film(count):
    """Writes a picture of that size, which no browser draws."""
    drawn = Mock(opened=lambda _: contextlib.nullcontext(), picture=lambda _: b"picture" * count)
    stands_in = {"_Stage": lambda *_: drawn, "Shown": Mock(of=lambda *_: Mock(speed=1.0))}
    run = SimpleNamespace(t=[0.0, 1.0], q=np.zeros((2, 1)))

    def write_film(place):
        with patch.multiple("sphshell_pin.view.film", **stands_in):
            render_film(place / "film.png", run)

    return write_film


def of_shell(side):
    shell = sp.Shell(*meshes.cube(side))
    return lambda place: shell.to_file(place / "box.obj")


WRITERS = {
    "report": (of_report("old"), of_report("new")),
    "sweep": (of_sweep(1), of_sweep(2)),
    "fit": (of_fit("old"), of_fit("new")),
    "render": (of_film(3), of_film(2)),
    "shell": (of_shell(1.0), of_shell(2.0)),
    "convert": tuple(
        lambda place, unit=unit: convert(MESH, place / "mesh.shl", unit) for unit in ("m", "mm")
    ),
    "recording and new": tuple(
        lambda place, text=text: write_whole(place / "page.html", text.encode())
        for text in ("old", "new")
    ),
}


@pytest.mark.parametrize("writer", WRITERS)
@pytest.mark.parametrize("act", [None, fill])
def test_other_files_are_old_or_new(writer, act, place, tmp_path):
    write_old, write_new = WRITERS[writer]
    write_old(place)
    keep = shutil.copytree(place, tmp_path / "keep")
    before = contents(place)
    write_new(place)
    after = contents(place)
    (tmp_path / "empty").mkdir()
    write_new(tmp_path / "empty")
    assert before != after == contents(tmp_path / "empty")
    check_every_end(place, keep, lambda: write_new(place), before, after, act)
