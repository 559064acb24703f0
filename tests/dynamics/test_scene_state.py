"""States of scenes and runs: the memory of friction, numbers of contacts, runs that go on."""

import copy
import pickle
from dataclasses import fields

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import InvalidParameter, NotPicklable, ResultError
from tests import meshes, models
from tests.dynamics.scenes import on_surface

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


def test_wrong_states_are_refused() -> None:
    scene = on_slope()
    q, v = start(scene)
    state = scene.state(q, v)
    for error, said, call in (
        (InvalidParameter, "state of this scene", lambda: on_slope().contacts(q, v, state)),
        (InvalidParameter, r"scene\.state\(q, v\)", lambda: scene.contacts(q, v, "state")),
        (InvalidParameter, "dt", lambda: state.advance(q, v, -1.0)),
        (NotPicklable, r"scene\.state", lambda: pickle.dumps(state)),
    ):
        with pytest.raises(error, match=said):
            call()
    scene.replace_pair("tip", friction=None)
    with pytest.raises(InvalidParameter, match="make another"):
        state.advance(q, v, DT)


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


LAW = sp.HuntCrossleyLaw(1e5, 1.5, 0.3)
STICKS = sp.BristleFriction(0.5, 0.4, 1e4, 10.0)
MINDLIN = sp.MindlinFriction(0.5, 0.4, 1e7, 0.3)


@models.every_integrator(2e-5, 1e-7, 1e-6)
@pytest.mark.parametrize("friction", [STICKS, MINDLIN], ids=["bristle", "mindlin"])
def test_a_run_goes_on_from_a_row_with_the_same_bits(integrator, friction):
    scene, q, v = on_surface("bowl", LAW, friction)
    sim = sp.Simulation(scene, integrator)
    given = {"record_dt": 1e-3, "record": ("state",)}
    whole = sim.run(q, v, 0.02, **given)
    assert len(whole.contacts) > 10
    for t in (0.0, 0.007, 0.0133):
        state = whole.at(t)
        assert state.t <= t
        rest = sim.run(state, duration=0.02 - state.t, **given)
        rows = np.searchsorted(whole.t, rest.t[1:])
        assert np.array_equal(whole.t[rows], rest.t[1:])
        for name in ("q", "v"):
            assert np.array_equal(getattr(whole, name)[rows], getattr(rest, name)[1:])
        count = int(np.sum(rest.contacts.row > 0))
        for name in ("depth", "friction_force_world", "contact_id"):
            first, second = (getattr(one.contacts, name)[-count:] for one in (whole, rest))
            assert np.array_equal(first, second), name
        for one in fields(whole.energy):
            first, second = (getattr(run.energy, one.name) for run in (whole, rest))
            assert np.array_equal(first[rows], second[1:]), one.name
        assert rest.at(0.02) == whole.at(0.02)
        assert rest.at(state.t) == state


def test_what_a_run_cannot_go_on_from_is_refused():
    scene, q, v = on_surface("bowl", LAW, STICKS)
    sim = sp.Simulation(scene, sp.SemiImplicitEuler(1e-4))
    with pytest.raises(ResultError, match=r"record=\('state',\)"):
        sim.run(q, v, 1e-3).at(0)
    result = sim.run(q, v, 1e-3, record=("state",), t0=1.0)
    with pytest.raises(InvalidParameter, match="before the first row: 1"):
        result.at(0.5)
    state = result.at(1.0005)
    with pytest.raises(InvalidParameter, match="the state of a run has its own"):
        sim.run(state, v)
    other = sp.Simulation(on_slope(), sp.SemiImplicitEuler(1e-4))
    with pytest.raises(InvalidParameter):
        other.run(state)
    # Another step: the motion goes on from there, on a grid of its own.
    finer = sp.Simulation(scene, sp.SemiImplicitEuler(5e-5)).run(state, duration=1e-4)
    assert finer.t == pytest.approx([1.0005, 1.00055, 1.0006], abs=1e-12)


def test_a_state_of_a_scene_is_a_value():
    scene = on_slope()
    q, v = start(scene)
    state = scene.state(q, v)
    for _ in range(20):
        v = v + DT * np.array([2.0, 0, -1.0])
        q = q + DT * v
        state.advance(q, v, DT)
    values, other = state.values, scene.state()
    assert other != state
    other.restore(values)
    assert other == state.copy() == state
    force = scene.external_forces(q, v, state=state)[1].vector
    assert np.any(force)
    assert np.array_equal(scene.external_forces(q, v, state=other)[1].vector, force)
    for one in (state, other):
        one.advance(q + DT * v, v, DT)
    assert other == state
    assert not np.array_equal(state.values, values)
    for wrong in (values[:-1], np.append(values, 0.0), values * np.nan, -values, np.zeros(3)):
        with pytest.raises(InvalidParameter, match="values"):
            other.restore(wrong)
    assert other == state
    assert on_slope().state(q, v) != state


RADIUS = 0.01


def ball(shell: sp.Shell, start, velocity=None) -> sp.results.SceneContacts:
    """Contacts of a run of a ball without rotation, from `start` (3,)."""
    law, model = sp.ImpactLaw(1e4, exponent=1.0, damping=2.0), models.block(9.81, 0.05, RADIUS)
    scene = models.on_shell(model, shell, law, radius=RADIUS)
    return models.run(scene, sp.SemiImplicitEuler(1e-4), start, velocity, 0.5).contacts


def test_one_number_over_many_elements() -> None:
    vertices, elements = meshes.icosphere(4)
    bowl = sp.Shell(0.04 * vertices, elements, side="inside")
    turn = np.radians(40)
    start = 0.03003 * np.array([np.sin(turn), 0.002, -np.cos(turn)])
    log = ball(bowl, start)
    assert len(np.unique(log.element)) > 10
    ids, counts = np.unique(log.contact_id[log.t > 0.01], return_counts=True)
    assert len(ids) == 1
    assert counts[0] > 4000


@pytest.mark.parametrize("cells", [1, 4])
def test_two_walls_two_numbers(cells: int) -> None:
    vertices, triangles = meshes.v_groove(np.radians(40), size=0.2, cells=cells)
    height = (RADIUS - 3.2e-5) / np.cos(np.radians(40))
    log = ball(sp.Shell(vertices, triangles), [1e-6, -0.05, height], [0, 0.1, 0])
    left = log.normal_world[:, 0] > 0
    for side in (left, ~left):
        assert len(np.unique(log.contact_id[side & (log.t > 0.05)])) == 1
    assert not set(log.contact_id[left]) & set(log.contact_id[~left])
