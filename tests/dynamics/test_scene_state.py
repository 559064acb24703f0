"""A scene's state in the user's own loop: the memory of friction and of contacts."""

import copy
import pickle

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import InvalidParameter, NotPicklable
from tests import meshes, models

R, K, G, DT = 0.05, 1e5, 9.81, 1e-4
BRISTLE = sp.BristleFriction(0.5, 0.4, K, 100.0)
SLOPE = 0.3  # [rad], below atan(0.5)


def on_slope(friction: sp.BristleFriction = BRISTLE, free: bool = False) -> sp.Scene:
    """1 kg on an inclined plate; a block that cannot turn, or a ball that can."""
    model = models.block()
    if free:
        model = models.empty()
        light = pin.Inertia.FromSphere(1e-6, R)
        carrier = models.add_body(model, "carrier", pin.JointModelTranslation(), inertia=light)
        models.add_body(model, "ball", pin.JointModelSpherical(), carrier)
    place = pin.SE3(pin.utils.rotate("y", SLOPE), np.zeros(3))
    plate = sp.Shell(*meshes.random_plate(60, seed=3, size=4.0))
    law = models.linear_law(K, 300.0)
    return models.on_shell(model, plate, law, friction, placement=place, name="tip")


def start(scene: sp.Scene, gap: float = -1e-5) -> tuple[np.ndarray, np.ndarray]:
    q = scene.neutral
    q[:3] = (R + gap) * np.array([np.sin(SLOPE), 0, np.cos(SLOPE)])
    return q, np.zeros(scene.model.nv)


def own_loop(scene: sp.Scene, q, v, steps: int):
    """Semi-implicit Euler with pin.aba."""
    model, data = scene.model.copy(), scene.model.createData()
    state = scene.state(q, v)
    for _ in range(steps):
        fext = scene.external_forces(q, v, state=state)
        v = v + DT * pin.aba(model, data, q, v, np.zeros(model.nv), fext)
        q = pin.integrate(model, q, DT * v)
        state.advance(q, v, DT)
    return q, v, state


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("torsional", [False, True])
@pytest.mark.parametrize("speed", [0.0, 0.4])
def test_the_own_loop_moves_as_a_run(free: bool, torsional: bool, speed: float) -> None:
    """Sticking, and sliding with spin; the ball of the second begins above the plate."""
    scene = on_slope(sp.BristleFriction(0.5, 0.4, K, 100.0, torsional=torsional), free)
    q, v = start(scene, 1e-4 if speed else -1e-5)
    v[:2] = speed, 0.5 * speed
    if free:
        v[5] = 10 * speed
    run = sp.Simulation(scene, sp.SemiImplicitEuler(DT)).run(q, v, 2000 * DT)
    last_q, last_v, state = own_loop(scene, q, v, 2000)
    assert last_q == pytest.approx(run.q[-1], abs=1e-12)
    assert last_v == pytest.approx(run.v[-1], abs=1e-10)
    contacts, row = scene.contacts(last_q, last_v, state), run.contacts.at_row(len(run.t) - 1)
    assert contacts.contact_id.tolist() == row.contact_id.tolist()
    assert contacts.friction_force_world == pytest.approx(row.friction_force_world, abs=1e-3)


def test_evaluations_change_nothing_and_copies_are_independent() -> None:
    scene = on_slope()
    q, v, state = own_loop(scene, *start(scene), 500)
    held = scene.contacts(q, v, state)
    assert np.linalg.norm(held.friction_force_world) > 1.0
    for other in (state.copy(), copy.copy(state), copy.deepcopy(state)):
        assert np.array_equal(scene.contacts(q, v, other).force_world, held.force_world)
        other.advance(q + [0.0, 0.0, 1.0], v, DT)
        other.advance(q, v, DT)
        unstretched = scene.contacts(q, v).friction_force_world
        assert np.array_equal(scene.contacts(q, v, other).friction_force_world, unstretched)
        scene.external_forces(q + 0.1, v + 1.0, state)
        scene.contact_derivatives(q, v + 1.0, state)
        assert np.array_equal(scene.contacts(q, v, state).force_world, held.force_world)


def test_contacts_have_ids() -> None:
    """A ball that lifts off and comes back has another contact."""
    scene = on_slope()
    q, v = start(scene)
    state, ids = scene.state(), []
    for height in (0.0, 0.0, 1.0, 0.0):
        state.advance(q + [0.0, 0.0, height], v, DT)
        ids += scene.contacts(q + [0.0, 0.0, height], v, state).contact_id.tolist()
    assert ids == [0, 0, 1]


def test_wrong_states_are_refused() -> None:
    scene = on_slope()
    q, v = start(scene)
    state = scene.state(q, v)
    with pytest.raises(InvalidParameter, match="state of this scene"):
        on_slope().contacts(q, v, state)
    with pytest.raises(InvalidParameter, match=r"scene\.state\(q, v\)"):
        scene.contacts(q, v, "state")
    with pytest.raises(InvalidParameter, match="dt"):
        state.advance(q, v, -1.0)
    scene.replace_pair("tip", friction=None)
    with pytest.raises(InvalidParameter, match="make another"):
        state.advance(q, v, DT)
    with pytest.raises(NotPicklable, match=r"scene\.state"):
        pickle.dumps(state)


def test_contact_wrench_with_a_state_moves_as_a_run() -> None:
    """A block on a plate that turns: the contact is where the block is, and held by the bristle."""
    law, friction = models.linear_law(K, 300.0), sp.BristleFriction(0.5, 0.4, K, 100.0)
    x, spin, n, state = 0.3, 2.0, np.array([0.0, 0.0, 1.0]), sp.BristleState()
    place, speed, angle = np.array([x, 0.0, R - G / K]), np.array([0.0, spin * x, 0.0]), 0.0
    disc = pin.Motion(np.zeros(3), spin * n)
    for _ in range(4000):
        block = pin.Motion(speed, np.zeros(3))
        contact = (place * [1, 1, 0], n, R - place[2], block, disc, law, friction)
        state.advance(*contact, dt=DT)
        wrench, _ = sp.contact_wrench(*contact, state=state)
        speed = speed + DT * (wrench.linear - G * n)
        place, angle = place + DT * speed, angle + DT * spin
    stretch = spin**2 * x / K
    bound = 3 * stretch + 0.6 * spin**2 * x * DT * 4000 * DT
    assert np.hypot(*place[:2]) == pytest.approx(x, abs=bound)
    assert np.arctan2(place[1], place[0]) - angle == pytest.approx(0.0, abs=1e-4)
    assert state.stretch_world @ n == pytest.approx(0.0, abs=1e-12)
    assert pickle.loads(pickle.dumps(state)).stretch_world.tolist() == state.stretch_world.tolist()
    state.advance(*contact[:2], -1e-3, *contact[3:], dt=DT)
    assert not state.stretch_world.any()
