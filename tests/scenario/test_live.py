"""A scenario that goes on while it is changed: what a page relies on."""

import numpy as np
import pytest

from sphshell_pin.errors import ScenarioError, SphshellError
from sphshell_pin.scenario import build
from sphshell_pin.scenario.live.live_run import LiveRun
from tests.scenario.files import DROP, write

LAW = "contact.ball-plate.law"
G = 9.81


@pytest.fixture
def live(tmp_path) -> LiveRun:
    return LiveRun(build(write(tmp_path)))


def weight(live: LiveRun) -> float:
    return float(live.scene.model.inertias[1].mass) * G


def settle(live: LiveRun, seconds: float = 1.0) -> None:
    for _ in range(round(seconds * 50)):
        live.advance(0.02)


def test_a_knob_acts_on_the_run_under_way(live: LiveRun) -> None:
    settle(live)
    time = live.time
    live.change(f"{LAW}.stiffness", 1e5)
    assert live.time == time
    settle(live, 3.0)
    # Ten times softer, k depth^1.5.
    assert live.contacts.depth[0] == pytest.approx((weight(live) / 1e5) ** (2 / 3), rel=1e-3)
    assert live.built.scenario.contact[0].law.stiffness == 1e5


def test_what_only_a_start_can_use_starts_anew(live: LiveRun) -> None:
    live.advance(0.2)
    live.change("robot.ball.start.root_joint.2", 0.05)
    assert live.time == 0.0
    assert live.q[2] == 0.05


def test_a_value_that_cannot_be_changes_nothing(live: LiveRun) -> None:
    live.advance(0.1)
    before, time, q = live.built, live.time, live.q.copy()
    for key, value in ((f"{LAW}.stiffness", -1.0), ("contact.none.law.stiffness", 1.0)):
        with pytest.raises(ScenarioError):
            live.change(key, value)
    with pytest.raises(SphshellError, match="depth"):
        live.change("robot.ball.start.root_joint.2", -0.001)
    assert live.built is before
    assert live.time == time
    np.testing.assert_array_equal(live.q, q)
    live.advance(0.1)
    assert live.ended is None


def test_a_push_moves_the_ball_for_its_time_only(live: LiveRun) -> None:
    live.change("gravity.2", 0.0)
    start = live.v.copy()
    live.push("ball", [0.5, 0.0, 0.0], 0.1)
    live.advance(0.05)
    live.advance(0.3)
    mass = float(live.scene.model.inertias[1].mass)
    assert live.v[0] - start[0] == pytest.approx(0.5 * 0.1 / mass, rel=2e-3)
    assert abs(live.residual) < 1e-9


def test_a_fault_of_the_users_own_function_ends_the_run_until_it_is_reset(tmp_path) -> None:
    (tmp_path / "mine.py").write_text(
        "def tau(t, q, v, contacts):\n"
        "    if t > 0.02:\n        raise ValueError('no more')\n    return 0 * v\n"
    )
    text = DROP.replace("[run]", '[controller]\ntype = "python"\nfunction = "mine.py:tau"\n\n[run]')
    live = LiveRun(build(write(tmp_path, text)))
    live.advance(0.1)
    assert "no more" in live.ended
    stood = live.time
    live.advance(0.1)
    assert live.time == stood
    live.reset()
    assert live.time == 0.0
    assert live.ended is None


@pytest.mark.robots
def test_another_path_speed_goes_on_from_where_the_tip_is() -> None:
    """The target neither jumps nor turns back: the tip slides on, at the new speed."""
    pytest.importorskip("example_robot_data", reason="needs the example-robot-data loaders")
    live = LiveRun(build("fingertip_on_blade"))
    live.advance(2.0)
    before = live.contacts.point_world[0].copy()
    live.change("controller.speed", 0.02)
    assert live.time == pytest.approx(2.0, abs=1e-3)
    live.advance(0.2)  # the change of speed has passed
    first = live.contacts.point_world[0].copy()
    assert np.linalg.norm(first - before) < 0.06 * 0.2
    live.advance(0.5)
    way = np.linalg.norm(live.contacts.point_world[0] - first)
    assert way == pytest.approx(0.02 * 0.5, rel=0.15)  # as the crow flies
    assert live.contacts.normal_force[0] == pytest.approx(5.0, rel=0.2)


def test_a_number_too_large_to_compute_with_is_one_sentence(live: LiveRun) -> None:
    live.advance(0.1)
    before = live.built
    live.change(f"{LAW}.stiffness", 1e300)
    live.advance(0.1)
    assert "\n" not in live.ended
    live.change(f"{LAW}.stiffness", 1e6)
    live.advance(0.01)
    assert live.ended is None
    assert live.built.scenario == before.scenario


def test_gravity_takes_push_and_audit_along(live: LiveRun) -> None:
    settle(live)
    live.push("ball", [0.0, 0.0, 2.0], 10.0)
    live.advance(0.01)
    residual, exchanged = live.residual, live.exchanged
    live.change("gravity.2", 0.0)
    assert live.residual == pytest.approx(residual, abs=1e-12)
    assert live.exchanged == exchanged
    live.advance(0.2)  # out of the contact
    mass, v = float(live.scene.model.inertias[1].mass), live.v.copy()
    live.advance(0.05)
    assert live.v[2] - v[2] == pytest.approx(2.0 * 0.05 / mass, rel=1e-2)
