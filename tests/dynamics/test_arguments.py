"""Wrong arguments of scenes, runs and controllers get a sentence that names them."""

from collections.abc import Callable
from contextlib import contextmanager

import coal
import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import CartesianImpedance, JointPD, Scene, Simulation, Sphere
from sphshell_pin.dynamics.run.open_run import OpenRun
from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.errors import FrameNotFound, InvalidParameter, NameNotFound, SphshellError
from sphshell_pin.patches import ShellTaxels
from tests.models import ARM_Q, LAW, add_body, arm, ball, empty, free_q, on_plate, plate

BALL, HIGH, NAN = Sphere(0.05, "ball"), free_q([0, 0, 1]), float("nan")
WRONG_PLACEMENTS = [
    pin.SE3(2 * np.eye(3), np.zeros(3)),
    pin.SE3(np.diag([1.0, 1.0, -1.0]), np.zeros(3)),
    pin.SE3(np.eye(3), np.array([0.0, np.nan, 0.0])),
    np.eye(4),
]


@contextmanager
def scene_of_a_ball():
    """A scene, which is as it was where something is refused."""
    scene = Scene(ball())
    try:
        yield scene
    except SphshellError:
        assert scene.pairs == ()
        raise


def add(**more):
    with scene_of_a_ball() as scene:
        scene.add_contact(**{"sphere": BALL, "shell": plate(), "law": LAW, **more})


def press(frame="ball", **more):
    return CartesianImpedance(frame, [[0, 0, 0]], 1.0, 1.0, **more)


def change(**more):
    on_plate(ball(), LAW).replace_pair("ball-plate", **more)


def at(q, v=None):
    return on_plate(ball(), LAW).contacts(q, v)


def run(q=HIGH, v=None, duration=0.1, **more):
    Simulation(on_plate(ball(), LAW), sp.SemiImplicitEuler(1e-3)).run(q, v, duration, **more)


def opened():
    return OpenRun(Simulation(on_plate(ball(), LAW)), HIGH, record_dt=1e-3)


def pd(**gains):
    JointPD(**{"kp": 1.0, "kd": 1.0, **gains})._bind(on_plate(arm(), LAW), ARM_Q)


def spheres(given):
    with scene_of_a_ball() as scene:
        scene.add_contacts(given, plate(), law=LAW)


def jointed(model=None, **parts):
    Scene(model or arm(), joints=sp.JointComponents(**parts))


def mindlin(**more):
    return sp.MindlinFriction(0.5, 0.4, 1e6, 0.4, **more)


def source(law=LAW, friction=None):
    Scene(ball()).add_contact_source(lambda i, j: None, "ball", "universe", law, friction)


def wrench(friction, *state):
    still = pin.Motion.Zero()
    sp.contact_wrench(np.zeros(3), np.eye(3)[2], 1e-4, still, still, LAW, friction, *state)


def torque(**more):
    return sp.JointTorqueSensor(name="a", joint="ball_joint", **more)


def switch(contact="b", **more):
    return sp.ContactSwitch(name="a", contact=contact, threshold=1, **more)


def sensing(sensors):
    Simulation(Scene(ball()), None, sensors)


def on_sphere(**more):
    add(shell=Sphere(0.1, "universe"), **more)


def wrong_q_lock():
    model = ball()
    add_body(model, "arm", pin.JointModelRX(), 1)
    q = pin.neutral(model)
    q[6] = 2.0
    Scene(model, lock=["arm_joint"], q_lock=q)


def without_a_frame(late):
    model = empty()
    joint = model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
    if late:
        model.addFrame(pin.Frame("tip", joint, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
        model.addJointFrame(joint)  # too late: the joint's frame has to come first
    Scene(model, lock=["hinge"])


RANGE = sp.JointLimits(-1.0, 1.0, LAW)
NAMES = np.array(["a", "b"])
ZEROS, FORGOT = [0, 0, 0], r"did you forget \(\)"
Call = Callable[[], object]
REFUSED: list[tuple[str, Call]] = [
    *(("placement", lambda one=one: add(placement=one)) for one in WRONG_PLACEMENTS),
    ("placement", lambda: press(shell=plate(), placement=np.eye(4))),
    ("sphere", lambda: add(sphere=0.1)),
    ("shell", lambda: add(shell="x.stl")),
    ("law = None must be a law of this package", lambda: add(law=None)),
    ("friction", lambda: add(friction=0.3)),
    ("frame", lambda: add(frame=None)),
    ("name", lambda: add(name=5)),
    (FORGOT, lambda: add(law=sp.ImpactLaw)),
    (FORGOT, lambda: run(controller=sp.GravityCompensation)),
    ("frame", lambda: Sphere(0.1, None)),
    ("frame", lambda: press(3)),
    ("frame_j", lambda: Scene(ball()).add_contact_source(lambda a, b: None, "ball", None, LAW)),
    ("frame = 'x'.* must not be given where shell is a", lambda: on_sphere(frame="x")),
    ("placement.* must not be given", lambda: on_sphere(placement=pin.SE3.Identity())),
    ("method = 'smooth' must not be given", lambda: on_sphere(method="smooth")),
    ("spheres = .* must be spheres, one at least", lambda: spheres([])),
    (r"spheres\[1\] = 'ball' must be a Sphere", lambda: spheres([BALL, "ball"])),
    ("friction", lambda: change(friction=0.3)),
    ("lock", lambda: Scene(arm(), lock=None)),
    ("lock", lambda: Scene(arm(), lock=["two_joint", "two_joint"])),
    (r"lock.*write \['two_joint'\]", lambda: Scene(arm(), lock="two_joint")),
    ("joints", lambda: sp.GravityCompensation(joints=3)),
    (r"q_lock.*lock", lambda: Scene(arm(), q_lock=ARM_Q)),
    (r"q_lock.*'ball_joint'.*unit length", wrong_q_lock),
    (r"'hinge'.*addJointFrame", lambda: without_a_frame(True)),
    (r"'hinge'.*addJointFrame", lambda: without_a_frame(False)),
    ("geometry_model", lambda: Scene.from_geometry(ball(), 5, LAW)),
    ("kp.*negative", lambda: pd(kp=-1.0)),
    ("kd.*negative", lambda: pd(kd=[1.0, -1.0, 1.0])),
    (r"q_ref.*unit length", lambda: run(controller=JointPD(1.0, 1.0, 2 * HIGH))),
    (r"q_ref.*unit length", lambda: run(controller=press(q_ref=2 * HIGH))),
    ("give the shell", lambda: press(shell_frame="ball")),
    ("give the shell", lambda: press(placement=pin.SE3.Identity())),
    ("shell", lambda: press(shell=5)),
    (r"offset.*numbers", lambda: Sphere(0.1, "ball", ["1e-3"] * 3)),
    *(
        ("q = .* must hold 7 numbers", lambda one=one: at(one))
        for one in ([True] * 7, ["0"] * 7, np.zeros(7, dtype=complex))
    ),
    (r"q has shape \(3,\), must have shape \(7,\)", lambda: at(np.zeros(3))),
    ("v has shape", lambda: on_plate(ball(), LAW).external_forces(HIGH, np.zeros(5))),
    ("q = .* must hold 7 numbers", lambda: at(np.ma.masked_equal(HIGH, 0.0))),
    ("scale = .* makes the shell too large", lambda: plate().transformed(1e308)),
    ("name = .* must be a name", lambda: on_plate(ball(), LAW).replace_pair(NAMES, law=LAW)),
    ("pair = .* must be a name", lambda: ShellTaxels(NAMES)),
    ("q = .* finite", lambda: run(HIGH * np.nan)),
    ("t0", lambda: run(t0=1e13)),
    ("v = .* finite", lambda: run(v=np.full(6, np.inf))),
    *(("duration", lambda one=one: run(duration=one)) for one in (-1.0, NAN, np.inf)),
    ("fixed to the world", lambda: opened().push("universe", [1, 0, 0])),
    ("force_world", lambda: opened().push("ball", [1, 0])),
    ("force_world", lambda: opened().push("ball", [1, 0, NAN])),
    ("fixed to the world", lambda: opened().pull("universe", ZEROS, ZEROS, 1.0)),
    ("point", lambda: opened().pull("ball", [0, 0], ZEROS, 1.0)),
    ("anchor_world", lambda: opened().pull("ball", ZEROS, [0, 0, np.inf], 1.0)),
    ("stiffness", lambda: opened().pull("ball", ZEROS, ZEROS, -1.0)),
    ("damping", lambda: opened().pull("ball", ZEROS, ZEROS, 1.0, NAN)),
    ("damping.one_joint.*negative", lambda: jointed(damping={"one_joint": -1.0})),
    ("damping.*one number or 1", lambda: jointed(damping={"one_joint": [1.0, 2.0]})),
    ("effort.*lower <= 0", lambda: jointed(effort={"one_joint": (1.0, 5.0)})),
    ("limits.one_joint.*JointLimits", lambda: jointed(limits={"one_joint": 3})),
    ("friction.*must map joint names", lambda: jointed(friction=1.0)),
    ("is a joint without a range", lambda: jointed(ball(), limits={"ball_joint": RANGE})),
    ("lower below upper", lambda: sp.JointLimits(1.0, 1.0, LAW)),
    ("lower, upper = .* must be a range", lambda: sp.JointLimits("x", 1.0, LAW)),
    *(
        (r"rings = .* must be a whole number in \[1, 8\]", lambda one=one: mindlin(rings=one))
        for one in (0, 9, 2.0, True)
    ),
    ("needs a sphere, and a contact source has none", lambda: source(friction=mindlin())),
    ("contact source", lambda: source(law=sp.FoundationLaw(1e4, 0.5))),
    ("must be a BristleState, which holds", lambda: wrench(mindlin())),
    ("rings = 2 must be 1", lambda: wrench(mindlin(rings=2), sp.BristleState(0.05))),
    ("must be the sphere's, of Mindlin's", lambda: wrench(mindlin(), sp.BristleState())),
    (r"sensors\[1\].name = 'a' is taken", lambda: sensing([torque(), torque()])),
    ("must be a list of sensors", lambda: sensing(torque())),
    (r"sensors\[0\] = 'wrist' must be a sensor", lambda: sensing(["wrist"])),
    ("seed = 1.5 must be a whole number", lambda: torque(seed=1.5)),
    ("must be one of the two", lambda: switch(contact=None)),
    ("release = 2.0 must not be above threshold = 1", lambda: switch(release=2)),
    ("must be 'patch' or 'torque'", lambda: run(record=["force"])),
    *(("record", lambda one=one: run(record=one)) for one in ("patch", ["pitch"], 3)),
    ("tau has shape", lambda: run(controller=lambda t, q, v, c: np.zeros(5), control_dt=1e-2)),
    *(
        ("tau", lambda one=one: Scene(arm()).dynamics_derivatives(ARM_Q, np.zeros(3), one))
        for one in (np.zeros(4), np.full(3, NAN), "heavy")
    ),
]


@pytest.mark.parametrize(("words", "call"), REFUSED)
def test_a_wrong_argument_is_named(words: str, call: Call) -> None:
    with pytest.raises(InvalidParameter, match=words) as caught:
        call()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    ("error", "valid", "call"),
    [
        (FrameNotFound, "ball universe", lambda: add(sphere=Sphere(0.05, "bll"))),
        (FrameNotFound, "ball universe", lambda: add(frame="ground")),
        (FrameNotFound, "ball", lambda: opened().push("bal", [1, 0, 0])),
        (FrameNotFound, "ball", lambda: spheres([BALL, Sphere(0.05, "hand")])),
        (NameNotFound, "facets", lambda: change(method="x")),
        (NameNotFound, "facets", lambda: add(method=5)),
        (NameNotFound, "two_joint", lambda: Scene(arm(), lock=["elbow"])),
        (NameNotFound, "two_joint", lambda: jointed(damping={"elbow": 1.0})),
    ],
)
def test_an_unknown_name_lists_the_valid_ones(error, valid: str, call: Call) -> None:
    with pytest.raises(error) as caught:
        call()
    for name in valid.split():
        assert name in caught.value.valid
        assert name in str(caught.value)


def test_a_rounded_placement_passes() -> None:
    rounded = pin.SE3(np.round(pin.rpy.rpyToMatrix(0.1, 0.2, 0.3), 8), np.ones(3))
    pair = Scene(ball()).add_contact(Sphere(0.05, "ball"), plate(), placement=rounded, law=LAW)
    rounded.translation = np.zeros(3)
    assert pair.side_j.placement.translation == pytest.approx(np.ones(3))


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
