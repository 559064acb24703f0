"""The command line: examples in every help, one sentence and exit code 2 for every fault."""

import os
import re
import signal
import subprocess
import sys
import time

import pytest
from typer.testing import CliRunner

import sphshell_pin
from sphshell_pin.cli import app
from tests.command import call, refused, succeed
from tests.programs import HEARS_CTRL_C, python
from tests.scenario.files import DROP, write

XACRO = '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="{}"/></robot>'
URDF = (
    "<robot name='a'><link name='b'/>"
    "<joint name='{}'><parent link='b'/><child link='c'/></joint></robot>"
)
COMMANDS = [one.name or one.callback.__name__ for one in app.registered_commands]


@pytest.mark.parametrize("command", [[], *([name] for name in COMMANDS)])
def test_every_help_has_an_example(command):
    assert "Example: sphshell-pin" in succeed(*command, "--help").output


def test_it_states_its_versions():
    assert call("--version").output.startswith(f"sphshell-pin {sphshell_pin.__version__}, with pin")


def test_help_is_quick_and_imports_nothing_heavy():
    code = """if True:
        import sys
        from sphshell_pin.cli import app
        try: app(["--help"])
        except SystemExit: pass
        heavy = "trimesh", "pydantic", "matplotlib", "meshcat", "pandas"
        print([name for name in heavy if name in sys.modules])"""
    assert python(code, check=True).stdout.strip().endswith("[]")


@pytest.fixture
def run(tmp_path):
    """The arguments of a run of a drop, and of the scenario `text`, into tmp_path/out."""

    def run(text=DROP):
        return "run", write(tmp_path, text), "--out", tmp_path / "out", "--no-recording"

    return run


def test_options_change_the_run(run):
    told = succeed(*run(), "--dt", "2e-5", "--duration", "0.01", "--set", "gravity=[0,0,0]")
    assert "500 steps of 2e-05 s" in told.output
    assert "KEY=VALUE" in refused(*run(), "--set", "run.dt")


def test_a_missed_expectation_is_exit_code_1_unless_the_scenario_was_changed(run):
    missed = run(DROP + '[expect]\n"stats.steps" = { max = 3 }\n')
    told = call(*missed)
    assert told.exit_code == 1
    assert "missed" in told.output
    assert "not counted" in succeed(*missed, "--dt", "2e-4").output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "no_such"], "fingertip_on_blade"),
        (["run", "no/such.toml"], "no such file"),
        (["check", "no_such.stl"], "no_such.stl"),
        (["check", "no_such.stl", "--side", "up"], "outside"),
        (["check", "no_such.shl", "--scale", "big"], '"apply", "ignore" or a positive'),
    ],
)
def test_a_fault_is_one_sentence_and_exit_code_2(arguments, words):
    assert words in refused(*arguments)


def test_a_faulty_scenario_and_debug(tmp_path):
    path = write(tmp_path, DROP.replace("dt =", "dtt ="))
    assert "did you mean 'dt'" in refused("run", path)
    assert type(call("--debug", "run", path).exception).__name__ == "ScenarioError"


OWN = """def tau(t, q, v, contacts):
    raise RuntimeError("no torque")
def find(pose_i, pose_j):
    raise RuntimeError("no teeth")
"""


def test_a_fault_of_the_users_routine_says_whose_it_is(run, tmp_path):
    (tmp_path / "own.py").write_text(OWN)
    text = DROP.replace("[run]", '[controller]\ntype = "python"\nfunction = "own.py:tau"\n[run]')
    told = refused(*run(text))
    assert "RuntimeError: no torque, raised by the controller at t = 0 s (own.py:tau" in told
    assert not (tmp_path / "out").exists()
    source = '[[source]]\nname = "gears"\nfind = "own.py:find"\nframe_i = "ball"\n'
    told = refused(*run(DROP.replace("[run]", f'{source}law.type = "adams"\n[run]')))
    assert "RuntimeError: no teeth, raised by contact source 'gears' with" in told
    assert "(own.py:find, line 4)" in told


def test_a_diverged_run_says_where_its_part_is_and_spares_the_complete_one(run, tmp_path):
    succeed(*run())
    out = tmp_path / "out"
    before = (out / "run.npz").read_bytes()
    told = call(*run(), "--set", "gravity=[0.0, 0.0, 1e30]")
    assert told.exit_code == 2
    assert "diverged at t =" in told.stderr
    assert "sphshell-pin explain" in told.stderr
    assert f"partial results are in {tmp_path / 'out-stopped'}" in told.stderr
    assert ".result" not in told.stderr
    assert (out / "run.npz").read_bytes() == before


def test_explain_names_the_pair_and_a_time_step(tmp_path):
    told = succeed("explain", write(tmp_path)).output
    assert "ball-plate" in told
    assert "dt" in told


TRIANGLE = "v 0 0 0\nv 30 0 0\nv 0 40 0\nf 1 2 3\n"
SPARE = "v 30 0 0\nf"
SHL = "3 1 0.001\n0 0 0\n1 0 0\n0 1 0\n3 1 2 3\n"
FAN = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n"


@pytest.mark.parametrize(
    ("name", "text", "options", "words"),
    [
        ("twice.obj", TRIANGLE.replace("f", SPARE), ["--unit", "mm"], "1 vertex is used by no"),
        ("fan.obj", FAN, ["--unit", "mm"], "ok, with "),  # three triangles on one edge
        ("a.shl", SHL, ["--scale", "apply"], "SCALE 0.001 of the file applied"),
        ("a.shl", SHL, ["--scale", "ignore"], "SCALE 0.001 of the file ignored"),
        ("a.shl", SHL, ["--scale", "0.5"], "scale 0.5 used in place of SCALE 0.001"),
    ],
)
def test_check_prints_the_health_of_a_file(name, text, options, words, tmp_path):
    (tmp_path / name).write_text(text)
    assert words in succeed("check", tmp_path / name, *options).output


def test_check_names_a_file_that_holds_no_surface(tmp_path):
    path = tmp_path / "deg.obj"
    path.write_text("")
    refused("check", path, "--unit", "mm")
    path.write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
    assert f"{path}: no element is left" in refused("check", path, "--unit", "mm")
    surface = 'primitive = { type = "box", size = [0.2, 0.2, 0.02] }'
    text = DROP.replace(surface, 'file = "deg.obj"\nunit = "mm"')
    told = refused("explain", write(tmp_path, text))
    assert "drop.toml: shell.plate: " in told
    assert "deg.obj: no element is left" in told


def test_check_asks_for_the_unit_as_the_command_line_states_it(tmp_path):
    path = tmp_path / "triangle.obj"
    path.write_text(TRIANGLE)
    told = refused("check", path)
    assert "the unit must be stated, as .obj files carry none" in told
    assert "triangle.obj measures 50 units: say --unit mm if that is 0.05 m" in told
    assert "unit=" not in told


def test_list_names_scenarios_and_robots():
    told = succeed("list").output
    for word in ("fingertip_on_blade", "gear_contact", "turntable"):
        assert word in told


def test_ctrl_c_keeps_what_was_computed(run, tmp_path):
    out = tmp_path / "out"
    arguments = run(DROP.replace("duration = 0.05", "duration = 600\nrecord_dt = 0.1"))
    command = [sys.executable, "-c", HEARS_CTRL_C, *arguments, "--dt", "1e-6"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
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


@pytest.mark.parametrize(
    ("command", "name", "text"),
    [
        ("check-robot", "a.xacro", XACRO.format("${xacro.fatal('\\x1b]0;x\\x07')}")),
        ("check-robot", "a.xacro", XACRO.format("a${xacro.warning('\\x1b[2J')}")),
        ("check-robot", "a.urdf", URDF.format("\x9b2J")),
        ("run", "a.toml", '[robot]\n"\\u001b[2Jx" = 1\n'),
        ("check", "a.obj", "v 0 \x1b]52;c;YQ==\x07 0\nf 1 2 3\n"),
    ],
)
def test_no_text_of_a_file_reaches_the_terminal_as_a_command(command, name, text, tmp_path):
    (tmp_path / name).write_text(text, encoding="utf-8")
    given = [command, tmp_path / name, *(["--unit", "m"] if command == "check" else [])]
    done = CliRunner().invoke(app, [*map(str, given)], color=True)
    assert done.exit_code in (1, 2)
    assert "\\x" in done.output
    assert not re.search("[\0-\b\v-\x1f\x7f-\x9f]", done.output)
