"""A start that states where the tip is: joints follow by inverse kinematics."""

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin.scenario import build
from sphshell_pin.scenario.format.reach import Reach, turn_between
from tests import models
from tests.scenario import files
from tests.scenario.files import arm_urdf
from tests.texts import text_of

SCENARIO = text_of("scenarios/tip_at.toml")
XYZ = [0.4, 0.1, 0.0105]


def scenario(folder, start, more="", sphere="link_5"):
    arm_urdf(folder)
    text = SCENARIO.replace("START", start).replace("# MORE", more).replace("SPHERE", sphere)
    return files.write(folder, text, "a.toml")


def pose_of(built, frame="link_5"):
    return files.pose_of(built.scene.model, built.q0, frame)


def tip_of(built, frame="link_5"):
    """Return where the center of the contact's sphere is at the start."""
    return pose_of(built, frame).act(np.array([0, 0, 0.2]))


@pytest.mark.parametrize(
    "start", [f"{{ tip_at = {XYZ} }}", f"{{ tip_at = {{ xyz = {XYZ} }}, joint_0 = 0.3 }}"]
)
def test_the_sphere_of_the_contact_is_where_it_is_stated(start, tmp_path):
    built = build(scenario(tmp_path, start))
    np.testing.assert_allclose(tip_of(built), XYZ, atol=1e-6)
    model = built.scene.model
    assert (built.q0 >= model.lowerPositionLimit).all()
    assert (built.q0 <= model.upperPositionLimit).all()
    # The same file, the same start.
    np.testing.assert_array_equal(built.q0, build(built.path).q0)


def test_the_axis_of_its_frame_points_as_stated(tmp_path):
    start = f"{{ tip_at = {{ xyz = {XYZ}, along = [1, 0, -2], frame = 'link_5' }} }}"
    pose = pose_of(build(scenario(tmp_path, start)))
    np.testing.assert_allclose(pose.translation, XYZ, atol=1e-6)
    np.testing.assert_allclose(pose.rotation[:, 2], np.array([1, 0, -2]) / np.sqrt(5), atol=1e-4)


def test_stated_joints_are_where_the_search_begins_and_locked_ones_stay(tmp_path):
    near = "{ tip_at = [0.4, 0.1, 0.3], joint_0 = 0.5, joint_1 = 0.9, joint_2 = 0.7 }"
    path = scenario(tmp_path, near, 'lock = ["joint_0"]')
    built = build(path)
    np.testing.assert_allclose(tip_of(built), [0.4, 0.1, 0.3], atol=1e-6)
    assert built.assembly.q0[0] == 0.5


def test_places_are_those_of_the_world(tmp_path):
    """Of two arms, the second stands elsewhere and is turned."""
    more = 'label = "one"\n[[robot]]\nurdf = "arm.urdf"\nlabel = "two"\n'
    more += "placement = { xyz = [1.0, 0.0, 0.0], rpy_deg = [0.0, 0.0, 90.0] }\n"
    more += "start = { tip_at = { xyz = [0.8, 0.2, 0.3], frame = 'link_5' } }\n"
    built = build(scenario(tmp_path, f"{{ tip_at = {XYZ} }}", more, sphere="one/link_5"))
    np.testing.assert_allclose(tip_of(built, "one/link_5"), XYZ, atol=1e-6)
    np.testing.assert_allclose(pose_of(built, "two/link_5").translation, [0.8, 0.2, 0.3], atol=1e-6)


@pytest.mark.parametrize("axis", [*np.eye(3), *-np.eye(3), np.array([2.0, -1.0, 2.0]) / 3])
def test_a_half_turn_is_one_about_an_axis_across(axis):
    """Of opposite directions there is no shortest turn: any of half a turn will do."""
    turn = turn_between(axis, -axis)
    assert np.linalg.norm(turn) == pytest.approx(np.pi, rel=1e-12)
    np.testing.assert_allclose(pin.exp3(turn) @ axis, -axis, atol=1e-12)


@pytest.mark.parametrize("beyond", [0.01, 0.5, 1.5])
def test_of_a_place_out_of_reach_a_solution_is_never_farther_than_its_start(beyond):
    """A hinge at its limit, and a place that its tip passes only beyond it."""
    model, arm = models.empty(), 0.3
    models.add_body(model, "tip", pin.JointModelRZ())
    model.lowerPositionLimit, model.upperPositionLimit = np.array([-1.0]), np.array([1.0])
    reach = Reach(model, "tip", [arm, 0.0, 0.0])
    # Beyond a limit a joint is brought back within, and no farther than it must.
    for q in (-4.0, -1.01, -0.99, 0.0, 0.99, 1.01, 4.0):
        inside = reach.into_limits(np.array([q]))[0]
        assert inside == q if abs(q) < 1 else 0.95 < inside * np.sign(q) < 1
    place = arm * np.array([np.cos(1 + beyond), np.sin(1 + beyond), 0.0])
    for start in (1.0, 0.5):
        q, off = reach.solve(np.array([start]), place)
        assert off == pytest.approx(np.linalg.norm(place - reach.center(q)), rel=1e-12)
        assert off <= 2 * arm * np.sin(0.5 * (1 + beyond - start)) * (1 + 1e-12)
