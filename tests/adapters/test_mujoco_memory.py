"""Friction's memory is a part of MuJoCo's state: copies, restored states and rollouts have it."""

import copy
import sys

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import InvalidParameter, SphshellError
from tests import models

mujoco = pytest.importorskip("mujoco")

from benchmarks.in_mujoco import ball, text  # noqa: E402
from sphshell_pin.adapters.mujoco import attach, reserve  # noqa: E402
from tests.adapters.mujoco_models import (  # noqa: E402
    LAW,
    STICKS,
    STIFF,
    model_of,
    on_slab,
    plate,
    slab,
    sliding,
)

RNG = np.random.default_rng(0)
SLOPE = f'gravity="{text(9.81 * np.sin(0.17), 0, -9.81 * np.cos(0.17))}" timestep="2e-5"'


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicitfast"])
def test_a_ball_sticks_on_a_slope_and_a_reset_forgets(integrator):
    """Bristles hold the weight where the ball cannot roll: no creep, and none of before."""
    model, data = model_of(sliding(f'{SLOPE} integrator="{integrator}"'), {})
    with attach(model, plate(), ["ball"], law=STIFF, friction=STICKS) as contacts:
        ends = []
        for _ in range(2):
            mujoco.mj_resetData(model, data)
            data.qpos[2] = 0.02
            for _ in range(20000):
                mujoco.mj_step(model, data)
            ends.append(data.qpos.copy())
            mujoco.mj_forward(model, data)
            found = contacts.contacts(data)
            weight = 0.1 * 9.81
            assert found.normal_force.sum() == pytest.approx(weight * np.cos(0.17), rel=1e-3)
            held = -found.friction_force_world.sum(axis=0)[0]
            assert held == pytest.approx(weight * np.sin(0.17), rel=5e-3)
            assert abs(data.qvel[0]) < 2e-6
        assert np.array_equal(*ends)


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicitfast"])
def test_memory_follows_every_copy_of_a_state(integrator):
    """mj_copyData, copy.copy, mj_setState; looking at other states changes nothing."""
    model, data = model_of(sliding(f'{SLOPE} integrator="{integrator}"'), {})
    with attach(model, plate(), ["ball"], law=STIFF, friction=STICKS) as contacts:
        data.qpos[2] = 0.02

        def go(data, steps):
            for _ in range(steps):
                mujoco.mj_step(model, data)
            return data.qpos.copy(), data.qvel.copy(), data.plugin_state.copy()

        go(data, 1000)
        copied = mujoco.MjData(model)
        mujoco.mj_copyData(copied, model, data)
        second = copy.copy(data)
        spec = mujoco.mjtState.mjSTATE_FULLPHYSICS
        state = np.empty(mujoco.mj_stateSize(model, spec))
        mujoco.mj_getState(model, data, state, spec)
        mujoco.mj_forward(model, data)
        held = contacts.contacts(data).friction_force_world.sum(axis=0)
        assert held[0] < -0.1
        wanted = go(data, 200)
        mujoco.mj_setState(model, data, state, spec)
        used = mujoco.MjData(model)
        go(used, 10)
        mujoco.mj_setState(model, used, state, spec)
        data.qpos[0] += 0.1
        mujoco.mj_forward(model, data)
        data.qpos[0] -= 0.1
        mujoco.mj_setState(model, data, state, spec)
        if integrator != "RK4":
            mujoco.mjd_transitionFD(model, data, 1e-7, True, np.zeros((6, 6)), None, None, None)
        for one in (data, copied, second, used):
            mujoco.mj_forward(model, one)
            assert np.array_equal(contacts.contacts(one).friction_force_world.sum(axis=0), held)
            # mj_forward has another warm start, to no effect without constraints.
            for found, want in zip(go(one, 200), wanted, strict=True):
                assert found == pytest.approx(want, rel=0, abs=1e-12)


@pytest.mark.parametrize("friction", [STICKS, sp.MindlinFriction(0.5, 0.4, 1e7, 0.3)])
def test_rollouts_over_any_number_of_data_are_the_same(friction):
    rollout = pytest.importorskip("mujoco.rollout")
    model, _ = model_of(sliding(SLOPE), {})
    with attach(model, plate(), ["ball"], law=STIFF, friction=friction):
        size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        starts = np.zeros((6, size))
        starts[:, 0] = RNG.uniform(0, 1, 6)
        starts[:, 3], starts[:, 4] = 0.01999, 0.02 * RNG.standard_normal(6)

        def run(count: int, starts: np.ndarray) -> np.ndarray:
            datas = [mujoco.MjData(model) for _ in range(count)]
            return rollout.rollout(model, datas, starts, nstep=100)[0]

        alone = np.concatenate([run(1, start[None]) for start in starts])
        for count in (1, 2, 3):
            assert np.array_equal(run(count, starts), alone)
        # Cut in two, the rows of the first half begin the second.
        again = run(2, alone[:, 49])[:, :50]
        assert np.array_equal(again[:, :, 1:], alone[:, 50:, 1:])


def test_rk4_moves_bristles_with_order_four():
    """A ball on springs of contact and bristle: both frictions and depths are smooth."""
    law, friction = sp.HuntCrossleyLaw(1e5, 1.0), sp.BristleFriction(0.6, 0.6, 1e4, 0.0)
    scene = sp.Scene(models.ball(mass=0.1, radius=0.02, joint=pin.JointModelTranslation()))
    scene.add_contact(sp.Sphere(0.02, "ball"), plate(), law=law, friction=friction)
    q0, v0 = np.array([0, 0, 0.02 - law.depth_at(0.981)]), np.array([3e-4, 0, 2e-4])
    exact = sp.Simulation(scene, sp.Adaptive(1e-12, 1e-16)).run(q0, v0, 0.02).q[-1]
    errors = []
    for dt in (1e-4, 5e-5):
        model, data = model_of(sliding(f'timestep="{dt}" integrator="RK4"'), {})
        with attach(model, plate(), ["ball"], law=law, friction=friction):
            data.qpos, data.qvel = q0, v0
            for _ in range(round(0.02 / dt)):
                mujoco.mj_step(model, data)
        errors.append(abs(data.qpos[0] - exact[0]))
    assert np.log2(errors[0] / errors[1]) > 3.5


def test_memory_has_its_room(monkeypatch):
    said = r"reserve\(spec, spheres=1\); model = spec.compile\(\)"
    given = {"law": LAW, "friction": STICKS}
    plain, roomy = model_of(ball(0.02, 0.1))[0], model_of(ball(0.02, 0.1), {})[0]
    first = attach(roomy, plate(), ["ball"], **given)
    for model in (plain, roomy):
        with pytest.raises(InvalidParameter, match=said):
            attach(model, plate(2.0), ["ball"], **given)
    first.detach()
    attach(roomy, plate(2.0), ["ball"], **given).detach()
    with pytest.raises(InvalidParameter, match=r"must be a mujoco\.MjSpec"):
        reserve(plain)
    with pytest.raises(InvalidParameter, match="contacts = 0"):
        reserve(mujoco.MjSpec(), contacts=0)
    # Numbers that it did not make, and more contacts than it has room for.
    model, data = model_of(slab(3), {"spheres": 3, "contacts": 1})
    contacts = on_slab(model, "ball0", "ball1", "ball2", friction=STICKS)
    monkeypatch.setattr(sys, "unraisablehook", lambda fault: None)
    mujoco.mj_step(model, data)
    with pytest.raises(SphshellError, match="more contacts touch at once"):
        contacts.check()
