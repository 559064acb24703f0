"""What a user sends to another process, or copies, computes the same bits there."""

import copy
import multiprocessing
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.dynamics.run.open_run import OpenRun
from sphshell_pin.errors import NotPicklable
from tests import meshes, models

Trip = Callable[[Any], Any]

LAWS = (sp.ImpactLaw(3e5, 1.7, 120.0, 2e-4), sp.HuntCrossleyLaw(4e6, 1.5, 0.3))
FRICTIONS = (
    sp.CoulombFriction(0.5, 0.3, 0.01, 0.1),
    sp.BristleFriction(0.5, 0.4, 1e5, 1e2, 1e-3, torsional=True),
)


def pickled(thing: Any) -> Any:
    return pickle.loads(pickle.dumps(thing))


@pytest.fixture(params=[pickled, copy.deepcopy], ids=["pickle", "deepcopy"])
def trip(request: pytest.FixtureRequest) -> Trip:
    return request.param


def touching(pose_i: pin.SE3, pose_j: pin.SE3) -> tuple[Any, Any, Any]:
    """Let the ball's center touch a plane 20 mm below the shell's vertices."""
    return [pose_i.translation - [0, 0, 0.05]], [[0, 0, 1.0]], [(0.03 - pose_i.translation[2])]


def bumpy_scene() -> sp.Scene:
    scene = sp.Scene(models.ball())
    shell = sp.Shell(*meshes.icosphere(2, 0.4))
    place = pin.SE3(np.eye(3), np.array([0, 0, -0.4]))
    for law, friction in zip(LAWS, FRICTIONS, strict=True):
        scene.add_contact(sp.Sphere(0.05, "ball"), shell, "universe", place, law, friction)
    scene.add_contact_source(touching, "ball", "universe", law=LAWS[0])
    return scene


START = np.array([0.01, 0.003, 0.0495, 0, 0, 0, 1.0])


def run(simulation: sp.Simulation) -> bytes:
    result = simulation.run(START, [0.3, 0, -0.2, 1.0, 2.0, 3.0], 0.02, record_dt=1e-3)
    assert len(result.contacts)
    columns = (result.q, result.v, result.energy.total, result.contacts.normal_force)
    return b"".join(column.tobytes() for column in columns)


def in_child(simulation: sp.Simulation) -> tuple[bytes, sp.Result]:
    return run(simulation), simulation.run(START, None, 1e-3)


def test_scenes_simulations_and_results(trip: Trip) -> None:
    simulation = sp.Simulation(bumpy_scene(), sp.SemiImplicitEuler(1e-4))
    bits = run(simulation)  # after this there is a compiled twin
    assert run(trip(simulation)) == bits
    assert run(sp.Simulation(trip(simulation.scene), simulation.integrator)) == bits
    pairs = trip(simulation.scene.pairs)
    assert pairs[0].side_j.shell is pairs[1].side_j.shell
    result = trip(simulation.run(START, None, 0.01))
    assert run(sp.Simulation(result.scene, simulation.integrator)) == bits


def test_a_process_of_its_own_computes_the_same_bits() -> None:
    simulation = sp.Simulation(bumpy_scene(), sp.Adaptive())
    bits = run(simulation)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        answer, result = pool.apply_async(in_child, (simulation,)).get(timeout=120)
    assert answer == bits
    assert result.scene.pairs[0].law == LAWS[0]


FAILURES = {
    "value": lambda: sp.Sphere(-1.0, "ball"),
    "name": lambda: bumpy_scene().pair("nobody"),
    "diverged": lambda: sp.Simulation(sp.Scene(models.ball()), sp.SemiImplicitEuler(1e-3)).run(
        START, None, 1.0, lambda t, q, v, contacts: np.full(6, 1e300)
    ),
}


@pytest.mark.parametrize("kind", FAILURES)
def test_an_error_passes_between_processes(kind: str, trip: Trip) -> None:
    with pytest.raises(sp.SphshellError) as raised:
        FAILURES[kind]()
    again = trip(raised.value)
    assert type(again) is type(raised.value)
    assert str(again) == str(raised.value)
    assert set(vars(again)) == set(vars(raised.value))


def test_an_open_run_says_why_not(trip: Trip) -> None:
    with pytest.raises(NotPicklable, match=r"OpenRun cannot be pickled.*snapshot\(\)"):
        trip(OpenRun(sp.Simulation(bumpy_scene()), START, record_dt=1e-3))


def test_a_copy_of_a_scene_is_independent(trip: Trip) -> None:
    scene = bumpy_scene()
    other = trip(scene)
    other.replace_pair(other.pairs[0].name, law=sp.ImpactLaw(1e3))
    assert scene.pairs[0].law == LAWS[0]
    assert scene.contacts(START).normal_force[0] != other.contacts(START).normal_force[0]
