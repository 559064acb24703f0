"""A run's folder: whole files or none, told early when unwritable, kept when interrupted."""

import csv
import json
import os
import sys
from unittest.mock import Mock

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin import errors
from sphshell_pin.scenario import build, run_built, run_scenario
from sphshell_pin.scenario.running.figures import figure_units, measuring
from tests.programs import python
from tests.scenario.files import DROP, write
from tests.scenario.operations import visible


@pytest.fixture
def built(tmp_path, no_pictures):
    return build(write(tmp_path))


def test_a_run_without_figures_writes_all_else_and_imports_no_matplotlib(tmp_path):
    program = (
        "import sys; from sphshell_pin.scenario import run_scenario; "
        "run_scenario(sys.argv[1], sys.argv[2], recording=False, figures=False); "
        "assert 'matplotlib' not in sys.modules"
    )
    path, out = write(tmp_path), tmp_path / "out"
    python(program, path, out, check=True)
    assert {"run.npz", "contacts.csv", "summary.json"} == set(os.listdir(out))


def test_the_folder_holds_what_was_computed(tmp_path):
    built, seen = build(write(tmp_path)), []
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
    with (out / "contacts.csv").open() as file:
        rows = list(csv.DictReader(file))
    log = report.result.contacts
    assert len(rows) == len(log.t) > 0
    assert {row["pair"] for row in rows} == {"ball-plate"}
    for name, column in (("depth [m]", log.depth), ("normal_z [1]", log.normal_world[:, 2])):
        np.testing.assert_allclose([float(row[name]) for row in rows], column, rtol=1e-12)


def test_a_folder_that_cannot_be_written_is_told_before_the_run(built, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(sp.Simulation, "run", lambda *_, **__: pytest.fail("it ran"))
    for place in (tmp_path / "file" / "out", "/proc/nothing"):
        with pytest.raises(errors.ResultError, match="cannot be written"):
            run_built(built, place)


def test_without_the_view_packages_the_rest_is_written(tmp_path, monkeypatch):

    for name in ("matplotlib", "matplotlib.figure", "meshcat"):
        monkeypatch.setitem(sys.modules, name, None)
    report = run_built(build(write(tmp_path)), tmp_path / "out")
    assert {file.name for file in report.files} == {"run.npz", "contacts.csv", "summary.json"}
    assert ["sphshell-pin[view]" in note for note in report.notes] == [True, True]


def stop_early(monkeypatch, fault=errors.SimulationDiverged):
    real = sp.Simulation.run

    def stop(self, q0, v0, duration, *args, **kwargs):
        part = real(self, q0, v0, duration / 2, *args, **kwargs)
        details = (0.025, part) if fault is errors.Interrupted else (0.025, "speed", part)
        raise fault(*details)

    monkeypatch.setattr(sp.Simulation, "run", stop)


@pytest.mark.parametrize("fault", [errors.Interrupted, errors.SimulationDiverged])
def test_a_run_that_stops_early_spares_complete_results(fault, built, tmp_path, monkeypatch):
    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        stop_early(patch, fault)
        report = run_built(built, out, recording=False)
    assert isinstance(report.stopped, fault)
    assert not json.loads((out / "summary.json").read_text())["complete"]
    run_built(built, out, recording=False)
    (out / "recording.html").write_text("of the complete run")
    (out / "notes.txt").write_text("mine")
    before = visible(out)
    stop_early(monkeypatch, fault)
    for _ in range(2):  # partial results give way to later partial ones
        report = run_built(built, out, recording=False)
        assert report.folder == tmp_path / "out-stopped"
        assert before.items() <= visible(out).items()
        assert sp.Result.load(report.folder / "run.npz").t[-1] == pytest.approx(0.025)
        assert any("earlier run" in note for note in report.notes)
    monkeypatch.undo()
    assert run_built(built, out, recording=False).folder == out
    assert json.loads((out / "summary.json").read_text())["complete"]
    assert (out / "notes.txt").read_text() == "mine"


def test_a_refused_start_leaves_no_folder(tmp_path):
    deep = build(write(tmp_path), {"robot.start.root_joint": "[0.01, 0.02, 0.0, 0, 0, 0, 1]"})
    (tmp_path / "mine").mkdir()
    for place in (tmp_path / "a" / "b", tmp_path / "mine"):
        with pytest.raises(errors.DeepStart):
            run_built(deep, place)
    assert sorted(os.listdir(tmp_path)) == ["drop.toml", "mine"]


def test_a_figure_that_fails_costs_no_numbers(built, tmp_path, monkeypatch):
    fails = Mock(side_effect=ZeroDivisionError("no axis"))
    monkeypatch.setattr("sphshell_pin.plot.save_figures", fails)
    report = run_built(built, tmp_path / "out", recording=False)
    assert [file.name for file in report.files] == ["run.npz", "contacts.csv", "summary.json"]
    assert any("ZeroDivisionError: no axis" in note for note in report.notes)


def test_a_figure_of_ones_own_that_fails_is_told_after_the_writing(tmp_path, no_pictures):
    (tmp_path / "own.py").write_text("def wrong(result, scene):\n    return 1 / 0\n")
    text = DROP + '[figures]\nw = "own.py:wrong"\n[expect]\n"figures.w" = { min = 1 }\n'
    with pytest.raises(ZeroDivisionError) as caught:
        run_scenario(write(tmp_path, text), tmp_path / "out", recording=False)
    assert "figure 'w' (own.py:wrong, line 2)" in caught.value.__notes__[0]
    assert (tmp_path / "out" / "run.npz").is_file()


def test_expectations_are_judged(tmp_path, no_pictures):
    text = DROP + (
        '[expect]\n"pairs.ball-plate.peak_force" = { min = 1e9 }\n"stats.steps" = '
        '{ value = 500, atol = 0.5 }\n"final.q.root_joint.0" = { value = 0.01, atol = 1e-6 }\n'
    )
    report = run_scenario(write(tmp_path, text), tmp_path / "out", recording=False)
    assert [verdict.met for verdict in report.verdicts] == [False, True, True]


def test_an_unknown_figure_is_told_before_the_run(tmp_path):
    text = DROP + '[expect]\n"pairs.ball-plate.peek_force" = { min = 1 }\n'
    with pytest.raises(errors.ScenarioError, match=r"pairs\.ball-plate\.peak_force"):
        run_scenario(write(tmp_path, text), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_every_figure_can_be_measured(built):
    result = built.simulation.run(built.q0, built.v0, 0.01)
    names, measure = figure_units(built), measuring(built, result)
    assert "final.v.root_joint.5" in names
    for name in names:
        assert isinstance(measure(name), float)
