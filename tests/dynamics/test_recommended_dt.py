"""The step that is recommended: time scales from the forces themselves, and what it resolves."""

import math
import warnings

import numpy as np
import pytest

import sphshell_pin as sp
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


def falling(law: object, gravity: float = 0.0) -> sp.Scene:
    return models.on_plate(models.slider(gravity, MASS), law)


def shortest(scene: sp.Scene, q: list[float], v: list[float]) -> float:
    """Return the shortest time scale [s]; the step is a thirtieth of it, rounded down."""
    explanation = scene.explain(q, v)
    figures, dt = explanation.pairs[0], explanation.recommended_dt
    digits = dt / 10.0 ** math.floor(math.log10(dt * (1 + 1e-9)))
    assert min(abs(digits - one) for one in (1, 2, 5)) < 1e-9
    assert 30 * dt <= figures.shortest_time * (1 + 1e-9) < 30 * 2.5 * dt * (1 + 1e-9)
    return figures.shortest_time


FRICTIONS = {
    "none": None,
    "coulomb": sp.CoulombFriction(0.5, 0.3, 1e-4, 0.1),
    "bristle": sp.BristleFriction(0.5, 0.5, 1e8),
    "damped bristle": sp.BristleFriction(0.5, 0.5, 1e6, 1e6),
    "mindlin": sp.MindlinFriction(0.4, 0.4, 1e9, 0.4),
}


@laws
@pytest.mark.parametrize("friction", FRICTIONS)
def test_the_shortest_time_is_that_of_the_law_or_of_the_friction(law: str, friction: str) -> None:
    """At the larger of the depths of the start and of the impact, under the larger load."""
    slip = FRICTIONS[friction]
    scene = models.on_plate(models.block(mass=MASS), (ELASTIC | DAMPED)[law], slip)
    one = scene.pairs[0].plane_law
    for pressed in (0.0, 2e-3):
        load = max(MASS * 9.81, one.normal_force(pressed))
        times = [one.shortest_time(MASS, SPEED, load)]
        if slip is not None:
            depth = max(one.depth_of(0.5 * MASS * SPEED**2), pressed)
            times.append(slip.slip_time(MASS, load, math.sqrt(RADIUS * depth)))
        found = shortest(scene, [0.0, 0.0, RADIUS - pressed], [0.0, 0.0, -SPEED])
        assert found == pytest.approx(min(times), rel=1e-9)


def test_a_ball_that_rolls_resists_a_slip_with_two_sevenths_of_its_mass() -> None:
    law, friction = sp.ImpactLaw(1e7, 1.0), FRICTIONS["coulomb"]
    ball = models.on_plate(models.ball(mass=MASS), law, friction)
    q = models.free_q([0.0, 0.0, RADIUS - law.depth_at(MASS * 9.81)])
    expected = friction.slip_time(2 / 7 * MASS, MASS * 9.81, 1.0)
    assert shortest(ball, q, [0.0] * 6) == pytest.approx(expected, rel=1e-3)


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
    told = [scene.explain(q, v, dt=share * dt).warnings for share in (1.0001, 1.0002)]
    assert ["recommended" in str(warnings) for warnings in told] == [False, True]
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


def test_the_shortest_of_pairs_and_joints_counts_and_a_thirtieth_is_rounded_down() -> None:
    model = models.slider(0.0, MASS)
    stop = sp.JointLimits(-1.0, 1.0, spring(0.03))
    scene = sp.Scene(model, joints=sp.JointComponents(limits={model.names[1]: stop}))
    assert sp.Scene(models.slider()).explain().recommended_dt == 1e-3
    for time, dt in ((0.3, 1e-3), (0.015001, 5e-4), (0.014999, 2e-4), (0.003001, 1e-4)):
        scene.add_contact(sp.Sphere(RADIUS, "ball"), models.plate(), law=spring(time))
        assert scene.explain([RADIUS], [-SPEED]).recommended_dt == pytest.approx(dt)
    assert any("recommended" in one for one in scene.explain([RADIUS], dt=1.01e-4).warnings)


def test_figures_of_a_spring() -> None:
    rate = math.sqrt(1e5 / MASS)
    one = falling(ELASTIC["linear"], gravity=9.81).explain([RADIUS], [-SPEED]).pairs[0]
    found = one.effective_mass, one.contact_time, one.impact_depth, one.resting_depth
    assert found == pytest.approx((MASS, math.pi / rate, SPEED / rate, 9.81 / rate**2), rel=1e-9)
    assert one.depth_limit_speed == pytest.approx(RADIUS * rate)


def two_bodies(joint: type) -> sp.Scene:
    """Bodies "one", of 1 kg and 0.3 m above, and "two", of 3 kg."""
    model = models.empty(9.81)
    for name, mass, z in (("one", 1.0, 0.3), ("two", 3.0, 0.0)):
        inertia = models.pin.Inertia.FromSphere(mass, RADIUS)
        at = models.pin.SE3(np.eye(3), np.array([0.0, 0.0, z]))
        models.add_body(model, name, joint(), placement=at, inertia=inertia)
    return sp.Scene(model)


def pair_of(model, *given, **more) -> sp.Scene:
    scene = sp.Scene(model)
    scene.add_contact(*given, law=ELASTIC["linear"], **more)
    return scene


def two_balls(joint: type) -> sp.Scene:
    return pair_of(two_bodies(joint).model, sp.Sphere(0.05, "one"), sp.Sphere(0.08, "two"))


def on_a_slide(side: str) -> sp.Scene:
    """A shell that moves, turned in its frame, met by a sphere on another slide."""
    model = models.empty(0.0)
    for name, mass in (("ball", 1.0), ("table", 3.0)):
        inertia = models.pin.Inertia.FromSphere(mass, RADIUS)
        models.add_body(model, name, models.pin.JointModelPX(), inertia=inertia)
    turn = models.pin.SE3(models.pin.utils.rpyToMatrix(0.0, math.pi / 2, 0.0), np.zeros(3))
    sphere = sp.Sphere(RADIUS, "ball", (0.02, 0.0, 0.0))
    return pair_of(model, sphere, models.plate(side=side), "table", turn)


def sided(side: str, height: float) -> float:
    """The height over a shell on the side that counts."""
    return {"both": abs(height), "outside": height, "inside": -height}[side]


PZ, FREE = models.pin.JointModelPZ, models.pin.JointModelTranslation
FALL = math.sqrt(2 * 9.81 * 0.17)
# A scene, q, v; its gap, effective mass and speed of approach. Two bodies have the reduced mass.
FIGURES = [
    *(
        (lambda gravity=g: falling(ELASTIC["linear"], gravity=gravity), [RADIUS + gap], [v])
        + (gap, MASS, speed)
        for gap, v, g, speed in (
            (0.02, 0.0, 9.81, math.sqrt(2 * 9.81 * 0.02)),
            (0.02, 1.0, 9.81, 1.0),
            (0.02, -1.0, 9.81, 1.0),
            (-0.001, 0.0, 9.81, 0.1),
            (0.02, 0.0, 0.0, 0.1),
        )
    ),
    (lambda: two_balls(PZ), [0.0, 0.0], [-0.7, 0.2], 0.17, 0.75, FALL),
    # Of one center: pushed apart along z.
    (lambda: two_balls(FREE), [0.0, 0.0, -0.3, 0, 0, 0])
    + ([0.4, 0.5, -0.7, 0.1, 0.3, 0.2], -0.13, 0.75, 0.9),
    # Where the center lies on the surface the normal is the surface's.
    *(
        (lambda side=side: on_a_slide(side), [x, 0.0], [-0.3, 0.2])
        + (sided(side, x + 0.02) - RADIUS, 0.75, 0.5)
        for side in ("both", "outside", "inside")
        for x in (0.03, -0.02, -0.08)
    ),
]


@pytest.mark.parametrize(("make", "q", "v", "gap", "mass", "speed"), FIGURES)
def test_gap_mass_and_speed_of_approach(make, q, v, gap, mass, speed) -> None:
    scene = make()
    one = scene.explain(q, v).pairs[0]
    found = (one.gap, one.effective_mass, one.approach_speed)
    assert found == pytest.approx((gap, mass, speed), rel=1e-9, abs=1e-12)
    weight = mass * float(np.linalg.norm(scene.model.gravity.linear))
    depth = scene.pairs[0].law.depth_at(weight)
    assert one.resting_depth == pytest.approx(depth, rel=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_bodies_that_turn_and_are_met_off_their_centers(seed: int) -> None:
    """Mobility 1 / m - [r] I^-1 [r] of each, r from its center of mass to the contact."""
    friction = sp.BristleFriction(0.5, 0.5, 1e12)
    scene, (q, v) = two_spheres(ELASTIC["linear"], friction), in_touch(seed)
    pair = scene.explain(q, v).pairs[0]
    places = [models.pin.XYZQUATToSE3(q[k : k + 7]) for k in (0, 7)]
    spheres = [side.sphere for side in scene.pairs[0].spheres]
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
    found = pair.gap, pair.effective_mass, pair.approach_speed
    expected = -0.004, 1 / (normal @ mobility @ normal), abs(closing)
    assert found == pytest.approx(expected, rel=1e-9)
    across = np.eye(3) - np.outer(normal, normal)
    slip_mass = 1 / np.linalg.eigvalsh(across @ mobility @ across).max()
    assert pair.shortest_time == pytest.approx(math.pi * math.sqrt(slip_mass / 1e12), rel=1e-9)


def test_what_does_not_move_at_all_has_no_mass() -> None:
    """Nor has what is heavier than a mountain."""
    sphere, friction = sp.Sphere(RADIUS, "universe", (0.0, 0.0, 0.04)), FRICTIONS["bristle"]
    explained = pair_of(models.empty(), sphere, models.plate(), friction=friction).explain()
    assert math.isnan(explained.pairs[0].effective_mass)
    assert (explained.pairs[0].shortest_time, explained.recommended_dt) == (math.inf, 1e-3)
    for mass, moves in ((0.75e12, True), (1e12, False), (1.5e12, False)):
        heavy = models.on_plate(models.slider(0.0, mass), ELASTIC["linear"])
        assert math.isfinite(heavy.explain([RADIUS]).pairs[0].effective_mass) == moves


def source(points: list, depths: list, friction: sp.BristleFriction | None = None) -> sp.Scene:
    scene = sp.Scene(models.slider(0.0, MASS))
    find = lambda i, j: (points, [[0.0, 0.6, 0.8]] * len(depths), depths)  # noqa: E731
    scene.add_contact_source(find, "ball", "universe", ELASTIC["linear"], friction, name="own")
    return scene


def test_a_source_counts_where_it_is_deepest() -> None:
    pair = source([[0, 0, 0], [0.1, 0, 0]], [1e-3, 4e-3]).explain([0.0], [-SPEED]).pairs[0]
    # The slide holds the ball across: along the normal it weighs 1 / 0.8^2 of its mass.
    found = pair.gap, pair.effective_mass, pair.approach_speed
    assert found == pytest.approx((-4e-3, MASS / 0.64, 0.8 * SPEED), rel=1e-12)
    assert math.isnan(pair.depth_limit_speed)
    bristles = sp.BristleFriction(0.5, 0.5, 1e9)
    pair = source([[0, 0, 0]], [1e-3], bristles).explain([0.0]).pairs[0]
    # Across the normal it weighs 1 / 0.6^2 of its mass.
    ring = math.pi * math.sqrt(MASS / 0.36 / 1e9)
    assert pair.shortest_time == pytest.approx(ring, rel=1e-9)
    nothing = source([], []).explain([0.0])
    assert np.isnan([nothing.pairs[0].gap, nothing.pairs[0].effective_mass]).all()
    assert nothing.recommended_dt == 1e-3


def test_what_cannot_move_along_the_normal_has_no_time_scales() -> None:
    """A slide along the plate: only its friction rings."""
    model = models.ball(mass=MASS, joint=models.pin.JointModelPX())
    scene = models.on_plate(model, ELASTIC["linear"])
    explained = scene.explain()
    assert math.isnan(explained.pairs[0].effective_mass)
    assert explained.recommended_dt == 1e-3
    assert any("neither body can move along the normal" in one for one in explained.warnings)
    scene.replace_pair("ball-plate", friction=sp.BristleFriction(0.5, 0.5, 1e6))
    found = scene.explain().pairs[0].shortest_time
    assert found == pytest.approx(math.pi * math.sqrt(MASS / 1e6), rel=1e-9)


@pytest.mark.parametrize("speed", [0.02, 2.0])
def test_the_disc_of_mindlin_is_that_of_both_spheres(speed: float) -> None:
    """At the larger of the depths of the start and of the impact."""
    scene, law = two_bodies(models.pin.JointModelTranslation), sp.ImpactLaw(1e6, 1.0)
    friction = sp.MindlinFriction(0.4, 0.4, 1e9, 0.4)
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

    law, dry = sp.ImpactLaw(1e6, 2.0), sp.JointFriction(3.0, stiffness=4e4)
    stop, ring = sp.JointLimits(-1.0, 1.0, law), math.pi * math.sqrt(MASS / 4e4)
    assert scale(damping=3.0) == math.inf
    assert scale(friction=dry) == pytest.approx(ring, rel=1e-12)
    for speed in (0.01, 50.0):
        impact = law.contact_time(law.depth_of(0.5 * MASS * speed**2), speed)
        assert scale(limits=stop, speed=speed) == pytest.approx(impact, rel=1e-12)
        both = scale(limits=stop, speed=speed, friction=dry)
        assert both == pytest.approx(min(ring, impact), rel=1e-12)


@pytest.mark.parametrize(("share", "weak"), [(1 - 1e-9, False), (1 + 1e-9, True)])
def test_a_law_is_weak_whose_depth_would_reach_the_radius(share: float, weak: bool) -> None:
    speed = share * RADIUS * math.sqrt(1e5 / MASS)
    told = falling(ELASTIC["linear"]).explain([RADIUS], [-speed]).warnings
    assert any("the law cannot stop the sphere" in one for one in told) == weak


@pytest.mark.parametrize(("share", "soft"), [(0.08, False), (0.15, True), (0.3, True)])
def test_a_law_in_which_a_body_sinks_by_a_tenth_of_its_radius_is_soft(share, soft) -> None:
    scene = falling(models.linear_law(MASS * 9.81 / (share * RADIUS), 10.0), gravity=9.81)
    told = [one for one in scene.explain([RADIUS]).warnings if "soft for this mass" in one]
    assert len(told) == soft
    assert all(f"at rest the depth is {share:.0%} of the radius" in one for one in told)
