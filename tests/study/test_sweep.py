"""Sweeps: the closed form of what is swept, and that nothing that happens shows in the table."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from sphshell_pin import errors, robots
from sphshell_pin.errors import ResultError, SweepError
from sphshell_pin.plot.sweep import plot_sweep
from sphshell_pin.study.sweep import plan_sweep, run_plan, sweep
from sphshell_pin.study.sweep.worker import prepare
from tests.command import call, refused, succeed
from tests.programs import python
from tests.study.resting import GRAVITY, RADIUS, write
from tests.tables import cases_of

pd = pytest.importorskip("pandas")
pytest.importorskip("pyarrow")

STIFFNESS, EXPONENT = "contact.law.stiffness", "contact.law.exponent"
VARY = {STIFFNESS: "1e4:1e6:log:30", EXPONENT: [1.5, 2.0]}
OPTIONS = ["--vary", f"{STIFFNESS}=1e4:1e6:log:30", "--vary", f"{EXPONENT}=1.5,2"]
SMALL = {STIFFNESS: [1e4, 2e4, 3e4, 4e4]}
RADII = {"contact.sphere.radius": [0.012, 0.03, 0.0125]}

# The process sends itself the signal when so many runs are in the table, however fast the machine
# is. Tests that run in the background pass on that Ctrl-C is to be ignored.
ENTRY = """
import os, signal
from sphshell_pin.cli import main
from sphshell_pin.study.sweep import driver

signal.signal(signal.SIGINT, signal.default_int_handler)
driver._SAVE_AFTER = driver._SAVE_SELDOM = 0.0
write = driver.write_table


def stop(path, table):
    write(path, table)
    if len(table) >= {runs}:
        driver.write_table = write
        os.kill(os.getpid(), {number})


if __name__ == "__main__":
    driver.write_table = stop
    main()
"""


@pytest.fixture(scope="module")
def serial(scenario):
    """The file that the runs leave when they are done in turn in this process."""
    path = scenario.parent / "serial.parquet"
    sweep(scenario, VARY, workers=0, out=path)
    return path


def test_the_depth_of_rest_follows_its_closed_form(serial):
    table = pd.read_parquet(serial)
    assert table["run"].tolist() == list(range(60))
    assert (table["status"] == "done").all()
    mass = robots.load("ball").model.inertias[1].mass
    expected = (mass * GRAVITY / table[STIFFNESS]) ** (1 / table[EXPONENT])
    np.testing.assert_allclose(table["figures.depth"], expected, rtol=1e-8)
    np.testing.assert_allclose(RADIUS - table["final.q.root_joint.2"], expected, rtol=1e-8)
    assert table["settings"].nunique() == 60
    assert not [name for name in table.columns if "wall" in name or "real_time" in name]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_stopped_sweep_goes_on_to_the_same_bytes(scenario, serial, number):
    out = scenario.parent / f"{number.name}.parquet"
    options = "sweep", scenario, *OPTIONS, "--workers", 0, "--out", out, "--no-pictures"
    told = python(ENTRY.format(runs=5, number=int(number)), *options)
    kept = pd.read_parquet(out)
    assert 5 <= len(kept) < 60
    if number == signal.SIGKILL:
        assert told.returncode == -signal.SIGKILL
    else:
        assert told.returncode == 130
        assert told.stderr.startswith(f"interrupted: {len(kept)} of 60 runs are done and kept in")
        assert told.stderr.strip().endswith(f"--workers 0 --out {out} --no-pictures")
        assert len(told.stderr.splitlines()) == 1
    told = succeed(*options)
    assert f"60 runs, 60 done, 0 failed; {len(kept)} were done before" in told.output
    assert out.read_bytes() == serial.read_bytes()


@pytest.mark.study
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_neither_ctrl_c_nor_a_kill_leaves_a_worker(scenario, number):
    script, out = scenario.parent / "entry.py", scenario.parent / f"{number.name}.parquet"
    program = ENTRY.format(runs=5, number=int(number))
    if number == signal.SIGINT:  # as a terminal sends it: to all processes
        program = program.replace("os.kill(", "os.killpg(")
    script.write_text(program)
    command = [sys.executable, script, "sweep", scenario, *OPTIONS, "--workers", "2", "--out", out]
    child = subprocess.Popen(command, stdout=-1, stderr=-1, text=True, start_new_session=True)
    _, errors = child.communicate(timeout=120)
    assert child.returncode == (130 if number == signal.SIGINT else -signal.SIGKILL)
    assert number == signal.SIGKILL or len(errors.splitlines()) == 1, errors
    end = time.monotonic() + 30
    with contextlib.suppress(ProcessLookupError):
        while time.monotonic() < end:
            os.killpg(child.pid, 0)
            time.sleep(0.1)
        pytest.fail("a process of the sweep is left")


def test_a_run_that_kills_its_workers_is_given_up_in_a_script_without_a_guard(tmp_path):
    """Processes that loaded the script would begin its sweep again; workers come back slowly."""
    program, path = tmp_path / "script.py", write(tmp_path, "deadly")
    program.write_text(
        "import dask\n"
        "from sphshell_pin.study.sweep import sweep\n"
        "dask.config.set({'distributed.deploy.lost-worker-timeout': '0.1s'})\n"
        f"print(*sweep({str(path)!r}, {SMALL}, workers=1)['status'])\n"
    )
    command = [sys.executable, program]
    told = subprocess.run(command, capture_output=True, text=True, check=True, timeout=900)
    assert (told.stdout, told.stderr) == ("done failed done done\n", "")


def test_a_port_that_another_sweep_has_is_not_asked_for(scenario, recwarn):
    """Dask's server would warn of its usual one."""
    with socket.socket() as taken:
        with contextlib.suppress(OSError):  # somebody else has it already
            taken.bind(("", 8787))
            taken.listen()
        sweep(scenario, {STIFFNESS: [1e4]}, workers=1)
    assert [one for one in recwarn if "8787" in str(one.message)] == []


def test_done_runs_are_not_done_again_and_a_table_grows(scenario, tmp_path):
    out, calls = tmp_path / "table.parquet", []
    sweep(scenario, {STIFFNESS: [1e4, 3e4]}, workers=0, out=out)
    more = {"workers": 0, "out": out, "progress": lambda *one: calls.append(one)}
    table = run_plan(plan_sweep(scenario, SMALL), **more)
    assert (calls[0], len(table)) == ((2, 0, 4), 4)
    calls.clear()
    whole = out.read_bytes()
    sweep(scenario, SMALL, **more)
    assert calls == [(4, 0, 4)]
    assert out.read_bytes() == whole
    pd.testing.assert_frame_equal(pd.read_parquet(out), table, check_dtype=False)
    fresh = tmp_path / "fresh.parquet"
    sweep(scenario, SMALL, workers=0, out=fresh)
    assert fresh.read_bytes() == whole


def test_a_failed_run_is_a_row_that_says_why(scenario, tmp_path):
    out = tmp_path / "table.parquet"
    table = sweep(scenario, RADII, workers=0, out=out)
    assert table["status"].tolist() == ["done", "failed", "done"]
    assert "starts at depth" in table["error"][1]
    assert str(scenario.parent) not in table["error"][1]
    assert table["figures.depth"].isna().tolist() == [False, True, False]
    calls = []
    again = sweep(scenario, RADII, workers=0, out=out, progress=lambda *one: calls.append(one))
    assert calls[0] == (2, 0, 3)
    pd.testing.assert_frame_equal(again, table)


def test_what_would_be_lost_or_mixed_is_refused(tmp_path):
    path, out = write(tmp_path), tmp_path / "table.parquet"
    sweep(path, SMALL, workers=0, out=out)
    kept = out.read_bytes()

    def refused(words, vary=SMALL, **named):
        with pytest.raises(SweepError, match=words):
            sweep(path, vary, workers=0, out=out, **named)

    refused("holds 3 runs", {STIFFNESS: [1e4, 5e4]})
    refused("holds 4 runs", changes={"run.duration": "2.0"})
    refused("holds 4 runs", None, dist={STIFFNESS: "uniform(1,2)"}, n=2)
    with (tmp_path / "figures.py").open("a") as figures:
        figures.write("\n# changed\n")
    refused("holds 4 runs .*files")
    assert out.read_bytes() == kept


@pytest.mark.parametrize("damage", ["other", "text", "bytes"])
def test_only_a_whole_table_of_a_sweep_is_taken(scenario, tmp_path, damage):
    out = tmp_path / "table.parquet"
    sweep(scenario, SMALL, workers=0, out=out)
    if damage == "other":
        pd.DataFrame({"precious": [1]}).to_parquet(out)
    elif damage == "text":
        out.write_bytes(b"precious")
    else:
        whole = bytearray(out.read_bytes())
        whole[whole.index(np.float64(2e4).tobytes())] ^= 1  # a value that varies
        out.write_bytes(whole)
    content = out.read_bytes()
    with pytest.raises(ResultError, match="no sweep wrote, or a damaged one"):
        sweep(scenario, SMALL, workers=0, out=out)
    assert out.read_bytes() == content


def test_units_stay_with_the_table(scenario, tmp_path):
    changes = {"run.duration": "0.1"}
    out = tmp_path / "units.parquet"
    table = sweep(scenario, {STIFFNESS: [1e4, 2e4]}, changes=changes, workers=0, out=out)
    units = table.attrs["units"]
    assert units[STIFFNESS] == "N/m^1.5"
    assert units["pairs.ball-plate.max_depth"] == "m"
    assert units["final.v.root_joint.5"] == "rad/s"
    assert set(units) < set(table.columns)
    assert pd.read_parquet(out).attrs == table.attrs
    (axis,) = plot_sweep(table, "final.q.root_joint.2").axes
    assert axis.get_xlabel() == f"{STIFFNESS} [N/m^1.5]"
    assert axis.get_ylabel() == "final.q.root_joint.2 [m]"
    vary = {STIFFNESS: [1e4], EXPONENT: [1.5, 2.0], "run.duration": [0.1], "run.rtol": [1e-5]}
    units = plan_sweep(scenario, vary).units
    # Where the exponent varies, too, the unit of the stiffness does.
    assert (units["run.duration"], STIFFNESS in units, "run.rtol" in units) == ("s", False, False)


def test_a_routine_that_breaks_or_remembers_touches_no_other_run(tmp_path):
    table = sweep(write(tmp_path, "breaks"), SMALL, workers=0)
    assert table["status"].tolist() == ["done", "failed", "done", "done"]
    assert "ZeroDivisionError" in table["error"][1]
    assert "figures.py:breaks" in table["error"][1]
    assert np.isnan(table["figures.breaks"][1])
    assert table["figures.depth"].notna().all()
    table = sweep(write(tmp_path, "count"), SMALL, workers=0)
    assert table["figures.count"].tolist() == [1.0] * 4


def test_words_lists_and_expectations(scenario):
    vary = {"contact.method": "smooth,facets", "gravity": "[0,0,-9.81],[0,0,-1.62]"}
    table = sweep(scenario, vary, workers=0)
    assert table["contact.method"].tolist() == ["smooth", "smooth", "facets", "facets"]
    assert table["gravity"].tolist() == ["[0, 0, -9.81]", "[0, 0, -1.62]"] * 2
    deep, shallow = table["figures.depth"][:2]
    assert shallow / deep == pytest.approx((1.62 / 9.81) ** (1 / 1.5), rel=1e-8)
    met = [float(one <= 1e-4) for one in (deep, shallow)] * 2
    assert table["met.figures.depth"].tolist() == met


def test_a_worker_with_other_files_or_versions_is_told(scenario, tmp_path):
    job = plan_sweep(scenario, SMALL).job
    for uses in ({"numpy": "1.0"}, {"figures.py": "0" * 64}):
        (name,) = uses
        with pytest.raises(SweepError, match=f"has another {name} than the sweep"):
            prepare(replace(job, uses={**job.uses, **uses}))
    with pytest.raises(SweepError, match=r"has another figures\.py"):
        prepare(replace(job, name=str(tmp_path / "elsewhere.toml")))
    job = plan_sweep("sphere_on_shell", {"run.rtol": [1e-3]}).job
    assert job.name == "sphere_on_shell"
    assert set(job.uses) > {"sphere_on_shell.py", "surfaces/bowl.shl", "numpy"}
    prepare(job)


@pytest.mark.parametrize(("kind", "words", "arguments"), cases_of("wrong_sweeps")["calls"])
def test_wrong_arguments_are_told_and_leave_nothing(scenario, monkeypatch, kind, words, arguments):
    monkeypatch.chdir(scenario.parent)
    (scenario.parent / "folder.parquet").mkdir(exist_ok=True)
    if kind == "MissingExtra":
        monkeypatch.setitem(sys.modules, words.partition(".")[0], None)
    with pytest.raises(getattr(errors, kind), match=words):
        sweep(scenario, SMALL, **{"workers": None, **arguments})
    assert not list(scenario.parent.glob("nothing*"))


def test_pictures_and_failed_runs_are_told(scenario):
    pytest.importorskip("matplotlib")
    out = scenario.parent / "failed.parquet"
    radii = ["--vary", "contact.sphere.radius=0.012,0.03", "--workers", "0", "--out", out]
    plotted = "--plot", "figures.depth", "--plot", "energy.residual"
    told = succeed("sweep", scenario, *radii, *plotted)
    assert "2 runs, 1 done, 1 failed" in told.output
    words = "run 1 failed (contact.sphere.radius = 0.03 m): contact 'ball-plate' starts"
    assert words in told.output
    for name in ("figures.depth", "energy.residual"):
        assert (scenario.parent / f"failed.{name}.png").read_bytes().startswith(b"\x89PNG")
    vary = ["--vary", "contact.sphere.radius=0.03,0.04", "--workers", "0"]
    assert call("sweep", scenario, *vary, "--out", scenario.parent / "none.parquet").exit_code == 2


def test_faults_are_one_sentence(scenario):
    plotted = "--vary", f"{STIFFNESS}=1,2", "--plot", "peak"
    assert "no figure 'peak'" in refused("sweep", scenario, *plotted)
    assert "must say what varies" in refused("sweep", scenario)
