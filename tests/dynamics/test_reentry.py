"""Routines that call back into what has called them, and cycles through them."""

import gc
import weakref

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin import _core
from sphshell_pin.dynamics.run.open_run import OpenRun
from sphshell_pin.errors import Busy, InvalidParameter
from tests.models import LAW, ball, free_q, on_plate

Q = free_q([0.0, 0.0, 0.049])


def some_contacts(count: int):
    return np.zeros((count, 3)), np.tile([0.0, 0.0, 1.0], (count, 1)), np.full(count, 1e-4)


def test_a_contact_source_may_ask_its_own_scene() -> None:
    """The inner evaluation has more contacts than the outer one, which keeps its own."""
    inside = []

    def find(pose_i, pose_j):
        if inside:
            return some_contacts(500)
        inside.append(True)
        assert len(scene.contacts(Q)) == 1500
        scene.external_forces(Q)
        inside.clear()
        return some_contacts(3)

    scene = sp.Scene(ball())
    for name in "abc":
        scene.add_contact_source(find, "ball", "universe", LAW, name=name)
    for _ in range(3):
        contacts = scene.contacts(Q)
        assert contacts.pair.tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2]
        np.testing.assert_array_equal(contacts.depth, 1e-4)


def test_a_source_that_asks_for_ever_ends() -> None:
    def find(pose_i, pose_j):
        return len(scene.contacts(Q)), [], []

    scene = sp.Scene(ball())
    scene.add_contact_source(find, "ball", "universe", LAW)
    with pytest.raises(RecursionError):
        scene.contacts(Q)


CALLS = {
    "advance": lambda run: run.advance(1e-3),
    "snapshot": lambda run: run.snapshot(),
    "residual": lambda run: run.residual,
    "time": lambda run: run.time,
    "push": lambda run: run.push("ball", [0.0, 0.0, 1.0]),
    "change": lambda run: run.change(run.scene),
}


@pytest.mark.parametrize("call", CALLS)
def test_a_run_is_busy_for_its_own_controller(call: str) -> None:
    asked = []

    def controller(t, q, v, contacts):
        if asked:
            CALLS[call](asked[0])
        return np.zeros(6)

    simulation = sp.Simulation(on_plate(ball(), LAW), sp.SemiImplicitEuler(1e-4))
    run = OpenRun(simulation, Q, controller=controller, record_dt=1e-3)
    asked.append(run)
    with pytest.raises(Busy, match=r"this \w+ is busy: .* own advance\(\)"):
        run.advance(0.01)
    asked.clear()
    before = run.time
    run.advance(0.01)
    assert run.time > before


class Holder:
    """Holds what holds its own routines."""

    def __init__(self, make) -> None:
        self.asks, self.scene = False, sp.Scene(ball())
        self.pair = self.scene.add_contact_source(self.find, "ball", "universe", LAW)
        self.held = make(self)

    def torque(self, t, q, v, contacts):
        return np.zeros(6)

    def find(self, pose_i, pose_j):
        if self.asks:  # so that there are two evaluations at once
            self.asks = False
            self.scene.contacts(Q)
        return some_contacts(1)


def run_of(holder: Holder) -> OpenRun:
    run = OpenRun(sp.Simulation(holder.scene), Q, record_dt=1e-3, controller=holder.torque)
    run.advance(2e-3)
    return run


def scene_of(holder: Holder) -> sp.Scene:
    holder.asks = True
    holder.scene.contacts(Q)
    return holder.scene


MAKERS = {
    "run": run_of,
    "scene": scene_of,
    "pair": lambda holder: holder.pair._bind(),
    "controller": lambda holder: _core.PythonController(holder.torque),
}


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_cycles_through_a_routine_are_collected(make) -> None:
    watched = [weakref.ref(Holder(make)) for _ in range(5)]
    kept = Holder(make)
    gc.collect()
    assert [one() for one in watched] == [None] * 5
    # What is still in use is not: the collector counts every reference once.
    gc.collect()
    assert kept.__dict__


def test_what_others_hold_of_a_cycle_survives() -> None:
    kept = Holder(run_of)
    run, watched = kept.held, weakref.ref(kept)
    del kept
    for _ in range(3):
        gc.collect()
        run.advance(1e-3)
    assert watched() is not None
    del run
    gc.collect()
    assert watched() is None


def test_a_source_with_too_many_contacts_is_refused() -> None:
    scene = sp.Scene(ball())
    scene.add_contact_source(lambda i, j: some_contacts(1_000_001), "ball", "universe", LAW)
    with pytest.raises(InvalidParameter, match=r"returns 1000001 .* 1000000 at most"):
        scene.contacts(Q)
    bristles = sp.BristleFriction(0.5, 0.4, 1e5, 1e2)
    scene = sp.Scene(ball())
    scene.add_contact_source(lambda i, j: some_contacts(1001), "ball", "universe", LAW, bristles)
    with pytest.raises(InvalidParameter, match="1000 at most with BristleFriction"):
        scene.contacts(Q)


def test_many_contacts_of_a_source_cost_in_proportion() -> None:
    """Recorded rows included: 30 000 contacts would need hours at the cost of all pairs."""
    scene = sp.Scene(ball())
    scene.add_contact_source(lambda i, j: some_contacts(30_000), "ball", "universe", LAW)
    contacts = scene.contacts(Q)
    assert len(contacts) == 30_000
    result = sp.Simulation(scene, sp.SemiImplicitEuler(1e-4)).run(Q, None, 3e-4)
    assert np.array_equal(result.contacts.contact_id[-30_000:], np.arange(30_000))
