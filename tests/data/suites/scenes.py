"""Scenes are made of robots and models."""

import pinocchio as pin

from sphshell_pin.testing import assert_derivatives, assert_forces_balance


def test_named(contact_scene_factory):
    touch = contact_scene_factory("three_link_finger", frame="tip", radius=0.01, seed=3)
    assert len(touch.scene.contacts(touch.q)) == 1
    assert_forces_balance(touch.scene, touch.q, touch.v)
    assert_derivatives(touch.scene, touch.q, touch.v)


def test_gap(contact_scene_factory):
    touch = contact_scene_factory("ball", depth=-0.5)
    assert len(touch.scene.contacts(touch.q)) == 0


def test_own_model(contact_scene_factory):
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelPlanar(), pin.SE3.Identity(), "slide")
    model.appendBodyToJoint(joint, pin.Inertia.FromSphere(1.0, 0.1), pin.SE3.Identity())
    model.addBodyFrame("puck", joint, pin.SE3.Identity(), 0)
    touch = contact_scene_factory(model, frame="puck", radius=0.1)
    assert_forces_balance(touch.scene, touch.q, touch.v)
