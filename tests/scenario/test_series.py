"""Curves for charts: values and units of what a live run and a finished one record."""

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin.scenario import build
from sphshell_pin.scenario.live.live_run import LiveRun
from sphshell_pin.scenario.running.rows import motion_series
from tests.scenario.files import FINGER, write

pytestmark = pytest.mark.usefixtures("no_pictures")


@pytest.fixture
def built(tmp_path):
    return build(write(tmp_path, FINGER))


def test_a_live_run_offers_its_joints_torques_sensors_and_energy(built) -> None:
    live = LiveRun(built)
    assert {f"{one.quantity} [{one.unit}]" for one in live.series} == {
        *("Force [N]", "Depth [mm]", "Joint position [deg]", "Joint velocity [deg/s]"),
        *("Controller torque [N m]", "Sensor wrist [N]", "Sensor wrist [N m]"),
        "Energy residual [J]",
    }
    rows = live.advance(0.05)
    values = {one.key: one.values(rows) for one in live.series}
    assert len(values) == len(live.series)
    assert values["q.knuckle"][-1] == pytest.approx(np.rad2deg(live.q[0]))
    assert values["v.knuckle"][-1] == pytest.approx(np.rad2deg(live.v[0]))
    assert values["residual"][-1] == live.residual
    assert np.isfinite(values["torque.knuckle"]).all()  # as the file records them
    now = {one.key: one.values(live.now) for one in live.series}
    assert now["q.knuckle"] == values["q.knuckle"][-1]


def test_torques_are_recorded_once_they_are_asked_for(tmp_path) -> None:
    live = LiveRun(build(write(tmp_path, FINGER.replace('record = ["torque"]', ""))))
    torque = next(one for one in live.series if one.key == "torque.knuckle")
    assert np.isnan(torque.values(live.advance(0.02))).all()
    live.ask({"q"})
    assert np.isnan(torque.values(live.advance(0.02))).all()
    live.ask({"torque", "q"})
    rows = live.advance(0.02)
    model = live.scene.model
    weight = pin.computeGeneralizedGravity(model, model.createData(), live.q)[0]
    expected = 0.05 * (0.6 - live.q[0]) - 0.004 * live.v[0] + weight
    assert torque.values(rows)[-1] == pytest.approx(expected, rel=1e-9)
    assert torque.values(live.now)[0] == pytest.approx(expected, rel=1e-9)
    live.reset()  # and in the next run
    assert np.isfinite(torque.values(live.advance(0.02))[1:]).all()


def test_a_joint_that_turns_without_end_has_an_angle() -> None:
    model = pin.Model()
    model.addJoint(0, pin.JointModelRUBZ(), pin.SE3.Identity(), "wheel")
    model.addJoint(1, pin.JointModelPZ(), pin.SE3.Identity(), "slide")
    model.addJoint(2, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "free")
    curves = {one.key: one for one in motion_series(model, torque=True)}
    q = pin.neutral(model)
    q[:3] = np.cos(2.5), np.sin(2.5), 0.25
    assert curves["q.wheel"].of(q[None]) == pytest.approx(np.rad2deg(2.5))
    assert curves["q.slide"].of(q[None]) == 250.0
    v = np.linspace(0.1, 0.8, model.nv)
    assert curves["v.wheel"].of(v[None]) == pytest.approx(np.rad2deg(0.1))
    assert curves["v.slide"].of(v[None]) == 200.0
    units = {"q.wheel": "deg", "q.slide": "mm", "q.free.0": "mm", "q.free.6": ""}
    units |= {"v.free.5": "deg/s", "torque.slide": "N"}
    units |= dict.fromkeys(("torque.wheel", "torque.free.5"), "N m")
    assert units == {key: curves[key].unit for key in units}
    assert len([key for key in curves if key.startswith("q.")]) == 9
