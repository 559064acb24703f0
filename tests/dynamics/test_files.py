"""Files of results keep what is told of the rows, and damaged ones are refused."""

from dataclasses import fields

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import ResultError
from tests.patches.scenes import LAW, RADIUS, plate, slider
from tests.results import damaged

ASKED = ("tip.law.stiffness", "tip.sphere.offset", "v0")


@pytest.fixture(scope="module")
def bounced():
    """A run with 7 columns and rows in and out of contact."""
    scene = sp.Scene(slider())
    friction = sp.BristleFriction(0.3, 0.2, 1e4, 1.0)
    scene.add_contact(sp.Sphere(RADIUS, "ball"), plate(), law=LAW, friction=friction, name="tip")
    more = {"frame": "ball_joint", "force_noise": 0.5}
    late = sp.ForceTorqueSensor(name="late", rate=1500, delay=1e-3, **more)
    sensors = [sp.ForceTorqueSensor(name="wrist", rate=1000, **more), late]
    q, v, given = [0.0, 0.0, RADIUS + 1e-4], [0.1, 0.0, -0.2], {"record": ("patch", "state")}
    simulation = sp.Simulation(scene, sp.Adaptive(), sensors)
    return simulation.run(q, v, 5e-3, record_dt=1e-4, sensitivities=ASKED, **given)


@pytest.fixture
def file(bounced, tmp_path):
    return bounced.save(tmp_path / "run.npz")


def assert_kept(again, before) -> None:
    assert again.tobytes() == np.ascontiguousarray(before).tobytes()
    assert (again.shape, again.dtype) == (before.shape, before.dtype)
    assert not again.flags.writeable


def test_files_keep_them_to_the_bit(bounced, file):
    loaded = sp.Result.load(file)
    again, before = loaded.sensitivities, bounced.sensitivities
    assert len(before.parameters) == 7
    assert again.parameters == before.parameters
    assert len(bounced.contacts) > 10
    for one in (field.name for field in fields(before)[1:]):
        assert_kept(getattr(again, one), getattr(before, one))
    assert np.abs(again.force_world).max() > 0
    assert list(loaded.sensors) == ["wrist", "late"]
    for name, log in bounced.sensors.items():
        assert loaded.sensors[name].columns == log.columns
        for part in ("t", "sampled", "values"):
            assert_kept(getattr(loaded.sensors[name], part), getattr(log, part))
    assert_kept(loaded.patches, bounced.patches)
    pressure = loaded.contact_columns()["peak_pressure [Pa]"]
    np.testing.assert_array_equal(pressure, bounced.patches["peak_pressure"])
    assert loaded.at(0.003) == bounced.at(0.003) != bounced.at(0.004)
    state, simulation = loaded.at(0.003), sp.Simulation(bounced.scene, sp.Adaptive())
    again = simulation.run(state, duration=0.005 - state.t)
    np.testing.assert_array_equal(again.q[-1], bounced.q[-1])


def test_what_was_not_asked_for_is_not_in_a_file(tmp_path):
    file = sp.Simulation(sp.Scene(slider())).run(np.zeros(3), None, 0.1).save(tmp_path / "run.npz")
    assert sp.Result.load(file).sensors == {}
    with np.load(file) as arrays:
        assert not [one for one in arrays if one.startswith(("sens", "patches"))]


def put(old: str, new: str):
    return lambda header: str(header).replace(old, new)


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("sensitivities.q", lambda a: a[:-1], r"'sensitivities\.q' has the shape \(50, 3, 7\)"),
        ("sensitivities.depth", lambda a: a[:, :-1], r"'sensitivities\.depth' has the shape"),
        ("sensitivities.force_world", lambda a: a[..., 0], "not \\(m, 3, p\\)"),
        ("sensitivities.normal_force", lambda a: None, "no array 'sensitivities.normal_force'"),
        ("sensitivities.q", lambda a: a.astype("f4"), r"'sensitivities\.q' holds float32"),
        ("sensitivities.q", lambda a: a.astype(object), "Python objects"),
        ("header", put("tip.law.stiffness", "v0.0"), "does not name each of 7 columns once"),
        ("header", put('"tip.law.stiffness"', "3"), r"header\.sensitivities\.0: "),
        ("sensors.values", lambda a: a[:-1], "its readings"),
        ("sensors.sensor", lambda a: a + 1, "not from 0 to 1"),
        ("sensors.t", lambda a: a[:-1], r"'sensors\.t' has the shape"),
        ("sensors.t", lambda a: None, r"no array 'sensors\.t'"),
        ("patches.approach", lambda a: a[:-1], r"'patches\.approach' has the shape"),
    ],
)
def test_a_damaged_file_is_refused(file, name, change, said):
    with pytest.raises(ResultError, match=said):
        sp.Result.load(damaged(file, name, change))


def test_all_arrays_count_as_memory(file):
    with np.load(file) as arrays:
        needed = sum(arrays[name].nbytes for name in arrays)
    with pytest.raises(ResultError, match="max_size"):
        sp.Result.load(file, max_size=needed - 1)
