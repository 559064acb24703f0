"""Robots by name: sound inertias, fingertips where they should be, clear faults."""

import builtins

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import robots
from sphshell_pin.errors import MissingExtra, NameNotFound


@pytest.mark.parametrize("name", robots.OWN)
def test_own_robots_are_sound(name):
    robot = robots.load(name)
    assert robot.name == name
    assert robot.q0.shape == (robot.model.nq,)
    assert robot.visual_model.ngeoms > 0
    for inertia in list(robot.model.inertias)[1:]:
        assert inertia.mass > 0
        least, middle, largest = np.linalg.eigvalsh(inertia.inertia)
        # Rigid bodies obey the triangle inequality.
        assert 0 < least <= largest <= least + middle + 1e-12
    data = robot.model.createData()
    assert np.isfinite(pin.aba(robot.model, data, robot.q0, *np.zeros((2, robot.model.nv)))).all()


def test_the_ball_is_a_solid_steel_ball():
    ball = robots.load("ball").model.inertias[1]
    assert ball.mass == pytest.approx(7800 * 4 / 3 * np.pi * 0.012**3, rel=1e-4)
    assert ball.inertia[0, 0] == pytest.approx(0.4 * ball.mass * 0.012**2, rel=1e-4)
    (tip,) = robots.fingertips("ball")
    assert (tip.frame, tip.radius) == ("ball", 0.012)


def test_unknown_names_list_the_known_ones():
    with pytest.raises(NameNotFound, match="turntable"):
        robots.load("turntabel")


def test_without_the_library_own_robots_still_load(monkeypatch):
    real = builtins.__import__

    def refuse(name, *args, **kwargs):
        if name.startswith("example_robot_data"):
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    assert robots.names() == list(robots.OWN)
    assert robots.load("ball").model.nv == 6
    with pytest.raises(MissingExtra, match=r"sphshell-pin\[robots\]"):
        robots.load("panda")


@pytest.mark.parametrize("name", ["ur3", "ur5_gripper", "ur10_limited"])
def test_the_posture_in_which_an_arm_works_has_the_flange_down(name):
    robot = robots.load(name)
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, np.array(robots.WORKING[name]))
    flange = data.oMf[robot.model.getFrameId("tool0")].rotation
    np.testing.assert_allclose(flange[:, 2], [0.0, 0.0, -1.0], atol=1e-4)


@pytest.mark.parametrize("name", ["so100", "a1", "panda", "ball"])
def test_the_base_of_a_shipped_robot_is_what_it_is_asked_to_be(name):
    plain, fixed, free = (robots.load(name, free_flyer=one) for one in (None, False, True))
    assert fixed.model.nq == free.model.nq - 7
    assert list(fixed.model.names)[1:] == list(free.model.names)[2:]
    # Where the reference posture has joints it stays.
    np.testing.assert_array_equal(free.q0[7:], fixed.q0)
    np.testing.assert_array_equal(plain.q0[plain.model.nq - fixed.model.nq :], fixed.q0)
    if plain.model.nq == fixed.model.nq:
        return
    # Links and their geometry are where the reference posture has them.
    shown = [(one.model, one.model.createData()) for one in (plain, fixed)]
    for (model, data), robot in zip(shown, (plain, fixed), strict=True):
        pin.framesForwardKinematics(model, data, robot.q0)
    for frame in plain.model.frames:
        if frame.type == pin.FrameType.BODY and frame.name != "universe":
            at = [data.oMf[model.getFrameId(frame.name, frame.type)] for model, data in shown]
            np.testing.assert_allclose(*(one.homogeneous for one in at), atol=1e-12)
    for kind in ("collision_model", "visual_model"):
        places, names = [], []
        for (model, data), robot in zip(shown, (plain, fixed), strict=True):
            bodies = getattr(robot, kind).geometryObjects
            places.append([data.oMi[one.parentJoint] * one.placement for one in bodies])
            names.append([model.frames[one.parentFrame].name for one in bodies])
        assert all(one.isApprox(other, 1e-12) for one, other in zip(*places, strict=True))
        assert names[0] == names[1]
