"""A run under the mouse: bodies that are dragged, targets of joints that are moved."""

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin.dynamics.scene.models import apparent_mass
from sphshell_pin.errors import FrameNotFound, InvalidParameter, NameNotFound
from sphshell_pin.scenario import build
from sphshell_pin.scenario.live.live_run import LiveRun
from tests import models
from tests.scenario.arms import PD, write_arm
from tests.scenario.files import DROP, write

G = 9.81
LAW = "contact.ball-plate.law"


@pytest.fixture
def ball(tmp_path) -> LiveRun:
    return LiveRun(build(write(tmp_path)))


@pytest.fixture
def arm(tmp_path) -> LiveRun:
    return LiveRun(build(write_arm(tmp_path)))


def settle(live: LiveRun, seconds: float = 2.0) -> None:
    for _ in range(round(seconds * 20)):
        live.advance(0.05)


def body_mass(live: LiveRun) -> float:
    return float(live.scene.model.inertias[1].mass)


def test_the_cursor_moves_and_the_same_spring_follows(ball) -> None:
    ball.change("gravity.2", 0.0)
    ball.pull("ball", [0.0, 0.0, 0.0], [0.0, 0.0, 0.1], 100.0)
    stiffness = ball._drag.stiffness
    assert stiffness == pytest.approx(100.0 * body_mass(ball), rel=1e-9)
    for share in np.linspace(0.0, 1.0, 20):
        ball.pull("ball", [0.0, 0.0, 0.0], [0.1 * share, 0.0, 0.1], 100.0)
        ball.advance(0.02)
        assert ball._drag.stiffness == stiffness
        damping = 2.0 * np.sqrt(stiffness * body_mass(ball))  # critical
        force = stiffness * ([0.1 * share, 0.0, 0.1] - ball.q[:3]) - damping * ball.v[:3]
        np.testing.assert_allclose(ball.drag.force_world, force, atol=1e-9)
    settle(ball)
    np.testing.assert_allclose(ball.q[:3], [0.1, 0.0, 0.1], atol=1e-6)


def test_a_drag_outlives_parameters_and_its_work_is_counted(ball) -> None:
    ball.pull("ball", [0.0, 0.0, 0.0], [0.0, 0.0, 0.1], 200.0)
    settle(ball, 0.5)
    ball.change(f"{LAW}.stiffness", 2e6)  # the run goes on
    ball.advance(0.05)
    ball.change("gravity.2", -5.0)  # another run goes on from where this one is
    settle(ball)
    assert ball.q[2] == pytest.approx(0.1 - 5.0 / 200.0, abs=1e-6)
    assert abs(ball.residual) < 1e-2 * ball.exchanged
    ball.change("robot.ball.start.root_joint.2", 0.03)  # a start: nothing is held any more
    assert ball.drag is None


def test_a_push_and_a_reset_end_a_drag(ball) -> None:
    ball.pull("ball", [0.0, 0.0, 0.0], [0.0, 0.0, 0.1], 100.0)
    ball.push("ball", [0.0, 0.0, 0.1], 0.01)
    assert ball.drag is None
    ball.pull("ball", [0.0, 0.0, 0.0], [0.0, 0.0, 0.1], 100.0)
    # The end of the push that was under way does not end the drag.
    ball.advance(0.1)
    assert ball.drag is not None
    ball.reset()
    assert ball.drag is None


@pytest.mark.parametrize("dt", [1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("integrator", ["semi-implicit-euler", "runge-kutta-4"])
def test_no_stiffness_makes_a_fixed_step_diverge(tmp_path, dt, integrator) -> None:
    text = DROP.replace("dt = 1e-4", f'dt = {dt}\nintegrator = "{integrator}"')
    live = LiveRun(build(write(tmp_path, text.replace("0.0125, 0, 0, 0, 1", "0.1, 0, 0, 0, 1"))))
    # Off the center the ball turns, too.
    live.pull("ball", [0.0, 0.008, 0.006], [0.05, 0.0, 0.2], 1e9)
    settle(live)
    assert live.ended is None
    sag = body_mass(live) * G / live._drag.stiffness
    assert sag >= G * (4.0 * dt) ** 2
    # Below the point that is held the ball swings on.
    np.testing.assert_allclose(live.drag.point_world, [0.05, 0.0, 0.2 - sag], atol=1e-3)


@pytest.mark.parametrize(
    ("given", "fault", "says"),
    [
        (("bal", [0, 0, 0], [0, 0, 0], 1.0), FrameNotFound, "no frame 'bal'"),
        (("universe", [0, 0, 0], [0, 0, 0], 1.0), InvalidParameter, "fixed to the world"),
        (("ball", [0, 0], [0, 0, 0], 1.0), InvalidParameter, "point"),
        (("ball", [0, 0, 0], [0, 0, np.nan], 1.0), InvalidParameter, "target_world"),
        (("ball", [0, 0, 0], [0, 0, 0], 0.0), InvalidParameter, "stiffness"),
    ],
)
def test_a_drag_that_cannot_be_changes_nothing(ball, given, fault, says) -> None:
    with pytest.raises(fault, match=says):
        ball.pull(*given)
    assert ball.drag is None


def test_the_mass_that_a_force_moves() -> None:
    """Against 3 / sum of 1/m over the axes: of a free body off its center by the tensor."""
    model = models.ball(mass=2.0, radius=0.1)
    q = models.free_q([0.3, 0.1, 0.2])
    assert apparent_mass(model, q, 1, np.zeros(3)) == pytest.approx(2.0)
    inertia = 0.4 * 2.0 * 0.1**2
    # At the distance r two directions have the mobility 1/m + r^2/I, the third 1/m.
    off = 3.0 / (3.0 / 2.0 + 2.0 * 0.1**2 / inertia)
    assert apparent_mass(model, q, 1, np.array([0.0, 0.1, 0.0])) == pytest.approx(off)
    hinge = models.empty()
    body = pin.Inertia(1.0, np.zeros(3), np.diag([0.1, 0.1, 0.2]))
    models.add_body(hinge, "arm", pin.JointModelRZ(), inertia=body)
    # It moves in one direction of three, with r^2/I; on the axis it does not move at all.
    far = np.array([1.0, 0.0, 0.0])
    assert apparent_mass(hinge, np.zeros(1), 1, far) == pytest.approx(min(3 * 0.2, 1.0))
    assert apparent_mass(hinge, np.zeros(1), 1, np.array([0.0, 0.0, 1.0])) == 1.0


def test_a_dragged_arm_gives_way_and_comes_back(arm) -> None:
    settle(arm)
    rest = arm.q.copy()
    arm.pull("lower", [0.0, 0.0, 0.3], np.array([0.6, 0.0, 0.1]), 100.0)
    before = arm.drag.point_world
    settle(arm)
    moved = arm.drag.point_world - before
    assert moved @ [0.6 - before[0], 0.0, 0.1 - before[2]] > 0.0
    # At rest the controller's torques are those of the spring.
    at_point = models.jacobian_of(arm.scene.model, arm.q, "lower", [0.0, 0.0, 0.3])[:3]
    np.testing.assert_allclose(at_point.T @ arm.drag.force_world, 60.0 * (arm.q - rest), atol=1e-4)
    arm.release()
    settle(arm)
    np.testing.assert_allclose(arm.q, rest, atol=1e-6)


def test_targets_have_the_limits_of_their_joints_and_move_the_arm(arm) -> None:
    shoulder, elbow = arm.targets
    assert (shoulder.joint, shoulder.rotates, shoulder.limited) == ("shoulder", True, True)
    assert (elbow.low, elbow.high, elbow.value) == (-2.0, 1.5, 0.5)
    arm.advance(0.1)
    arm.aim("elbow", -1.0)
    assert arm.time == pytest.approx(0.1, abs=1e-9)
    assert [one.value for one in arm.targets] == [0.4, -1.0]
    settle(arm, 4.0)
    np.testing.assert_allclose(arm.q, [0.4, -1.0], atol=1e-5)
    # Gains and the start keep what was aimed at.
    arm.change("controller.kp", 90.0)
    settle(arm, 1.0)
    np.testing.assert_allclose(arm.q, [0.4, -1.0], atol=1e-5)
    arm.reset()
    np.testing.assert_array_equal(arm.q, [0.4, 0.5])
    settle(arm, 4.0)
    np.testing.assert_allclose(arm.q, [0.4, -1.0], atol=1e-5)
    assert abs(arm.residual) < 1e-2 * arm.exchanged


def test_a_gain_leaves_the_posture_of_the_start_where_it_was(arm) -> None:
    """The controller states no q_ref: it is that of the start, not of the moment of the change."""
    arm.pull("lower", [0.0, 0.0, 0.3], [0.6, 0.0, 0.1], 100.0)
    settle(arm)
    arm.change("controller.kp", 40.0)
    arm.release()
    settle(arm, 4.0)
    np.testing.assert_allclose(arm.q, [0.4, 0.5], atol=1e-5)


@pytest.mark.parametrize(
    "controller", ["", '[controller]\ntype = "gravity-compensation"\n', PD.replace("60.0", "0.0")]
)
def test_without_a_posture_there_are_no_targets(tmp_path, controller) -> None:
    live = LiveRun(build(write_arm(tmp_path, controller)))
    assert live.targets == ()
    with pytest.raises(NameNotFound, match="none"):
        live.aim("elbow", 0.0)


def test_patches_are_computed_when_they_are_wanted(ball) -> None:
    settle(ball)
    assert ball.patches is None
    ball.record_patches(True)
    assert len(ball.patches) == len(ball.contacts.depth) == 1
    ball.change("gravity.2", -5.0)
    ball.advance(0.05)
    assert len(ball.patches) == len(ball.contacts.depth)
    ball.record_patches(False)
    ball.advance(0.01)
    assert ball.patches is None


def test_a_parameter_of_the_posture_takes_the_place_of_its_target(tmp_path) -> None:
    live = LiveRun(build(write_arm(tmp_path, PD + "q_ref = { elbow = 0.2 }\n")))
    live.aim("elbow", -1.0)
    live.aim("shoulder", 0.1)
    live.change("controller.q_ref.elbow", 0.3)
    assert [one.value for one in live.targets] == [0.1, 0.3]
