"""Sweeps: the closed form of what is swept, and that nothing that happens shows in the table."""

import contextlib
import json
import os
import signal
import sys
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sphshell_pin import robots
from sphshell_pin.errors import InvalidParameter, MissingExtra, ResultError, SweepError
from sphshell_pin.plot.sweep import plot_sweep
from sphshell_pin.study.sweep import axes_of, plan_sweep, sweep
from sphshell_pin.study.sweep.driver import run_plan
from sphshell_pin.study.sweep.journal import Journal
from sphshell_pin.study.sweep.table import varied_columns
from sphshell_pin.study.sweep.worker import prepare
from tests.study.resting import GRAVITY, RADIUS, SCENARIO, check_once, entries, write

pd = pytest.importorskip("pandas")
pytest.importorskip("pyarrow")

STIFFNESS, EXPONENT = "contact.law.stiffness", "contact.law.exponent"
VARY = {STIFFNESS: "1e4:1e6:log:30", EXPONENT: [1.5, 2.0]}
SMALL = {STIFFNESS: [1e4, 2e4, 3e4, 4e4]}


@pytest.fixture(scope="module")
def serial(scenario):
    """The file that the runs leave when they are done in turn in this process."""
    path = scenario.parent / "serial.parquet"
    sweep(scenario, VARY, workers=0, out=path)
    return path


def kill_worker(table: Path) -> None:
    """Kill the worker that did the last run."""
    os.kill(int(entries(table)[-1]["worker"].rpartition(":")[2]), signal.SIGKILL)


def test_the_depth_of_rest_follows_its_closed_form(serial):
    table = pd.read_parquet(serial)
    assert len(table) == 60
    assert (table["status"] == "done").all()
    assert (table["error"] == "").all()
    mass = robots.load("ball").model.inertias[1].mass
    expected = (mass * GRAVITY / table[STIFFNESS]) ** (1 / table[EXPONENT])
    np.testing.assert_allclose(table["figures.depth"], expected, rtol=1e-8)
    np.testing.assert_allclose(RADIUS - table["final.q.root_joint.2"], expected, rtol=1e-8)
    assert table["settings"].nunique() == 60
    assert not [name for name in table.columns if "wall" in name or "real_time" in name]


def test_a_killed_worker_costs_nothing(scenario, serial):
    table = scenario.parent / "killed.parquet"

    def progress(done, failed, total):
        if done in (10, 35):
            kill_worker(table)

    sweep(scenario, VARY, workers=2, out=table, progress=progress)
    check_once(table, 60)
    assert len({one["worker"] for one in entries(table)}) >= 3
    assert table.read_bytes() == serial.read_bytes()


def test_values_are_read_back_exactly_from_either_kind_of_file(scenario, serial):
    h5py = pytest.importorskip("h5py")
    table = scenario.parent / "same.h5"
    returned = sweep(scenario, VARY, workers=0, out=table)
    pd.testing.assert_frame_equal(returned, pd.read_parquet(serial), check_dtype=False)
    with h5py.File(table) as file:
        rows = file["sweep"][()]
        assert json.loads(file["sweep"].attrs["description"])["scenario"] == "resting"
    for name in returned.columns:
        if rows.dtype[name].kind == "f":
            np.testing.assert_array_equal(rows[name], returned[name].to_numpy())
        elif rows.dtype[name].kind == "S":
            assert [one.decode() for one in rows[name]] == returned[name].tolist()
    again = scenario.parent / "again.h5"
    sweep(scenario, VARY, workers=0, out=again)
    assert again.read_bytes() == table.read_bytes()


def test_a_failed_run_is_a_row_that_says_why(scenario):
    vary = {"contact.sphere.radius": [0.012, 0.03, 0.0125]}
    table = sweep(scenario, vary, workers=0)
    assert table["status"].tolist() == ["done", "failed", "done"]
    assert "starts at depth" in table["error"][1]
    assert str(scenario.parent) not in table["error"][1]
    assert table["figures.depth"].isna().tolist() == [False, True, False]


def test_units_stay_with_the_table(scenario, tmp_path):
    stiffness, exponent = "contact.law.stiffness", "contact.law.exponent"
    changes = {"run.duration": "0.1"}
    plan = plan_sweep(scenario, {stiffness: [1e4, 2e4]}, changes=changes)
    report = run_plan(plan, workers=0, out=tmp_path / "units.parquet")
    units = report.table.attrs["units"]
    assert units[stiffness] == "N/m^1.5"
    assert units["pairs.ball-plate.max_depth"] == "m"
    assert units["final.v.root_joint.5"] == "rad/s"
    assert set(units) < set(report.table.columns)
    assert pd.read_parquet(report.out).attrs["units"] == units
    (axis,) = plot_sweep(report.table, "final.q.root_joint.2").axes
    assert axis.get_xlabel() == f"{stiffness} [N/m^1.5]"
    assert axis.get_ylabel() == "final.q.root_joint.2 [m]"
    assert "2 runs, 0 failed, varied 'contact.law.stiffness [N/m^1.5]'" in repr(report)
    assert "pairs.ball-plate.peak_force [N]" in report._repr_html_()
    start = "robot.start.root_joint.2"
    moved = plan_sweep(scenario, {start: [0.012, 0.013]}, changes=changes)
    assert moved.units[start] == "m"
    # Where the exponent varies, too, the unit of the stiffness does.
    both = {stiffness: [1e4], exponent: [1.5, 2.0]}
    varied = plan_sweep(scenario, both, changes=changes)
    assert stiffness not in varied.units


def test_a_figure_that_breaks_leaves_the_others(tmp_path):
    path = write(tmp_path, "breaks")
    table = sweep(path, SMALL, workers=0)
    assert table["status"].tolist() == ["done", "failed", "done", "done"]
    assert "ZeroDivisionError" in table["error"][1]
    assert "figures.py:breaks" in table["error"][1]
    assert np.isnan(table["figures.breaks"][1])
    assert table["figures.depth"].notna().all()


def test_a_run_that_kills_its_workers_is_given_up_and_the_others_go_on(tmp_path):
    path = write(tmp_path, "deadly")
    out = tmp_path / "table.parquet"
    table = sweep(path, SMALL, workers=2, out=out)
    assert table["status"].tolist() == ["done", "failed", "done", "done"]
    assert "worker process died" in table["error"][1]
    assert np.isnan(table["figures.depth"][1])
    check_once(out, 4)


def test_routines_forget_between_runs(tmp_path):
    """A routine that remembers would make a row depend on those before it."""
    path = write(tmp_path, "count")
    assert sweep(path, SMALL, workers=0)["figures.count"].tolist() == [1.0] * 4


def test_expectations_become_columns(scenario):
    table = sweep(scenario, {STIFFNESS: [1e4, 1e6]}, workers=0, verdicts=True)
    assert table["met.figures.depth"].tolist() == [0.0, 1.0]
    assert (table["figures.depth"] <= 1e-4).tolist() == [False, True]


def test_words_lists_and_values_in_step(scenario):
    vary = {"contact.method": "smooth,facets", "gravity": "[0,0,-9.81],[0,0,-1.62]"}
    table = sweep(scenario, vary, workers=0, together=True)
    assert table["contact.method"].tolist() == ["smooth", "facets"]
    assert table["gravity"].tolist() == ["[0, 0, -9.81]", "[0, 0, -1.62]"]
    deep, shallow = table["figures.depth"]
    assert shallow / deep == pytest.approx((1.62 / 9.81) ** (1 / 1.5), rel=1e-8)


@pytest.fixture
def finished(scenario, tmp_path):
    """A finished sweep: its scenario, its table, its journal."""
    path, out = scenario, tmp_path / "table.parquet"
    sweep(path, SMALL, workers=0, out=out)
    return path, out, out.with_name(out.name + ".journal")


@pytest.mark.parametrize(
    "damage", [b"a,b\n1,2\n" * 100, b'{"format": 4}\n', b"[" * 100_000, "SQLite"]
)
def test_a_file_that_is_no_journal_is_refused_and_left_alone(finished, damage):
    path, out, journal = finished
    damage = damage if isinstance(damage, bytes) else b"SQLite format 3\0" + journal.read_bytes()
    journal.write_bytes(damage)
    with pytest.raises(SweepError, match=r"no journal of this version.* start the sweep again"):
        sweep(path, SMALL, workers=0, out=out)
    assert journal.read_bytes() == damage


def rewritten(journal: bytes, change) -> bytes:
    """The journal with its first run changed, and the checksum of that."""
    head, line, others = journal.split(b"\n", 2)
    text = change(line.rpartition(b', "crc32": ')[0])
    line = text + b', "crc32": ' + str(zlib.crc32(text)).encode() + b"}"
    return b"\n".join([head, line, others])


def with_figures(figures: bytes):
    return lambda text: text.partition(b'"figures": ')[0] + b'"figures": ' + figures


CHANGES = [
    (b'"run": 0', b'"run": 3'),
    (b'"run": 0', b'"run": null'),
    (b'"done"', b'"maybe"'),
    (b'"wall_time": ', b'"wall_time": 7'),
    (b'"run": 0, ', b""),
]
NO_RUNS = [with_figures(one) for one in (b"[]", b"{", b'{"x": "1"}', b"[" * 100_000)]
NO_RUNS.append(lambda text: text.replace(b'"run": 0', b'"run": 4'))


@pytest.mark.parametrize(
    ("damage", "resumed", "told"),
    [
        (lambda journal: b"", 0, 0),
        (lambda journal: journal[:20], 0, 0),  # no whole head
        (lambda journal: journal[:-20], 3, 0),  # as a kill leaves it
        *[(lambda journal, one=one: journal.replace(*one, 1), 3, 1) for one in CHANGES],
        *[(lambda journal, one=one: rewritten(journal, one), 3, 1) for one in NO_RUNS],
    ],
)
def test_a_sweep_goes_on_from_what_is_whole_in_its_journal(finished, damage, resumed, told):
    path, out, journal = finished
    whole = out.read_bytes()
    journal.write_bytes(damage(journal.read_bytes()))
    out.unlink()
    notes: list[str] = []
    report = run_plan(plan_sweep(path, SMALL), workers=0, out=out, note=notes.append)
    assert report.resumed == resumed
    assert [f"{journal}, line 2: is damaged" in note for note in notes] == [True] * told
    assert out.read_bytes() == whole
    assert run_plan(plan_sweep(path, SMALL), workers=0, out=out).resumed == 4


def test_damage_anywhere_in_the_rows_is_noticed(finished):
    path, _, journal = finished
    plan, whole = plan_sweep(path, SMALL), journal.read_bytes()
    right = {i: repr(one) for i, one in Journal(journal, plan.head, 4).outcomes.items()}
    places = [i for i in range(len(whole)) if whole[i : i + 1].isdigit()]
    for place in places[::40]:
        changed = bytearray(whole)
        changed[place] ^= 1
        journal.write_bytes(changed)
        with contextlib.suppress(SweepError, ResultError):
            found = Journal(journal, plan.head, 4)
            found.close()
            assert all(repr(one) == right[i] for i, one in found.outcomes.items())


def test_a_journal_of_damaged_lines_alone_is_kept(finished):
    path, _, journal = finished
    head, _, lines = journal.read_bytes().partition(b"\n")
    damaged = head + b"\n" + lines.replace(b'"run"', b'"ran"')
    journal.write_bytes(damaged)
    Journal(journal, plan_sweep(path, SMALL).head, 4).close()
    assert journal.read_bytes() == damaged
    journal.write_bytes(head + b"\n" + lines[:20])
    Journal(journal, plan_sweep(path, SMALL).head, 4).close()
    assert not journal.exists()


def test_done_runs_are_not_done_again(scenario):
    path, out = scenario, scenario.parent / "done.parquet"
    sweep(path, SMALL, workers=0, out=out)
    before = entries(out)
    calls = []
    sweep(path, SMALL, workers=0, out=out, progress=lambda *counts: calls.append(counts))
    assert calls == [(4, 0, 4)]
    assert entries(out) == before


def test_failed_runs_are_done_again_on_demand(scenario):
    path, out = scenario, scenario.parent / "retry.parquet"
    vary = {"contact.sphere.radius": [0.012, 0.03]}
    first = sweep(path, vary, workers=0, out=out)
    second = sweep(path, vary, workers=0, out=out, retry_failed=True)
    pd.testing.assert_frame_equal(first, second)
    assert [one["run"] for one in entries(out)] == [0, 1, 1]


def test_the_journal_of_another_sweep_is_refused(tmp_path):
    path, out = write(tmp_path), tmp_path / "table.parquet"
    sweep(path, SMALL, workers=0, out=out)
    kept = out.read_bytes()

    def refused(words, vary=SMALL, **named):
        with pytest.raises(SweepError, match=words):
            sweep(path, vary, workers=0, out=out, **named)

    refused("other values", {STIFFNESS: [1e4, 5e4]})
    refused("other settings", changes={"run.duration": "2.0"})
    refused("combined in another way", together=True)
    refused("other columns", verdicts=True)
    figures = tmp_path / "figures.py"
    figures.write_text(figures.read_text() + "\n# changed\n")
    refused("other contents of the files")
    path.write_text(SCENARIO.replace("damping = 5.0", "damping = 6.0"))
    refused("other settings")
    assert out.read_bytes() == kept


def test_only_one_sweep_writes_a_journal(scenario):
    out = scenario.parent / "locked.parquet"

    def progress(done, failed, total):
        if done == 1:
            with pytest.raises(SweepError, match="another sweep is writing it"):
                sweep(scenario, SMALL, workers=0, out=out)

    sweep(scenario, SMALL, workers=0, out=out, progress=progress)
    check_once(out, 4)


def test_a_worker_with_other_files_or_versions_is_told(scenario, tmp_path):
    job = plan_sweep(scenario, SMALL).job
    with pytest.raises(SweepError, match=r"has numpy .*; the sweep was started with .*numpy 1\.0"):
        prepare(replace(job, versions={**job.versions, "numpy": "1.0"}))
    with pytest.raises(SweepError, match=r"has another file .*figures\.py"):
        prepare(replace(job, files={"figures.py": "0" * 64}))
    with pytest.raises(SweepError, match=r"has no file .*figures\.py"):
        prepare(replace(job, name=str(tmp_path / "elsewhere.toml")))


def test_a_shipped_scenario_is_found_by_its_name_on_any_machine():
    job = plan_sweep("sphere_on_shell", {"run.rtol": [1e-3]}).job
    assert (job.name, job.shipped) == ("sphere_on_shell", True)
    assert set(job.files) == {"sphere_on_shell.py", "surfaces/bowl.shl"}
    prepare(job)


def test_a_missing_extra_is_told_before_anything_runs(scenario, monkeypatch):
    path, out = scenario, scenario.parent / "extra.parquet"
    for package in ("pandas", "pyarrow"):
        with monkeypatch.context() as patch:
            patch.setitem(sys.modules, package, None)
            with pytest.raises(MissingExtra, match=rf"{package}.*sphshell-pin\[sweep\]"):
                sweep(path, SMALL, workers=0, out=out)
    assert not list(scenario.parent.glob("extra*"))


def test_wrong_arguments_are_told_and_leave_nothing(scenario):
    path = scenario
    with pytest.raises(InvalidParameter, match=r"\.parquet or \.h5"):
        sweep(path, SMALL, out=scenario.parent / "table.csv")
    with pytest.raises(InvalidParameter, match="0 or more"):
        sweep(path, SMALL, workers=-1)
    for wrong in (1.5, "2", True):
        with pytest.raises(InvalidParameter, match="whole number"):
            sweep(path, SMALL, workers=wrong)
    with pytest.raises(InvalidParameter, match="scheduler"):
        sweep(path, SMALL, workers=2, scheduler="tcp://127.0.0.1:8786")
    with pytest.raises(InvalidParameter, match="tcp://host:8786"):
        sweep(path, SMALL, scheduler="nowhere", out=scenario.parent / "nothing.parquet")
    with pytest.raises(ResultError, match="cannot be written"):
        sweep(path, SMALL, out=path / "below_a_file" / "table.parquet")
    assert not list(scenario.parent.glob("nothing*"))


@pytest.mark.parametrize("suffix", [".parquet", ".h5"])
def test_only_a_table_of_a_sweep_is_replaced(scenario, suffix):
    path, out = scenario, scenario.parent / f"place{suffix}"
    journal = out.with_name(f"{out.name}.journal")
    if suffix == ".h5":
        with pytest.importorskip("h5py").File(out, "w") as file:
            file["sweep"] = [1]
    else:
        pd.DataFrame({"precious": [1]}).to_parquet(out)
    for content in (out.read_bytes(), b"precious"):
        out.write_bytes(content)
        with pytest.raises(ResultError, match="no sweep wrote"):
            sweep(path, SMALL, workers=0, out=out)
        assert out.read_bytes() == content
        assert not journal.exists()
    out.unlink()
    out.mkdir()
    with pytest.raises(ResultError, match="is a folder"):
        sweep(path, SMALL, workers=0, out=out)
    out.rmdir()
    sweep(path, SMALL, workers=0, out=out)
    before = out.read_bytes()
    journal.unlink()
    sweep(path, SMALL, workers=0, out=out)
    assert out.read_bytes() == before


def test_whole_numbers_without_end_are_columns():
    few = varied_columns(axes_of({"a": [1, 2]}), [(1,), (2,)])
    huge = varied_columns(axes_of({"a": [1, 10**30]}), [(1,), (10**30,)])
    endless = varied_columns(axes_of({"a": [1, 10**400]}), [(1,), (10**400,)])
    assert few["a"].dtype == np.int64
    assert huge["a"].tolist() == [1.0, 1e30]
    assert endless["a"].tolist() == ["1", str(10**400)]
