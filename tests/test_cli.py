"""The command line: examples in every help, one sentence and exit code 2 for every fault."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest
from typer.testing import CliRunner

from sphshell_pin.cli import app
from tests.scenario.files import DROP, write

ENTRY = [sys.executable, "-c", "from sphshell_pin.cli import main; main()"]


def call(*arguments):
    return CliRunner().invoke(app, [str(one) for one in arguments])


@pytest.mark.parametrize("command", [[], ["run"], ["explain"], ["check"], ["list"]])
def test_every_help_has_an_example(command):
    told = call(*command, "--help")
    assert told.exit_code == 0
    assert "Example: sphshell-pin" in told.output


def test_help_is_quick_and_imports_nothing_heavy():
    code = (
        "import sys; sys.argv = ['sphshell-pin', '--help']\n"
        "from sphshell_pin.cli import app\n"
        "try: app()\n"
        "except SystemExit: pass\n"
        "print([m for m in ('trimesh', 'pydantic', 'matplotlib', 'meshcat', 'pandas')\n"
        "       if m in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip().endswith("[]")


def test_run_prints_a_summary_and_where_the_files_are(tmp_path):
    out = tmp_path / "out"
    told = call("run", write(tmp_path), "--out", out, "--no-recording")
    assert told.exit_code == 0
    for words in ("ball-plate", "peak force", "energy residual", "real-time factor", "run.npz"):
        assert words in told.output
    assert (out / "run.npz").is_file()


def test_options_change_the_run(tmp_path):
    arguments = ["run", write(tmp_path), "--out", tmp_path / "out", "--no-recording"]
    told = call(*arguments, "--dt", "2e-5", "--duration", "0.01", "--set", "gravity=[0,0,0]")
    assert told.exit_code == 0
    assert "500 steps of 2e-05 s" in told.output
    told = call(*arguments, "--set", "run.dt")
    assert told.exit_code == 2
    assert "KEY=VALUE" in told.output


def test_a_missed_expectation_is_exit_code_1_unless_the_scenario_was_changed(tmp_path):
    path = write(tmp_path, DROP + '[expect]\n"stats.steps" = { max = 3 }\n')
    arguments = ["run", path, "--out", tmp_path / "out", "--no-recording"]
    told = call(*arguments)
    assert told.exit_code == 1
    assert "missed" in told.output
    told = call(*arguments, "--dt", "2e-4")
    assert told.exit_code == 0
    assert "not counted" in told.output


FAULTS = {
    "no such scenario": (["run", "no_such"], "fingertip_on_blade"),
    "no such file": (["run", "no/such.toml"], "no such file"),
    "no such surface": (["check", "no_such.stl"], "no_such.stl"),
    "wrong side": (["check", "no_such.stl", "--side", "up"], "outside"),
    "wrong scale": (["check", "no_such.shl", "--scale", "big"], '"apply", "ignore" or a positive'),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_one_sentence_and_exit_code_2(fault):
    arguments, words = FAULTS[fault]
    told = call(*arguments)
    assert told.exit_code == 2
    assert words in told.stderr
    assert told.stdout == ""
    assert told.stderr.count("\n") == 1
    assert "Traceback" not in told.output


def test_a_faulty_scenario_and_debug(tmp_path):
    path = write(tmp_path, DROP.replace("dt =", "dtt ="))
    told = call("run", path)
    assert told.exit_code == 2
    assert "did you mean 'dt'" in told.stderr
    told = call("--debug", "run", path)
    assert told.exception is not None
    assert type(told.exception).__name__ == "ScenarioError"


def test_an_unwritable_folder_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    told = call("run", write(tmp_path), "--out", tmp_path / "file" / "out")
    assert told.exit_code == 2
    assert "cannot be written" in told.stderr


def test_explain_names_the_pair_and_a_time_step(tmp_path):
    told = call("explain", write(tmp_path))
    assert told.exit_code == 0
    assert "ball-plate" in told.output
    assert "dt" in told.output


def test_check_prints_the_health_of_a_file(tmp_path):
    path = tmp_path / "triangle.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nf 1 2 3\n")
    told = call("check", path, "--unit", "mm")
    assert told.exit_code == 0
    assert "1" in told.output
    path.write_text("")
    assert call("check", path, "--unit", "mm").exit_code == 2


def test_check_asks_for_the_unit_as_the_command_line_states_it(tmp_path):
    path = tmp_path / "triangle.obj"
    path.write_text("v 0 0 0\nv 30 0 0\nv 0 40 0\nf 1 2 3\n")
    told = call("check", path)
    assert told.exit_code == 2
    assert "the unit must be stated, as .obj files carry none" in told.stderr
    assert "triangle.obj measures 50 units: say --unit mm if that is 0.05 m" in told.stderr
    assert "unit=" not in told.stderr
    assert told.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("scale", "told_of"),
    [
        ("apply", "SCALE 0.001 of the file applied"),
        ("ignore", "SCALE 0.001 of the file ignored"),
        ("0.5", "scale 0.5 used in place of SCALE 0.001"),
    ],
)
def test_check_uses_the_scale_of_a_shl_file_as_told(scale, told_of, tmp_path):
    path = tmp_path / "triangle.shl"
    path.write_text("3 1 0.001\n0 0 0\n1 0 0\n0 1 0\n3 1 2 3\n")
    told = call("check", path, "--scale", scale)
    assert told.exit_code == 0
    assert told_of in told.output


def test_list_names_scenarios_and_robots():
    told = call("list")
    assert told.exit_code == 0
    for word in ("fingertip_on_blade", "gear_contact", "turntable"):
        assert word in told.output


def test_ctrl_c_keeps_what_was_computed(tmp_path):
    path = write(tmp_path, DROP.replace("duration = 0.05", "duration = 600\nrecord_dt = 0.1"))
    out = tmp_path / "out"
    arguments = ["run", str(path), "--out", str(out), "--no-recording", "--dt", "1e-6"]
    process = subprocess.Popen(
        [*ENTRY, *arguments], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    # The folder appears just before the run starts.
    deadline = time.monotonic() + 30
    while not out.exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(1.0)
    os.kill(process.pid, signal.SIGINT)
    _, stderr = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "interrupted at t =" in stderr
    assert (out / "run.npz").is_file()
