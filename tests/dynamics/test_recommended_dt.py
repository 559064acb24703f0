"""The step that is recommended: time scales from the forces themselves, and what it resolves."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.dynamics.scene.explain import _round_down, relaxation_time, weakness
from sphshell_pin.errors import SetupWarning
from tests import models
from tests.dynamics.scenes import in_touch, two_spheres

RADIUS, MASS, SPEED = 0.05, 0.7, 0.4
STEEL = {"young": 2e8, "poisson": 0.3}
# Damped so heavily that their decay is the shortest time scale.
DAMPED = {
    "impact": sp.ImpactLaw(1e5, 1.5, 3e4, 1e-6),
    "impact, a part of its damping": sp.ImpactLaw(1e5, 1.0, 3e5, 4 * SPEED * math.sqrt(MASS / 1e5)),
    "hunt-crossley": sp.HuntCrossleyLaw(1e6, 1.5, 80.0),
    "hertz": sp.HertzLaw(**STEEL, restitution=0.01, speed=0.01, radius=RADIUS),
    "foundation": sp.FoundationLaw(1e7, 0.05, 60.0),
    "viscoelastic": sp.HertzLaw(**STEEL, loss_tangent=0.5, frequency=3.0, radius=RADIUS),
}
TABLE = sp.TableLaw([0.0, 1e-3, 2e-3, 3e-3], [0.0, 80.0, 200.0, 360.0])
ELASTIC = {
    "linear": sp.ImpactLaw(1e5, 1.0),
    "power": sp.ImpactLaw(1e6, 2.2),
    "table": TABLE,
    "layer": sp.FoundationLaw(1e7, 0.05),
}
laws = pytest.mark.parametrize("law", ELASTIC | DAMPED)


def falling(law: object, friction: object = None, gravity: float = 0.0) -> sp.Scene:
    return models.on_plate(models.slider(gravity, MASS), law, friction)


def block(law: object, friction: object) -> sp.Scene:
    """A mass that slides but does not turn, at rest on a plate."""
    model = models.empty()
    inertia = models.pin.Inertia.FromSphere(MASS, RADIUS)
    models.add_body(model, "ball", models.pin.JointModelTranslation(), inertia=inertia)
    return models.on_plate(model, law, friction)


def shortest(scene: sp.Scene, q: list[float], v: list[float]) -> float:
    """Return the shortest time scale [s]; the step is a thirtieth of it, rounded down."""
    explanation = scene.explain(q, v)
    figures, dt = explanation.pairs[0], explanation.recommended_dt
    digits = dt / 10.0 ** math.floor(math.log10(dt * (1 + 1e-9)))
    assert min(abs(digits - one) for one in (1, 2, 5)) < 1e-9
    assert 30 * dt <= figures.shortest_time * (1 + 1e-9) < 30 * 2.5 * dt * (1 + 1e-9)
    return figures.shortest_time


@pytest.mark.parametrize("law", DAMPED)
def test_the_decay_follows_from_the_force(law: str) -> None:
    """20 decays at the largest depth: a mass on a damper c slows down by e in m / c."""
    scene = falling(DAMPED[law])
    one = scene.pairs[0].plane_law
    depth = one.depth_of(0.5 * MASS * SPEED**2)
    h = 1e-7
    damping = (one.normal_force(depth, -h) - one.normal_force(depth, h)) / (2 * h)
    found = shortest(scene, [RADIUS], [-SPEED])
    assert found == pytest.approx(20 * MASS / damping, rel=1e-6)
    assert found < 0.5 * one.contact_time(depth, SPEED)


@pytest.mark.parametrize("law", ELASTIC)
def test_without_damping_it_is_the_contact_time(law: str) -> None:
    """That of a run with error control."""
    scene = falling(ELASTIC[law])
    run = sp.Simulation(scene, sp.Adaptive(1e-9)).run([RADIUS + 1e-4], [-SPEED], 0.2)
    contact_time = run.stats.pairs["ball-plate"].contact_time
    assert shortest(scene, [RADIUS], [-SPEED]) == pytest.approx(contact_time, rel=2e-3)


@pytest.mark.parametrize(("pressed", "gravity"), [(5e-3, 9.81), (0.0, 2500.0 / MASS)])
def test_under_load_it_is_half_an_oscillation(pressed: float, gravity: float) -> None:
    law = sp.ImpactLaw(1e8, 2.0)
    depth = 5e-3  # where it is pressed or comes to rest, far deeper than an impact at 0.1 m/s
    scene = falling(law, gravity=gravity)
    half = math.pi * math.sqrt(MASS / (2 * 1e8 * depth))
    assert shortest(scene, [RADIUS - pressed], [0.0]) == pytest.approx(half, rel=1e-6)


def test_slow_slip_of_coulomb_friction_decays_under_the_load() -> None:
    law, friction = sp.ImpactLaw(1e7, 1.0), sp.CoulombFriction(0.5, 0.3, 1e-4, 0.1)
    load = MASS * 9.81
    slow = 1e-6 * friction.v_static
    damping = load * friction.coefficient(slow) / slow
    found = shortest(block(law, friction), [0.0, 0.0, RADIUS - law.depth_at(load)], [0.0] * 3)
    assert found == pytest.approx(20 * MASS / damping, rel=1e-4)
    pressed = [0.0, 0.0, RADIUS - law.depth_at(2 * load)]
    assert shortest(block(law, friction), pressed, [0.0] * 3) == pytest.approx(found / 2, rel=1e-4)
    # A ball rolls: 2/7 of its mass resist a slip.
    ball = models.on_plate(models.ball(mass=MASS), law, friction)
    q = models.free_q([0.0, 0.0, RADIUS - law.depth_at(load)])
    assert shortest(ball, q, [0.0] * 6) == pytest.approx(2 / 7 * found, rel=1e-3)


@pytest.mark.parametrize(
    ("friction", "time"),
    [
        (sp.BristleFriction(0.5, 0.5, 1e6), math.pi * math.sqrt(MASS / 1e6)),
        (sp.BristleFriction(0.5, 0.5, 1e6, 1e5), 20 * MASS / 1e5),
    ],
)
def test_bristles_ring_or_decay(friction: sp.BristleFriction, time: float) -> None:
    law = sp.ImpactLaw(1e4, 1.0)
    q = [0.0, 0.0, RADIUS - law.depth_at(MASS * 9.81)]
    assert shortest(block(law, friction), q, [0.0] * 3) == pytest.approx(time, rel=1e-6)


@laws
def test_the_recommended_step_resolves_an_impact(law: str) -> None:
    one = (ELASTIC | DAMPED)[law]
    scene = falling(one)
    q, v = [RADIUS + 1e-4], [-SPEED]
    explained = scene.explain(q, v)
    dt, end = explained.recommended_dt, min(0.2, 20 * explained.pairs[0].contact_time)
    fine = sp.Simulation(scene, sp.Adaptive(1e-9)).run(q, v, end)
    coarse = sp.Simulation(scene, sp.SemiImplicitEuler(dt)).run(q, v, end)
    assert coarse.v[-1, 0] == pytest.approx(fine.v[-1, 0], abs=0.05 * SPEED)
    peaks = [run.stats.pairs["ball-plate"].peak_force for run in (coarse, fine)]
    assert peaks[0] == pytest.approx(peaks[1], rel=0.15)


def test_a_run_warns_in_the_words_of_the_explanation() -> None:
    scene = falling(ELASTIC["linear"])
    q, v = [RADIUS], [-SPEED]
    dt = 50 * scene.explain(q, v).recommended_dt
    (sentence,) = (one for one in scene.explain(q, v, dt=dt).warnings if "recommended" in one)
    shortest_time = scene.explain(q, v).pairs[0].shortest_time
    assert f"would get {shortest_time / dt:.2g} steps" in sentence
    with pytest.warns(SetupWarning) as caught:
        sp.Simulation(scene, sp.SemiImplicitEuler(dt)).run(q, v, 10 * dt)
    assert [str(one.message) for one in caught] == [sentence]
    assert caught[0].filename == __file__


def test_steps_that_are_short_enough_earn_no_warning() -> None:
    scene = falling(ELASTIC["linear"])
    q, v = [RADIUS], [-SPEED]
    dt = scene.explain(q, v).recommended_dt
    for share, count in ((1.0001, 0), (1.0002, 1)):
        said = scene.explain(q, v, dt=share * dt).warnings
        assert sum("recommended" in one for one in said) == count
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sp.Simulation(scene, sp.SemiImplicitEuler(dt)).run(q, v, 10 * dt)
        # No stiffness limits these.
        for integrator in (sp.LinearlyImplicitEuler(50 * dt), sp.Adaptive(), sp.Implicit()):
            sp.Simulation(scene, integrator).run(q, v, 10 * dt)
        free = sp.Scene(models.slider())
        sp.Simulation(free, sp.SemiImplicitEuler(0.1)).run([0.0], np.ones(1), 1.0)


def spring(time: float) -> sp.ImpactLaw:
    """A spring that the mass touches for `time` [s]."""
    return sp.ImpactLaw(MASS * (math.pi / time) ** 2, 1.0)


@pytest.mark.parametrize(("dt", "below"), [(1e-4, 5e-5), (2e-4, 1e-4), (5e-4, 2e-4)])
def test_a_thirtieth_is_rounded_down(dt: float, below: float) -> None:
    for share, expected in ((1 + 1e-7, dt), (1 - 1e-7, below)):
        scene = falling(spring(30 * dt * share))
        assert scene.explain([RADIUS], [-SPEED]).recommended_dt == pytest.approx(expected)
    assert any("recommended" in one for one in scene.explain([RADIUS], dt=1.01 * below).warnings)


def test_the_shortest_of_pairs_and_joints_counts() -> None:
    stop = sp.JointLimits(-1.0, 1.0, spring(0.03))
    model = models.slider(0.0, MASS)
    joints = sp.JointComponents(limits={str(model.names[1]): stop})
    scene = sp.Scene(model, joints=joints)
    assert sp.Scene(models.slider()).explain().recommended_dt == 1e-3
    for time, dt in ((0.3, 1e-3), (0.0151, 5e-4), (0.00301, 1e-4), (0.0061, 1e-4)):
        scene.add_contact(sp.Sphere(RADIUS, "ball"), models.plate(), law=spring(time))
        assert scene.explain([RADIUS], [-SPEED]).recommended_dt == pytest.approx(dt)


def test_figures_of_a_spring() -> None:
    rate = math.sqrt(1e5 / MASS)
    one = falling(sp.ImpactLaw(1e5, 1.0), gravity=9.81).explain([RADIUS], [-SPEED]).pairs[0]
    found = (one.effective_mass, one.contact_time, one.impact_depth, one.resting_depth)
    assert found == pytest.approx((MASS, math.pi / rate, SPEED / rate, 9.81 / rate**2), rel=1e-9)
    assert one.depth_limit_speed == pytest.approx(RADIUS * rate)


@pytest.mark.parametrize(
    ("gap", "v", "gravity", "speed"),
    [
        (0.02, 0.0, 9.81, math.sqrt(2 * 9.81 * 0.02)),
        (0.02, 1.0, 9.81, 1.0),
        (0.02, -1.0, 9.81, 1.0),
        (-0.001, 0.0, 9.81, 0.1),
        (0.02, 0.0, 0.0, 0.1),
    ],
)
def test_speed_of_approach(gap: float, v: float, gravity: float, speed: float) -> None:
    one = falling(ELASTIC["linear"], gravity=gravity).explain([RADIUS + gap], [v]).pairs[0]
    assert (one.gap, one.approach_speed) == pytest.approx((gap, speed), rel=1e-9)


@pytest.mark.parametrize(
    ("side", "gaps"),
    [("both", (0.01, 0.01)), ("outside", (0.01, -0.11)), ("inside", (-0.11, 0.01))],
)
def test_the_gap_is_on_the_side_of_the_shell(side: str, gaps: tuple[float, float]) -> None:
    scene = models.on_plate(models.slider(), ELASTIC["linear"], shell=models.plate(side=side))
    found = [scene.explain([z]).pairs[0].gap for z in (0.06, -0.06)]
    assert found == pytest.approx(gaps)


def two_bodies(joint: type) -> sp.Scene:
    """Bodies "one", of 1 kg and 0.3 m above, and "two", of 3 kg."""
    model = models.empty(9.81)
    for name, mass, z in (("one", 1.0, 0.3), ("two", 3.0, 0.0)):
        inertia = models.pin.Inertia.FromSphere(mass, RADIUS)
        at = models.pin.SE3(np.eye(3), np.array([0.0, 0.0, z]))
        models.add_body(model, name, joint(), placement=at, inertia=inertia)
    return sp.Scene(model)


def test_two_bodies_have_the_reduced_mass_and_the_relative_speed() -> None:
    scene, law = two_bodies(models.pin.JointModelPZ), ELASTIC["linear"]
    scene.add_contact(sp.Sphere(0.05, "one"), sp.Sphere(0.08, "two"), law=law)
    scene.add_contact(sp.Sphere(0.05, "two"), sp.Sphere(0.08, "one"), law=law, name="turned")
    for pair in scene.explain([0.0, 0.0], [-0.7, 0.2]).pairs:
        found = (pair.gap, pair.effective_mass, pair.approach_speed)
        assert found == pytest.approx((0.17, 0.75, max(0.9, math.sqrt(2 * 9.81 * 0.17))), rel=1e-9)
        weight = 0.75 * 9.81
        assert pair.resting_depth == pytest.approx(law.depth_at(weight), rel=1e-9)
    # Of one center: pushed apart along z.
    scene = two_bodies(models.pin.JointModelTranslation)
    scene.add_contact(sp.Sphere(0.05, "one"), sp.Sphere(0.08, "two"), law=law)
    pair = scene.explain([0.0, 0.0, -0.3, 0, 0, 0], [0.4, 0.5, -0.7, 0.1, 0.3, 0.2]).pairs[0]
    found = (pair.gap, pair.effective_mass, pair.approach_speed)
    assert found == pytest.approx((-0.13, 0.75, 0.9), rel=1e-9)


@pytest.mark.parametrize("side", ["both", "outside", "inside"])
def test_a_shell_that_moves_is_met_in_its_own_frame(side: str) -> None:
    """And where the center lies on the surface the normal is the surface's."""
    model = models.empty(0.0)
    turn = models.pin.SE3(models.pin.utils.rpyToMatrix(0.0, math.pi / 2, 0.0), np.zeros(3))
    for name, mass in (("ball", 1.0), ("table", 3.0)):
        inertia = models.pin.Inertia.FromSphere(mass, RADIUS)
        models.add_body(model, name, models.pin.JointModelPX(), inertia=inertia)
    scene = sp.Scene(model)
    shell = models.plate(side=side)
    sphere = sp.Sphere(RADIUS, "ball", (0.02, 0.0, 0.0))
    scene.add_contact(sphere, shell, "table", turn, law=ELASTIC["linear"])
    for x in (0.03, -0.02):
        pair = scene.explain([x, 0.0], [-0.3, 0.2]).pairs[0]
        height = x + 0.02
        distance = -height if side == "inside" else height
        found = (pair.gap, pair.effective_mass, pair.approach_speed)
        assert found == pytest.approx((distance - RADIUS, 0.75, 0.5), rel=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_bodies_that_turn_and_are_met_off_their_centers(seed: int) -> None:
    """Mobility 1 / m - [r] I^-1 [r] of each, r from its center of mass to the contact."""
    friction = sp.BristleFriction(0.5, 0.5, 1e12)
    scene, (q, v) = two_spheres(ELASTIC["linear"], friction), in_touch(seed)
    pair = scene.explain(q, v).pairs[0]
    places = [models.pin.XYZQUATToSE3(q[k : k + 7]) for k in (0, 7)]
    spheres = (scene.pairs[0].sphere, scene.pairs[0].other_sphere)
    one, two = (at * np.array(sphere.offset) for at, sphere in zip(places, spheres, strict=True))
    normal = (one - two) / np.linalg.norm(one - two)
    point = two + spheres[1].radius * normal
    mobility, closing = np.zeros((3, 3)), 0.0
    for k, at in enumerate(places):
        inertia = scene.model.inertias[k + 1]
        arm = models.pin.skew(point - at * inertia.lever)
        about = at.rotation @ inertia.inertia @ at.rotation.T
        mobility += np.eye(3) / inertia.mass - arm @ np.linalg.solve(about, arm)
        linear, spin = (at.rotation @ part for part in np.split(v[6 * k : 6 * k + 6], 2))
        closing += (1 - 2 * k) * normal @ (linear + np.cross(spin, point - at.translation))
    found = (pair.gap, pair.effective_mass, pair.approach_speed)
    expected = (-0.004, 1 / (normal @ mobility @ normal), abs(closing))
    assert found == pytest.approx(expected, rel=1e-9)
    across = np.eye(3) - np.outer(normal, normal)
    slip_mass = 1 / np.linalg.eigvalsh(across @ mobility @ across).max()
    assert pair.shortest_time == pytest.approx(math.pi * math.sqrt(slip_mass / 1e12), rel=1e-9)


def test_beside_a_border_the_normal_leads_to_the_center() -> None:
    sphere = sp.Sphere(RADIUS, "ball", (0.53, 0.0, 0.04))
    scene = sp.Scene(models.slider(0.0, MASS))
    scene.add_contact(sphere, models.plate(), law=ELASTIC["linear"])
    pair = scene.explain([0.0], [-0.5]).pairs[0]
    found = (pair.gap, pair.effective_mass, pair.approach_speed)
    assert found[1:] == pytest.approx((MASS / 0.64, 0.4), rel=1e-9)
    assert pair.gap == pytest.approx(0.0, abs=1e-12)


def test_what_does_not_move_at_all_has_no_mass() -> None:
    scene = sp.Scene(models.empty())
    sphere = sp.Sphere(RADIUS, "universe", (0.0, 0.0, 0.04))
    friction = sp.BristleFriction(0.5, 0.5, 1e6)
    scene.add_contact(sphere, models.plate(), law=ELASTIC["linear"], friction=friction)
    explained = scene.explain()
    assert math.isnan(explained.pairs[0].effective_mass)
    assert (explained.pairs[0].shortest_time, explained.recommended_dt) == (math.inf, 1e-3)


@pytest.mark.parametrize(("mass", "moves"), [(0.75e12, True), (1e12, False), (1.5e12, False)])
def test_what_is_heavier_than_a_mountain_does_not_move(mass: float, moves: bool) -> None:
    pair = models.on_plate(models.slider(0.0, mass), ELASTIC["linear"]).explain([RADIUS]).pairs[0]
    assert math.isfinite(pair.effective_mass) == moves


def test_rounding_forgives_rounding() -> None:
    for digit, below in ((1.0, 0.5), (2.0, 1.0), (5.0, 2.0)):
        assert _round_down(digit * (1 - 0.75e-12)) == digit
        assert _round_down(digit * (1 - 1.5e-12)) == below
        assert _round_down(digit) == digit


def source(points: list, depths: list, friction: sp.BristleFriction | None = None) -> sp.Scene:
    scene = sp.Scene(models.slider(0.0, MASS))
    normals = np.tile([0.0, 0.6, 0.8], (len(depths), 1))
    find = lambda i, j: (np.array(points), normals, depths)  # noqa: E731
    law = sp.ImpactLaw(1e5, 1.0)
    scene.add_contact_source(find, "ball", "universe", law, friction, name="own")
    return scene


def test_a_source_counts_where_it_is_deepest() -> None:
    scene = source([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]], [1e-3, 4e-3])
    pair = scene.explain([0.0], [-SPEED]).pairs[0]
    # The slide holds the ball across: along the normal it weighs 1 / 0.8^2 of its mass.
    found = (pair.gap, pair.effective_mass, pair.approach_speed)
    assert found == pytest.approx((-4e-3, MASS / 0.64, 0.8 * SPEED), rel=1e-12)
    assert math.isnan(pair.depth_limit_speed)
    bristles = sp.BristleFriction(0.5, 0.5, 1e9)
    pair = source([[0.0, 0.0, 0.0]], [1e-3], bristles).explain([0.0]).pairs[0]
    # Across the normal it weighs 1 / 0.6^2 of its mass.
    ring = math.pi * math.sqrt(MASS / 0.36 / 1e9)
    assert pair.shortest_time == pytest.approx(ring, rel=1e-9)
    nothing = source([], []).explain([0.0])
    pair = nothing.pairs[0]
    assert all(map(math.isnan, (pair.gap, pair.effective_mass, pair.contact_time)))
    assert (pair.shortest_time, nothing.recommended_dt) == (math.inf, 1e-3)


def test_what_cannot_move_along_the_normal_has_no_time_scales() -> None:
    """A slide along the plate: only its friction rings."""
    model = models.empty()
    inertia = models.pin.Inertia.FromSphere(MASS, RADIUS)
    models.add_body(model, "ball", models.pin.JointModelPX(), inertia=inertia)
    scene = models.on_plate(model, ELASTIC["linear"])
    explained = scene.explain()
    assert math.isnan(explained.pairs[0].effective_mass)
    assert explained.recommended_dt == 1e-3
    assert any("neither body can move along the normal" in one for one in explained.warnings)
    scene.replace_pair("ball-plate", friction=sp.BristleFriction(0.5, 0.5, 1e6))
    found = scene.explain().pairs[0].shortest_time
    assert found == pytest.approx(math.pi * math.sqrt(MASS / 1e6), rel=1e-9)
    friction = sp.BristleFriction.mindlin(0.5, None, 1e9, 0.3)
    below = models.pin.SE3(np.eye(3), np.array([0.0, 0.0, -2 * RADIUS]))
    apart = models.on_plate(model, ELASTIC["linear"], friction, placement=below)
    assert apart.explain().pairs[0].shortest_time == math.inf


def test_a_lever_weighs_by_its_arm() -> None:
    """A link of inertia I on a hinge, its tip L away: I / L^2, at L w."""
    model = models.empty(0.0)
    inertia = models.pin.Inertia(1.0, np.zeros(3), np.diag([0.1, 0.2, 0.3]))
    tip = models.pin.SE3(np.eye(3), np.array([0.4, 0.0, 0.06]))
    at = models.pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.0]))
    joint = models.pin.JointModelRY()
    models.add_body(model, "ball", joint, placement=at, inertia=inertia, frame=tip)
    pair = models.on_plate(model, ELASTIC["linear"]).explain([0.0], [0.5]).pairs[0]
    found = (pair.gap, pair.effective_mass, pair.approach_speed)
    assert found == pytest.approx((0.01, 0.2 / 0.4**2, 0.4 * 0.5), rel=1e-9)


@pytest.mark.parametrize("speed", [0.02, 2.0])
def test_the_disc_of_mindlin_is_that_of_both_spheres(speed: float) -> None:
    """At the larger of the depths of the start and of the impact."""
    scene, law = two_bodies(models.pin.JointModelTranslation), sp.ImpactLaw(1e6, 1.0)
    friction = sp.BristleFriction.mindlin(0.4, None, 1e9, 0.4)
    scene.add_contact(sp.Sphere(0.2, "one"), sp.Sphere(0.1, "two"), law=law, friction=friction)
    for pressed in (-1e-3, 1e-3):
        q, v = [0.0, 0.0, -pressed, 0.0, 0.0, 0.0], [0.0, 0.0, -speed, 0.0, 0.0, 0.0]
        pair = scene.explain(q, v).pairs[0]
        disc = math.sqrt(max(pair.impact_depth, pressed) / (1 / 0.2 + 1 / 0.1))
        expected = friction.slip_time(0.75, 1.0, disc)
        assert pair.shortest_time == pytest.approx(expected, rel=1e-9)


def test_joints_have_scales_of_their_own() -> None:
    """Half a period of a stop at the joint's speed limit, and of the spring of dry friction."""
    model = models.slider(0.0, MASS)
    name = str(model.names[1])

    def scale(**parts: object) -> float:
        joints = sp.JointComponents(**{key: {name: value} for key, value in parts.items()})
        return joints.time_scales(model).get(name, math.inf)

    stop = sp.JointLimits(-1.0, 1.0, sp.ImpactLaw(1e6, 2.0))
    dry = sp.JointFriction(3.0, stiffness=4e4)
    law, ring = stop.law, math.pi * math.sqrt(MASS / 4e4)

    def impact(speed: float) -> float:
        return law.contact_time(law.depth_of(0.5 * MASS * speed**2), speed)

    assert scale(damping=3.0) == math.inf
    assert scale(friction=dry) == pytest.approx(ring, rel=1e-12)
    assert scale(limits=stop, speed=2.0) == pytest.approx(impact(2.0), rel=1e-12)
    assert scale(limits=stop, speed=0.01) == pytest.approx(impact(0.01), rel=1e-12)
    assert scale(limits=stop, speed=0.01, friction=dry) == pytest.approx(ring, rel=1e-12)
    assert scale(limits=stop, speed=50.0, friction=dry) == pytest.approx(impact(50.0), rel=1e-12)


def test_relaxation_and_weakness_follow_the_speed_that_the_law_can_stop() -> None:
    for stiffness in (1e4, 1e12):
        pair = (scene := falling(sp.ImpactLaw(stiffness, 1.0))).pairs[0]
        limit = RADIUS * math.sqrt(stiffness / MASS)
        figures = scene.explain([RADIUS], [-(1 - 1e-9) * limit]).pairs[0]
        assert weakness(pair, figures) is None
        expected = min(0.02 * math.pi * math.sqrt(MASS / stiffness), 2e-5)
        assert relaxation_time(pair, figures) == pytest.approx(expected, rel=1e-9)
        figures = scene.explain([RADIUS], [-(1 + 1e-9) * limit]).pairs[0]
        assert "the law cannot stop the sphere" in str(weakness(pair, figures))
        assert weakness(pair, replace(figures, impact_depth=RADIUS)) is not None
        assert relaxation_time(pair, replace(figures, depth_limit_speed=math.nan)) == 2e-5
    pair = (scene := falling(TABLE)).pairs[0]
    unknown = replace(scene.explain([RADIUS]).pairs[0], depth_limit_speed=math.nan)
    assert relaxation_time(pair, unknown) == 2e-5
    own = source([[0.0, 0.0, 0.0]], [1e-3])
    assert relaxation_time(own.pairs[0], own.explain([0.0]).pairs[0]) == 2e-5
