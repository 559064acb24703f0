"""The adapter of PyBullet against closed forms and Pinocchio."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

pytest.importorskip("pybullet")

from sphshell_pin.benchmarks.peers import scenes
from sphshell_pin.benchmarks.peers.merged import merged_urdf
from sphshell_pin.benchmarks.peers.pybullet import PyBullet

PARAMS = {"dt": 1e-3, "breaking": 1e-4}


@pytest.fixture(scope="module")
def engine():
    return PyBullet()


def coarse(scene, **changes):
    """Return the scene on a small plate of large triangles: quick to load."""
    return replace(scene, surface=scenes.shapes.plate(0.06, 0.02), **changes)


def test_free_flight_is_a_parabola_in_real_units(engine):
    velocity, spin = np.array([0.3, -0.2, 0.5]), np.array([4.0, 5.0, -6.0])
    scene = coarse(
        scenes.plate(),
        rolls=True,
        position=(0.0, 0.0, 0.2),
        velocity=tuple(velocity),
        angular_velocity=tuple(spin),
        duration=0.1,
    )
    found = engine.run(scene, PARAMS)
    assert found.steps == 100
    np.testing.assert_allclose(found.t[-1], 0.1)
    # Semi-implicit Euler falls by dt * t / 2 * g further than the parabola.
    fall = -0.5 * 9.81 * found.t * (found.t + PARAMS["dt"])
    exact = [0, 0, 0.2] + np.outer(found.t, velocity)
    exact[:, 2] += fall
    np.testing.assert_allclose(found.position, exact, atol=1e-9)
    np.testing.assert_allclose(found.velocity[-1], velocity + [0, 0, -0.981], atol=1e-9)
    np.testing.assert_allclose(found.angular_velocity, np.tile(spin, (101, 1)), atol=1e-9)


def test_the_weight_is_carried_at_the_depth_of_the_spring(engine):
    scene = coarse(scenes.plate())
    # Over the middle of a triangle: next to an edge both neighbors push, each with the spring.
    corners = scene.surface.vertices[scene.surface.triangles]
    middles = corners[np.ptp(corners[:, :, 2], axis=1) == 0].mean(axis=1)
    x, y, _ = middles[np.argmin(np.linalg.norm(middles, axis=1))]
    scene = replace(scene, position=(x, y, scene.position[2]))
    found = engine.run(scene, PARAMS)
    np.testing.assert_allclose(found.force[-50:].mean(axis=0), [0, 0, scene.weight], atol=2e-3)
    depth = scene.radius - found.position[-1, 2]
    assert depth == pytest.approx(scene.weight / scene.stiffness, rel=0.05)


def test_friction_holds_a_body_that_cannot_turn(engine):
    scene = replace(scenes.slope(), rolls=False)
    found = engine.run(scene, PARAMS)
    # The whole force of the plate, friction included, balances the tilted gravity.
    carried = found.force[-100:].mean(axis=0)
    np.testing.assert_allclose(carried, -scene.mass * np.array(scene.gravity), atol=5e-3)
    assert np.abs(found.angular_velocity).max() < 1e-6


def test_continuous_collision_detection_stops_the_shot(engine):
    scene = scenes.impact().variants()[3]
    passed = [
        engine.run(scene, {"dt": 1e-3, "breaking": 2e-3, "ccd": on}).position[-1, 2] < 0
        for on in (False, True)
    ]
    assert passed == [True, False]


def test_every_scene_has_settings_and_a_first_setting(engine):
    for build in scenes.SCENES.values():
        scene = build()
        assert all(scene_setting for scene_setting in engine.settings(scene).values())
        assert engine.param_sets(scene)[0]["dt"] > 0


@pytest.mark.parametrize("scale", [1.0, 10.0])
def test_the_merged_arm_moves_as_the_whole_one(scale):
    scene = scenes.press()
    whole, merged = (pin.buildModelFromXML(t) for t in (scene.urdf, merged_urdf(scene, scale)))
    rng = np.random.default_rng(0)
    for _ in range(5):
        q, v, a = rng.uniform(-1, 1, (3, whole.nv))
        # Continuous joints have two coordinates in Pinocchio.
        circle = np.c_[np.cos(q), np.sin(q)].ravel()
        torque = pin.rnea(whole, whole.createData(), q, v, a)
        merged.gravity.linear = scale * whole.gravity.linear
        scaled = pin.rnea(merged, merged.createData(), circle, v, a)
        np.testing.assert_allclose(scaled, scale**2 * torque, rtol=1e-9, atol=1e-9)


def free_arm(scene, steps):
    """Return the fingertip of Pinocchio's arm after so many steps of the PD control alone."""
    model = pin.buildModelFromXML(scene.urdf)
    data = model.createData()
    model.gravity.linear = np.zeros(3)
    q, v, q_ref = np.array(scene.q0), np.zeros(model.nv), np.array(scene.q_ref)
    for _ in range(steps):
        v = v + scene.dt * pin.aba(model, data, q, v, scene.kp * (q_ref - q) - scene.kd * v)
        q = q + scene.dt * v
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId("panda_hand_tcp")].translation.copy()


def test_the_free_arm_follows_its_control(engine):
    far = scenes.shapes.plate(0.05, 5e-3)
    scene = scenes.press()
    scene = replace(scene, surface=far, q_ref=tuple(np.array(scene.q0) + 0.1), steps=500)
    found = engine.run(scene, {"dt": scene.dt, "breaking": 2e-3})
    np.testing.assert_allclose(found.position[-1], free_arm(scene, 500), atol=2e-5)
