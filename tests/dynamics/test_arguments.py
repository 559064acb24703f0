"""Wrong arguments of scenes and controllers get a sentence that names them; nothing is guessed."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import CartesianImpedance, CoulombFriction, ImpactLaw, JointPD, Scene, Sphere
from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.errors import FrameNotFound, InvalidParameter, NameNotFound, SphshellError
from tests.models import ARM_Q, LAW, add_body, arm, ball, empty, free_q, on_plate, plate

WRONG_PLACEMENTS = {
    "scaled": pin.SE3(2 * np.eye(3), np.zeros(3)),
    "mirrored": pin.SE3(np.diag([1.0, 1.0, -1.0]), np.zeros(3)),
    "not finite": pin.SE3(np.eye(3), np.array([0.0, np.nan, 0.0])),
    "turn not finite": pin.SE3(np.full((3, 3), np.nan), np.zeros(3)),
    "matrix": np.eye(4),
    "text": "above",
    "class": pin.SE3,
}


@pytest.mark.parametrize("wrong", WRONG_PLACEMENTS)
def test_a_placement_that_is_no_rigid_motion(wrong: str) -> None:
    value = WRONG_PLACEMENTS[wrong]
    scene = Scene(ball())
    with pytest.raises(InvalidParameter, match="placement"):
        scene.add_contact(Sphere(0.05, "ball"), plate(), placement=value, law=LAW)
    assert scene.pairs == ()
    with pytest.raises(InvalidParameter, match="placement"):
        CartesianImpedance("ball", [[0, 0, 0]], 1.0, 1.0, shell=plate(), placement=value)


def test_a_rounded_placement_passes() -> None:
    rounded = pin.SE3(np.round(pin.rpy.rpyToMatrix(0.1, 0.2, 0.3), 8), np.ones(3))
    pair = Scene(ball()).add_contact(Sphere(0.05, "ball"), plate(), placement=rounded, law=LAW)
    rounded.translation = np.zeros(3)
    assert pair.placement.translation == pytest.approx(np.ones(3))


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"sphere": 0.1}, "sphere"),
        ({"sphere": Sphere}, "sphere"),
        ({"shell": "x.stl"}, "shell"),
        ({"law": "impact"}, "law"),
        ({"law": ImpactLaw}, "law"),
        ({"friction": 0.3}, "friction"),
        ({"friction": CoulombFriction}, "friction"),
        ({"frame": None}, "frame"),
        ({"frame": 3}, "frame"),
        ({"name": 5}, "name"),
        ({"method": 5}, "method"),
    ],
)
def test_add_contact(wrong: dict, name: str) -> None:
    scene = Scene(ball())
    given = {"sphere": Sphere(0.05, "ball"), "shell": plate(), "law": LAW, **wrong}
    with pytest.raises(SphshellError, match=name) as caught:
        scene.add_contact(**given)
    assert "\n" not in str(caught.value)
    assert scene.pairs == ()


def test_a_class_in_place_of_an_object_is_recognised() -> None:
    with pytest.raises(InvalidParameter, match=r"did you forget \(\)"):
        Scene(ball()).add_contact(Sphere(0.05, "ball"), plate(), law=ImpactLaw)
    sim = sp.Simulation(on_plate(ball(), LAW))
    with pytest.raises(InvalidParameter, match=r"did you forget \(\)"):
        sim.run(free_q([0, 0, 1]), controller=sp.GravityCompensation)


@pytest.mark.parametrize("frame", [None, 3])
def test_names_of_frames(frame) -> None:
    with pytest.raises(InvalidParameter, match="frame"):
        Sphere(0.1, frame)
    with pytest.raises(InvalidParameter, match="frame"):
        CartesianImpedance(frame, [[0, 0, 0]], 1.0, 1.0)
    with pytest.raises(InvalidParameter, match="frame_j"):
        Scene(ball()).add_contact_source(lambda a, b: None, "ball", frame, LAW)


def test_replace_pair() -> None:
    scene = on_plate(ball(), LAW)
    with pytest.raises(NameNotFound, match="facets"):
        scene.replace_pair("ball-plate", method="x")
    for wrong in ({"law": None}, {"law": ImpactLaw}, {"friction": 0.3}):
        with pytest.raises(InvalidParameter, match=next(iter(wrong))):
            scene.replace_pair("ball-plate", **wrong)
    assert scene.pair("ball-plate").law == LAW
    scene.replace_pair("ball-plate", friction=None, method="elements")
    assert scene.pair("ball-plate").method == "elements"


@pytest.mark.parametrize("lock", [None, 3, "two_joint", ["two_joint", "two_joint"], [3]])
def test_lists_of_joints(lock) -> None:
    with pytest.raises(InvalidParameter, match="lock"):
        Scene(arm(), lock=lock)
    if lock is not None:
        with pytest.raises(InvalidParameter, match="joints"):
            sp.GravityCompensation(joints=lock)


def test_a_text_in_place_of_a_list_says_how_to_write_it() -> None:
    with pytest.raises(InvalidParameter, match=r"write \['two_joint'\]"):
        Scene(arm(), lock="two_joint")


def test_joints_of_a_controller_may_come_from_a_generator() -> None:
    scene = on_plate(arm(), LAW)
    controller = sp.GravityCompensation(joints=(name for name in ["two_joint"]))
    masks = [controller.actuated(scene.model) for _ in range(2)]
    assert masks[0].tolist() == masks[1].tolist() == [0, 1, 0]


def test_q_lock() -> None:
    with pytest.raises(InvalidParameter, match=r"q_lock.*lock"):
        Scene(arm(), q_lock=ARM_Q)
    model = ball()
    add_body(model, "arm", pin.JointModelRX(), 1)
    q = pin.neutral(model)
    q[6] = 2.0
    with pytest.raises(InvalidParameter, match=r"q_lock.*'ball_joint'.*unit length"):
        Scene(model, lock=["arm_joint"], q_lock=q)


def test_locking_every_joint_holds_the_robot_still() -> None:
    scene = Scene(arm(), lock=["one_joint", "two_joint", "ball_joint"])
    assert scene.model.nv == 0


@pytest.mark.parametrize("operational", [True, False])
def test_a_joint_without_its_own_frame_cannot_be_locked(operational: bool) -> None:
    model = empty()
    joint = model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
    if operational:
        frame = pin.Frame("tip", joint, pin.SE3.Identity(), pin.FrameType.OP_FRAME)
        model.addFrame(frame)
        model.addJointFrame(joint)  # too late: the joint's frame has to come first
    with pytest.raises(InvalidParameter, match=r"'hinge'.*addJointFrame"):
        Scene(model, lock=["hinge"])


def mimicking() -> pin.Model:
    """Arm whose second joint follows its first."""
    return pin.transformJointIntoMimic(arm(), 1, 2, 2.0, 0.0)


def test_locking_one_of_a_mimic_group_holds_all_of_it() -> None:
    free = Scene(mimicking()).model.nv - 1
    assert Scene(mimicking(), lock=["two_joint"]).model.nv == free
    assert Scene(mimicking(), lock=["one_joint"]).model.nv == free


def twins() -> pin.Model:
    """Ball whose joint, body and operational frame are all called "ball"."""
    model = empty()
    joint = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "ball")
    model.appendBodyToJoint(joint, pin.Inertia.FromSphere(1.0, 0.05), pin.SE3.Identity())
    model.addJointFrame(joint)
    for kind, x in ((pin.FrameType.OP_FRAME, 0.1), (pin.FrameType.BODY, 0.2)):
        placement = pin.SE3(np.eye(3), np.array([x, 0.0, 0.0]))
        model.addFrame(pin.Frame("ball", joint, placement, kind), False)
    return model


def test_of_frames_with_one_name_the_bodys_comes_first() -> None:
    model = twins()
    assert model.frames[find_frame(model, "ball")].type == pin.FrameType.BODY
    pair = Scene(model).add_contact(Sphere(0.05, "ball"), plate(), law=LAW)
    assert pair.placement_i.translation == pytest.approx([0.2, 0, 0])
    CartesianImpedance("ball", [[0, 0, 0]], 1.0, 1.0)._bind(Scene(model), free_q([0, 0, 1]))
    with pytest.raises(FrameNotFound, match="ball"):
        find_frame(model, "bal")


def test_geometry_stays_on_its_joint_whatever_the_frames_are_called() -> None:
    model = twins()
    place = pin.SE3(np.eye(3), np.array([0.0, 0.3, 0.0]))
    geometry = pin.GeometryModel()
    tip = pin.GeometryObject("tip", 1, place, coal.Sphere(0.05))
    floor = pin.GeometryObject("floor", 0, pin.SE3.Identity(), coal.Box(1.0, 1.0, 0.1))
    pair = pin.CollisionPair(geometry.addGeometryObject(tip), geometry.addGeometryObject(floor))
    geometry.addCollisionPair(pair)
    (made,) = Scene.from_geometry(model, geometry, LAW).pairs
    assert made.placement_i.isApprox(place)
    with pytest.raises(InvalidParameter, match="geometry_model"):
        Scene.from_geometry(model, 5, LAW)


@pytest.mark.parametrize("name", ["kp", "kd"])
def test_negative_gains(name: str) -> None:
    scene = on_plate(arm(), LAW)
    for wrong in (-1.0, [1.0, -1.0, 1.0]):
        gains = {"kp": 1.0, "kd": 1.0, name: wrong}
        with pytest.raises(InvalidParameter, match=f"{name}.*negative"):
            JointPD(**gains)._bind(scene, ARM_Q)


def test_q_ref_must_be_normalised() -> None:
    scene = on_plate(ball(), LAW)
    q = free_q([0, 0, 1])
    for wrong in (
        JointPD(1.0, 1.0, 2 * q),
        CartesianImpedance("ball", [[0, 0, 0]], 1.0, 1.0, q_ref=2 * q),
    ):
        with pytest.raises(InvalidParameter, match=r"q_ref.*unit length"):
            wrong._bind(scene, q)


def test_an_impedance_without_a_shell_takes_no_place_of_one() -> None:
    for place in ({"shell_frame": "ball"}, {"placement": pin.SE3.Identity()}):
        with pytest.raises(InvalidParameter, match="give the shell"):
            CartesianImpedance("ball", [[0, 0, 0]], 1.0, 1.0, **place)
    with pytest.raises(InvalidParameter, match="shell"):
        CartesianImpedance("ball", [[0, 0, 0]], 1.0, 1.0, shell=5)


@pytest.mark.parametrize("wrong", [True, "1e-3", 1j, None])
def test_numbers_are_numbers(wrong) -> None:
    with pytest.raises(InvalidParameter, match="number"):
        Sphere(wrong, "ball")
    with pytest.raises(InvalidParameter, match=r"offset.*numbers"):
        Sphere(0.1, "ball", [wrong] * 3)


@pytest.mark.parametrize("wrong", [[True] * 7, ["0"] * 7, [1j] * 7, np.zeros(7, dtype=complex)])
def test_vectors_hold_real_numbers(wrong) -> None:
    with pytest.raises(InvalidParameter, match=r"q = .* must hold 7 numbers"):
        on_plate(ball(), LAW).contacts(wrong)


def test_a_wrong_shape_is_called_a_shape() -> None:
    with pytest.raises(InvalidParameter, match=r"q has shape \(3,\), must have shape \(7,\)"):
        on_plate(ball(), LAW).contacts(np.zeros(3))


def test_a_long_value_is_told_in_one_line() -> None:
    with pytest.raises(InvalidParameter) as caught:
        on_plate(ball(), LAW).replace_pair("ball-plate", law=np.zeros((50, 50)))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400
