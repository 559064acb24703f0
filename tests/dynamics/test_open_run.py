"""A run in pieces: against the same run in one, and against closed forms of pushes and changes."""

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.dynamics.run.open_run import OpenRun
from tests import models

G = 9.81
R = 0.05
FIXED = [sp.SemiImplicitEuler(1e-4), sp.RungeKutta4(1e-4), sp.LinearlyImplicitEuler(1e-4)]
every = models.every_integrator(1e-4, 1e-9, 1e-8)
fixed = pytest.mark.parametrize("integrator", FIXED, ids=lambda i: type(i).__name__)
FIRST_ORDER = sp.SemiImplicitEuler | sp.LinearlyImplicitEuler
PLATE = models.plate()
BRISTLES = sp.BristleFriction(0.6, 0.5, 1e5, 100.0)


def sliding_ball(friction=models.FRICTION) -> sp.Scene:
    return models.on_plate(models.ball(), models.LAW, friction)


def opened(scene: sp.Scene, integrator, q, v, **more) -> OpenRun:
    return OpenRun(sp.Simulation(scene, integrator), q, v, record_dt=1e-3, **more)


@fixed
@pytest.mark.parametrize("friction", [models.FRICTION, BRISTLES], ids=["coulomb", "bristle"])
def test_pieces_are_the_run_in_one(integrator, friction) -> None:
    q, v = models.free_q([0.0, 0.0, R - 1e-3]), np.array([0.3, 0.1, 0.0, 0.0, 2.0, 0.0])
    whole = models.run(sliding_ball(friction), integrator, q, v, 0.2, record_dt=1e-3)
    run = opened(sliding_ball(friction), integrator, q, v)
    pieces = [run.advance(piece) for piece in (0.0301, 0.07, 0.0005, 0.0994)]
    last = run.snapshot()
    np.testing.assert_array_equal(last.q[0], whole.q[-1])
    np.testing.assert_array_equal(last.v[0], whole.v[-1])
    np.testing.assert_array_equal(np.concatenate([one.t for one in pieces]), whole.t)
    for name in ("t", "contact_id", "depth", "friction_force_world"):
        joined = np.concatenate([getattr(one.contacts, name) for one in pieces])
        np.testing.assert_array_equal(joined, getattr(whole.contacts, name))
    assert run.residual == pytest.approx(whole.energy.residual[-1], abs=1e-12)


@every
def test_a_piece_ends_where_it_was_asked_to(integrator) -> None:
    run = opened(sliding_ball(), integrator, models.free_q([0.0, 0.0, R + 0.05]), None)
    run.advance(0.0123)
    step = getattr(integrator, "dt", 0.0)
    assert 0.0123 - 1e-12 <= run.time < 0.0123 + step + 1e-12
    assert run.snapshot().q[0, 2] == pytest.approx(R + 0.05 - 0.5 * G * run.time**2, abs=step)


@every
def test_a_push_gives_its_impulse_and_its_work(integrator) -> None:
    """From rest, a force F for a time T moves 1 kg at F T, and its work is (F T)^2 / 2."""
    scene = models.on_plate(models.ball(gravity=0.0), models.LAW)
    run = opened(scene, integrator, models.free_q([0.0, 0.0, 1.0]), None)
    run.push("ball", [3.0, 0.0, -4.0])
    run.advance(0.1)
    run.push("ball", np.zeros(3))
    pushed = run.time
    run.advance(0.05)
    row = run.snapshot()
    np.testing.assert_allclose(row.v[0, :3], pushed * np.array([3.0, 0.0, -4.0]), rtol=1e-9)
    np.testing.assert_allclose(row.v[0, 3:], 0.0, atol=1e-12)
    assert row.energy.control_work[0] == pytest.approx(0.5 * (5.0 * pushed) ** 2, rel=1e-9)
    assert abs(run.residual) < 1e-9
    # So it is of a controller's force.
    steady = lambda *_: np.array([3.0, 0.0, -4.0, 0.0, 0.0, 0.0])  # noqa: E731
    row = sp.Simulation(scene, integrator).run(models.free_q([0, 0, 1.0]), None, 0.1, steady)
    assert row.energy.control_work[-1] == pytest.approx(0.5 * (5.0 * row.t[-1]) ** 2, rel=1e-9)


@every
def test_a_damped_pull_follows_its_closed_form(integrator) -> None:
    """x'' + 2 w x' + w^2 x = 0 from rest at x = s: s (1 + w t) exp(-w t), a free ball's center."""
    mass, rate, stretch = 2.0, 12.0, np.array([0.3, -0.1, 0.2])
    scene, anchor = sp.Scene(models.ball(mass=mass, gravity=0.0)), np.array([0.1, 0.2, 1.0])
    run = opened(scene, integrator, models.free_q(anchor + stretch), None)
    run.pull("ball", np.zeros(3), anchor, mass * rate**2, 2.0 * mass * rate)
    run.advance(0.15)
    row, t = run.snapshot(), run.time
    place, speed = (1.0 + rate * t) * np.exp(-rate * t), -(rate**2) * t * np.exp(-rate * t)
    tolerance = 1e-3 if isinstance(integrator, FIRST_ORDER) else 1e-6
    np.testing.assert_allclose(row.q[0, :3], anchor + stretch * place, rtol=tolerance)
    np.testing.assert_allclose(row.v[0, :3], stretch * speed, rtol=tolerance)
    # Its work is the kinetic energy that it gave; most of what the spring had is in the damper.
    spring = 0.5 * mass * rate**2 * stretch @ stretch
    work = row.energy.control_work[0]
    assert work == pytest.approx(row.energy.kinetic[0], abs=tolerance * spring)
    assert abs(run.residual) < tolerance * spring


@every
def test_a_pull_takes_hold_where_a_body_is_that_nothing_touches(integrator) -> None:
    """A hinge turned by 90 degrees: the first step, too, has to know where its tip is."""
    model, inertia = models.empty(0.0), models.pin.Inertia(1.0, np.zeros(3), 0.2 * np.eye(3))
    models.add_body(model, "arm", models.pin.JointModelRZ(), inertia=inertia)
    run = opened(sp.Scene(model), integrator, [0.5 * np.pi], None)
    # The point is at y = 0.4; the spring pulls along -x.
    run.pull("arm", [0.4, 0.0, 0.0], [-0.5, 0.4, 0.0], 10.0)
    run.advance(1e-3)
    torque = 0.4 * 0.5 * 10.0
    assert run.snapshot().v[0, 0] == pytest.approx(torque / 0.2 * run.time, rel=1e-3)


def test_a_pull_outlives_a_change_and_ends_with_a_push() -> None:
    scene = models.on_plate(models.ball(), models.LAW, models.FRICTION, shell=PLATE)
    run = opened(scene, sp.Adaptive(1e-9), models.free_q([0.0, 0.0, 1.0]), None)
    run.pull("ball", np.zeros(3), [0.0, 0.0, 1.0], 1e3, 60.0)
    run.advance(2.0)
    hung = run.snapshot().q[0, 2]
    law = models.linear_law(1e4, 1.0)
    assert run.change(models.on_plate(models.ball(), law, models.FRICTION, shell=PLATE))
    run.advance(0.1)
    assert run.snapshot().q[0, 2] == pytest.approx(hung, abs=1e-9)
    assert abs(run.residual) < 1e-6
    run.push("ball", np.zeros(3))
    dropped = run.time
    run.advance(0.1)
    fallen = 0.5 * G * (run.time - dropped) ** 2
    assert hung - run.snapshot().q[0, 2] == pytest.approx(fallen, rel=1e-6)


@every
def test_a_change_of_stiffness_is_booked_and_gives_the_new_rest(integrator) -> None:
    def scene(stiffness: float) -> sp.Scene:
        law = models.linear_law(stiffness, 2.0 * np.sqrt(stiffness))
        return models.on_plate(models.ball(), law, shell=PLATE)

    run = opened(scene(2e4), integrator, models.free_q([0.0, 0.0, R - G / 2e4]), None)
    run.advance(0.05)
    assert run.change(scene(1e4))
    jumped = run.snapshot()
    depth = jumped.contacts.depth[0]
    # Half the stiffness at the same depth holds half the energy: the change took it away.
    assert jumped.energy.control_work[0] == pytest.approx(-0.5 * 1e4 * depth**2, rel=1e-6)
    run.advance(0.4)
    assert run.snapshot().contacts.depth[0] == pytest.approx(G / 1e4, rel=1e-3)
    assert abs(run.residual) < 1e-3 * G * (G / 1e4)


def test_a_target_goes_on_from_its_place_at_every_change_of_speed() -> None:
    def controller(speed: float) -> sp.CartesianImpedance:
        way = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
        return sp.CartesianImpedance("ball", way, 1e4, 200.0, speed=speed)

    scene, speeds = sp.Scene(models.block()), (0.1, 0.05, 0.2, 0.1)
    run = opened(scene, sp.Adaptive(1e-9), [0.0, 0.0, 0.0], None, controller=controller(speeds[0]))
    for speed, place in zip(speeds, np.cumsum(speeds), strict=True):
        assert run.change(scene, controller(speed))
        run.advance(1.0)
        assert run.snapshot().q[0, 0] == pytest.approx(place, abs=1e-6)


def test_a_stretched_bristle_outlives_a_change() -> None:
    """A block on a slope hangs on its bristle; another normal law must not let it slip."""
    tilt, friction = 0.3, sp.BristleFriction(0.8, 0.8, 1e5, 300.0)
    soft, hard = (
        models.on_plate(models.block(tilt=tilt), law, friction, shell=PLATE)
        for law in (models.linear_law(1e5, 300.0), models.linear_law(2e5, 300.0))
    )
    start = [0.0, 0.0, R - G * np.cos(tilt) / 1e5]
    run = opened(soft, sp.Adaptive(1e-9), start, None)
    run.advance(0.5)
    held = run.snapshot().q[0, 0]
    assert held == pytest.approx(G * np.sin(tilt) / 1e5, rel=1e-6)
    assert run.change(hard)
    run.advance(0.5)
    assert run.snapshot().q[0, 0] == pytest.approx(held, rel=1e-6)


def test_another_scene_is_not_taken_for_a_change() -> None:
    run = opened(sliding_ball(), FIXED[0], models.free_q([0.0, 0.0, R]), None)
    elsewhere = models.on_plate(models.ball(), models.LAW, models.FRICTION)  # its own plate
    assert not run.change(elsewhere)
    assert not run.change(models.on_plate(models.ball(mass=2.0), models.LAW, models.FRICTION))
    run.advance(0.01)
    assert run.ended is None


def test_a_run_that_diverges_says_so_and_stands_still() -> None:
    push = lambda t, q, v, contacts: np.full(6, 1e30 if t > 0.01 else 0.0)  # noqa: E731
    stepper, start = sp.SemiImplicitEuler(1e-3), models.free_q([0.0, 0.0, 9.0])
    run = opened(models.on_plate(models.ball(), models.LAW), stepper, start, None, controller=push)
    run.advance(0.1)
    assert run.ended is not None
    assert "joint" in run.ended
    stood = run.time
    run.advance(0.1)
    assert run.time == stood


def test_a_fixed_step_of_many_fine_ones_can_be_left_half_way() -> None:
    """A caller with a time limit gets control back, and the motion is that of one whole run."""
    dt = 1e-2
    q, v = models.free_q([0.0, 0.0, R + 0.1]), np.array([0.0, 0.0, -200.0, 0.0, 0.0, 0.0])
    law = sp.ImpactLaw(1e9, 1.5)
    simulation = sp.Simulation(models.on_plate(models.ball(), law), sp.RungeKutta4(dt))
    whole = simulation.run(q, v, 2 * dt)
    run = OpenRun(simulation, q, v, record_dt=dt)
    run.advance(dt, wall=0.0)
    assert 0.0 < run.time < dt
    while run.time < 2 * dt:
        run.advance(2 * dt - run.time, wall=0.0)
    np.testing.assert_array_equal(run.snapshot().q[0], whole.q[-1])
