"""Several robots in one model: names, placements, start values, locked joints."""

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import robots
from sphshell_pin.scenario.format.bodies import assemble, reduce_visual, restrict
from sphshell_pin.scenario.format.reading import read_scenario
from tests.models import pose_of
from tests.scenario.files import write
from tests.texts import DATA, text_of

TWO = text_of("scenarios/finger_and_ball.toml")


def assembled(folder, text=TWO):
    path = write(folder, text)
    return assemble(read_scenario(path), path)


def test_names_carry_the_robot_and_the_values_their_joint(tmp_path):
    assembly = assembled(tmp_path)
    model = assembly.model
    finger = [f"three_link_finger/{one}" for one in ("knuckle", "middle_joint", "distal_joint")]
    assert list(model.names)[1:] == [*finger, "ball/root_joint"]
    assert assembly.lock == ("three_link_finger/middle_joint",)
    np.testing.assert_allclose(model.gravity.linear, [0, 1, -2])
    np.testing.assert_allclose(assembly.q0, [0.3, 0.4, 0, 1, 2, 3, 0, 0, 0.6, 0.8])
    np.testing.assert_allclose(assembly.v0, [1.5, 0, 0, 1, 2, 3, 4, 5, 6])


MOUNTED = text_of("scenarios/mounted.toml")


def test_a_robot_may_be_mounted_on_another(tmp_path):
    assembly = assembled(tmp_path, MOUNTED)
    model = assembly.model

    finger = robots.load("three_link_finger").model
    stand = pin.SE3(pin.rpy.rpyToMatrix(0, 0, np.pi / 2), np.array([0.1, 0.2, 0.3]))
    tip = pose_of(finger, np.array([0.3, 0.4, 0.5]), "tip")
    expected = pose_of(model, assembly.q0, "turntable/disc") * stand * tip
    assert pose_of(model, assembly.q0, "three_link_finger/tip").isApprox(expected, 1e-12)
    assert np.allclose(pose_of(model, assembly.q0, "ball/root_joint").translation, [1, 2, 3])
    # The disc carries the finger's weight too.
    single = robots.load("turntable").model
    both = pin.computeTotalMass(single) + pin.computeTotalMass(finger)
    carried = model.subtrees[model.getJointId("turntable/axle")]
    assert sum(model.inertias[j].mass for j in carried) == pytest.approx(both)


def test_locking_keeps_the_other_joints_values(tmp_path):
    assembly = assembled(tmp_path)
    ids = [assembly.model.getJointId(name) for name in assembly.lock]
    reduced = pin.buildReducedModel(assembly.model, ids, assembly.q0)
    q, v = restrict(assembly.model, reduced, assembly.q0, assembly.v0)
    np.testing.assert_allclose(q, [0.3, 0, 1, 2, 3, 0, 0, 0.6, 0.8])
    np.testing.assert_allclose(v, [1.5, 0, 1, 2, 3, 4, 5, 6])
    visual = reduce_visual(assembly)
    assert visual.ngeoms == assembly.visual_model.ngeoms
    assert max(g.parentJoint for g in visual.geometryObjects) == reduced.njoints - 1


GRIPPER = text_of("scenarios/gripper.toml").replace("FILE", f"{DATA}/mjcf/gripper.xml")


def gripper(tmp_path, keys=""):
    return assembled(tmp_path, GRIPPER.replace("# KEYS", keys))


def test_mimic_joints_are_exact_unless_they_are_not_wanted(tmp_path):
    assert gripper(tmp_path).model.nv == 2
    assert gripper(tmp_path, "mimic = false").model.nv == 3


@pytest.mark.parametrize(
    ("keys", "q"),
    [
        ("start = { left_finger = 0.01 }", [0, 0.01]),
        ("start = { right_finger = 0.01 }", [0, 0.01]),
        ("start = { right_finger = 0.01, lift = 0.1, left_finger = 0.01 }", [0.1, 0.01]),
        ("q = [0.1, 0.02]", [0.1, 0.02]),
        ("q = [0.1, 0.02, 0.02]", [0.1, 0.02]),
    ],
)
def test_a_start_may_name_mimic_joints(tmp_path, keys, q):
    assert np.allclose(gripper(tmp_path, keys).q0, q)
