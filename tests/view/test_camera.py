import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.scenario import build
from sphshell_pin.view.camera import ASPECT, FIELD_OF_VIEW, View, choose_view


def in_picture(view, points):
    """Picture coordinates (k, 2) of world points, -1 to 1 inside the free part of the window."""
    back = (view.eye - view.target) / view.distance
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    relative = points - view.eye
    depth = -relative @ back
    assert (depth > 0.0).all()
    across = depth * np.tan(np.deg2rad(0.5 * FIELD_OF_VIEW))
    return np.column_stack((relative @ right / (ASPECT * across), relative @ up / across))


@pytest.mark.parametrize("seed", range(20))
def test_everything_near_the_action_is_in_the_picture(seed):
    random = np.random.default_rng(seed)
    size = 10.0 ** random.uniform(-3, 2)
    action = size * (random.normal(size=(5, 3)) + random.normal(size=3))
    around = action.mean(axis=0) + size * random.uniform(-2, 2, (30, 3))
    normal = random.normal(size=3)
    normal /= np.linalg.norm(normal)
    view = View.of(action, around, normal, 0.02 * size)
    picture = in_picture(view, np.vstack((action, around)))
    assert np.abs(picture).max() < 1.0
    assert np.abs(picture).max() > 0.4


@pytest.mark.parametrize("normal", [*np.eye(3), *-np.eye(3)])
def test_the_eye_stands_on_the_side_of_the_contact_normal(normal):
    point = np.array([[0.5, 0.1, 0.3]])
    view = View.of(point, np.zeros((0, 3)), normal, 0.01)
    assert (view.eye - point[0]) @ normal > 0.15 * view.distance


def test_things_far_away_do_not_shrink_the_contact():
    near = View.of(np.zeros((1, 3)), np.zeros((0, 3)), np.zeros(3), 0.01)
    far = View.of(np.zeros((1, 3)), np.array([[50.0, 0, 0]]), np.zeros(3), 0.01)
    assert far.distance == pytest.approx(near.distance)


def test_the_whole_robot_is_in_the_picture_of_a_short_run():
    built = build("fingertip_on_blade")
    scene, q = built.scene, built.q0
    data = scene.model.createData()
    pin.forwardKinematics(scene.model, data, q)
    joints = np.array([data.oMi[k].translation for k in range(1, scene.model.njoints)])
    tip = scene.pairs[0].spheres[0]
    point = data.oMi[tip.joint].act(tip.in_joint.translation)[None, :]
    seen = (scene, q[None, :], point, np.array([[0.0, 0.0, 1.0]]))
    whole = choose_view(*seen, whole=True)
    assert np.abs(in_picture(whole, joints)).max() < 1.0
    assert np.abs(in_picture(whole, point)).max() < 1.0
    near = choose_view(*seen)
    assert near.distance < 0.8 * whole.distance
    # A floor that reaches far beyond the robot does not make it small.
    floor = sp.Shell([[0, 0, 0], [9, 0, 0], [9, 9, 0], [0, 9, 0]], [[0, 1, 2, 3]])
    scene.add_contact(sp.Sphere(0.02, "panda_link0"), floor, law=sp.ImpactLaw(1e5, 1.5, 0, 1e-4))
    assert choose_view(*seen, whole=True).distance < 1.5 * whole.distance
