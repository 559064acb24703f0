"""Our engine, the plain loop and MuJoCo on the scenes, at cheap settings."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from benchmarks.peers import mujoco as peer
from benchmarks.peers import scenes
from benchmarks.peers.ours import Ours
from benchmarks.peers.press import press
from benchmarks.peers.python_loop import PYTHON, Finder, PythonLoop
from sphshell_pin.errors import MissingExtra


def joined(engine, scene, params, variants=None):
    runs = scene.variants()[:variants]
    return scene.joined([one.errors(engine.run(one, params)) for one in runs])


@pytest.mark.parametrize(
    ("scene", "params", "bar"),
    [
        ("plate", {"integrator": "SemiImplicitEuler", "dt": 1e-4}, 1e-11),
        ("bowl", {"integrator": "RungeKutta4", "dt": 2e-3}, 2e-5),
        ("cylinder", {"integrator": "Adaptive", "rtol": 1e-4}, 1e-4),
        ("turntable", {"integrator": "Implicit", "rtol": 1e-4}, 1e-4),
        ("groove", {"integrator": "SemiImplicitEuler", "dt": 1e-4}, 1e-11),
        ("slope", {"integrator": "Implicit", "rtol": 1e-4}, 1e-9),
        ("impact", {"integrator": "Adaptive", "rtol": 1e-6}, 1e-6),
    ],
)
def test_ours_is_near_the_truth(scene, params, bar):
    errors = joined(Ours(), scenes.SCENES[scene](), params, 3)
    assert max(errors.values()) < bar


def test_the_loop_finds_one_contact_of_the_plate_and_two_of_the_groove():
    plate = scenes.plate()
    depth = 1e-4
    found = Finder(plate.surface, plate.radius).contacts(np.array([1e-3, 0, plate.radius - depth]))
    assert len(found) == 1
    assert found[0][0] == pytest.approx(depth, rel=1e-9)
    assert found[0][1] == pytest.approx([0, 0, 1])
    groove = scenes.groove()
    height = (groove.radius - depth) * np.sqrt(2)
    found = Finder(groove.surface, groove.radius).contacts(np.array([0.0, 0.0, height]))
    assert sorted(normal[0] for _, normal in found) == pytest.approx([-(0.5**0.5), 0.5**0.5])
    assert [d for d, _ in found] == pytest.approx([depth, depth])


def press_scene():
    try:
        return press()
    except MissingExtra as missing:
        pytest.skip(str(missing))


@pytest.mark.robots
def test_the_loop_and_ours_press_alike():
    scene = press_scene()
    loop = PythonLoop().run(scene, {"dt": scene.dt, "loop": PYTHON})
    params = {"integrator": "SemiImplicitEuler", "dt": scene.dt}
    short = Ours().run(replace(scene, steps=loop.steps), params)
    # Flat triangles and one contact against curved elements: alike to the sagitta.
    assert loop.position[-1] == pytest.approx(short.position[-1], abs=1e-4)


@pytest.mark.robots
def test_mujoco_has_the_arm_of_pinocchio():
    mujoco = pytest.importorskip("mujoco")
    scene = press_scene()
    params = peer.MuJoCo().param_sets(scene)[0]
    theirs = peer.press_model(scene, params)
    data = mujoco.MjData(theirs)
    q = np.array(scene.q0) + 0.1
    data.qpos[:] = q
    mujoco.mj_forward(theirs, data)
    found = np.zeros((7, 7))
    mujoco.mj_fullM(theirs, data, found)
    model = pin.buildModelFromXML(scene.urdf)
    expected = pin.crba(model, model.createData(), q)
    expected = np.triu(expected) + np.triu(expected, 1).T
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-9)
    at = model.createData()
    pin.forwardKinematics(model, at, q)
    tip = pin.updateFramePlacement(model, at, model.getFrameId("panda_hand_tcp")).translation
    geom = mujoco.mj_name2id(theirs, mujoco.mjtObj.mjOBJ_GEOM, "panda_hand_tcp")
    assert data.geom_xpos[geom] == pytest.approx(tip, abs=1e-9)


@pytest.mark.parametrize(
    ("scene", "params", "bar"),
    [
        ("groove", {"integrator": "RK4", "dt": 1e-3, "surface": "boxes"}, 1e-9),
        ("slope", {"integrator": "implicitfast", "dt": 1e-3, "surface": "boxes"}, 5e-3),
        ("turntable", {"integrator": "implicitfast", "dt": 1e-3, "surface": "boxes"}, 0.1),
    ],
)
def test_mujoco_is_near_the_truth_on_boxes(scene, params, bar):
    pytest.importorskip("mujoco")
    assert max(joined(peer.MuJoCo(), scenes.SCENES[scene](), params).values()) < bar
