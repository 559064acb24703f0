"""State transition of the integrators of fixed step, against differences of runs of one step."""

from functools import partial
from itertools import product

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import InvalidParameter, NameNotFound
from tests import differences, models
from tests.dynamics import scenes
from tests.dynamics.scenes import COULOMB, FRICTIONS, LAWS, in_bowl, moving
from tests.dynamics.test_mimic import CASES as MIMIC
from tests.models import two_free_bodies, two_free_state
from tests.studies import mostly_studies

DT = 2e-4
STEPPERS = {
    "semi-implicit": sp.SemiImplicitEuler(DT),
    "runge-kutta": sp.RungeKutta4(DT),
    "linearly implicit": sp.LinearlyImplicitEuler(DT),
}
every_stepper = pytest.mark.parametrize("stepper", STEPPERS)


def one_step(scene, integrator, q, v, tau):
    """Return q and v after one step under held torques, by a run."""
    run = sp.Simulation(scene, integrator).run(q, v, integrator.dt, lambda *_: tau)  # type: ignore[attr-defined, arg-type]
    assert len(run.t) == 2
    return run.q[-1], run.v[-1]


def assert_step(scene, integrator, q, v):
    """Compare the derivatives of a step with those of runs of one step.

    Every column relative to its largest entry, positions and velocities apart.
    """
    model, nv = scene.model, scene.model.nv
    tau = np.random.default_rng(1).normal(size=nv)
    names = differences.names_of(scene)
    got = sp.Simulation(scene, integrator).step_derivatives(q, v, tau, parameters=names)  # type: ignore[arg-type]
    end = one_step(scene, integrator, q, v, tau)
    np.testing.assert_allclose(got.q, end[0], rtol=0, atol=1e-12 * abs(end[0]).max())
    np.testing.assert_allclose(got.v, end[1], rtol=0, atol=1e-12 * abs(end[1]).max())
    assert got.by_state.shape == (2 * nv, 2 * nv)
    assert got.by_tau.shape == (2 * nv, nv)
    columns = [column for name in names for column in differences.columns_of(name)]
    assert list(got.parameters) == columns

    def after(scene: sp.Scene, q: Array, v: Array, tau: Array) -> tuple[Array, Array]:
        q, v = one_step(scene, integrator, q, v, tau)
        return np.asarray(pin.difference(model, end[0], q)), v - end[1]

    moves = differences.moves(scene, q, v, tau)
    known = differences.ROUNDING * np.array([1.0, max(1.0, float(np.abs(end[1]).max()))])
    blocks = {f"q.{k}": (got.by_state[:, k], 1e-2) for k in range(nv)}
    blocks |= {f"v.{k}": (got.by_state[:, nv + k], 1e-2 * DT) for k in range(nv)}
    blocks |= {f"tau.{k}": (got.by_tau[:, k], 0.0) for k in range(nv)}
    # Along the surface a place may not matter, and rounding is that of the others.
    places = [k for k, column in enumerate(columns) if differences.is_place(column)]
    among = 1e-2 * DT * float(np.abs(got.by_parameters[:, places]).max(initial=0.0))
    for k, column in enumerate(columns):
        blocks[column] = got.by_parameters[:, k], among if k in places else 0.0
    wrong = {}
    for (name, (column, floor)), part in product(blocks.items(), (0, 1)):
        moved, scale, ahead = moves[name]
        # At its bound, 0, a number is differenced to one side.
        bound = 1e-5 if ahead else 1e-6
        limits = {"floor": floor, "tolerance": bound, "known": float(known[part]), "ahead": ahead}
        f = lambda x, moved=moved, part=part: after(*moved(x))[part]  # noqa: E731
        error = differences.off(np.split(column, 2)[part], f, scale, **limits)
        if not error <= bound:
            wrong[f"{'qv'[part]} by {name}"] = error
    assert not wrong
    return got


# Slow ones on a shell that moves are studies.
STEPS = mostly_studies(
    product([in_bowl, moving], ["impact", "hunt-crossley", "hertz, two materials", "foundation"]),
    lambda both: both[1] == "impact" or (both[0] is in_bowl and both[1] != "foundation"),
)


@every_stepper
@pytest.mark.parametrize(("make", "law"), STEPS)
def test_a_touching_step(make, law: str, stepper: str) -> None:  # type: ignore[no-untyped-def]
    scene, q, v = make(LAWS[law], COULOMB)
    assert_step(scene, STEPPERS[stepper], q, v)


IMPACT = LAWS["impact"]
SCENES = {slip: partial(in_bowl, IMPACT, FRICTIONS[slip]) for slip in scenes.BRISTLES}
SCENES["two spheres"] = partial(scenes.balls, "impact", "coulomb")
SCENES |= {name: partial(scenes.mimicking, name) for name in MIMIC}
SCENES["joint components"] = partial(in_bowl, LAWS["impact"], COULOMB, joints=scenes.STOPS)


@every_stepper
@pytest.mark.parametrize("name", mostly_studies(SCENES, lambda name: name != "panda"))
def test_a_step_of_other_scenes(name: str, stepper: str) -> None:
    """Bristles are stretched within the step."""
    scene, q, v = SCENES[name]()
    assert len(scene.contacts(q, v)) == 1
    assert_step(scene, STEPPERS[stepper], q, v)


@every_stepper
def test_nothing_touches(stepper: str) -> None:
    scene = two_free_bodies(LAWS["impact"], COULOMB)
    got = assert_step(scene, STEPPERS[stepper], *two_free_state(depth=-0.2))
    assert not got.by_parameters.any()


@every_stepper
def test_a_step_on_a_linear_spring_in_closed_form(stepper: str) -> None:
    """q'' = -w^2 q: each method has its own matrix."""
    k, m = 4e5, 2.0
    scene = models.on_plate(models.slider(gravity=0.0, mass=m), sp.ImpactLaw(k, 1.0))
    got = sp.Simulation(scene, STEPPERS[stepper]).step_derivatives([0.045], [-0.3])
    h, w2 = DT, k / m
    a = np.array([[0.0, 1.0], [-w2, 0.0]])
    powers = [np.linalg.matrix_power(h * a, n) for n in range(5)]
    expected = {
        "semi-implicit": np.array([[1 - h * h * w2, h], [-h * w2, 1.0]]),
        "runge-kutta": sum(p / f for p, f in zip(powers, (1, 1, 2, 6, 24), strict=True)),
        "linearly implicit": np.linalg.inv(np.eye(2) - h * a),
    }[stepper]
    scale = np.abs(expected).max(axis=1, keepdims=True)
    assert np.abs((got.by_state - expected) / scale).max() <= 1e-12


@pytest.mark.parametrize("depth", [-3e-8, 3e-8])
def test_a_linearly_implicit_step_near_a_touch_is_that_of_its_side(depth: float) -> None:
    """Its matrix has second derivatives of the rates, which a touch must not come into."""
    k, m = 4e5, 2.0
    scene = models.on_plate(models.slider(gravity=0.0, mass=m), sp.ImpactLaw(k, 1.0))
    q = [0.05 - depth]
    assert len(scene.contacts(np.array(q), np.zeros(1))) == (depth > 0)
    got = sp.Simulation(scene, STEPPERS["linearly implicit"]).step_derivatives(q, [-0.3])
    a = np.array([[0.0, 1.0], [-k / m if depth > 0 else 0.0, 0.0]])
    np.testing.assert_allclose(got.by_state, np.linalg.inv(np.eye(2) - DT * a), rtol=1e-9)


def test_a_state_with_bristles() -> None:
    """Of one evaluation a step: the velocity changes by dt times the accelerations of the state."""
    (scene, q, v), state = scenes.stuck()
    tau, dt = np.array([0.3, -0.2, 0.1]), DT
    simulation = sp.Simulation(scene, STEPPERS["semi-implicit"])
    names = [name for name in differences.names_of(scene) if name.endswith(".stiffness")]
    got = simulation.step_derivatives(q, v, tau, parameters=names, state=state)
    by = scene.dynamics_derivatives(q, v, tau, parameters=names, state=state)
    assert np.abs(simulation.step_derivatives(q, v, tau).v - got.v).max() > 1e-5
    np.testing.assert_allclose(got.v, v + dt * by.acceleration, rtol=0, atol=1e-12)
    np.testing.assert_allclose(got.q, q + dt * got.v, rtol=0, atol=1e-12)
    columns = np.hstack([dt * by.by_q, np.eye(3) + dt * by.by_v, dt * by.by_parameters])
    places = dt * columns + np.eye(3, columns.shape[1])
    found = np.hstack([got.by_state, got.by_parameters])
    for part, expected in zip(np.split(found, 2), (places, columns), strict=True):
        size = np.abs(expected).max(axis=0)
        assert (np.abs(part - expected) <= 1e-12 * np.maximum(size, dt)).all()


def test_bad_input() -> None:
    """What else is refused is that of `dynamics_derivatives`."""
    scene, q, v = in_bowl(LAWS["impact"], COULOMB)
    for integrator in (sp.Adaptive(), sp.Implicit()):
        with pytest.raises(InvalidParameter, match="SemiImplicitEuler"):
            sp.Simulation(scene, integrator).step_derivatives(q, v)
    with pytest.raises(NameNotFound, match=r"law\.stiffness"):
        sp.Simulation(scene, sp.RungeKutta4(DT)).step_derivatives(q, v, parameters=["tip.law.x"])
