"""The controller's torques in the rows of a run: what they are, and that nothing else changes."""

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin import robots
from sphshell_pin.dynamics.run.open_run import OpenRun
from sphshell_pin.dynamics.scene.joint_components import JointComponents
from tests import models
from tests.results import assert_same_bits

Q0 = np.array([0.2, 0.6, 0.5])
KP, KD = np.array([0.4, 0.3, 0.2]), np.array([0.02, 0.01, 0.01])


def simulation(integrator=None, effort=None):
    finger = robots.load("three_link_finger")
    upright = pin.SE3(pin.rpy.rpyToMatrix(0.0, -np.pi / 2, 0.0), np.array([0.07, 0.0, 0.1]))
    joints = JointComponents(effort={} if effort is None else {"knuckle": effort})
    scene = sp.Scene(finger.model, joints=joints)
    law = sp.HuntCrossleyLaw(1e6, 1.5, dissipation=2.0)
    scene.add_contact(
        sp.Sphere(0.010, "tip"), models.square(0.2), placement=upright, law=law, name="tip-wall"
    )
    return sp.Simulation(scene, integrator or sp.RungeKutta4(2e-4))


def pd():
    return sp.JointPD(KP, KD, q_ref=Q0 + 0.3, gravity_compensation=True)


def expected(model, result):
    """kp (q_ref - q) - kd v + g(q), row by row."""
    data = model.createData()
    weights = [pin.computeGeneralizedGravity(model, data, q).copy() for q in result.q]
    return KP * (Q0 + 0.3 - result.q) - KD * result.v + np.array(weights)


@models.every_integrator(2e-4, 1e-6, 1e-5)
def test_they_are_those_of_the_controller_and_all_else_keeps_its_bits(integrator):
    run = simulation(integrator)
    asked = run.run(Q0, duration=0.1, controller=pd(), record_dt=1e-3, record=("torque",))
    plain = run.run(Q0, duration=0.1, controller=pd(), record_dt=1e-3)
    assert asked.torque.shape == (101, 3)
    np.testing.assert_allclose(asked.torque, expected(run.scene.model, asked), atol=1e-12)
    assert not asked.torque.flags.writeable
    assert plain.torque is None
    assert len(asked.contacts) > 10
    assert_same_bits(asked, plain)


def test_held_torques_are_those_of_the_last_time_of_control():
    asked = []

    def controller(t, q, v, contacts):
        asked.append(KP * (Q0 + 0.3 - q) - KD * v)
        return asked[-1]

    given = {"control_dt": 4e-3, "record_dt": 1e-3, "record": ["torque"]}
    result = simulation().run(Q0, duration=0.02, controller=controller, **given)
    assert len(asked) == 5  # not once more for the rows
    assert np.isnan(result.torque[0]).all()  # before the first
    np.testing.assert_array_equal(result.torque[1:], np.repeat(asked, 4, axis=0))


def test_they_are_cut_to_the_limits_of_the_motors_and_zero_without_a_controller():
    given = {"duration": 0.02, "record_dt": 1e-3, "record": ["torque"]}
    cut = simulation(effort=0.01).run(Q0, controller=pd(), **given)
    assert np.abs(cut.torque[:, 0]).max() == 0.01
    assert not simulation().run(Q0, **given).torque.any()


def test_they_are_saved_and_known_to_rollouts_and_open_runs(tmp_path):
    run = simulation()
    result = run.run(Q0, duration=0.02, controller=pd(), record_dt=1e-3, record=["torque"])
    loaded = sp.Result.load(result.save(tmp_path / "run.npz"))
    np.testing.assert_array_equal(loaded.torque, result.torque)
    rollout = run.rollout(
        [Q0, Q0], duration=0.02, controller=pd(), record_dt=1e-3, record=["torque"]
    )
    np.testing.assert_array_equal(rollout[1].torque, result.torque)
    open_run = OpenRun(run, Q0, controller=pd(), record_dt=1e-3)
    first = open_run.advance(0.01)
    open_run.record_torques()
    second = open_run.advance(0.01)
    assert first.torque is None
    np.testing.assert_array_equal(second.torque, result.torque[11:])
    assert open_run.snapshot().torque.shape == (1, 3)
    # A start that was recorded before has none.
    open_run = OpenRun(run, Q0, controller=pd(), record_dt=1e-3)
    open_run.record_torques()
    assert np.isnan(open_run.advance(2e-3).torque).any(axis=1).tolist() == [True, False, False]
