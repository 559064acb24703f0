"""Readings of a run: saved, loaded, as columns, drawn."""

import csv

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import ResultError
from sphshell_pin.scenario.running.run import write_sensors
from tests.dynamics.test_sensors import noisy, sine, slider, torque


def two_sensors():
    sensors = [noisy(rate=100), torque(rate=150, delay=1e-3)]
    return slider(sp.Adaptive(), sensors).run([0.0], None, 0.1, sine(5.0))


def test_readings_are_saved_and_loaded(tmp_path):
    result = two_sensors()
    loaded = sp.Result.load(result.save(tmp_path / "run.npz"))
    assert list(loaded.sensors) == ["wrist", "torque"]
    for name, log in result.sensors.items():
        other = loaded.sensors[name]
        assert other.columns == log.columns
        for part in ("t", "sampled", "values"):
            assert np.array_equal(getattr(other, part), getattr(log, part))
            assert not getattr(other, part).flags.writeable
    plain = slider(sp.Adaptive(), []).run([0.0], None, 0.1)
    assert sp.Result.load(plain.save(tmp_path / "plain.npz")).sensors == {}
    with np.load(tmp_path / "plain.npz") as file:
        assert not [name for name in file if name.startswith("sensors")]


def test_a_file_with_other_readings_is_refused(tmp_path):
    two_sensors().save(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as file:
        arrays = dict(file)
    for name, wrong, said in (
        ("sensors.values", arrays["sensors.values"][:-1], "its readings"),
        ("sensors.sensor", arrays["sensors.sensor"] + 1, "not from 0 to 1"),
        ("sensors.t", arrays["sensors.t"][:-1], "'sensors.t' has the shape"),
    ):
        np.savez_compressed(tmp_path / "bad.npz", **arrays | {name: wrong})
        with pytest.raises(ResultError, match=said):
            sp.Result.load(tmp_path / "bad.npz")
    del arrays["sensors.t"]
    np.savez_compressed(tmp_path / "bad.npz", **arrays)
    with pytest.raises(ResultError, match=r"no array 'sensors\.t'"):
        sp.Result.load(tmp_path / "bad.npz")


def test_readings_are_columns(tmp_path):
    result = two_sensors()
    columns = result.sensor_columns()
    assert list(columns)[:2] == ["t [s]", "wrist.force_x [N]"]
    assert list(columns)[-1] == "torque.force [N]"
    write_sensors(tmp_path / "sensors.csv", result)
    with open(tmp_path / "sensors.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(result.sensors["wrist"]) + len(result.sensors["torque"])
    for name, column in (("wrist", "force_z [N]"), ("torque", "force [N]")):
        log = result.sensors[name]
        found = [(r["t [s]"], r[f"{name}.{column}"]) for r in rows if r[f"{name}.{column}"]]
        at = log.columns.index(column)
        assert [float(t) for t, _ in found] == log.t.tolist()
        assert [float(x) for _, x in found] == log.values[:, at].tolist()


def test_readings_are_drawn():
    figure = two_sensors().plot("sensors")
    titles = [axis.get_title(loc="left") for axis in figure.axes]
    assert titles == ["wrist", "wrist", "torque"]
    assert [len(axis.lines) for axis in figure.axes] == [3, 3, 1]
    empty = slider(sp.Adaptive(), []).run([0.0], None, 0.1).plot("sensors")
    assert empty.axes[0].texts[0].get_text() == "no sensors"
