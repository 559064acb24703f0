"""Stops, damping, dry friction, armature and limits of joints, against closed forms."""

import math
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.dynamics.result.run_stats import JointFigures
from sphshell_pin.dynamics.run.open_run import OpenRun
from sphshell_pin.errors import NameNotFound
from sphshell_pin.scenario.format.build import build
from tests import models
from tests.dynamics.scenes import assert_rate_jacobian
from tests.scenario.files import write
from tests.texts import text_of

MASS, LENGTH, OWN = 1.0, 0.3, 0.01
INERTIA = OWN + MASS * LENGTH**2
STIFFNESS = 500.0
URDF = text_of("robots/link.urdf")


def link(gravity: float = 0.0) -> pin.Model:
    model = pin.buildModelFromXML(URDF)
    model.gravity.linear = np.array([0.0, 0.0, -gravity])
    return model


def swing(joints, integrator, q: float, v: float, *more, gravity: float = 0.0, **options):
    """Run of the link from an angle and a speed."""
    scene = sp.Scene(link(gravity), joints=sp.JointComponents(**joints))
    return sp.Simulation(scene, integrator).run([q], [v], *more, **options)


WEIGHT = 2.0 * 9.81


def held(friction: sp.JointFriction, integrator, q: float, duration: float, **options) -> sp.Result:
    """Run of a mass of 2 kg along z under dry friction."""
    joints = sp.JointComponents(friction={"ball_joint": friction})
    scene = sp.Scene(models.slider(mass=2.0), joints=joints)
    return sp.Simulation(scene, integrator).run([q], None, duration, **options)


def residual(result: sp.Result) -> float:
    return float(np.abs(result.energy.residual).max() / result.energy.exchanged)


def stops(law: sp.ImpactLaw | sp.HuntCrossleyLaw, lower: float = -1.0) -> dict[str, object]:
    return {"limits": {"hinge": sp.JointLimits(lower, 0.5, law)}}


every = pytest.mark.parametrize(
    "integrator", [sp.Adaptive(1e-9, 1e-11), sp.Implicit(1e-9, 1e-11)], ids=lambda one: one.kind
)


@every
def test_a_link_bounces_off_its_stop_as_the_closed_form(integrator):
    result = swing(stops(sp.ImpactLaw(STIFFNESS, 1.0)), integrator, 0.0, 2.0, 1.0)
    half = math.pi / math.sqrt(STIFFNESS / INERTIA)
    touch, lift_off = result.events
    assert (touch.pair, touch.kind, lift_off.kind) == ("hinge", "stop", "stop_left")
    assert touch.t == pytest.approx(0.25, abs=1e-9)
    assert lift_off.t == pytest.approx(0.25 + half, abs=1e-7)
    assert result.v[-1, 0] == pytest.approx(-2.0, rel=1e-7)
    figures = result.stats.joints["hinge"]
    assert figures.stops == 1
    assert figures.stop_time == pytest.approx(half, rel=1e-6)
    assert residual(result) < 1e-7


def test_the_lower_stop_is_the_mirror_image() -> None:
    joints = stops(sp.HuntCrossleyLaw(STIFFNESS, 1.5, 0.3), -0.5)
    up, down = (swing(joints, sp.RungeKutta4(1e-3), 0.0, v, 0.5) for v in (2.0, -2.0))
    np.testing.assert_array_equal(up.q, -down.q)


@every
def test_a_damped_stop_throws_back_at_its_restitution(integrator) -> None:
    law = sp.HuntCrossleyLaw.with_restitution(STIFFNESS, 1.0, 0.6, 2.0)
    result = swing(stops(law), integrator, 0.0, 2.0, 0.6)
    assert result.v[-1, 0] == pytest.approx(-1.2, abs=1e-6)
    assert residual(result) < 1e-7


def test_a_top_without_torque_turns_as_the_closed_form_to_rounding() -> None:
    """Steps of so small turns that the chart of rotations is near its origin, by its series."""
    along, across = 2e-3, 1e-3
    model, moments = models.empty(gravity=0.0), np.array([across, across, along])
    inertia = pin.Inertia(1.0, np.zeros(3), np.diag(moments))
    models.add_body(model, "top", pin.JointModelFreeFlyer(), inertia=inertia)
    w = np.array([7.0, 1.0, 7.0])
    q, v = models.free_q(np.zeros(3)), np.concatenate([np.zeros(3), w])
    result = models.run(sp.Scene(model), sp.RungeKutta4(9e-5), q, v, 0.3)
    t = result.t[-1]
    precession = pin.exp3(moments * w / across * t)
    spin = pin.exp3(np.array([0.0, 0.0, (across - along) / across * w[2] * t]))
    turned = pin.Quaternion(result.q[-1][3:]).matrix()
    np.testing.assert_allclose(turned, precession @ spin, rtol=0, atol=2e-13)


def test_damping_and_armature_decay_as_the_closed_form() -> None:
    joints = {"damping": {"hinge": 0.3}, "armature": {"hinge": 0.05}}
    result = swing(joints, sp.Adaptive(1e-11, 1e-13), 0.0, 1.0, 2.0)
    expected = np.exp(-0.3 / (INERTIA + 0.05) * result.t)
    np.testing.assert_allclose(result.v[:, 0], expected, rtol=1e-8)
    lost = 0.5 * (INERTIA + 0.05) * (1.0 - expected[-1] ** 2)
    assert result.energy.damping_loss[-1] == pytest.approx(lost, rel=1e-8)


EACH = [sp.Adaptive(1e-6, 1e-8), sp.Implicit(1e-6, 1e-8), sp.SemiImplicitEuler(1e-3)]


@pytest.mark.parametrize("integrator", EACH)
def test_dry_friction_holds_99_percent_for_a_minute_without_creep(integrator):
    q = held(sp.JointFriction(WEIGHT / 0.99), integrator, 1.0, 60.0, record_dt=1.0).q[1:, 0]
    # The load comes on at once, and the spring gives way by a part of a millimeter.
    assert q[0] == pytest.approx(1.0, abs=2e-3)
    assert np.ptp(q) < 1e-10


def test_a_joint_that_is_held_stores_the_work_of_its_load() -> None:
    """Of the work F x the spring x = F / k holds a half; its damping took the other."""
    friction = sp.JointFriction(2 * WEIGHT, 1e3, 20.0)
    result = held(friction, sp.Adaptive(1e-9, 1e-11), 0.0, 3.0)
    assert result.q[-1, 0] == pytest.approx(-WEIGHT / 1e3, rel=1e-6)
    assert result.energy.friction_loss[-1] == pytest.approx(0.5 * WEIGHT**2 / 1e3, rel=1e-5)
    assert residual(result) < 1e-6


def test_the_order_of_joints_changes_no_step() -> None:
    """What bounds the error of a joint's friction is its own: either of two links moves."""
    model, friction = models.empty(9.81), {}
    for name in ("one", "other"):
        inertia = pin.Inertia(1.0, np.array([0.0, 0.0, -0.3]), 0.01 * np.eye(3))
        models.add_body(model, name, pin.JointModelRY(), inertia=inertia)
        friction[str(model.names[-1])] = sp.JointFriction(0.3)
    scene = sp.Scene(model, joints=sp.JointComponents(friction=friction))
    simulation = sp.Simulation(scene, sp.Adaptive(1e-6, 1e-8))
    runs = [simulation.run(start, None, 1.0) for start in ([0.8, 0.0], [0.0, 0.8])]
    assert runs[0].stats.evaluations == runs[1].stats.evaluations
    assert runs[0].q[-1, 0] == pytest.approx(runs[1].q[-1, 1], rel=1e-9)


@every
def test_dry_friction_slides_at_101_percent(integrator) -> None:
    result = held(sp.JointFriction(WEIGHT / 1.01), integrator, 1.0, 1.0)
    # All of the limit acts once the spring has given way.
    acceleration = np.diff(result.v[-2:, 0]) / np.diff(result.t[-2:])
    assert acceleration[0] == pytest.approx(-9.81 * (1 - 1 / 1.01), rel=1e-6)
    assert residual(result) < 1e-7


@every
def test_compensated_friction_leaves_the_motion_as_it_is_without(integrator) -> None:
    """The motor does the work that friction takes; beyond its effort limit friction is back."""
    brakes = sp.JointComponents.from_model(link(), ["damping", "friction"])

    def moved(joints, q, v, gravity, compensated=True) -> sp.Result:
        pd = sp.JointPD(20.0, 1.0, q_ref=[0.5], friction_compensation=compensated)
        scene = sp.Scene(link(gravity), joints=joints)
        return models.run(scene, integrator, q, v, 1.0, controller=pd)

    free = moved(sp.JointComponents(), [0.0], [0.5], 9.81)
    eased, braked = (moved(brakes, [0.0], [0.5], 9.81, one) for one in (True, False))
    assert eased.q[-1, 0] == pytest.approx(free.q[-1, 0], abs=1e-7)
    assert abs(braked.q[-1, 0] - free.q[-1, 0]) > 1e-3
    assert eased.energy.friction_loss[-1] > 0.1
    assert max(map(residual, (free, eased, braked))) < 1e-6
    weak = moved(brakes.replaced("hinge", effort=0.2), [0.0], None, 0.0)
    assert abs(weak.q[-1, 0]) < 2e-3  # 0.2 N m do not move what dry friction of 0.3 holds


def test_torques_are_cut_at_the_effort_limit_and_the_result_says_when() -> None:
    joints = {"effort": {"hinge": 5.0}, "speed": {"hinge": 3.0}}
    push = lambda t, *_: [20.0 * (1 - t)]  # noqa: E731
    result = swing(joints, sp.RungeKutta4(1e-3), 0.0, 0.0, 0.9, push, control_dt=0.01)
    # 5 N m until t = 0.75, then what is asked for, held over 0.01 s.
    assert result.v[750, 0] == pytest.approx(5.0 * 0.75 / INERTIA, rel=1e-9)
    figures = result.stats.joints["hinge"]
    assert figures.cut_time == pytest.approx(0.75, abs=0.011)
    assert figures.first_too_fast == pytest.approx(3.0 * INERTIA / 5.0, abs=2e-3)
    assert figures.peak_speed == pytest.approx(result.v.max(), rel=1e-12)
    kinds = [event.kind for event in result.events]
    assert kinds == ["effort_limit", "speed_limit", "effort_limit_left"]
    assert residual(result) < 1e-9


def test_the_fastest_of_a_joint_s_directions_counts() -> None:
    scene = sp.Scene(models.block(), joints=sp.JointComponents(speed={"ball_joint": 2.5}))
    result = models.run(scene, sp.RungeKutta4(1e-2), [0.0] * 3, [1.0, -3.0, 0.5])
    figures = result.stats.joints["ball_joint"]
    assert figures.peak_speed == pytest.approx(3.0, rel=1e-12)
    assert figures.first_too_fast == 0.0


def test_of_several_limits_of_a_joint_the_first_cut_and_the_greatest_speed_count() -> None:
    """Of a planar joint: -1 is never."""
    times = {"cut_time": 0.1, "first_cut": 0.4, "peak_speed": 2.0, "first_too_fast": -1.0}
    other = {"cut_time": 0.3, "first_cut": 0.2, "peak_speed": 1.0, "first_too_fast": 0.7}
    for limits in ([times, other], [other, times]):
        figures = JointFigures.from_core([], limits)
        assert (figures.cut_time, figures.first_cut) == (0.3, 0.2)
        assert (figures.peak_speed, figures.first_too_fast) == (2.0, 0.7)


def test_events_of_limits_name_the_joint_that_met_them() -> None:
    model = pin.buildSampleModelManipulator()
    model.gravity.setZero()
    for name in list(model.names)[1:]:
        torque = 1.5 * np.eye(model.nv)[model.joints[model.getJointId(name)].idx_v]
        scene = sp.Scene(model, joints=sp.JointComponents(effort={name: 1.0}, speed={name: 0.05}))
        push = lambda *_, torque=torque: torque  # noqa: E731
        start, step = pin.neutral(model), sp.RungeKutta4(1e-3)
        events = models.run(scene, step, start, duration=0.5, controller=push).events
        assert {event.kind for event in events} == {"effort_limit", "speed_limit"}
        assert {event.pair for event in events} == {name}


def test_efforts_may_differ_by_direction() -> None:
    joints = {"effort": {"hinge": (-2.0, 5.0)}}
    for asked, got in ((10.0, 5.0), (-10.0, -2.0), (1.0, 1.0)):
        push = lambda *_, asked=asked: [asked]  # noqa: E731
        result = swing(joints, sp.RungeKutta4(1e-3), 0.0, 0.0, 0.1, push, control_dt=0.1)
        assert result.v[-1, 0] == pytest.approx(0.1 * got / INERTIA, rel=1e-9)


def everything() -> sp.Scene:
    joints = sp.JointComponents(
        limits={"hinge": sp.JointLimits(-0.2, 0.2, sp.HuntCrossleyLaw(80.0, 1.3, 0.4))},
        damping={"hinge": 0.2},
        friction={"hinge": sp.JointFriction(0.5, stiffness=30.0, damping=0.4)},
        armature={"hinge": 0.03},
    )
    return sp.Scene(link(9.81), joints=joints)


@pytest.mark.parametrize(
    ("q", "v", "z"),
    [
        (0.1, 0.3, 0.004),  # sticks
        (0.25, 0.3, 0.004),  # in the stop
        (-0.26, 1.3, 0.012),  # in the other one, slides
        (0.1, -0.4, 0.03),  # slides, and the spring gives way
    ],
)
def test_slopes_agree_with_differences(q: float, v: float, z: float) -> None:
    assert_rate_jacobian(everything(), np.array([q]), np.array([v]), np.array([z]))


def test_your_own_loop_makes_the_same_motion() -> None:
    scene, dt = everything(), 1e-4
    model, data = scene.model, scene.model.createData()
    q, v = np.array([0.1]), np.array([1.5])
    state, expected = scene.state(q, v), models.run(scene, sp.SemiImplicitEuler(dt), q, v, 0.2)
    for _ in range(2000):
        v = v + dt * pin.aba(model, data, q, v, scene.joint_forces(q, v, state=state))
        q = pin.integrate(model, q, dt * v)
        state.advance(q, v, dt)
    np.testing.assert_allclose(q, expected.q[-1], atol=1e-12)
    np.testing.assert_allclose(v, expected.v[-1], atol=1e-12)


@every
def test_springs_of_joints_and_bristles_of_contacts_live_side_by_side(integrator) -> None:
    """Contacts that come and go reorder the state that both share."""
    dry = {"one_joint": sp.JointFriction(0.4), "two_joint": sp.JointFriction(0.2)}
    law, friction = sp.HuntCrossleyLaw(1e6, 1.5, 0.2), sp.BristleFriction(0.5, 0.4, 1e4, 1.0, 1e-2)
    scene = sp.Scene(models.arm(), joints=sp.JointComponents(friction=dry))
    scene.add_contact(sp.Sphere(0.05, "ball"), models.plate(), law=law, friction=friction)
    result = models.run(scene, integrator, models.ARM_Q, [1.0, 0.0, 0.0], 1.0)
    assert result.stats.pairs["ball-shell"].touches > 1
    assert residual(result) < 1e-5
    assert result.v[-1, 0] == pytest.approx(0.0, abs=1e-9)  # it sticks


def test_a_model_states_its_joints() -> None:
    joints = sp.JointComponents.from_model(link())
    limits = joints.limits["hinge"]
    assert (limits.lower, limits.upper) == (-1.0, 1.2)
    assert joints.damping == {"hinge": 0.7}
    assert joints.friction == {"hinge": sp.JointFriction(0.3)}
    assert joints.effort == {"hinge": 5.0}
    assert joints.speed == {"hinge": 3.0}
    # At its highest speed the joint goes 0.01 rad into the stop, or less if its motor is strong.
    energy = 0.5 * INERTIA * 3.0**2
    assert limits.law.depth_of(energy) <= 0.01 * (1 + 1e-9)
    one_way = link()
    one_way.lowerEffortLimit[0] = -2.0
    assert sp.JointComponents.from_model(one_way).effort == {"hinge": (-2.0, 5.0)}
    assert sp.JointComponents.from_model(link(), ["damping"]).kinds() == ("damping",)
    # The rotor behind its gear, unless the file states an armature.
    geared = link()
    geared.rotorInertia[0], geared.rotorGearRatio[0] = 2e-5, 50.0
    assert sp.JointComponents.from_model(geared, ["armature"]).armature["hinge"] == 0.05
    geared.armature = np.array([0.07])
    assert sp.JointComponents.from_model(geared, ["armature"]).armature["hinge"] == 0.07
    with pytest.raises(NameNotFound, match=r"'drag'.*damping"):
        sp.JointComponents.from_model(link(), ["drag"])


def test_zeros_and_missing_limits_are_not_stated() -> None:
    text = URDF.replace('effort="5" velocity="3"', 'effort="0" velocity="0"')
    text = text.replace('lower="-1" upper="1.2"', 'lower="0" upper="0"')
    text = text.replace('damping="0.7" friction="0.3"', 'damping="0" friction="0"')
    assert not sp.JointComponents.from_model(pin.buildModelFromXML(text)).kinds()


def test_explain_lists_what_is_modelled_and_what_is_left_out() -> None:
    damped = sp.JointComponents.from_model(link(), ["damping"])
    modelled, absent = str(sp.Scene(link(), joints=damped).explain()).split("Not modeled:")
    assert "damping of 'hinge'" in modelled
    assert "position limits that the robot's file states, of 'hinge'" in absent
    assert "damping" not in absent


def test_an_open_run_takes_over_new_numbers_of_joints() -> None:
    scenes = [sp.Scene(link(), joints=sp.JointComponents(damping={"hinge": c})) for c in (0.0, 2.0)]
    run = OpenRun(sp.Simulation(scenes[0], sp.Adaptive(1e-8)), [0.0], [1.0], record_dt=0.01)
    run.advance(0.1)
    assert run.change(scenes[1])
    after = run.advance(0.2)
    assert after.v[-1, 0] == pytest.approx(math.exp(-2.0 * 0.2 / INERTIA), rel=1e-4)
    assert not run.change(sp.Scene(link()))


def test_results_with_joints_are_saved_and_loaded(tmp_path: Path) -> None:
    result = swing(stops(sp.ImpactLaw(STIFFNESS, 1.0)), sp.Adaptive(1e-6), 0.0, 2.0, 0.5)
    loaded = sp.Result.load(result.save(tmp_path / "run.npz"))
    assert loaded.stats.joints == result.stats.joints
    assert loaded.events == result.events


def test_a_scenario_states_joints(tmp_path: Path) -> None:
    (tmp_path / "link.urdf").write_text(URDF)
    built = build(write(tmp_path, text_of("scenarios/swinging_link.toml")))
    joints, law = built.scene.joints, sp.HuntCrossleyLaw(400.0, 1.0)
    assert joints.kinds() == ("limits", "damping", "friction")
    assert joints.damping == {"hinge": 0.05}
    assert joints.limits == {"hinge": sp.JointLimits(-1.0, 0.3, law)}
    result = built.simulation.run(built.q0, built.v0, 1.0, built.controller)
    assert result.stats.joints["hinge"].stops >= 1


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.6, 0.0, 0.8)])
def test_the_energy_of_an_armature_counts_about_any_axis(axis: tuple[float, ...]) -> None:
    model = models.ball(0.0, 1.0, 0.1, pin.JointModelRevoluteUnaligned(*axis))
    model.armature, speed = np.array([0.05]), 3.0
    run = sp.Simulation(sp.Scene(model), sp.Adaptive()).run(np.zeros(1), [speed], 0.01)
    inertia = 0.4 * 1.0 * 0.1**2 + 0.05
    assert run.energy.kinetic == pytest.approx(0.5 * inertia * speed**2, rel=1e-12)


def test_slopes_of_springs_in_two_joints() -> None:
    model = link(9.81)
    body = pin.SE3(np.eye(3), np.array([0.0, 0.0, -0.3]))
    joint = model.addJoint(1, pin.JointModelRY(), body, "second")
    model.appendBodyToJoint(joint, pin.Inertia.FromSphere(0.5, 0.1), body)
    friction = sp.JointFriction(0.5, stiffness=30.0, damping=0.4)
    joints = sp.JointComponents(friction={"hinge": friction, "second": friction})
    state = np.array([0.1, -0.2]), np.array([0.3, -0.2]), np.array([0.004, 0.03])
    assert_rate_jacobian(sp.Scene(model, joints=joints), *state)
