"""The adapters of Drake, PyBullet and EXUDYN against closed forms and Pinocchio."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from benchmarks.peers import drake, scenes
from benchmarks.peers.merged import merged_urdf
from benchmarks.peers.workers import engine_called
from sphshell_pin.study.report import swing

SAP = {"contact": "kSap", "dt": 1e-3, "edge": 1e-3}
BULLET = {"dt": 1e-3, "breaking": 1e-4}


def engine_of(name):
    pytest.importorskip({"drake": "pydrake"}.get(name, name))
    return engine_called(name)


def coarse(scene, **changes):
    """Return the scene on a small plate of large triangles: quick to load."""
    return replace(scene, surface=scenes.shapes.plate(0.06, 0.02), **changes)


@pytest.mark.parametrize(
    ("engine", "params", "rel"),
    [("drake", SAP | {"edge": 2.5e-4}, 0.1), ("pybullet", BULLET, 0.05)],
)
def test_the_weight_is_carried_as_deep_as_by_the_spring(engine, params, rel):
    scene = coarse(scenes.plate())
    # Over the middle of a triangle: in PyBullet both neighbors of an edge push.
    corners = scene.surface.vertices[scene.surface.triangles]
    middles = corners[np.ptp(corners[:, :, 2], axis=1) == 0].mean(axis=1)
    x, y, _ = middles[np.argmin(np.linalg.norm(middles, axis=1))]
    found = engine_of(engine).run(replace(scene, position=(x, y, scene.position[2])), params)
    np.testing.assert_allclose(found.force[-50:].mean(axis=0), [0, 0, scene.weight], atol=2e-3)
    depth = scene.radius - found.position[-1, 2]
    assert depth == pytest.approx(scene.weight / scene.stiffness, rel=rel)


@pytest.mark.parametrize(
    ("engine", "params", "tolerance"),
    # Drake takes the gains implicitly: the motion differs by about a step's share of it.
    [("drake", {"contact": "kSap", "edge": 0.012}, 2e-4), ("pybullet", {"breaking": 2e-3}, 2e-5)],
)
def test_the_free_arm_follows_its_control(engine, params, tolerance):
    scene = scenes.press()
    scene = coarse(scene, q_ref=tuple(np.array(scene.q0) + 0.1), steps=500)
    model = pin.buildModelFromXML(scene.urdf)
    model.gravity.linear = np.zeros(3)
    data, q, v = model.createData(), np.array(scene.q0), np.zeros(model.nv)
    for _ in range(scene.steps):
        torque = scene.kp * (scene.q_ref - q) - scene.kd * v
        v = v + scene.dt * pin.aba(model, data, q, v, torque)
        q = q + scene.dt * v
    pin.framesForwardKinematics(model, data, q)
    tip = data.oMf[model.getFrameId("panda_hand_tcp")].translation
    for _ in range(2):  # Drake's arm is kept; a second run starts from the same state
        found = engine_of(engine).run(scene, {"dt": scene.dt, **params})
        np.testing.assert_allclose(found.position[-1], tip, atol=tolerance)
        assert found.steps == scene.steps


@pytest.mark.parametrize("name", ["plate", "bowl"])
def test_the_modulus_gives_the_load_at_the_depth_of_the_spring(name):
    scene = scenes.SCENES[name]()
    depth = drake.load(scene) / scene.stiffness
    # The patch by quadrature, from the exact shapes: pressure modulus * (r - s) / r, s the distance
    # from the ball's center.
    across = np.linspace(0, 2.0 * np.sqrt(scene.radius * depth), 20001)
    if isinstance(scene, scenes.Bowl):
        out = swing.ARM + depth  # from the middle of the bowl to the center of the ball
        height = np.sqrt(swing.BOWL**2 - across**2) - out
    else:
        height = scene.radius - depth
    inside = np.maximum(scene.radius - np.hypot(across, height), 0.0)
    pressure = drake.modulus(scene) * inside / scene.radius
    force = np.trapezoid(2 * np.pi * across * pressure, across)
    assert force == pytest.approx(drake.load(scene), rel=0.01)


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


@pytest.mark.parametrize("solver", ["GeneralizedAlpha", "RK44"])
def test_exudyn_carries_and_rolls(solver):
    """The depth of the spring, the acceleration of a rolling ball, and the circle on a table."""
    params = {"solver": solver, "dt": 2e-4, "exact edges": True}
    engine = engine_of("exudyn")
    plate = coarse(scenes.plate())
    errors = plate.errors(engine.run(plate, params))
    assert errors == pytest.approx({"depth": 0.0, "side force": 0.0}, abs=1e-9)
    slope = coarse(scenes.slope())
    assert slope.errors(engine.run(slope, params))["acceleration"] < 0.02
    held = slope.variants()[1]
    assert 0 < held.errors(engine.run(held, params))["creep [m/s]"] < 1e-3
    table = replace(scenes.turntable(), surface=scenes.shapes.plate(0.2, 0.05))
    assert table.errors(engine.run(table, params))["rate"] < 0.02
