"""A run's folder: whole files or none, told early when unwritable, kept when interrupted."""

from __future__ import annotations

import csv
import json
import os
from pathlib import Path

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import Interrupted, ResultError, ScenarioError, SimulationDiverged
from sphshell_pin.scenario import build, run_built, run_scenario
from sphshell_pin.scenario.figures import figure_names, measure
from tests.scenario.files import DROP, write


@pytest.fixture
def built(tmp_path):
    return build(write(tmp_path))


def test_the_folder_holds_what_was_computed(built, tmp_path):
    seen = []
    out = tmp_path / "a" / "b"
    report = run_built(built, out, recording=False, progress=seen.append)
    names = {file.name for file in report.files}
    assert {"run.npz", "contacts.csv", "summary.json"} <= names
    assert set(os.listdir(out)) == names
    assert report.stopped is None
    assert all(0 <= fraction <= 1 for fraction in seen)
    loaded = sp.Result.load(out / "run.npz")
    np.testing.assert_array_equal(loaded.q, report.result.q)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["complete"]
    assert summary["stats"]["steps"] == 500
    assert summary["settings"]["run"]["duration"] == 0.05


def test_the_contact_table_is_the_log(built, tmp_path):
    report = run_built(built, tmp_path / "out", recording=False)
    log = report.result.contacts
    with (tmp_path / "out" / "contacts.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(log.t) > 0
    np.testing.assert_allclose([float(row["depth [m]"]) for row in rows], log.depth, rtol=1e-12)
    assert {row["pair"] for row in rows} == {"ball-plate"}
    np.testing.assert_allclose(
        [float(row["normal_z [1]"]) for row in rows], log.normal_world[:, 2], rtol=1e-12
    )


def test_a_folder_that_cannot_be_written_is_told_before_the_run(built, tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setattr(sp.Simulation, "run", lambda *_, **__: pytest.fail("it ran"))
    with pytest.raises(ResultError, match="cannot be written"):
        run_built(built, blocked / "out")
    with pytest.raises(ResultError, match="cannot be written"):
        run_built(built, "/proc/nothing")


def test_a_failing_writer_leaves_the_earlier_files(built, tmp_path, monkeypatch):
    out = tmp_path / "out"
    run_built(built, out, recording=False)
    before = {path.name: path.read_bytes() for path in out.iterdir()}

    def half(self, path):
        Path(path).write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(sp.Result, "save", half)
    with pytest.raises(ResultError, match="No space left"):
        run_built(built, out, recording=False)
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_without_the_view_packages_the_rest_is_written(built, tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    monkeypatch.setitem(sys.modules, "meshcat", None)
    report = run_built(built, tmp_path / "out")
    assert {file.name for file in report.files} == {"run.npz", "contacts.csv", "summary.json"}
    assert len(report.notes) == 2
    for note in report.notes:
        assert "sphshell-pin[view]" in note


@pytest.mark.parametrize("fault", [Interrupted, SimulationDiverged])
def test_what_was_computed_until_then_is_written(fault, built, tmp_path, monkeypatch):
    real = sp.Simulation.run

    def stop(self, q0, v0, duration, *args, **kwargs):
        part = real(self, q0, v0, duration / 2, *args, **kwargs)
        details = (0.025, part) if fault is Interrupted else (0.025, "speed", part)
        raise fault(*details)

    monkeypatch.setattr(sp.Simulation, "run", stop)
    report = run_built(built, tmp_path / "out", recording=False)
    assert isinstance(report.stopped, fault)
    assert sp.Result.load(tmp_path / "out" / "run.npz").t[-1] == pytest.approx(0.025)
    assert not json.loads((tmp_path / "out" / "summary.json").read_text())["complete"]


def test_a_recording_of_another_run_does_not_stay(built, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "recording.html").write_text("old")
    report = run_built(built, out, recording=False)
    assert not (out / "recording.html").exists()
    assert any("recording.html" in note for note in report.notes)


def test_expectations_are_judged(tmp_path):
    text = DROP + (
        '[expect]\n"pairs.ball-plate.peak_force" = { min = 1e9 }\n"stats.steps" = '
        '{ value = 500, atol = 0.5 }\n"final.q.root_joint.0" = { value = 0.01, atol = 1e-6 }\n'
    )
    report = run_scenario(write(tmp_path, text), tmp_path / "out", recording=False)
    assert [verdict.met for verdict in report.verdicts] == [False, True, True]


def test_an_unknown_figure_is_told_before_the_run(tmp_path):
    text = DROP + '[expect]\n"pairs.ball-plate.peek_force" = { min = 1 }\n'
    with pytest.raises(ScenarioError, match=r"pairs\.ball-plate\.peak_force"):
        run_scenario(write(tmp_path, text), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_every_figure_can_be_measured(built):
    result = built.simulation.run(built.q0, built.v0, 0.01)
    names = figure_names(built)
    assert "final.v.root_joint.5" in names
    for name in names:
        assert isinstance(measure(built, result, name), float)
