"""MindlinFriction: stiffness of two elastic bodies, energy, torsion, rolling, oblique impacts."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

import sphshell_pin as sp
from sphshell_pin import _core
from sphshell_pin.dynamics.run.open_run import OpenRun
from tests import meshes, models

R = 0.02
RUBBER, STEEL = (4e6, 0.48), (2.1e11, 0.3)
UP, ALONG = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
LAW = sp.ImpactLaw.hertz(R, *RUBBER, *STEEL)
STICKS = sp.MindlinFriction(1e3, 1e3, *RUBBER, *STEEL, torsional=True)


def shear(young: float, poisson: float) -> float:
    return young / (2 * (1 + poisson))


# Johnson 1985, ch. 7.
G_STAR = 1 / ((2 - RUBBER[1]) / shear(*RUBBER) + (2 - STEEL[1]) / shear(*STEEL))
G_TWIST = 1 / (1 / shear(*RUBBER) + 1 / shear(*STEEL))


def disc(depth: float) -> float:
    return math.sqrt(R * depth)


def test_stiffness_of_equal_bodies() -> None:
    """Of one material 8 G* a is 4 G a / (2 - nu), and 16/3 G a^3 of two is 8/3 of one's."""
    modulus = shear(*RUBBER)
    expected = 4 * modulus * 0.01 / (2 - RUBBER[1]), 8 / 3 * modulus * 0.01**3
    for law in (sp.MindlinFriction(0.5, 0.4, *RUBBER, *more) for more in ((), RUBBER)):
        found = law.tangential_stiffness(0.01), law.torsional_stiffness(0.01)
        assert found == pytest.approx(expected, rel=1e-14)


def after(depth: float, motion: pin.Motion, time: float) -> tuple[pin.Force, pin.Force]:
    """Wrenches after a motion at constant depth, from a touch that carries nothing."""
    state, still = sp.BristleState(R), pin.Motion.Zero()
    point = np.zeros(3)
    state.advance(point, UP, depth, still, still, LAW, STICKS, dt=0.0)
    for _ in range(10):
        state.advance(point, UP, depth, motion, still, LAW, STICKS, dt=time / 10)
    return sp.contact_wrench(point, UP, depth, still, still, LAW, STICKS, state)


@pytest.mark.parametrize("depth", [1e-8, 1e-5, 1e-3])
def test_slopes_of_load_by_displacement_and_of_torque_by_twist(depth: float) -> None:
    shift, twist = 1e-3 * depth, 1e-3
    on_i, on_j = after(depth, pin.Motion(shift / 0.1 * ALONG, np.zeros(3)), 0.1)
    assert -on_i.linear[0] / shift == pytest.approx(8 * G_STAR * disc(depth), rel=1e-12)
    assert on_i.linear + on_j.linear == pytest.approx(np.zeros(3), abs=0)
    on_i, _ = after(depth, pin.Motion(np.zeros(3), twist / 0.1 * UP), 0.1)
    assert -on_i.angular[2] / twist == pytest.approx(16 / 3 * G_TWIST * disc(depth) ** 3, rel=1e-12)


def held_ball(joint: pin.JointModel, depth: float, friction, inertia: pin.Inertia) -> sp.Scene:
    """A ball at a constant depth in a plate, on a joint along or about an axis."""
    model = models.empty(0.0)
    place = pin.SE3(np.eye(3), np.array([0.0, 0.0, R - depth]))
    models.add_body(model, "ball", joint, placement=place, inertia=inertia)
    return models.on_shell(model, models.square(), LAW, friction, radius=R)


@pytest.mark.parametrize("integrator", [sp.Adaptive(1e-10), sp.Implicit(1e-8)], ids=str)
@pytest.mark.parametrize("twist", [False, True])
@pytest.mark.parametrize("rings", [1, 5])
def test_a_ball_swings_on_its_bristle(rings: int, twist: bool, integrator) -> None:  # type: ignore[no-untyped-def]
    depth, inertia = 1e-3, pin.Inertia.FromSphere(1.0, R)
    friction = replace(STICKS, rings=rings)
    stiffness = STICKS.tangential_stiffness(disc(depth)) / inertia.mass
    if twist:
        stiffness = STICKS.torsional_stiffness(disc(depth)) / inertia.inertia[2, 2]
    period = 2 * math.pi / math.sqrt(stiffness)
    scene = held_ball(pin.JointModelRZ() if twist else pin.JointModelPX(), depth, friction, inertia)
    run = sp.Simulation(scene, integrator).run([0.0], [1e-3], 3 * period, record_dt=period / 8)
    exact = 1e-3 * np.cos(2 * math.pi * run.t / period)
    assert run.v[:, 0] == pytest.approx(exact, abs=1e-9)
    assert np.abs(run.energy.friction_loss).max() < 1e-6 * run.energy.exchanged


def test_damping_scales_with_the_stiffness() -> None:
    """With damping_time = 2 zeta / omega a motion at omega is damped by zeta."""
    depth, zeta = 1e-3, 0.2
    omega = math.sqrt(STICKS.tangential_stiffness(disc(depth)))
    friction = sp.MindlinFriction(1e3, 1e3, *RUBBER, *STEEL, damping_time=2 * zeta / omega)
    scene = held_ball(pin.JointModelPX(), depth, friction, pin.Inertia.FromSphere(1.0, R))
    run = sp.Simulation(scene, sp.Adaptive(1e-9)).run([0.0], [1e-3], 3 / omega)
    fast = omega * math.sqrt(1 - zeta**2)
    exact = np.exp(-zeta * omega * run.t) / fast * np.sin(fast * run.t)
    assert run.q[:, 0] == pytest.approx(1e-3 * exact, abs=1e-8 / omega)


# The ball of models.ball, r 50 mm, 1 kg: some 5 mm deep.
SOFT = (1e6, 0.4)
DEEP_LAW = sp.ImpactLaw.hertz(0.05, *SOFT, *SOFT)


@pytest.mark.parametrize(("rings", "bound"), [(2, 0.08), (4, 0.025), (8, 0.007)])
def test_loading_curve_of_mindlin(rings: int, bound: float) -> None:
    """At constant load F = mu N (1 - (1 - s / s_0)^1.5), s_0 = 3 mu N / (2 k).

    A mass comes in at a speed and stops where the curve has taken its energy, at 0.8 s_0.
    """
    depth = 1e-3
    friction = sp.MindlinFriction(0.5, 0.5, *RUBBER, *STEEL, rings=rings)
    limit = 0.5 * LAW.normal_force(depth)
    s_0 = 1.5 * limit / friction.tangential_stiffness(disc(depth))
    taken = limit * s_0 * (0.8 + 0.4 * (0.2**2.5 - 1))
    scene = held_ball(pin.JointModelPX(), depth, friction, pin.Inertia.FromSphere(1.0, R))
    speed = math.sqrt(2 * taken)
    run = sp.Simulation(scene, sp.Adaptive(1e-9)).run([0.0], [speed], 4 * s_0 / speed)
    assert run.q.max() == pytest.approx(0.8 * s_0, rel=bound)
    force = run.contacts.friction_force_world[:, 0]
    before = run.t <= run.t[np.argmax(run.q)]
    exact = -limit * (1 - (1 - np.minimum(run.q[before, 0] / s_0, 1)) ** 1.5)
    assert force[before] == pytest.approx(exact, abs=bound * limit)


def test_a_run_goes_on_with_as_many_rings() -> None:
    def scene(**more: float) -> sp.Scene:
        friction = replace(STICKS, **more)  # type: ignore[arg-type]
        return models.on_plate(models.ball(), DEEP_LAW, friction)

    now = scene(rings=2)
    run = OpenRun(sp.Simulation(now, sp.Adaptive()), models.free_q([0, 0, 0.045]), record_dt=0.01)
    changed = now.with_pairs((replace(now.pairs[0], friction=replace(STICKS, rings=3)),))
    assert not run.change(changed)
    changed = now.with_pairs((replace(now.pairs[0], friction=replace(STICKS, rings=2, young=5e6)),))
    assert run.change(changed)
    assert len(run.advance(0.05).t) > 1


@pytest.mark.parametrize(("integrator", "order"), [(sp.SemiImplicitEuler, 1), (sp.RungeKutta4, 4)])
@pytest.mark.parametrize("parts", [False, True])
@pytest.mark.parametrize("rings", [1, 3])
def test_order_of_convergence(integrator, order: int, parts: bool, rings: int) -> None:  # type: ignore[no-untyped-def]
    """The ball sticks, spins and rolls while the depth grows, or falls, all the time."""
    more = {"damping_time": 1e-3, "rolling": 0.01, "rolling_speed": 10.0, "rings": rings}
    friction = sp.MindlinFriction(5.0, 5.0, *SOFT, torsional=True, **more)
    scene = models.on_plate(models.ball(gravity=0.0), DEEP_LAW, friction)
    depth = 0.008 if parts else 0.003
    v = np.array([0.02, -0.03, 0.05 if parts else -0.5, 0.3, 0.2, 1.0])
    ends = []
    for steps in (40, 80, 160) if order == 1 else (20, 40, 80):
        step, q = integrator(0.006 / steps), models.free_q([0, 0, 0.05 - depth])
        run = sp.Simulation(scene, step).run(q, v, 0.006, record_dt=step.dt)
        heights = np.diff(run.q[:, 2])
        assert (heights > 0).all() if parts else (heights < 0).all()
        assert run.contacts.friction_force_world[-1, :2].any()
        ends.append(np.concatenate([run.q[-1], run.v[-1]]))
    errors = [np.linalg.norm(b - a) for a, b in pairwise(ends)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)


@models.every_integrator(1e-4, 1e-6, 1e-5)
def test_nothing_creeps_on_a_slope(integrator) -> None:  # type: ignore[no-untyped-def]
    angle = math.radians(10)
    law = sp.ImpactLaw.hertz(0.05, *SOFT, *SOFT, restitution=0.1, speed=0.1)
    friction = sp.MindlinFriction(0.5, 0.4, *SOFT, damping_time=0.01)
    scene = models.on_plate(models.block(tilt=angle), law, friction)
    start = [0.0, 0.0, 0.05 - law.depth_at(9.81 * math.cos(angle))]
    run = sp.Simulation(scene, integrator).run(start, duration=4.0, record_dt=1.0)
    assert np.abs(run.v[-1]).max() < 1e-8
    force = run.contacts.friction_force_world[-1]
    assert force[0] == pytest.approx(-9.81 * math.sin(angle), rel=1e-5)
    depth = law.depth_at(9.81 * math.cos(angle))
    stretch = 9.81 * math.sin(angle) / friction.tangential_stiffness(math.sqrt(0.05 * depth))
    assert run.q[-1, 0] == pytest.approx(stretch, rel=1e-3)


@pytest.mark.parametrize("rings", [1, 4])
def test_a_spin_dies_out_at_the_moment_limit(rings: int) -> None:
    """M = 3 pi / 16 mu N a."""
    depth = 1e-3
    friction = sp.MindlinFriction(0.4, 0.4, *RUBBER, *STEEL, torsional=True, rings=rings)
    inertia = pin.Inertia.FromSphere(1.0, R)
    scene = held_ball(pin.JointModelRZ(), depth, friction, inertia)
    moment = 3 * math.pi / 16 * 0.4 * LAW.normal_force(depth) * disc(depth)
    rate = moment / inertia.inertia[2, 2]
    run = sp.Simulation(scene, sp.Adaptive(1e-8)).run([0.0], [0.1 * rate], 0.08, record_dt=1e-3)
    late = run.t > 0.02
    slope = np.polyfit(run.t[late], run.v[late, 0], 1)[0]
    assert slope == pytest.approx(-rate, rel=1e-6)


ROLLING = 0.02


def rolled(slope: float, speed: float, rolling_speed: float) -> sp.Result:
    model = models.ball()
    model.gravity.linear = 9.81 * np.array([math.sin(slope), 0.0, -math.cos(slope)])
    stiff = (1e9, 0.3, 1e9, 0.3)
    law = sp.ImpactLaw.hertz(0.05, *stiff, restitution=0.1, speed=0.1)
    friction = sp.MindlinFriction(0.5, 0.5, 1e9, 0.3, rolling=ROLLING, rolling_speed=rolling_speed)
    q = models.free_q([-0.3, 0, 0.05 - law.depth_at(9.81 * math.cos(slope))])
    v = [speed, 0, 0, 0, speed / 0.05, 0]
    scene = models.on_plate(model, law, friction)
    return sp.Simulation(scene, sp.Implicit()).run(q, v, 1.0, record_dt=0.1)


def test_resistance_to_rolling_slows_a_ball_down() -> None:
    """a = 5/7 c g: the moment c r N acts about the contact point."""
    run = rolled(0.0, 0.5, 1e-3)
    exact = 0.5 * run.t - 0.5 * 5 / 7 * ROLLING * 9.81 * run.t**2
    assert run.q[:, 0] + 0.3 == pytest.approx(exact, abs=1e-4)
    assert np.abs(run.energy.residual).max() < 1e-6 * run.energy.exchanged


def test_a_ball_creeps_below_the_speed_of_its_resistance_to_rolling() -> None:
    """On a slope of half the coefficient, at x (3 - x^2) / 2 = 1/2."""
    run = rolled(math.atan(ROLLING / 2), 0.0, 0.01)
    roots = np.roots([-0.5, 0.0, 1.5, -0.5])
    share = float(roots[(roots > 0) & (roots < 1)][0].real)
    assert run.q[-1, 0] - run.q[-2, 0] == pytest.approx(0.1 * share * 0.01, rel=1e-3)


OVER_GROOVES = [
    (sp.MindlinFriction(0.4, 0.3, 1e6, 0.4, torsional=True, damping_time=1e-4, rings=1), 5),
    (sp.MindlinFriction(0.4, 0.3, 1e6, 0.4, torsional=True, damping_time=1e-4, rings=3), 5),
    *((sp.BristleFriction(0.4, 0.3, 1e4, 50.0), degrees) for degrees in (1, 5, 12)),
]


def over_a_groove(angle: float, friction: sp.Friction, dissipation: float = 0.5) -> sp.Scene:
    """A ball of radius 0.1 over a groove whose sides rise by `angle`."""
    shell = sp.Shell(*meshes.v_groove(angle, size=2.0, cells=6))
    law = sp.HuntCrossleyLaw(3e5, 1.5, dissipation)
    return models.on_shell(models.ball(radius=0.1), shell, law, friction, radius=0.1)


@pytest.mark.parametrize(("friction", "degrees"), OVER_GROOVES)
def test_friction_is_continuous_over_a_groove(friction, degrees: float) -> None:  # type: ignore[no-untyped-def]
    """Where contacts split and merge; and Mindlin's friction gives nothing back."""
    given_back = 1e-6 if isinstance(friction, sp.MindlinFriction) else 1.0
    angle = math.radians(degrees)
    scene = over_a_groove(angle, friction)
    height = 0.1 / math.cos(angle) + 0.02 * math.tan(angle) - 5e-4
    q, v = models.free_q([-0.02, 0.1, height]), [0.4, 0.03, -0.035, 0, 2, 5.0]
    jumps = []
    for record_dt in (2e-4, 2.5e-5):
        run = sp.Simulation(scene, sp.Adaptive(1e-8)).run(q, v, 0.1, record_dt=record_dt)
        assert np.bincount(run.contacts.row).max() > 1
        force = np.zeros((len(run.t), 3))
        np.add.at(force, run.contacts.row, run.contacts.friction_force_world)
        jumps.append(np.linalg.norm(np.diff(force[5:], axis=0), axis=1).max())
        assert np.abs(run.energy.residual).max() < 1e-6 * run.energy.exchanged
        assert np.diff(run.energy.friction_loss).min() > -given_back * run.energy.exchanged
    assert jumps[1] < 0.4 * jumps[0]


def test_contacts_that_split_and_merge_share_one_bristle() -> None:
    """A ball that rolls over a groove while 1 N along it holds: each contact carries all of it."""
    angle, radius, dt = math.radians(1), 0.1, 1e-3
    scene = over_a_groove(angle, sp.BristleFriction(0.4, 0.3, 1e4), 0.0)
    x = np.linspace(-0.004, 0.004, 100)
    z = radius / math.cos(angle) - 5e-4 + np.abs(x) * math.tan(angle)
    start = models.free_q([x[0], 0.1, z[0]])
    state = scene.state(start, np.zeros(6))
    state.advance(start, [0.0, 0.1, 0.0, 0.0, 0.0, 0.0], dt)
    counts = []
    for k in range(1, len(x)):
        q, speed = models.free_q([x[k], 0.1, z[k]]), (x[k] - x[k - 1]) / dt
        state.advance(q, [speed, 0.0, 0.0, 0.0, speed / radius, 0.0], dt)
        found = scene.contacts(q, np.zeros(6), state=state)
        counts.append(len(found.depth))
        held = -np.sign(found.normal_force)  # a saddle counts off
        assert found.friction_force_world[:, 1] == pytest.approx(held, rel=1e-3)
    assert counts[0] == counts[-1] == 1
    assert counts.count(3) > 20


def test_cycle_of_elata_and_berryman() -> None:
    """Slip at a high load, back at a low one: incremental laws gain (k_1 - k_2) s^2 / 2.

    Here the force falls with the load, and that energy is lost.
    """
    high, low, shift, rest = 4e-4, 1e-4, 1e-6, np.zeros(3)
    k_1, k_2 = (STICKS.tangential_stiffness(disc(d)) for d in (high, low))
    # Depth and slip at the corners; of each side the stretch at its end, and the work so far.
    corners = np.array([[high, 0.0], [high, shift], [low, shift], [low, 0.0], [high, 0.0]])
    ends = [np.zeros(4)]
    for begin, end in pairwise(corners):
        closing, slip = end - begin

        def rate(t, y, depth=begin[0], closing=closing, slip=slip):  # type: ignore[no-untyped-def]
            where = depth + t * closing, UP, np.array([slip, 0.0, -closing]), 0.0, rest, y[:3]
            found = _core.contact_force(LAW._binding, STICKS._binding, *where, R, 1e-5)
            return [*found[3], found[1][0] * slip]

        side = solve_ivp(rate, (0.0, 1.0), ends[-1], rtol=1e-9, atol=1e-16, method="LSODA")
        assert side.success
        ends.append(side.y[:, -1])
    assert ends[1][3] == pytest.approx(-k_1 * shift**2 / 2, rel=1e-6)
    assert ends[3][3] == pytest.approx(-(k_1 - k_2) * shift**2 / 2, rel=1e-6)
    # Back at the start nothing is left: the force that the bodies took apart is gone.
    assert np.abs(ends[4][:3]).max() < 1e-6 * np.abs(ends[1][:3]).max()
