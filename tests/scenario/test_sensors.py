"""Sensors in scenario files: tables, keys, results."""

import csv

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import ScenarioError
from sphshell_pin.scenario import build, run_scenario
from sphshell_pin.scenario.running.replay import Replay
from tests.scenario.files import DROP, write
from tests.texts import text_of

SENSORS = text_of("scenarios/sensors.toml")
READING = """
def tau(t, q, v, contacts, sensors):
    push = [0.0] * 6
    push[2] = 3.0 if sensors["touch"] else 0.0
    return push
"""


def test_a_scenario_states_its_sensors(tmp_path):
    (tmp_path / "own.py").write_text(READING, encoding="utf-8")
    controller = '\n[controller]\ntype = "python"\nfunction = "own.py:tau"\n'
    path = write(tmp_path, DROP + SENSORS + controller)
    report = run_scenario(path, tmp_path / "out", recording=False)
    names = {file.name for file in report.files}
    assert {"sensors.csv", "sensors.png"} <= names
    loaded = sp.Result.load(tmp_path / "out" / "run.npz")
    assert {name: log.values.shape for name, log in loaded.sensors.items()} == {
        "inside": (26, 6),
        "touch": (51, 1),
    }
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
    report = run_scenario(write(tmp_path, DROP + SENSORS + expect), tmp_path, recording=False)
    assert [one.met for one in report.verdicts] == [True] * 3
    log = report.result.sensors["inside"].values
    assert [one.measured for one in report.verdicts] == [1.0, log[-1, 2], log[:, 3].mean()]
    with pytest.raises(ScenarioError, match=r"nearest ones are: sensors\.inside\.force_"):
        run_scenario(write(tmp_path, DROP + SENSORS + expect.replace("force_z", "force")))


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (('frame = "root_joint"', 'frame = "tip"'), r"sensor.inside: no frame 'tip'"),
        (('type = "force-torque"', 'type = "force"'), "unknown type 'force'; valid types: force-"),
        (("rate = 500", "rte = 500"), "sensor.inside.rte: unknown key; did you mean 'rate'"),
        (("rate = 500", "rate = -500"), "sensor.inside.rate: should be greater than 0"),
        (('contact = "ball-plate"', 'contact = "b"'), "sensor.touch: no contact 'b'"),
        (('name = "touch"', 'name = "inside"'), r"sensor: sensors\[1\].name = 'inside' is taken"),
        (("threshold = 0.5", ""), "sensor.touch.threshold: is missing"),
    ],
)
def test_a_wrong_sensor_is_named_with_its_key(changed, said, tmp_path):
    text = SENSORS[: SENSORS.index("[[knob]]")]
    path = write(tmp_path, (DROP + text).replace(*changed))
    with pytest.raises(ScenarioError, match=said):
        build(path)


def test_a_single_table_will_do(tmp_path):
    table = (
        '\n[sensor]\ntype = "contact-switch"\nname = "a"\ncontact = "ball-plate"\nthreshold = 1\n'
    )
    built = build(write(tmp_path, DROP + table), {"sensor.threshold": "0.25"})
    assert built.simulation.sensors[0].threshold == 0.25
    assert np.isfinite(built.simulation.sensors[0].rate)
