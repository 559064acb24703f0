"""Contacts in MuJoCo's steps: against the scene's own forces and motions, energy and momentum."""

import itertools
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import InvalidParameter, SetupWarning
from sphshell_pin.scenario import build
from tests import meshes, models
from tests.shell.test_faces import torus

mujoco = pytest.importorskip("mujoco")

from benchmarks.in_mujoco import ball, generalized, mjcf_of  # noqa: E402
from sphshell_pin.adapters.mujoco import attach  # noqa: E402
from tests.adapters.mujoco_models import LAW, SOFT, model_of, plate  # noqa: E402

RNG = np.random.default_rng(0)


def test_a_panda_on_the_blade_feels_the_forces_of_its_scene():
    built = build("fingertip_on_blade")
    scene, pair = built.scene, built.scene.pairs[0]
    model, data = model_of(mjcf_of(scene.model, pair.side_i.sphere))
    placed = {"placement": pair.placement_j, "law": pair.law, "friction": pair.friction}
    with pytest.warns(SetupWarning, match="timestep of 0.002 s is too long"):
        contacts = attach(model, pair.side_j.shell, ["tip"], **placed)
    touched = 0
    with contacts:
        for _ in range(300):
            q = built.q0 + 0.02 * RNG.standard_normal(7)
            v = 0.5 * RNG.standard_normal(7)
            data.qpos, data.qvel = q, v
            mujoco.mj_forward(model, data)
            wanted = generalized(scene, q, v)
            own = scene.contacts(q, v)
            touched += bool(np.any(wanted))
            # The placements of both engines differ by their rounding, 1e-16 m and more.
            size = np.abs(wanted).max() + 1e-3 * 7.5e6 * own.depth.max(initial=0.0) ** 0.5
            assert data.qfrc_passive == pytest.approx(wanted, rel=0, abs=1e-12 * size)
            assert contacts.contacts(data).depth == pytest.approx(own.depth, abs=1e-14)
    assert touched > 100
    mujoco.mj_forward(model, data)
    assert not np.any(data.qfrc_passive)


def test_a_ball_in_a_torus_and_the_torus_push_each_other():
    other = """<body name="torus"><freejoint/>
      <inertial pos="0.01 0.02 0.03" mass="2" fullinertia="0.1 0.12 0.2 0 0.01 0"/></body>"""
    model, data = model_of(ball(0.095, 0.3, more=other))
    given = {"law": sp.HuntCrossleyLaw(1e4, 1.5), "friction": sp.CoulombFriction(0.4, 0.3)}
    touched = 0
    with attach(model, torus(), ["ball"], body="torus", **given):
        for _ in range(100):
            at, turn = data.qpos, pin.exp3(RNG.standard_normal(3))
            at[7:10], at[10:] = RNG.standard_normal(3), pin.Quaternion(turn).coeffs()[[3, 0, 1, 2]]
            angle = RNG.uniform(0, 6.28)
            middle = 0.3 * np.array([np.cos(angle), np.sin(angle), 0.0])
            at[:3] = at[7:10] + turn @ (middle + RNG.uniform(-6e-3, 6e-3, 3))
            data.qvel[:] = RNG.standard_normal(12)
            mujoco.mj_forward(model, data)
            forces = data.qfrc_passive.reshape(2, 2, 3)
            touched += bool(np.any(forces[0, 0]))
            scale = 1 + np.abs(forces).max()
            assert forces[:, 0].sum(axis=0) == pytest.approx(0.0, abs=1e-12 * scale)
            # The moments of both about the world's origin: a free joint's turns are the body's.
            moment = np.zeros(3)
            for k, name in enumerate(("ball", "torus")):
                moment += data.body(name).xmat.reshape(3, 3) @ forces[k, 1]
                moment += np.cross(at[7 * k : 7 * k + 3], forces[k, 0])
            assert moment == pytest.approx(0.0, abs=1e-11 * scale)
    assert touched > 20


@pytest.mark.parametrize(
    "friction", [sp.CoulombFriction(0.5, 0.4), sp.MindlinFriction(0.5, 0.4, 1e7, 0.3)]
)
def test_steps_are_those_of_a_simulation(friction):
    """A ball is thrown onto a plate: MuJoCo's Euler is SemiImplicitEuler, friction's memory too."""
    dt, radius = 1e-5, 0.02
    law = sp.HuntCrossleyLaw(1e6, 1.5, 0.1)
    model, data = model_of(ball(radius, 0.1, options=f'timestep="{dt}"'), {})
    scene = sp.Scene(models.ball(mass=0.1, radius=radius))
    scene.add_contact(sp.Sphere(radius, "ball"), plate(), law=law, friction=friction)
    q0 = np.array([0, 0, radius + 1e-5, 0, 0, 0, 1.0])
    v0 = np.array([0.05, 0.02, -0.1, 0, 0, 0])
    result = sp.Simulation(scene, sp.SemiImplicitEuler(dt)).run(q0, v0, 0.03, record_dt=1e-3)
    data.qpos[:3], data.qvel[:6] = q0[:3], v0
    with attach(model, plate(), ["ball"], law=law, friction=friction, log=True) as contacts:
        for _ in range(round(0.03 / dt)):
            mujoco.mj_step(model, data)
        # Of a turning body MuJoCo integrates the velocity in the world, Pinocchio in the body.
        assert data.qpos[:3] == pytest.approx(result.q[-1, :3], abs=5e-8)
        assert data.qvel[3:] == pytest.approx(result.v[-1, 3:], abs=1e-3)
        log = contacts.log(data)
        assert log.t[0] < 1e-3
        assert np.all(np.diff(log.t) >= 0)
        assert len(log.t) > 20


def test_energy_of_a_ball_that_swings_in_a_bowl():
    model, data = model_of(ball(0.05, 0.2, options='timestep="1e-4" integrator="RK4"'))
    shell = sp.Shell(*meshes.bowl(24, 1.0, 2.0), name="bowl")
    data.qpos[:3] = 0.2, 0.1, 0.08
    with attach(model, shell, ["ball"], law=sp.HuntCrossleyLaw(1e6, 1.5)) as contacts:
        # It is let fall from a hair above the bowl, and bounces.
        energies = []
        for _ in range(10000):
            mujoco.mj_step(model, data)
            if not len(contacts.contacts(data).depth):
                energies.append(0.1 * data.qvel[:3] @ data.qvel[:3] + 0.2 * 9.81 * data.qpos[2])
    assert len(energies) > 100
    assert np.ptp(energies) < 1e-5 * abs(energies[0])


def test_models_and_threads_do_not_disturb_each_other():
    law = sp.HuntCrossleyLaw(1e5, 1.5, 0.5)
    frictions = sp.CoulombFriction(0.5, 0.4), sp.MindlinFriction(0.5, 0.4, 1e7, 0.3)
    made = [model_of(ball(0.02, 0.1, options='timestep="1e-4"'), {})[0] for _ in frictions]
    held = [
        attach(model, plate(), ["ball"], law=law, friction=friction)
        for model, friction in zip(made, frictions, strict=True)
    ]

    def moved(model, speed: float) -> np.ndarray:
        data = mujoco.MjData(model)
        data.qpos[2], data.qvel[0] = 0.03, speed
        for _ in range(3000):
            mujoco.mj_step(model, data)
        return data.qpos.copy()

    models_of, speeds = zip(*itertools.product(made, (0.1, 0.2, 0.3, 0.4)), strict=True)
    alone = list(map(moved, models_of, speeds))
    with ThreadPoolExecutor(len(alone)) as pool:
        assert np.array_equal(list(pool.map(moved, models_of, speeds)), alone)
    assert len({one.tobytes() for one in alone}) == len(alone)
    for one in held:
        one.detach()
    assert moved(made[0], 0.1)[2] == pytest.approx(0.03 - 0.5 * 9.81 * 0.3**2, rel=1e-3)


def test_mujocos_own_contact_is_off_between_them_and_nowhere_else():
    xml = """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 .1"/>
      <body name="tray"><freejoint/><geom name="tray" type="box" size=".1 .1 .01"/></body>
      <body name="a" pos="0 0 .12"><freejoint/><geom name="a" type="sphere" size=".02"/></body>
      <body name="b" pos="0 .03 .12"><freejoint/><geom name="b" type="sphere" size=".02"/></body>
      </worldbody></mujoco>"""
    model, data = model_of(xml)

    def touching() -> set[frozenset[str]]:
        mujoco.mj_forward(model, data)
        return {frozenset(model.geom(int(k)).name for k in pair) for pair in data.contact.geom}

    data.qpos[[2, 9, 16]] = 0.009, 0.0185, 0.0185
    everything = set(map(frozenset, itertools.combinations(("floor", "tray", "a", "b"), 2)))
    assert touching() == everything
    with pytest.warns(SetupWarning):
        contacts = attach(model, plate(0.1), ["a"], body="tray", law=LAW)
    assert touching() == everything - {frozenset(("tray", "a"))}
    second = attach(model, plate(0.1), ["b"], body="tray", law=SOFT)
    contacts.detach()
    assert touching() == everything - {frozenset(("tray", "b"))}
    second.detach()
    assert touching() == everything


def test_substeps_carry_a_stiff_law():
    model, data = model_of(ball(0.02, 0.1, options='timestep="2e-3"'))
    data.qpos[2] = 0.03
    with pytest.warns(SetupWarning, match=r"set model.opt.timestep, or call contacts.step\(data\)"):
        contacts = attach(model, plate(), ["ball"], law=sp.HuntCrossleyLaw(1e7, 1.5, 1.0))
    with contacts:
        heights = []
        for _ in range(500):
            contacts.step(data)
            heights.append(data.qpos[2])
        assert contacts.substeps > 10
        assert data.time == pytest.approx(1.0)
        assert model.opt.timestep == 2e-3
        # It never comes as high as it began, and far above that without.
        assert min(heights) > 0.0196
        assert max(heights[100:]) < 0.0295
        for _ in range(500):
            mujoco.mj_step(model, data)
            heights.append(data.qpos[2])
    assert max(heights) > 0.04


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"spheres": ["nobody"]}, "must be the name of a geom or site"),
        ({"spheres": []}, "must name at least one"),
        ({"spheres": ["floor"]}, "must be a sphere: the geom has another type"),
        ({"spheres": "ball"}, "must be a list of names"),
        ({"body": "nobody"}, "must be the name of a body"),
        ({"body": "ball"}, "another body than that of the spheres"),
        ({"shell": 3}, "must be a Shell"),
        ({"model": 3}, "must be a mujoco.MjModel"),
        ({"placement": 3}, "must be a pinocchio.SE3"),
        ({"law": 3}, "law"),
    ],
)
def test_what_cannot_be_attached_is_refused_and_changes_nothing(changes, said):
    floor = '<geom name="floor" type="plane" size="1 1 .1"/>'
    model, data = model_of(ball(0.02, 0.1, more=floor))
    given = {"model": model, "shell": plate(), "spheres": ["ball"], "law": LAW} | changes
    with pytest.raises(InvalidParameter, match=said):
        attach(**given)
    data.qpos[2] = 0.019
    mujoco.mj_forward(model, data)
    assert data.ncon == 1
    assert not np.any(data.qfrc_passive)


def test_a_callback_of_ones_own_may_apply_them():
    model, data = model_of(ball(0.02, 0.1))
    called = []
    mujoco.set_mjcb_passive(lambda *_: called.append(1))
    try:
        with pytest.raises(InvalidParameter, match=r"contacts\.apply"):
            attach(model, plate(), ["ball"], law=LAW)
        mujoco.set_mjcb_passive(None)
        with pytest.warns(SetupWarning):
            contacts = attach(model, plate(), ["ball"], law=LAW)
        mujoco.set_mjcb_passive(lambda _, data: contacts.apply(data))
        data.qpos[2] = 0.0199
        mujoco.mj_forward(model, data)
        assert data.qfrc_passive[2] == pytest.approx(contacts.contacts(data).normal_force[0])
        contacts.detach()
    finally:
        mujoco.set_mjcb_passive(None)
