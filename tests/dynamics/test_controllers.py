"""What controllers find in the scene, and their torques in the rows of a run."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import robots
from sphshell_pin.dynamics.run.open_run import OpenRun
from sphshell_pin.errors import InvalidParameter
from tests import models
from tests.results import assert_same_bits

PLACE = pin.SE3(pin.rpy.rpyToMatrix(0.2, 0.0, 0.3), np.array([0.1, 0.0, 0.2]))
PATH = [[0.0, 0.0, 0.0], [0.05, 0.02, 0.0]]


def press(**more) -> sp.CartesianImpedance:
    return sp.CartesianImpedance("ball", PATH, 100.0, 10.0, 1.0, joints=["ball_joint"], **more)


def moved(scene: sp.Scene, controller: sp.CartesianImpedance):
    start = models.free_q([0.1, 0.0, 0.3])
    return models.run(scene, sp.RungeKutta4(1e-3), start, duration=0.05, controller=controller).q


def test_the_place_of_a_shell_is_found_where_the_contacts_have_it() -> None:
    shell, scene = models.plate(), sp.Scene(models.ball())
    sphere = sp.Sphere(0.01, "ball")
    for name in ("one", "two"):
        scene.add_contact(sphere, shell, placement=PLACE, law=sp.ImpactLaw(1e5), name=name)
    found = moved(scene, press(shell=shell))
    np.testing.assert_array_equal(found, moved(scene, press(shell=shell, placement=PLACE)))
    elsewhere = moved(scene, press(shell=shell, shell_frame="universe"))
    assert np.abs(found - elsewhere).max() > 1e-4
    scene.add_contact(sphere, shell, law=sp.ImpactLaw(1e5), name="three")
    with pytest.raises(InvalidParameter, match=r"several places .*give shell_frame"):
        moved(scene, press(shell=shell))


def test_by_default_nothing_but_the_point_is_held() -> None:
    """A body that spins about the target goes on."""
    control = sp.CartesianImpedance("ball", [[0.0, 0.0, 0.0]], 50.0, 5.0)
    spin = [0.0, 0.0, 0.0, 1.0, 2.0, 3.0]
    start = models.free_q([0.0, 0.0, 0.0])
    made = sp.Simulation(sp.Scene(models.ball(0.0))).run(start, spin, 0.1, control)
    assert made.v[-1] == pytest.approx(spin, abs=1e-12)


def test_gains_and_posture_by_joint() -> None:
    model = models.arm()
    first = model.names[1]
    controller = sp.JointPD({first: 3.0}, 1.0, {first: 0.5})
    start = pin.neutral(model)
    assert controller.gain("kp", model).tolist() == [3.0, *[0.0] * (model.nv - 1)]
    assert controller.posture(model, start)[0] == 0.5
    for wrong in (sp.JointPD({"x": 3.0}, 1.0), sp.JointPD(1.0, 1.0, {"x": 0.5})):
        with pytest.raises(InvalidParameter, match=rf"joint 'x'.*{first}"):
            wrong._bind(sp.Scene(model), start)


def test_a_point_beside_the_frame_is_moved_as_a_frame_there() -> None:
    """Torques with an offset are those of a frame of the model at the same point."""
    model = models.arm()
    frame = model.frames[model.nframes - 1]
    offset = np.array([0.03, -0.02, 0.08])
    place = frame.placement * pin.SE3(np.eye(3), offset)
    model.addFrame(pin.Frame("beside", frame.parentJoint, place, pin.FrameType.OP_FRAME))
    shell, scene = models.plate(), sp.Scene(model)
    start = pin.randomConfiguration(model, -np.ones(model.nq), np.ones(model.nq))

    def end(name: str, **more) -> np.ndarray:
        more |= {"rotational_stiffness": 2.0}
        pressing = sp.CartesianImpedance(name, PATH, 100.0, 10.0, 1.0, shell, **more)
        return sp.Simulation(scene, sp.RungeKutta4(1e-3)).run(start, None, 0.1, pressing).q[-1]

    np.testing.assert_array_equal(end(frame.name, offset=offset), end("beside"))
    assert np.abs(end(frame.name) - end("beside")).max() > 1e-6
    with pytest.raises(InvalidParameter, match="offset"):
        sp.CartesianImpedance("ball", PATH, 100.0, 10.0, offset=[0.0, 0.1])


@pytest.mark.parametrize("integrator", [sp.RungeKutta4(1e-4), sp.Adaptive(1e-8, 1e-10)])
def test_the_normal_force_comes_on_as_a_smooth_step(integrator) -> None:
    # A free mass is pushed away from the shell's normal: its speed is the integral of the force.
    rise, force, more = 0.02, 3.0, {"shell": models.plate(), "joints": ["ball_joint"]}
    pressing = sp.CartesianImpedance("ball", PATH[:1], 0.0, 0.0, force, force_rise=rise, **more)
    simulation = sp.Simulation(sp.Scene(models.ball()), integrator)
    result = simulation.run(models.free_q([0, 0, 0.3]), None, 0.03, pressing, record_dt=1e-3)
    share = np.minimum(result.t / rise, 1.0)
    pushed = force * (rise * (share**3 - 0.5 * share**4) + np.maximum(result.t - rise, 0.0))
    np.testing.assert_allclose(result.v[:, 2], -pushed, rtol=1e-6, atol=1e-12)


Q0 = np.array([0.2, 0.6, 0.5])
KP, KD = np.array([0.4, 0.3, 0.2]), np.array([0.02, 0.01, 0.01])


def simulation(integrator=None, effort=None):
    finger = robots.load("three_link_finger")
    upright = pin.SE3(pin.rpy.rpyToMatrix(0.0, -np.pi / 2, 0.0), np.array([0.07, 0.0, 0.1]))
    joints = sp.JointComponents(effort={} if effort is None else {"knuckle": effort})
    scene, law = sp.Scene(finger.model, joints=joints), sp.HuntCrossleyLaw(1e6, 1.5, 2.0)
    scene.add_contact(sp.Sphere(0.010, "tip"), models.square(0.2), placement=upright, law=law)
    return sp.Simulation(scene, integrator or sp.RungeKutta4(2e-4))


def pd():
    return sp.JointPD(KP, KD, q_ref=Q0 + 0.3, gravity_compensation=True)


def expected(model, result):
    """kp (q_ref - q) - kd v + g(q), row by row."""
    data = model.createData()
    weights = [pin.computeGeneralizedGravity(model, data, q).copy() for q in result.q]
    return KP * (Q0 + 0.3 - result.q) - KD * result.v + np.array(weights)


@models.every_integrator(2e-4, 1e-6, 1e-5)
def test_they_are_those_of_the_controller_and_all_else_keeps_its_bits(integrator):
    run = simulation(integrator)
    asked = run.run(Q0, duration=0.1, controller=pd(), record_dt=1e-3, record=("torque",))
    plain = run.run(Q0, duration=0.1, controller=pd(), record_dt=1e-3)
    assert asked.torque.shape == (101, 3)
    np.testing.assert_allclose(asked.torque, expected(run.scene.model, asked), atol=1e-12)
    assert not asked.torque.flags.writeable
    assert plain.torque is None
    assert len(asked.contacts) > 10
    assert_same_bits(asked, plain)


def test_held_torques_are_those_of_the_last_time_of_control():
    asked = []

    def controller(t, q, v, contacts):
        asked.append(KP * (Q0 + 0.3 - q) - KD * v)
        return asked[-1]

    given = {"control_dt": 4e-3, "record_dt": 1e-3, "record": ["torque"]}
    result = simulation().run(Q0, duration=0.02, controller=controller, **given)
    assert len(asked) == 5  # not once more for the rows
    assert np.isnan(result.torque[0]).all()  # before the first
    np.testing.assert_array_equal(result.torque[1:], np.repeat(asked, 4, axis=0))


def test_they_are_cut_to_the_limits_of_the_motors_and_zero_without_a_controller():
    given = {"duration": 0.02, "record_dt": 1e-3, "record": ["torque"]}
    cut = simulation(effort=0.01).run(Q0, controller=pd(), **given)
    assert np.abs(cut.torque[:, 0]).max() == 0.01
    assert not simulation().run(Q0, **given).torque.any()


def test_they_are_saved_and_known_to_rollouts_and_open_runs(tmp_path):
    run, given = simulation(), {"duration": 0.02, "record_dt": 1e-3, "record": ["torque"]}
    result = run.run(Q0, controller=pd(), **given)
    loaded = sp.Result.load(result.save(tmp_path / "run.npz"))
    np.testing.assert_array_equal(loaded.torque, result.torque)
    rollout = run.rollout([Q0, Q0], controller=pd(), **given)
    np.testing.assert_array_equal(rollout[1].torque, result.torque)
    open_run = OpenRun(run, Q0, controller=pd(), record_dt=1e-3)
    first = open_run.advance(0.01)
    open_run.record_torques()
    second = open_run.advance(0.01)
    assert first.torque is None
    np.testing.assert_array_equal(second.torque, result.torque[11:])
    assert open_run.snapshot().torque.shape == (1, 3)
    # A start that was recorded before has none.
    open_run = OpenRun(run, Q0, controller=pd(), record_dt=1e-3)
    open_run.record_torques()
    assert np.isnan(open_run.advance(2e-3).torque).any(axis=1).tolist() == [True, False, False]
