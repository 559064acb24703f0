"""Mimic joints move exactly: against the full model reduced by hand."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.mimic import Mimic, mimics, shortened, with_mimics
from sphshell_pin.errors import SphshellError
from tests import meshes, models
from tests.texts import text_of


def gripper() -> tuple[pin.Model, pin.Model]:
    """Return the gripper with exact mimic joints, and with free ones."""
    text = text_of("robots/two_fingers.urdf")
    return tuple(pin.buildModelFromXML(text, mimic=mimic) for mimic in (True, False))  # type: ignore[return-value]


def panda() -> tuple[pin.Model, pin.Model]:
    """Return example-robot-data's Panda, whose second finger mimics the first."""
    data = pytest.importorskip("example_robot_data")
    path = data.load("panda").urdf
    return tuple(pin.buildModelFromUrdf(path, mimic=mimic) for mimic in (True, False))  # type: ignore[return-value]


def reduction(model: pin.Model, full: pin.Model) -> tuple[Array, Array]:
    """Return G (nv of full, nv) and the offsets of q = G q_reduced + offset."""
    matrix, offset = np.zeros((full.nv, model.nv)), np.zeros(full.nq)
    for joint, free in zip(model.joints[1:], full.joints[1:], strict=True):
        ratio = 1.0
        if joint.shortname() == "JointModelMimic":
            ratio, offset[free.idx_q] = joint.extract().scaling, joint.extract().offset
        matrix[free.idx_v, joint.idx_v] = ratio
    return matrix, offset


def with_contact(model: pin.Model, tip: str, other: str) -> sp.Scene:
    """A sphere on one finger against a shell on the other, which always touch."""
    scene = sp.Scene(model)
    scene.add_contact(
        sp.Sphere(0.5, frame=tip, offset=(0.02, 0.01, 0.03)),
        sp.Shell(*meshes.grid_plate(4, 4, 2.0)),
        frame=other,
        law=sp.HuntCrossleyLaw(1e4, 1.5, 0.3),
        friction=sp.BristleFriction(0.5, 0.4, 1e4, 1.0, 1e-2),
    )
    return scene


CASES = {
    "panda": (panda, "panda_leftfinger", "panda_rightfinger"),
    "gripper": (gripper, "left_pad", "right_pad"),
}


@pytest.mark.parametrize("integrator", [sp.Adaptive(1e-8, 1e-10), sp.Implicit(1e-7, 1e-9)])
def test_a_closing_grasp_keeps_its_energy(integrator: sp.Adaptive | sp.Implicit) -> None:
    model, full = gripper()
    scene = sp.Scene(model)
    box = sp.Shell(*meshes.cube(0.02))
    # The right finger, of the smaller ratio, reaches less far.
    for side, radius in (("left", 0.006), ("right", 0.0095)):
        scene.add_contact(
            sp.Sphere(radius, frame=f"{side}_pad", offset=(0.0, 0.0, 0.02)),
            box,
            placement=pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.078])),
            law=sp.HuntCrossleyLaw(1e6, 1.5, 0.5),
            friction=sp.CoulombFriction(0.5, 0.4, 0.01, 0.1),
            name=side,
        )
    control = sp.JointPD(
        {"left_knuckle_joint": 2.0, "lift": 500.0}, 0.02, {"left_knuckle_joint": 0.9}
    )
    result = sp.Simulation(scene, integrator).run(np.zeros(model.nq), None, 0.5, control)
    figures = result.stats.pairs
    assert figures["left"].touches
    assert figures["right"].touches
    assert np.abs(result.energy.residual).max() < 1e-5 * result.energy.exchanged
    # Both pads stay where their ratio has them.
    matrix, offset = reduction(model, full)
    data, free = model.createData(), full.createData()
    pin.forwardKinematics(model, data, result.q[-1])
    pin.forwardKinematics(full, free, matrix @ result.q[-1] + offset)
    for ours, theirs in zip(data.oMi, free.oMi, strict=True):
        assert ours.isApprox(theirs, 1e-12)


def test_joint_components_act_on_the_joint_that_is_mimicked() -> None:
    model, _ = gripper()
    joints = sp.JointComponents.from_model(model)
    assert set(joints.limits) == {"lift", "left_knuckle_joint"}
    scene = sp.Scene(model, joints=joints)
    result = sp.Simulation(scene, sp.Adaptive(1e-7)).run(
        np.zeros(2), [0.0, 8.0], 1.0, sp.JointPD({"lift": 500.0}, {"lift": 1.0})
    )
    assert result.stats.joints["left_knuckle_joint"].stops
    assert np.abs(result.energy.residual).max() < 1e-5 * result.energy.exchanged


@pytest.mark.parametrize("off", [1e-5, -1e-3, 0.1])
def test_a_joint_that_follows_is_where_its_rule_puts_it(off: float) -> None:
    model, full = gripper()
    matrix, offset = reduction(model, full)
    q = matrix @ np.array([0.1, 0.4]) + offset
    np.testing.assert_allclose(shortened(model, q, check=True), [0.1, 0.4], rtol=0, atol=0)
    for joint in mimics(model):
        one = q.copy()
        one[full.joints[full.getJointId(joint)].idx_q] += off
        with pytest.raises(SphshellError, match=f"joint '{joint}' cannot be at .* it mimics"):
            shortened(model, one, check=True)


def test_chained_rules_are_one_rule() -> None:
    """c = 2 b + 0.1 and b = 3 a - 0.2 put c at 6 a - 0.3."""
    model = models.empty()
    for name in "abc":
        models.add_body(model, name, pin.JointModelRZ())
    b, c = model.names[2], model.names[3]
    rules = [Mimic(c, b, 2.0, 0.1), Mimic(b, model.names[1], 3.0, -0.2)]
    made = with_mimics(model, rules)
    assert shortened(made, [0.5, 1.3, 2.7], check=True) == pytest.approx([0.5])
