"""Friction of one's own does what the friction does whose formula it states."""

import math

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin import errors
from sphshell_pin.scenario import build
from sphshell_pin.testing import assert_derivatives
from tests import models
from tests.contact.test_function_law import BALL, C_LAW, FORCE, MOVES, TWIN
from tests.scenario.files import DROP, write

NUMBERS = {"mu": 0.3, "v": 0.1}
SMOOTH = sp.CoulombFriction(0.3, 0.3, 0.1, 0.2)  # a cubic up to 0.1 m/s
LINE = (
    'friction = { type = "function", function = "own.py:size", parameters = { mu = 0.3, v = 0.1 } }'
)


def size(slip, normal, parameters):
    x = min(slip / parameters[1], 1.0)
    return parameters[0] * normal * x * (3 - x * x) / 2


OWN = sp.FunctionFriction(FORCE(size), NUMBERS)
SLOW = np.array([0.03, 0.02, -0.05, 0.4, 0.3, 0.2])  # 0.03 m/s of slip and some spin


def python_friction():
    with pytest.warns(errors.SlowLawWarning, match="a FunctionFriction of a Python function"):
        return sp.FunctionFriction(size, NUMBERS)


@pytest.mark.parametrize("make", [lambda: OWN, python_friction], ids=["C", "python"])
def test_it_answers_as_its_twin(make) -> None:
    own = make()
    for speed in (0.0, 1e-6, 0.02, 0.1, 3.0):
        assert own.coefficient(speed, 5.0) == pytest.approx(SMOOTH.coefficient(speed), abs=1e-12)
    assert own.slip_time(2.0, 7.0, 0.0) == pytest.approx(SMOOTH.slip_time(2.0, 7.0, 0.0), rel=1e-9)
    assert own.coefficient(own.sticking_speed) == pytest.approx(0.3, rel=0.01)
    assert own.sticking_speed == pytest.approx(0.1, rel=0.15)
    assert (own.mu, own.v, own.has_state) == (0.3, 0.1, False)
    scenes = [models.on_plate(models.ball(), TWIN, one) for one in (own, SMOOTH)]
    for moves in (SLOW, MOVES, 0 * MOVES):
        ours, theirs = (one.external_forces(BALL, moves)[1].vector for one in scenes)
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12 * np.abs(theirs).max())


def test_what_follows_from_the_load_by_no_coefficient() -> None:
    """Adhesion: a part of the force that is there whatever the load."""
    own = sp.FunctionFriction(
        FORCE(lambda slip, normal, p: (p[0] + 0.2 * normal) * min(slip / 0.01, 1.0)),
        {"adhesion": 3.0},
    )
    scene = models.on_plate(models.ball(), TWIN, own)
    contacts = scene.contacts(BALL, MOVES)
    (normal,), (friction,) = contacts.normal_force, contacts.friction_force_world
    assert np.linalg.norm(friction) == pytest.approx(3.0 + 0.2 * normal, rel=1e-12)
    assert own.coefficient(1.0, 10.0) == pytest.approx(0.5)
    slopes = scene.dynamics_derivatives(
        BALL, MOVES, np.zeros(6), parameters=["ball-plate.friction.adhesion"]
    )
    # Of 1 N more of it.
    pushed = scene.model.inertias[1].mass * slopes.by_parameters[:3, 0]
    np.testing.assert_allclose(pushed, friction / np.linalg.norm(friction), rtol=0, atol=1e-6)


@pytest.mark.parametrize("law", [TWIN, C_LAW], ids=["built in", "of one's own"])
@pytest.mark.parametrize("moves", [SLOW, MOVES, 0 * MOVES], ids=["slow", "fast", "at rest"])
def test_derivatives_are_those_of_the_twin(law, moves) -> None:
    own, twin = (models.on_plate(models.ball(), law, one) for one in (OWN, SMOOTH))
    if moves.any():
        assert_derivatives(own, BALL, moves)
    found, exact = (one.dynamics_derivatives(BALL, moves, np.zeros(6)) for one in (own, twin))
    for name in ("by_q", "by_v"):
        ours, theirs = getattr(found, name), getattr(exact, name)
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-7 * np.abs(theirs).max())


def test_a_run_is_that_of_the_twin_and_keeps_its_energy() -> None:
    runs = [
        sp.Simulation(models.on_plate(models.ball(), TWIN, one), sp.Adaptive(1e-10)).run(
            BALL, MOVES, 0.05, record_dt=1e-3
        )
        for one in (OWN, SMOOTH)
    ]
    np.testing.assert_allclose(runs[0].q, runs[1].q, rtol=0, atol=1e-8)
    assert np.abs(runs[0].energy.residual).max() < 1e-8
    assert runs[0].energy.friction_loss[-1] > 1e-4


def test_what_is_negative_counts_as_none_and_no_number_is_refused() -> None:
    scene = models.on_plate(models.ball(), TWIN, sp.FunctionFriction(FORCE(lambda s, n, p: -n)))
    assert not scene.contacts(BALL, MOVES).friction_force_world.any()
    wrong = models.on_plate(
        models.ball(), TWIN, sp.FunctionFriction(FORCE(lambda s, n, p: math.nan))
    )
    with pytest.raises(errors.SphshellError, match="of a FunctionFriction is nan at slip speed"):
        wrong.external_forces(BALL, MOVES)


def test_what_does_not_vanish_at_rest_is_warned_of() -> None:
    constant = sp.FunctionFriction(FORCE(lambda s, n, p: 0.3 * n))
    with pytest.warns(errors.SetupWarning, match="does not vanish at rest"):
        models.on_plate(models.ball(), TWIN, constant)


def test_a_scenario_names_it(tmp_path) -> None:
    code = "def size(s, n, p):\n    x = min(s / p[1], 1.0)\n"
    code += "    return p[0] * n * x * (3 - x * x) / 2\n"
    (tmp_path / "own.py").write_text(code)
    law = next(one for one in DROP.splitlines() if one.startswith("law"))
    path = write(tmp_path, DROP.replace(law, f"{law}\n{LINE}"))
    with pytest.warns(errors.SlowLawWarning):
        built = build(path)
    (pair,) = built.scene.pairs
    assert isinstance(pair.friction, sp.FunctionFriction)
    assert pair.friction.parameters == NUMBERS
    starts, speeds = [built.q0] * 2, [[0.1, 0.0, -0.2, 0.0, 0.0, 0.0]] * 2
    mu = {"ball-plate.friction.mu": [0.1, 0.5]}
    runs = built.simulation.rollout(starts, speeds, 0.02, vary=mu)
    assert runs[0].v[-1][0] > runs[1].v[-1][0]
