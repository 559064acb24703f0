"""Sensors in scenario files: tables, keys, results."""

import csv

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import ScenarioError
from sphshell_pin.scenario import build, run_scenario
from sphshell_pin.scenario.running.replay import Replay
from tests.scenario.files import DROP, SENSORS, write

READING = """
def tau(t, q, v, contacts, sensors):
    push = [0.0] * 6
    push[2] = 3.0 if sensors["touch"] else 0.0
    return push
"""


def test_a_scenario_states_its_sensors(tmp_path):
    (tmp_path / "own.py").write_text(READING, encoding="utf-8")
    controller = '\n[controller]\ntype = "python"\nfunction = "own.py:tau"\n'
    path = write(tmp_path, SENSORS + controller)
    report = run_scenario(path, tmp_path / "out", recording=False)
    names = {file.name for file in report.files}
    assert {"sensors.csv", "sensors.png"} <= names
    loaded = sp.Result.load(tmp_path / "out" / "run.npz")
    shapes = {name: log.values.shape for name, log in loaded.sensors.items()}
    assert shapes == {"inside": (26, 6), "touch": (51, 1)}
    assert 0 < loaded.sensors["touch"].values.sum() < 51
    with open(tmp_path / "out" / "sensors.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0][0] == "t [s]"
    assert rows[0][-1] == "touch.closed"
    assert len(rows) == 52
    assert Replay(tmp_path / "out" / "run.npz").scene.pairs[0].name == "ball-plate"
    plain = run_scenario(write(tmp_path), tmp_path / "out", recording=False)
    assert not {"sensors.csv", "sensors.png"} & {file.name for file in plain.files}
    assert not (tmp_path / "out" / "sensors.csv").exists()


def test_readings_are_figures(tmp_path, no_pictures):
    expect = """
[expect]
"sensors.touch.closed.max" = { value = 1.0, atol = 1e-9 }
"sensors.inside.force_z.last" = { min = -1.0, max = 1.0 }
"sensors.inside.torque_x.mean" = { max = 1.0 }
"""
    report = run_scenario(write(tmp_path, SENSORS + expect), tmp_path, recording=False)
    assert [one.met for one in report.verdicts] == [True] * 3
    log = report.result.sensors["inside"].values
    assert [one.measured for one in report.verdicts] == [1.0, log[-1, 2], log[:, 3].mean()]
    with pytest.raises(ScenarioError, match=r"nearest ones are: sensors\.inside\.force_"):
        run_scenario(write(tmp_path, SENSORS + expect.replace("force_z", "force")))


def test_a_single_table_will_do(tmp_path):
    keys = 'type = "contact-switch"\nname = "a"\ncontact = "ball-plate"\nthreshold = 1\n'
    built = build(write(tmp_path, f"{DROP}\n[sensor]\n{keys}"), {"sensor.threshold": "0.25"})
    assert built.simulation.sensors[0].threshold == 0.25
    assert np.isfinite(built.simulation.sensors[0].rate)
