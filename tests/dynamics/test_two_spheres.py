"""Spheres on spheres: closed forms, symmetry, conservation, and the ball as a fine mesh."""

import math

import coal
import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin import testing
from sphshell_pin.errors import DeepStart
from tests import models
from tests.dynamics.scenes import FRICTIONS, LAWS, ONE, TWO, in_touch, two_bodies, two_spheres

R, OTHER = ONE.radius, TWO.radius


@pytest.mark.parametrize("turned", [False, True])
def test_depth_normal_and_point_have_closed_forms(turned: bool) -> None:
    scene = two_spheres(sp.ImpactLaw(1e4, 1.5), turned=turned)
    q, _ = in_touch(1)
    balls = [side.sphere for side in scene.pairs[0].spheres]
    places = [models.pose_of(scene.model, q, one.frame) * np.array(one.offset) for one in balls]
    away, found = places[0] - places[1], scene.contacts(q)
    assert np.allclose(found.depth, [R + OTHER - np.linalg.norm(away)], rtol=0, atol=1e-15)
    assert np.allclose(found.normal_world[0], away / np.linalg.norm(away), rtol=0, atol=1e-14)
    expected = places[1] + balls[1].radius * found.normal_world[0]
    assert np.allclose(found.point_world[0], expected, rtol=0, atol=1e-15)
    assert np.allclose(found.normal_force, [1e4 * found.depth[0] ** 1.5], rtol=1e-13)
    assert testing.assert_contacts_found(scene, q) < 1e-12
    testing.assert_wrenches_cancel(scene, q)


def test_two_spheres_with_one_center_are_pushed_along_some_normal() -> None:
    scene = two_spheres(sp.ImpactLaw(1e4, 1.5))
    q = np.concatenate([models.free_q(-np.array(ONE.offset)), models.free_q(-np.array(TWO.offset))])
    found = scene.contacts(q)
    assert np.isclose(np.linalg.norm(found.normal_world[0]), 1.0)
    assert found.depth[0] == R + OTHER
    assert all(np.isfinite(part).all() for part in scene.contact_derivatives(q))


# Of two spheres exchanged, the contact point moves by the depth, which is all that differs: at
# velocities that do not turn the force is the same to rounding.
@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("law", [one for one in LAWS if one != "foundation"])
def test_the_force_is_symmetric(law: str, friction: str) -> None:
    q, v = in_touch(2, spin=0.0)
    forces = []
    for turned in (False, True):
        scene = two_spheres(LAWS[law], FRICTIONS[friction], turned=turned)
        found = scene.contacts(q, v)
        sign = -1.0 if turned else 1.0
        forces.append(sign * np.vstack([found.force_world, found.friction_force_world]))
    assert np.abs(forces[0]).max() > 0
    assert np.allclose(*forces, rtol=1e-12, atol=1e-12 * np.abs(forces[0]).max())


def test_torsion_is_symmetric_and_that_of_the_disc_of_both_radii() -> None:
    # Spun about the normal, a soft finger turns with the moment mu N 3 pi / 16 sqrt(r d), where
    # 1 / r = 1 / r_1 + 1 / r_2 (Johnson, Contact Mechanics, 4.22).
    depth, law = 1e-3, sp.ImpactLaw(1e4, 1.5)
    friction = sp.BristleFriction(0.5, 0.5, 1e5, 1e3, 1e-3, torsional=True)
    q = np.concatenate([models.free_q(np.zeros(3)), models.free_q([0, 0, R + OTHER - depth])])
    radius = R * OTHER / (R + OTHER)
    limit = 0.5 * law.normal_force(depth) * 3 * math.pi / 16 * math.sqrt(radius * depth)
    pair = [sp.Sphere(R, "one"), sp.Sphere(OTHER, "two")]
    for spheres in (pair, pair[::-1]):
        scene = sp.Scene(two_bodies())
        scene.add_contact(*spheres, law=law, friction=friction)
        moment = scene.external_forces(q, 50.0 * np.eye(12)[5])[1].angular[2]
        assert np.isclose(moment, -limit, rtol=1e-12)


@pytest.mark.parametrize("friction", FRICTIONS)
@pytest.mark.parametrize("integrator", [sp.Adaptive(1e-8, 1e-10), sp.Implicit(1e-8, 1e-10)])
def test_an_oblique_impact_keeps_momentum_and_the_energy_audit(friction: str, integrator) -> None:  # type: ignore[no-untyped-def]
    """Of two free balls that hit each other off center, spinning."""
    scene = sp.Scene(two_bodies(pin.Inertia.FromSphere(1.0, R)))
    more = {"law": sp.HuntCrossleyLaw(1e7, 1.5, 0.1), "friction": FRICTIONS[friction]}
    scene.add_contact(sp.Sphere(R, "one"), sp.Sphere(OTHER, "two"), **more)
    q = np.concatenate([models.free_q([0.0, 0.04, 0.01]), models.free_q([0.14, 0.0, 0.0])])
    v = np.array([2.0, 0, 0, 10, 20, -30, -1.0, 0, 0.5, 5, -10, 20])
    result = models.run(scene, integrator, q, v, 0.02)
    (figures,) = result.stats.pairs.values()
    assert figures.touches == 1
    assert result.energy.damping_loss[-1] > 0
    assert (result.energy.friction_loss[-1] > 0) == (friction != "none")
    testing.assert_momentum_kept(result, 1e-10)
    testing.assert_energy_kept(result, 1e-6)


@pytest.mark.parametrize("integrator", [sp.SemiImplicitEuler(1e-2), sp.Adaptive(1e-5)])
@pytest.mark.parametrize("speed", [3.0, 3000.0])
@pytest.mark.filterwarnings("ignore::sphshell_pin.errors.WeakLawWarning")
def test_no_sphere_flies_through_another(integrator, speed: float) -> None:  # type: ignore[no-untyped-def]
    # The center of one crosses that of the other in 0.01 of a step.
    radius, model = 0.01, models.empty(0.0)
    for name in ("one", "two"):
        models.add_body(model, name, pin.JointModelPX(), inertia=pin.Inertia.FromSphere(1.0, 0.01))
    law, scene = models.linear_law(0.5 * (2 * speed / (0.3 * radius)) ** 2), sp.Scene(model)
    scene.add_contact(sp.Sphere(radius, "one"), sp.Sphere(radius, "two"), law=law)
    start, v = [0.0, 2 * radius + 0.2137], [speed, -speed]
    result = models.run(scene, integrator, start, v, 0.4 / speed)
    assert result.q[-1, 1] - result.q[-1, 0] > 2 * radius
    assert result.v[-1, 1] > 0.5 * speed
    assert {event.kind for event in result.events} == {"touch", "lift_off"}


def test_a_deep_start_is_refused_by_the_smaller_radius() -> None:
    scene = two_spheres(sp.ImpactLaw(1e4, 1.5))
    q, v = in_touch(6, depth=0.6 * R)
    with pytest.raises(DeepStart, match=r"radius 0\.05 m"):
        sp.Simulation(scene, sp.Adaptive(1e-6)).run(q, v, 1e-3)
    q, v = in_touch(6, depth=0.4 * R)
    assert len(scene.contacts(q, v)) == 1
    sp.Simulation(scene, sp.Adaptive(1e-6)).run(q, v, 1e-4)


def test_spheres_of_a_geometry_model_collide() -> None:
    model, geometry, law = two_bodies(), pin.GeometryModel(), sp.ImpactLaw(1e4, 1.5)
    for joint, (name, sphere) in enumerate((("a", ONE), ("b", TWO)), 1):
        placement = pin.SE3(np.eye(3), np.array(sphere.offset))
        made = pin.GeometryObject(name, joint, placement, coal.Sphere(sphere.radius))
        geometry.addGeometryObject(made)
    geometry.addCollisionPair(pin.CollisionPair(0, 1))
    scene = sp.Scene.from_geometry(model, geometry, law)
    assert [pair.name for pair in scene.pairs] == ["a-b"]
    q, v = in_touch(8)
    assert np.allclose(scene.contacts(q, v).depth, two_spheres(law).contacts(q, v).depth)
