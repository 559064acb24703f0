"""A run that goes on from a row of another one has its bits, and a state is a value."""

from dataclasses import fields

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import InvalidParameter, ResultError
from tests import models
from tests.dynamics.scenes import on_surface
from tests.dynamics.test_scene_state import DT, on_slope, start

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


def test_states_are_kept_in_files(tmp_path):
    scene, q, v = on_surface("bowl", LAW, STICKS)
    sim = sp.Simulation(scene, sp.SemiImplicitEuler(1e-4))
    result = sim.run(q, v, 0.01, record=("state",))
    read = sp.Result.load(result.save(tmp_path / "run.npz"))
    assert read.at(0.005) == result.at(0.005)
    assert read.at(0.005) != result.at(0.006)
    again = sim.run(read.at(0.005), duration=0.005)
    assert np.array_equal(again.q[-1], result.q[-1])


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
    values = state.values
    other = scene.state()
    assert other != state
    other.restore(values)
    assert other == state
    assert state.copy() == state
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
