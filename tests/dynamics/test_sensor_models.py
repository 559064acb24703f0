"""Sensors on models of several origins: MJCF, joined robots, joints that follow others."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import robots
from tests.dynamics.test_sensor_wrench import URDF, arm, read, sensor, weight
from tests.models import pose_of
from tests.texts import DATA, text_of


def test_joints_that_mimic_others():
    """A gripper's finger hangs on a joint that follows: its weight counts, it has no motor."""
    model = robots.load("panda", mimic=True).model
    finger = model.names[model.njoints - 1]
    q = np.array([0.3, 0.2, -0.4, -1.5, 0.3, 1.2, 0.5, *([0.02] * (model.nq - 7))])
    sensors = [sp.ForceTorqueSensor(name="hand", frame="panda_hand")]
    result = read(sp.Scene(model), q, sp.GravityCompensation(), sensors)
    hand = model.frames[model.getFrameId("panda_hand_joint")].inertia.mass
    mass = hand + sum(model.inertias[k].mass for k in (model.njoints - 2, model.njoints - 1))
    turn = pose_of(model, q, "panda_hand").rotation
    force = result.sensors["hand"].values[0, :3]
    assert np.allclose(turn @ force, [0, 0, 9.81 * mass], rtol=0, atol=1e-10)
    follower = sp.JointTorqueSensor(name="s", joint=finger)
    with pytest.raises(sp.SphshellError, match="it follows another joint, measure that one"):
        read(sp.Scene(model), q, None, [follower])


def test_the_drive_of_joints_that_follow_carries_them():
    """A slide of 1 kg, and one of 0.5 kg that goes up twice as far."""
    model = pin.buildModelFromXML(text_of("robots/two_slides.urdf"), mimic=True)
    drive = sp.JointTorqueSensor(name="drive", joint="first")
    wrench = sp.ForceTorqueSensor(name="wrench", frame="two")
    result = read(sp.Scene(model), [0.1], sp.GravityCompensation(), [drive, wrench])
    assert abs(result.sensors["drive"].values[0, 0] - 9.81 * (1.0 + 2 * 0.5)) < 1e-12
    assert abs(result.sensors["wrench"].values[0, 2] - 9.81 * 0.5) < 1e-12
    # Let go, the first falls with g (1 + 1) / (1 + 4 0.5): the drive gives nothing.
    fall = read(sp.Scene(model), [0.1], None, [drive, wrench])
    assert abs(fall.sensors["drive"].values[0, 0]) < 1e-12
    acceleration = -2 * 9.81 * (1.0 + 2 * 0.5) / (1.0 + 4 * 0.5)
    assert abs(fall.sensors["wrench"].values[0, 2] - 0.5 * (acceleration + 9.81)) < 1e-12


@pytest.mark.parametrize(("frame", "mass"), [("a", 6), ("j", 6), ("b", 5), ("c", 3)])
def test_bodies_of_an_mjcf_file(frame, mass):
    model = pin.buildModelFromMJCF(str(DATA / "robots" / "bodies_and_site.xml"))
    scene = sp.Scene(model)
    result = read(scene, pin.neutral(model), sp.GravityCompensation(), [sensor(frame)])
    expected = [0, 0, 9.81 * mass, 0, 0, 0]
    assert np.allclose(result.sensors["wrist"].values[0], expected, rtol=0, atol=1e-10)
    with pytest.raises(sp.SphshellError, match="'s' is a point on a link"):
        read(scene, pin.neutral(model), None, [sensor("s")])


@pytest.mark.parametrize("lock", [(), ("r/knuckle",), ("shoulder",)])
def test_robots_that_were_joined(lock):
    one, two = arm(), arm()
    for k, frame in enumerate(two.frames):
        two.frames[k].name = f"r/{frame.name}"
    for k in range(1, two.njoints):
        two.names[k] = f"r/{two.names[k]}"
    both = pin.appendModel(one, two, 0, pin.SE3(np.eye(3), np.array([0.0, 1.0, 0.0])))
    q = np.array([0.4, -0.7, 0.2, 0.9])
    names = ("shoulder", "knuckle", "r/shoulder", "r/knuckle")
    left = q[[k for k, name in enumerate(names) if name not in lock]]
    scene = sp.Scene(both, lock=lock, q_lock=q if lock else None)
    for frame, posture in (("mount", q[:2]), ("r/mount", q[2:])):
        result = read(scene, left, sp.GravityCompensation(), [sensor(frame)])
        seen = result.sensors["wrist"].values[0]
        assert np.abs(seen - weight(one, posture)).max() < 1e-10


def test_nothing_holds_a_floating_base():
    base = """<link name="base"><inertial><mass value="3"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
    urdf = URDF.replace('<link name="base"/>', base)
    model = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
    q = np.array([0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0, 0.4, -0.7])
    sensors = [sensor("mount"), sp.ForceTorqueSensor(name="root", frame="base")]
    simulation = sp.Simulation(sp.Scene(model), sp.Adaptive(), sensors)
    result = simulation.run(q, np.linspace(-1, 1, model.nv), 0.1)
    assert np.abs(result.sensors["root"].values).max() < 1e-12
    assert np.abs(result.sensors["wrist"].values).max() > 0.1
