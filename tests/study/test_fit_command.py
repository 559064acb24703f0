"""The command that fits: what it prints and writes, and its exit codes."""

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy")
pytest.importorskip("matplotlib")

import sphshell_pin as sp
from sphshell_pin.base.tables import csv_text
from sphshell_pin.scenario import read_scenario
from tests.command import call, succeed
from tests.study import test_fit
from tests.study.fitted_sets import SCENARIO
from tests.study.test_fit import DISSIPATION, FORCE, FRICTION, HEIGHT, STIFFNESS, measured


def test_the_command_writes_values_in_place(bounce, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    t = np.linspace(0.0, 0.1, 201)
    fast = "robot.ball.speed.root_joint=[0.0,0.0,-1.0,0.0,0.0,0.0]"
    for name, changes in (("drop.csv", {}), ("fast.csv", dict([fast.split("=")]))):
        Path(name).write_text(csv_text(measured(bounce, t, [FORCE], changes=changes)))
    command = ["fit", "drop.csv", bounce, f"--param={STIFFNESS}", f"--param={DISSIPATION}=0:1"]
    command += ["--experiment", f"fast.csv {fast}", "--set", f"{STIFFNESS}=8e4"]
    done = succeed(*command)
    assert "2 experiments" in done.output
    out = Path("results/bounce")
    names = ["bounce.fitted.toml", "fit.json", "fit.png"]
    assert sorted(path.name for path in out.iterdir()) == names
    fit = json.loads((out / "fit.json").read_text())
    text = (out / "bounce.fitted.toml").read_text()
    lines = zip(SCENARIO.split("\n"), text.split("\n"), strict=True)
    assert sum(old != new for old, new in lines) == 1
    law = read_scenario(out / "bounce.fitted.toml").contact[0].law
    values = {one["key"]: one["value"] for one in fit["parameters"]}
    assert law.stiffness == pytest.approx(values[STIFFNESS], rel=1e-8)
    assert law.stiffness == pytest.approx(1e5, rel=0.02)


def test_the_command_ends_with_1_where_the_data_do_not_determine(bounce, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("fall.csv").write_text(f"t [ms],{HEIGHT} [mm]\n0,17\n1,16.5\n2,16.0\n5,14.4\n")
    command = ["fit", "fall.csv", str(bounce), "--param", STIFFNESS, "--no-picture"]
    done = call(*command)
    assert done.exit_code == 1, done.output
    assert f"the data do not determine {STIFFNESS}" in done.output
    done = call(*command, "--set", f"{STIFFNESS}=-1")
    assert done.exit_code == 2


def test_what_is_not_told_from_0_is_a_result_like_others(bounce):
    """Its types are those of JSON."""
    # The ball's place along x is measured to 40 mm, of which friction does less in 0.05 s.
    t = np.linspace(0.0, 0.05, 201)
    (x,) = test_fit.columns_of(bounce, t, ["q.root_joint.0"]).values()
    x = x + 0.04 * np.random.default_rng(3).normal(size=201)
    found = sp.fit(bounce, {"t [s]": t, "q.root_joint.0 [m]": x}, [FRICTION])
    assert any("leaves its order of magnitude open" in one for one in found.remarks)
    one = json.loads(found.to_json())["parameters"][0]
    assert one["determined"] is found[FRICTION].determined is False
    assert one["low"] == 0.0
    assert {type(value) for value in (found[FRICTION].low, found[FRICTION].high)} <= {int, float}


@pytest.mark.parametrize("maker", ["to_json", "plot", "scenario_text"])
def test_a_file_that_cannot_be_made_leaves_none(bounce, tmp_path, monkeypatch, maker):
    monkeypatch.chdir(tmp_path)

    def fail(*_):
        raise sp.SphshellError("no such thing")

    monkeypatch.setattr(f"sphshell_pin.study.fit.report.Fit.{maker}", fail)
    Path("fall.csv").write_text(f"t [ms],{HEIGHT} [mm]\n0,17\n1,16.5\n2,16.0\n5,14.4\n")
    done = call("fit", "fall.csv", bounce, "--param", "gravity.2")
    assert done.exit_code == 2
    assert not Path("results").exists()
