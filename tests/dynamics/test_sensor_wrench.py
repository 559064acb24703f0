"""What force-torque and joint torque sensors measure, against Newton's and Euler's laws by hand."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import robots
from sphshell_pin.dynamics.run.open_run import OpenRun
from tests import models, urdf
from tests.texts import DATA, text_of

# A joint, its link, a sensor fixed to it, on that a flange with a tool fixed to it and a finger on
# a joint: masses [kg], centers of mass [m] in the link, inertia about it.
PARTS = {
    "upper": (2.0, (0.01, 0.02, 0.15), (0.02, 0.03, 0.01)),
    "flange": (0.4, (0.0, 0.01, 0.02), (1e-3, 2e-3, 3e-3)),
    "tool": (0.7, (0.05, 0.0, 0.03), (4e-3, 1e-3, 2e-3)),
    "finger": (0.3, (0.0, 0.0, 0.06), (1e-3, 1e-3, 5e-4)),
}
BEYOND = ("flange", "tool", "finger")


URDF = urdf.robot(
    urdf.link("base"),
    *(urdf.link(name, urdf.inertial(mass, own, at)) for name, (mass, at, own) in PARTS.items()),
    urdf.link("tip"),
    urdf.joint(
        "shoulder", "revolute", "base", "upper", at="0 0 0.4", rpy="0.3 0 0", axis="0 0.6 0.8"
    ),
    urdf.joint("mount", "fixed", "upper", "flange", at="0 0 0.3", rpy="0.2 -0.4 0.7"),
    urdf.joint("grip", "fixed", "flange", "tool", at="0.02 0 0.05", rpy="0 0.5 0"),
    urdf.joint("knuckle", "revolute", "flange", "finger", at="0 0.03 0.05"),
    urdf.joint("end", "fixed", "finger", "tip", at="0 0 0.1"),
)


def arm():
    return pin.buildModelFromXML(URDF)


def sensor(frame="mount", **more):
    return sp.ForceTorqueSensor(name="wrist", frame=frame, **more)


def weight(model, q, at="mount", parts=BEYOND):
    """Force and torque that carry the weight of the parts, in the frame `at`."""
    total = pin.Force.Zero()
    for name in parts:
        mass, com, _ = PARTS[name]
        up, arm = np.array([0.0, 0.0, 9.81 * mass]), models.pose_of(model, q, name) * np.array(com)
        total += pin.Force(up, np.cross(arm, up))
    return models.pose_of(model, q, at).actInv(total).vector


def read(scene, q, controller, sensors, duration=0.0, **more):
    return sp.Simulation(scene, sp.Adaptive(), sensors).run(q, None, duration, controller, **more)


ALL = tuple(PARTS)
AT = {"mount": BEYOND, "flange": BEYOND, "grip": ("tool",), "finger": ("finger",)}
AT |= {"shoulder": ALL, "upper": ALL, "base": ALL}


def rest(scene, q, given):
    """What a sensor reads of a robot that is held at rest."""
    return read(scene, q, sp.GravityCompensation(), [given]).sensors[given.name].values[0]


@pytest.mark.parametrize("lock", [(), ("knuckle",), ("shoulder",)])
@pytest.mark.parametrize("frame", AT)
def test_at_rest_it_reads_the_weight_beyond_it(frame, lock):
    """Whatever is locked."""
    for q in np.random.default_rng(0).uniform(-1.5, 1.5, (5, 2)):
        scene = sp.Scene(arm(), lock=lock, q_lock=q if lock else None)
        left = q[[name not in lock for name in ("shoulder", "knuckle")]]
        expected = weight(arm(), q, frame, AT[frame])
        assert np.abs(rest(scene, left, sensor(frame)) - expected).max() < 1e-10


def test_a_contact_on_the_frame_of_a_locked_joint_is_beyond_the_sensor():
    """As that of a sphere on the link there, which is at the same place."""
    model, q, law = arm(), np.array([0.4, -0.7]), sp.ImpactLaw(1e6, 1.5)
    center = models.pose_of(model, q, "finger").translation
    plane = pin.SE3(np.eye(3), center - [0.01, 0.02, 0.02 - 3e-4])
    read_by = {}
    for one in (None, "knuckle", "finger"):
        scene = sp.Scene(model, lock=["knuckle"], q_lock=q)
        if one is not None:
            scene.add_contact(sp.Sphere(0.02, one), models.plate(), placement=plane, law=law)
        read_by[one] = rest(scene, q[:1], sensor())
    assert np.abs(read_by["knuckle"] - read_by["finger"]).max() < 1e-10
    # The plane carries 5.2 N, nearly all of it beyond the sensor; the shoulder hardly moves.
    held, pressed = (np.linalg.norm(read_by[one][:3]) for one in (None, "knuckle"))
    assert held - pressed == pytest.approx(5.2, abs=0.2)


@pytest.mark.parametrize("seed", range(3))
def test_a_pressed_tip_reads_the_opposite_of_the_contact_force(seed):
    model, radius, depth = arm(), 0.02, 3e-4
    q = np.random.default_rng(seed).uniform(-1.0, 1.0, model.nq)
    center = models.pose_of(model, q, "tip").translation
    law, scene = sp.ImpactLaw(1e6, 1.5), sp.Scene(model)
    place = pin.SE3(np.eye(3), center - [0.01, 0.02, radius - depth])
    scene.add_contact(sp.Sphere(radius, "tip"), models.plate(), placement=place, law=law)
    data = model.createData()
    hold = pin.rnea(model, data, q, np.zeros(2), np.zeros(2), scene.external_forces(q))
    switch = sp.ContactSwitch(name="switch", frame="finger", threshold=1.0)
    tool = sp.ForceTorqueSensor(name="tool", frame="grip")
    result = read(scene, q, lambda t, q, v, contacts: hold, [sensor(), tool, switch])
    pose = models.pose_of(model, q, "mount")
    push = np.array([0.0, 0.0, law.normal_force(depth)])
    arm_of_force = center - [0, 0, radius] - pose.translation
    contact = np.ravel([pose.rotation.T @ one for one in (push, np.cross(arm_of_force, push))])
    assert push[2] > 5
    seen = result.sensors["wrist"].values[0]
    assert np.abs(seen - (weight(model, q) - contact)).max() < 1e-10
    # The finger is not beyond the tool.
    tool = result.sensors["tool"].values[0]
    assert np.abs(tool - weight(model, q, "grip", ("tool",))).max() < 1e-10
    assert result.sensors["switch"].values.tolist() == [[1.0]]


@pytest.mark.parametrize("integrator", [sp.Adaptive(), sp.Implicit(), sp.RungeKutta4(1e-3)])
def test_a_swinging_link_needs_centripetal_and_angular_acceleration(integrator):
    """What a joint in place of the mount, which rests, would transmit; the knuckle is locked."""
    rate, model = 250.0, arm()
    scene = sp.Scene(model, lock=["knuckle"])
    simulation = sp.Simulation(scene, integrator, [sensor(rate=rate)])
    result = simulation.run([0.9], [4.0], 0.4, record_dt=1 / rate)
    log = result.sensors["wrist"]
    assert np.allclose(log.t, result.t, rtol=0, atol=1e-12)
    whole = pin.buildModelFromXML(URDF.replace('"mount" type="fixed"', '"mount" type="revolute"'))
    data, mount = whole.createData(), whole.getJointId("mount")
    first = np.eye(whole.nq)[whole.joints[whole.getJointId("shoulder")].idx_v]
    for q, v, seen in zip(result.q, result.v, log.values, strict=True):
        a = pin.aba(scene.model, scene.model.createData(), q, v, np.zeros(1))
        pin.rnea(whole, data, q * first, v * first, a * first)
        assert np.allclose(seen, data.f[mount].vector, rtol=0, atol=1e-9)
    assert np.abs(log.values).max() > 9


@pytest.mark.parametrize("held", [None, 0.01])
def test_a_joint_torque_at_rest_carries_the_weight(held):
    q = np.array([0.4, -0.7])
    tip = ("finger",)
    for name, axis, parts in (("shoulder", [0, 0.6, 0.8], ALL), ("knuckle", [0, 1, 0], tip)):
        given = sp.JointTorqueSensor(name=name, joint=name)
        torque = weight(arm(), q, name, parts)[3:] @ axis
        control = sp.GravityCompensation()
        log = read(sp.Scene(arm()), q, control, [given], control_dt=held).sensors[name]
        assert abs(log.values[0, 0] - torque) < 1e-10
        assert log.columns == ("torque [N m]",)


def test_a_push_from_outside_is_felt():
    scene, given = sp.Scene(models.slider()), [sensor("ball_joint", rate=1000)]
    simulation = sp.Simulation(scene, sp.SemiImplicitEuler(1e-3), given)
    run = OpenRun(simulation, [0.0], record_dt=1e-3, controller=sp.GravityCompensation())
    run.advance(0.01)
    run.push("ball", [3.0, -4.0, 7.0])
    rows = run.advance(0.01)
    # The joint slides along z: it holds the push across, and the weight.
    assert np.allclose(rows.sensors["wrist"].values[-1, :3], [-3.0, 4.0, 9.81], atol=1e-12)
    assert np.allclose(rows.sensors["wrist"].t[0], 0.011)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (sensor("nowhere"), "nowhere"),
        (sensor("tip"), "frame = 'tip' has nothing beyond it"),
        (sensor("ball"), "'ball' is a point on a link"),
        (sp.JointTorqueSensor(name="s", joint="mount"), "no joint 'mount'"),
        (sp.JointTorqueSensor(name="s", joint="ball_joint"), "one degree of .*, this has 6"),
        (sp.ContactSwitch(name="s", contact="a", threshold=0), "no contact 'a'"),
        (sp.ContactSwitch(name="s", frame="finger", threshold=0), "has no contact on it"),
    ],
)
def test_what_cannot_be_measured_in_a_scene_is_named(given, said):
    model = models.ball() if "ball" in repr(given) else arm()
    with pytest.raises(sp.SphshellError, match=said):
        read(sp.Scene(model), pin.neutral(model), None, [given])


def test_what_a_joint_adds_is_transmitted():
    """A wheel driven against damping and sliding dry friction, with a rotor: I times alpha."""
    model = models.empty(gravity=0.0)
    link, rotor, damping, friction, joint = 0.3, 0.2, 0.4, 1.5, "wheel_joint"
    inertia = pin.Inertia(1.0, np.zeros(3), np.diag([0.1, 0.1, link]))
    models.add_body(model, "wheel", pin.JointModelRZ(), inertia=inertia)
    parts = {"damping": damping, "armature": rotor, "effort": 4.0}
    parts |= {"friction": sp.JointFriction(friction)}
    joints = sp.JointComponents(**{kind: {joint: one} for kind, one in parts.items()})
    torque = sp.JointTorqueSensor(name="torque", joint=joint, rate=200)
    sensors = [torque, sensor(joint, rate=200)]
    simulation = sp.Simulation(sp.Scene(model, joints=joints), sp.Adaptive(rtol=1e-9), sensors)
    held = {"control_dt": 0.05, "record_dt": 1 / 200}
    result = simulation.run([0.0], [1.0], 0.2, lambda t, q, v, contacts: [5.0], **held)
    # Cut to 4 N m by the motor's limit.
    alpha = (4.0 - damping * result.v[:, 0] - friction) / (link + rotor)
    seen = result.sensors["torque"].values[:, 0]
    assert np.allclose(seen[20:], link * alpha[20:], rtol=1e-6)
    assert np.allclose(result.sensors["wrist"].values[:, 5], seen, rtol=1e-12)
    assert result.stats.joints[joint].cut_time > 0.19


def test_joints_that_mimic_others():
    """A gripper's finger hangs on a joint that follows: its weight counts."""
    model = robots.load("panda", mimic=True).model
    q = np.array([0.3, 0.2, -0.4, -1.5, 0.3, 1.2, 0.5, *([0.02] * (model.nq - 7))])
    force = rest(sp.Scene(model), q, sensor("panda_hand"))[:3]
    hand = model.frames[model.getFrameId("panda_hand_joint")].inertia.mass
    mass = hand + sum(model.inertias[k].mass for k in (model.njoints - 2, model.njoints - 1))
    turn = models.pose_of(model, q, "panda_hand").rotation
    assert np.allclose(turn @ force, [0, 0, 9.81 * mass], rtol=0, atol=1e-10)


def test_the_drive_of_joints_that_follow_carries_them():
    """A slide of 1 kg, and one of 0.5 kg that goes up twice as far."""
    model = pin.buildModelFromXML(text_of("robots/two_slides.urdf"), mimic=True)
    drive = sp.JointTorqueSensor(name="drive", joint="first")
    wrench = sp.ForceTorqueSensor(name="wrench", frame="two")
    result = read(sp.Scene(model), [0.1], sp.GravityCompensation(), [drive, wrench])
    assert abs(result.sensors["drive"].values[0, 0] - 9.81 * (1.0 + 2 * 0.5)) < 1e-12
    assert abs(result.sensors["wrench"].values[0, 2] - 9.81 * 0.5) < 1e-12
    follower = sp.JointTorqueSensor(name="s", joint="second")
    with pytest.raises(sp.SphshellError, match="it follows another joint, measure that one"):
        read(sp.Scene(model), [0.1], None, [follower])
    # Let go, the first falls with g (1 + 1) / (1 + 4 0.5): the drive gives nothing.
    fall = read(sp.Scene(model), [0.1], None, [drive, wrench])
    assert abs(fall.sensors["drive"].values[0, 0]) < 1e-12
    acceleration = -2 * 9.81 * (1.0 + 2 * 0.5) / (1.0 + 4 * 0.5)
    assert abs(fall.sensors["wrench"].values[0, 2] - 0.5 * (acceleration + 9.81)) < 1e-12


@pytest.mark.parametrize(("frame", "mass"), [("a", 6), ("j", 6), ("b", 5), ("c", 3)])
def test_bodies_of_an_mjcf_file(frame, mass):
    model = pin.buildModelFromMJCF(str(DATA / "robots" / "bodies_and_site.xml"))
    scene = sp.Scene(model)
    found = rest(scene, pin.neutral(model), sensor(frame))
    assert np.allclose(found, [0, 0, 9.81 * mass, 0, 0, 0], rtol=0, atol=1e-10)
    with pytest.raises(sp.SphshellError, match="'s' is a point on a link"):
        read(scene, pin.neutral(model), None, [sensor("s")])


@pytest.mark.parametrize("lock", [(), ("r/knuckle",), ("shoulder",)])
def test_robots_that_were_joined(lock):
    two = arm()
    for k, frame in enumerate(two.frames):
        two.frames[k].name = f"r/{frame.name}"
    for k in range(1, two.njoints):
        two.names[k] = f"r/{two.names[k]}"
    both = pin.appendModel(arm(), two, 0, pin.SE3(np.eye(3), np.array([0.0, 1.0, 0.0])))
    q = np.array([0.4, -0.7, 0.2, 0.9])
    left = q[[name not in lock for name in list(both.names)[1:]]]
    scene = sp.Scene(both, lock=lock, q_lock=q if lock else None)
    for frame, posture in (("mount", q[:2]), ("r/mount", q[2:])):
        assert np.abs(rest(scene, left, sensor(frame)) - weight(arm(), posture)).max() < 1e-10


def test_nothing_holds_a_floating_base():
    heavy = URDF.replace(urdf.link("base"), urdf.link("base", urdf.inertial(3.0)))
    model = pin.buildModelFromXML(heavy, pin.JointModelFreeFlyer())
    q = np.array([0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0, 0.4, -0.7])
    sensors = [sensor("mount"), sp.ForceTorqueSensor(name="root", frame="base")]
    simulation = sp.Simulation(sp.Scene(model), sp.Adaptive(), sensors)
    result = simulation.run(q, np.linspace(-1, 1, model.nv), 0.1)
    assert np.abs(result.sensors["root"].values).max() < 1e-12
    assert np.abs(result.sensors["wrist"].values).max() > 0.1
