"""MindlinFriction: stiffness of two elastic bodies, energy, torsion, rolling, oblique impacts."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

import sphshell_pin as sp
from sphshell_pin import _core
from sphshell_pin.errors import InvalidParameter
from tests import meshes, models
from tests.bounces import bounce
from tests.oracle import oblique

R = 0.02
RUBBER, STEEL = (4e6, 0.48), (2.1e11, 0.3)
UP, ALONG = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
LAW = sp.ImpactLaw.hertz(R, *RUBBER, *STEEL)
STICKS = sp.BristleFriction.mindlin(1e3, None, *RUBBER, *STEEL, torsional=True)


def shear(young: float, poisson: float) -> float:
    return young / (2 * (1 + poisson))


# Johnson 1985, ch. 7.
G_STAR = 1 / ((2 - RUBBER[1]) / shear(*RUBBER) + (2 - STEEL[1]) / shear(*STEEL))
G_TWIST = 1 / (1 / shear(*RUBBER) + 1 / shear(*STEEL))


def disc(depth: float) -> float:
    return math.sqrt(R * depth)


def test_stiffness_of_equal_bodies() -> None:
    """Of one material 8 G* a is 4 G a / (2 - nu), and 16/3 G a^3 of two is 8/3 of one's."""
    one = sp.BristleFriction.mindlin(0.5, 0.4, *RUBBER)
    both = sp.BristleFriction.mindlin(0.5, 0.4, *RUBBER, *RUBBER)
    for law in (one, both):
        assert law.tangential_stiffness(0.01) == pytest.approx(
            4 * shear(*RUBBER) * 0.01 / (2 - RUBBER[1]), rel=1e-14
        )
        assert law.torsional_stiffness(0.01) == pytest.approx(
            8 / 3 * shear(*RUBBER) * 0.01**3, rel=1e-14
        )
    assert STICKS.tangential_stiffness(0.01) == pytest.approx(8 * G_STAR * 0.01, rel=1e-14)
    assert STICKS.torsional_stiffness(0.01) == pytest.approx(16 / 3 * G_TWIST * 1e-6, rel=1e-14)


def after(depth: float, motion: pin.Motion, time: float) -> tuple[pin.Force, pin.Force]:
    """Wrenches after a motion at constant depth, from a touch that carries nothing."""
    state, still = sp.BristleState(R), pin.Motion.Zero()
    point = np.zeros(3)
    state.advance(point, UP, depth, still, still, LAW, STICKS, dt=0.0)
    for _ in range(10):
        state.advance(point, UP, depth, motion, still, LAW, STICKS, dt=time / 10)
    return sp.contact_wrench(point, UP, depth, still, still, LAW, STICKS, state)


@pytest.mark.parametrize("depth", [1e-8, 1e-5, 1e-3])
def test_slope_of_load_and_displacement(depth: float) -> None:
    shift = 1e-3 * depth
    on_i, on_j = after(depth, pin.Motion(shift / 0.1 * ALONG, np.zeros(3)), 0.1)
    assert -on_i.linear[0] / shift == pytest.approx(8 * G_STAR * disc(depth), rel=1e-12)
    assert on_i.linear + on_j.linear == pytest.approx(np.zeros(3), abs=0)


@pytest.mark.parametrize("depth", [1e-8, 1e-5, 1e-3])
def test_slope_of_torque_and_twist(depth: float) -> None:
    on_i, _ = after(depth, pin.Motion(np.zeros(3), 1e-2 * UP), 0.1)
    assert -on_i.angular[2] / 1e-3 == pytest.approx(16 / 3 * G_TWIST * disc(depth) ** 3, rel=1e-12)


def held_ball(joint: pin.JointModel, depth: float, friction, inertia: pin.Inertia) -> sp.Scene:
    """A ball at a constant depth in a plate, on a joint along or about an axis."""
    model = models.empty(0.0)
    place = pin.SE3(np.eye(3), np.array([0.0, 0.0, R - depth]))
    models.add_body(model, "ball", joint, placement=place, inertia=inertia)
    scene = sp.Scene(model)
    quad = sp.Shell([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2, 3]])
    scene.add_contact(sp.Sphere(R, "ball"), quad, law=LAW, friction=friction)
    return scene


@pytest.mark.parametrize("integrator", [sp.Adaptive(1e-10), sp.Implicit(1e-8)], ids=str)
@pytest.mark.parametrize("twist", [False, True])
def test_a_ball_swings_on_its_bristle(twist: bool, integrator) -> None:  # type: ignore[no-untyped-def]
    depth, inertia = 1e-3, pin.Inertia.FromSphere(1.0, R)
    stiffness = STICKS.tangential_stiffness(disc(depth)) / inertia.mass
    if twist:
        stiffness = STICKS.torsional_stiffness(disc(depth)) / inertia.inertia[2, 2]
    period = 2 * math.pi / math.sqrt(stiffness)
    scene = held_ball(pin.JointModelRZ() if twist else pin.JointModelPX(), depth, STICKS, inertia)
    run = sp.Simulation(scene, integrator).run([0.0], [1e-3], 3 * period, record_dt=period / 8)
    exact = 1e-3 * np.cos(2 * math.pi * run.t / period)
    assert run.v[:, 0] == pytest.approx(exact, abs=1e-9)
    assert np.abs(run.energy.friction_loss).max() < 1e-6 * run.energy.exchanged


def test_damping_scales_with_the_stiffness() -> None:
    """With damping_time = 2 zeta / omega a motion at omega is damped by zeta."""
    depth, zeta = 1e-3, 0.2
    omega = math.sqrt(STICKS.tangential_stiffness(disc(depth)))
    friction = sp.BristleFriction.mindlin(1e3, None, *RUBBER, *STEEL, damping_time=2 * zeta / omega)
    scene = held_ball(pin.JointModelPX(), depth, friction, pin.Inertia.FromSphere(1.0, R))
    run = sp.Simulation(scene, sp.Adaptive(1e-9)).run([0.0], [1e-3], 3 / omega)
    fast = omega * math.sqrt(1 - zeta**2)
    exact = np.exp(-zeta * omega * run.t) / fast * np.sin(fast * run.t)
    assert run.q[:, 0] == pytest.approx(1e-3 * exact, abs=1e-8 / omega)


class Path:
    """Force, moment and work along a motion of one contact, by the law's own rates."""

    def __init__(self, friction: sp.MindlinFriction) -> None:
        self.friction = friction

    def at(self, z, depth: float, closing: float, slip, spin: float):  # type: ignore[no-untyped-def]
        velocity = np.array([*slip, -closing])
        law, friction = LAW.core, self.friction.core
        rest = np.zeros(3)
        return _core.contact_force(law, friction, depth, UP, velocity, spin, rest, z, R, 1e-5)

    def run(self, times, depth, slip, spin):  # type: ignore[no-untyped-def]
        """Work (n,) of friction on what moves the bodies; functions of time give value and rate."""

        def rate(t: float, y):  # type: ignore[no-untyped-def]
            value, closing = depth(t)
            _, drag, moment, z_rate = self.at(y[:3], value, closing, slip(t), spin(t))
            return [*z_rate, drag[:2] @ slip(t) + moment[2] * spin(t)]

        out = [np.zeros(4)]
        for begin, end in pairwise(times):
            step = solve_ivp(rate, (begin, end), out[-1], rtol=1e-9, atol=1e-16, method="LSODA")
            assert step.success
            out.append(step.y[:, -1])
        return np.array(out)


def test_cycle_of_elata_and_berryman() -> None:
    """Slip at a high load, back at a low one: incremental laws gain (k_1 - k_2) s^2 / 2.

    Here the force falls with the load, and that energy is lost.
    """
    high, low, shift = 4e-4, 1e-4, 1e-6
    depths = [high, high, low, low, high]
    slips = [0.0, shift, shift, 0.0, 0.0]

    def leg(values: list[float], t: float) -> tuple[float, float]:
        k = min(int(t), 3)
        return values[k] + (t - k) * (values[k + 1] - values[k]), values[k + 1] - values[k]

    path = Path(STICKS)
    rows = path.run(
        range(5), lambda t: leg(depths, t), lambda t: [leg(slips, t)[1], 0.0], lambda t: 0.0
    )
    k_1, k_2 = (STICKS.tangential_stiffness(disc(d)) for d in (high, low))
    assert rows[1, 3] == pytest.approx(-k_1 * shift**2 / 2, rel=1e-6)
    assert rows[3, 3] == pytest.approx(-(k_1 - k_2) * shift**2 / 2, rel=1e-6)
    # Back at the start nothing is left: the force that the bodies took apart is gone.
    assert np.abs(rows[-1, :3]).max() < 1e-6 * np.abs(rows[1, :3]).max()


@pytest.mark.parametrize("mu", [0.3, 1e3])
@pytest.mark.parametrize("seed", range(6))
def test_no_closed_path_gains_energy(seed: int, mu: float) -> None:
    """Random loops in depth, slip and twist, again and again: friction only takes work."""
    rng = np.random.default_rng(seed)
    friction = sp.BristleFriction.mindlin(mu, None, *RUBBER, *STEEL, torsional=True)
    phase = rng.uniform(0, 2 * math.pi, (4, 3))
    size = rng.normal(size=(4, 3)) * np.array([[0.3], [0.05], [0.05], [0.5]])
    number = np.arange(1, 4)
    depth_0 = 1e-4

    def wave(k: int, t: float) -> tuple[float, float]:
        angle = number * t + phase[k]
        return float(size[k] @ np.sin(angle)), float(size[k] @ (number * np.cos(angle)))

    def depth(t: float) -> tuple[float, float]:
        value, rate = wave(0, t)
        return depth_0 * math.exp(value), depth_0 * math.exp(value) * rate

    def slip(t: float) -> list[float]:
        return [depth_0 * wave(1, t)[1], depth_0 * wave(2, t)[1]]

    def spin(t: float) -> float:
        return depth_0 / disc(depth_0) * wave(3, t)[1]

    loops = 2 * math.pi * np.arange(4)
    work = Path(friction).run(loops, depth, slip, spin)[:, 3]
    size_of_work = friction.tangential_stiffness(disc(depth_0)) * (0.05 * depth_0) ** 2
    assert (np.diff(work) < 0).all()
    assert work[-1] < -1e-3 * size_of_work


ALUMINA_GLASS = (380e9, 0.23, 70e9, 0.25)
BALL, DENSITY, MU, SPEED = 2.5e-3, 4000.0, 0.092, 3.9
ELASTIC = sp.ImpactLaw.hertz(BALL, *ALUMINA_GLASS)
KHARAZ = sp.BristleFriction.mindlin(MU, None, *ALUMINA_GLASS)
KAPPA = oblique.kappa(*ALUMINA_GLASS)


def thrown(degrees: float, speed: float = SPEED, law=ELASTIC, friction=KHARAZ, **more):  # type: ignore[no-untyped-def]
    return bounce(math.radians(degrees), speed, BALL, DENSITY, law, friction, **more)


@pytest.mark.parametrize("degrees", [5, 10, 20, 28, 40])
@pytest.mark.parametrize("integrator", [sp.Adaptive(1e-8), sp.Implicit(1e-6)], ids=str)
def test_audit_of_an_oblique_bounce(degrees: float, integrator) -> None:  # type: ignore[no-untyped-def]
    energy = thrown(degrees, integrator=integrator).result.energy
    bound = 1e-8 if isinstance(integrator, sp.Adaptive) else 1e-6
    assert np.abs(energy.residual).max() < bound * energy.exchanged
    assert np.diff(energy.friction_loss).min() > -bound * energy.exchanged


@pytest.mark.parametrize("degrees", [5, 10, 15, 20, 25, 28])
def test_oblique_bounce_against_the_theory(degrees: float) -> None:
    """Speeds at which the depth, which the half-space neglects, is 1e-4 and 2e-5 of the radius."""
    psi = KAPPA * math.tan(math.radians(degrees)) / MU
    theory = oblique.rigid_disc(np.array([psi]), KAPPA)[0] / psi
    slow, slower = thrown(degrees, 0.039), thrown(degrees, 0.0039)
    assert slow.tangential == pytest.approx(slower.tangential, abs=1e-3)
    assert slow.slip == pytest.approx(slower.slip, abs=1e-3)
    assert slower.tangential == pytest.approx(1 + 2 / 7 * (theory - 1), abs=1e-4)
    assert slower.normal == pytest.approx(1.0, abs=1e-8)


def test_what_micro_slip_adds() -> None:
    """The figures of docs/laws.md: v_t' / v_t of Kharaz's ball, against Maw et al.'s theory."""
    degrees = np.array([2.0, 5, 10, 15, 20, 25, 30])
    psi = KAPPA * np.tan(np.radians(degrees)) / MU
    ratios = [
        1 + 2 / 7 * (theory(psi, KAPPA, steps=10_000) - psi) / psi
        for theory in (oblique.rigid_disc, oblique.micro_slip)
    ]
    assert ratios[0] == pytest.approx([0.877, 0.860, 0.710, 0.630, 0.618, 0.636, 0.681], abs=1e-3)
    assert ratios[1] == pytest.approx([0.774, 0.736, 0.637, 0.590, 0.592, 0.622, 0.681], abs=1e-3)


@pytest.mark.parametrize("restitution", [1.0, 0.98])
@pytest.mark.parametrize("degrees", [35, 50, 70, 85])
def test_gross_sliding(degrees: float, restitution: float) -> None:
    """v_t' = v_t - mu (1 + e) v_n; the spin has the arm r - depth of the contact point."""
    law = sp.ImpactLaw.hertz(BALL, *ALUMINA_GLASS, restitution=restitution, speed=SPEED)
    out = thrown(degrees, law=law)
    down = SPEED * math.cos(math.radians(degrees))
    along = SPEED * math.sin(math.radians(degrees))
    lost = MU * (1 + out.normal) * down
    assert out.tangential == pytest.approx(1 - lost / along, abs=1e-6)
    assert out.spin == pytest.approx(2.5 * lost / BALL, rel=6e-3)
    if restitution == 1.0:
        # The impulse-weighted depth of an elastic impact: B(2/5, 3/2) / (5/2) of the largest.
        beta = math.gamma(0.4) * math.gamma(1.5) / math.gamma(1.9)
        mass = DENSITY * 4 / 3 * math.pi * BALL**3
        mean = beta / 2.5 * ELASTIC.depth_of(0.5 * mass * down**2)
        assert out.spin == pytest.approx(2.5 * lost * (BALL - mean) / BALL**2, rel=1e-6)


# The ball of models.ball, r 50 mm, 1 kg: some 5 mm deep.
SOFT = (1e6, 0.4)
DEEP_LAW = sp.ImpactLaw.hertz(0.05, *SOFT, *SOFT)


@pytest.mark.parametrize(("integrator", "order"), [(sp.SemiImplicitEuler, 1), (sp.RungeKutta4, 4)])
@pytest.mark.parametrize("parts", [False, True])
def test_order_of_convergence(integrator, order: int, parts: bool) -> None:  # type: ignore[no-untyped-def]
    """The ball sticks, spins and rolls while the depth grows, or falls, all the time."""
    friction = sp.BristleFriction.mindlin(
        5.0, None, *SOFT, torsional=True, damping_time=1e-3, rolling=0.01, rolling_speed=10.0
    )
    scene = models.on_plate(models.ball(gravity=0.0), DEEP_LAW, friction)
    depth = 0.008 if parts else 0.003
    v = np.array([0.02, -0.03, 0.05 if parts else -0.5, 0.3, 0.2, 1.0])
    ends = []
    for steps in (40, 80, 160) if order == 1 else (20, 40, 80):
        run = sp.Simulation(scene, integrator(0.006 / steps)).run(
            models.free_q([0, 0, 0.05 - depth]), v, 0.006, record_dt=0.006 / steps
        )
        heights = np.diff(run.q[:, 2])
        assert (heights > 0).all() if parts else (heights < 0).all()
        assert run.contacts.friction_force_world[-1, :2].any()
        ends.append(np.concatenate([run.q[-1], run.v[-1]]))
    errors = [np.linalg.norm(b - a) for a, b in pairwise(ends)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)


@pytest.mark.parametrize(
    "integrator",
    [sp.SemiImplicitEuler(1e-4), sp.RungeKutta4(1e-4), sp.LinearlyImplicitEuler(1e-3),
     sp.Adaptive(), sp.Implicit()],
    ids=str,
)  # fmt: skip
def test_nothing_creeps_on_a_slope(integrator) -> None:  # type: ignore[no-untyped-def]
    angle = math.radians(10)
    model = models.empty()
    model.gravity.linear = 9.81 * np.array([math.sin(angle), 0.0, -math.cos(angle)])
    models.add_body(model, "ball", pin.JointModelTranslation())
    law = sp.ImpactLaw.hertz(0.05, *SOFT, *SOFT, restitution=0.1, speed=0.1)
    friction = sp.BristleFriction.mindlin(0.5, 0.4, *SOFT, damping_time=0.01)
    scene = models.on_plate(model, law, friction)
    start = [0.0, 0.0, 0.05 - law.depth_at(9.81 * math.cos(angle))]
    run = sp.Simulation(scene, integrator).run(start, duration=4.0, record_dt=1.0)
    assert np.abs(run.v[-1]).max() < 1e-8
    force = run.contacts.friction_force_world[-1]
    assert force[0] == pytest.approx(-9.81 * math.sin(angle), rel=1e-5)
    depth = law.depth_at(9.81 * math.cos(angle))
    stretch = 9.81 * math.sin(angle) / friction.tangential_stiffness(math.sqrt(0.05 * depth))
    assert run.q[-1, 0] == pytest.approx(stretch, rel=1e-3)


def test_a_spin_dies_out_at_the_moment_limit() -> None:
    """M = 3 pi / 16 mu N a."""
    depth = 1e-3
    friction = sp.BristleFriction.mindlin(0.4, None, *RUBBER, *STEEL, torsional=True)
    inertia = pin.Inertia.FromSphere(1.0, R)
    scene = held_ball(pin.JointModelRZ(), depth, friction, inertia)
    moment = 3 * math.pi / 16 * 0.4 * LAW.normal_force(depth) * disc(depth)
    rate = moment / inertia.inertia[2, 2]
    run = sp.Simulation(scene, sp.Adaptive(1e-8)).run([0.0], [0.1 * rate], 0.08, record_dt=1e-3)
    late = run.t > 0.02
    slope = np.polyfit(run.t[late], run.v[late, 0], 1)[0]
    assert slope == pytest.approx(-rate, rel=1e-6)


class TestRolling:
    COEFFICIENT = 0.02

    def rolling(
        self, slope: float, speed: float, duration: float, rolling_speed: float
    ) -> sp.Result:
        model = models.ball()
        model.gravity.linear = 9.81 * np.array([math.sin(slope), 0.0, -math.cos(slope)])
        law = sp.ImpactLaw.hertz(0.05, 1e9, 0.3, 1e9, 0.3, restitution=0.1, speed=0.1)
        friction = sp.BristleFriction.mindlin(
            0.5, None, 1e9, 0.3, rolling=self.COEFFICIENT, rolling_speed=rolling_speed
        )
        scene = models.on_plate(model, law, friction)
        q = models.free_q([-0.3, 0, 0.05 - law.depth_at(9.81 * math.cos(slope))])
        return sp.Simulation(scene, sp.Implicit()).run(
            q, [speed, 0, 0, 0, speed / 0.05, 0], duration, record_dt=duration / 10
        )

    def test_it_slows_a_ball_down(self) -> None:
        """a = 5/7 c g: the moment c r N acts about the contact point."""
        run = self.rolling(0.0, 0.5, 1.0, 1e-3)
        x = run.q[:, 0] + 0.3
        exact = 0.5 * run.t - 0.5 * 5 / 7 * self.COEFFICIENT * 9.81 * run.t**2
        assert x == pytest.approx(exact, abs=1e-4)
        assert np.abs(run.energy.residual).max() < 1e-6 * run.energy.exchanged

    def test_it_creeps_below_its_speed(self) -> None:
        """On a slope of half the coefficient the ball creeps, at x (3 - x^2) / 2 = 1/2."""
        slope = math.atan(self.COEFFICIENT / 2)
        run = self.rolling(slope, 0.0, 1.0, 0.01)
        roots = np.roots([-0.5, 0.0, 1.5, -0.5])
        share = float(roots[(roots > 0) & (roots < 1)][0].real)
        assert run.q[-1, 0] - run.q[-2, 0] == pytest.approx(0.1 * share * 0.01, rel=1e-3)


def test_friction_is_continuous_over_a_groove() -> None:
    """Where contacts split and merge; and friction gives nothing back."""
    shell = sp.Shell(*meshes.v_groove(math.radians(5), size=2.0, cells=6))
    scene = sp.Scene(models.ball(radius=0.1))
    law = sp.HuntCrossleyLaw(3e5, 1.5, 0.5)
    friction = sp.BristleFriction.mindlin(0.4, 0.3, 1e6, 0.4, torsional=True, damping_time=1e-4)
    scene.add_contact(sp.Sphere(0.1, "ball"), shell, law=law, friction=friction)
    height = 0.1 / math.cos(math.radians(5)) + 0.02 * math.tan(math.radians(5)) - 5e-4
    jumps = []
    for record_dt in (2e-4, 2.5e-5):
        run = sp.Simulation(scene, sp.Adaptive(1e-8)).run(
            models.free_q([-0.02, 0.1, height]), [0.4, 0.03, -0.035, 0, 2, 5.0], 0.1,
            record_dt=record_dt,
        )  # fmt: skip
        assert np.bincount(run.contacts.row).max() > 1
        force = np.zeros((len(run.t), 3))
        np.add.at(force, run.contacts.row, run.contacts.friction_force_world)
        jumps.append(np.linalg.norm(np.diff(force[5:], axis=0), axis=1).max())
        assert np.abs(run.energy.residual).max() < 1e-6 * run.energy.exchanged
    assert jumps[1] < 0.4 * jumps[0]


@pytest.mark.parametrize("seed", range(4))
def test_energy_of_random_rolls(seed: int) -> None:
    """Over a bumpy surface, with touches and lift-offs."""
    rng = np.random.default_rng(seed)
    vertices, triangles = meshes.dome(cells=10, size=1.0, radius=1.0)
    height = 0.02 * np.sin(9 * vertices[:, 0]) * np.cos(7 * vertices[:, 1])
    shell = sp.Shell(vertices * [1, 1, -1] + height[:, None] * [0, 0, 1], triangles)
    scene = sp.Scene(models.ball(radius=0.1))
    friction = sp.BristleFriction.mindlin(
        0.3, 0.25, 1e6, 0.4, torsional=bool(seed % 2), rolling=0.01 * (seed // 2)
    )
    law = sp.HuntCrossleyLaw(3e5, 1.5, 0.3)
    scene.add_contact(sp.Sphere(0.1, "ball"), shell, law=law, friction=friction)
    q = models.free_q([*rng.uniform(-0.1, 0.1, 2), 0.0])
    q[2] = 0.1 + max(0.0, -float(shell.closest_points(q[None, :3]).distances[0]))
    v = np.concatenate([rng.uniform(-0.5, 0.5, 3), rng.uniform(-10, 10, 3)])
    energy = sp.Simulation(scene, sp.Adaptive(1e-8)).run(q, v, 0.5).energy
    assert np.abs(energy.residual).max() < 1e-5 * energy.exchanged
    assert np.diff(energy.friction_loss).min() > -1e-6 * energy.exchanged


def test_a_source_has_no_radius() -> None:
    scene = sp.Scene(models.ball())
    with pytest.raises(InvalidParameter, match="needs a sphere, and a contact source has none"):
        scene.add_contact_source(lambda i, j: ([], [], []), "ball", "universe", LAW, STICKS)


def test_a_wrench_needs_the_radius() -> None:
    still = pin.Motion.Zero()
    with pytest.raises(InvalidParameter, match="must be a BristleState, which holds"):
        sp.contact_wrench(np.zeros(3), UP, 1e-4, still, still, LAW, STICKS)
    plain = sp.BristleFriction.mindlin(0.5, 0.4, *RUBBER)
    with pytest.raises(InvalidParameter, match="must be the sphere's, of Mindlin's friction"):
        sp.contact_wrench(np.zeros(3), UP, 1e-4, still, still, LAW, plain, sp.BristleState())


def test_time_scales_follow_the_stiffness_under_load() -> None:
    depth = 1e-3
    inertia = pin.Inertia.FromSphere(1.0, R)
    scene = held_ball(pin.JointModelTranslation(), depth, STICKS, inertia)
    figures = scene.explain(np.zeros(3)).pairs[0]
    assert "Mindlin, coefficient 1000 at rest" in "".join(figures.modelled)
    deepest = max(depth, figures.impact_depth)
    half = math.pi / math.sqrt(STICKS.tangential_stiffness(disc(deepest)))
    assert figures.shortest_time <= half
    assert STICKS.slip_time(1.0, 1.0, disc(deepest)) == pytest.approx(half)
