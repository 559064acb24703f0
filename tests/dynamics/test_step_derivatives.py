"""State transition of the integrators of fixed step, against differences of runs of one step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import FrozenInstanceError
from itertools import product

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import sphshell_pin as sp
from sphshell_pin.errors import InvalidParameter, NameNotFound
from tests import differences, models
from tests.dynamics.test_contact_derivatives import ARM_V, BRISTLES, FRICTIONS
from tests.dynamics.test_dynamics_derivatives import (
    BRISTLE,
    COULOMB,
    LAWS,
    STOPS,
    arm_on,
    in_bowl,
    moving,
    stuck,
)
from tests.dynamics.test_mimic import CASES as MIMIC
from tests.dynamics.test_mimic import with_contact
from tests.dynamics.test_two_spheres import in_touch, two_spheres
from tests.models import ARM_Q, two_free_bodies, two_free_state
from tests.studies import mostly_studies

Array = NDArray[np.float64]

DT = 2e-4
STEPPERS = {
    "semi-implicit": sp.SemiImplicitEuler(DT),
    "runge-kutta": sp.RungeKutta4(DT),
    "linearly implicit": sp.LinearlyImplicitEuler(DT),
}
every_stepper = pytest.mark.parametrize("stepper", STEPPERS)


def one_step(
    scene: sp.Scene, integrator: object, q: Array, v: Array, tau: Array
) -> tuple[Array, Array]:
    """Return q and v after one step under held torques, by a run."""
    run = sp.Simulation(scene, integrator).run(q, v, integrator.dt, lambda *_: tau)  # type: ignore[attr-defined, arg-type]
    assert len(run.t) == 2
    return run.q[-1], run.v[-1]


def assert_step(
    scene: sp.Scene, integrator: object, q: Array, v: Array, *, tolerance: float = 1e-6
) -> sp.StepDerivatives:
    """Every column relative to its largest entry, positions and velocities apart."""
    model = scene.model
    nv = model.nv
    tau = np.random.default_rng(1).normal(size=nv)
    names = differences.names_of(scene)
    got = sp.Simulation(scene, integrator).step_derivatives(q, v, tau, parameters=names)  # type: ignore[arg-type]
    end = one_step(scene, integrator, q, v, tau)
    np.testing.assert_allclose(got.q, end[0], rtol=0, atol=1e-12 * abs(end[0]).max())
    np.testing.assert_allclose(got.v, end[1], rtol=0, atol=1e-12 * abs(end[1]).max())
    assert got.by_state.shape == (2 * nv, 2 * nv)
    assert got.by_tau.shape == (2 * nv, nv)
    depth = differences.depth_of(scene, q, v)
    fast = max(float(np.abs(v).max(initial=0.0)), 1e-2)

    def after(
        scene: sp.Scene = scene, q: Array = q, v: Array = v, tau: Array = tau
    ) -> tuple[Array, Array]:
        q, v = one_step(scene, integrator, q, v, tau)
        return np.asarray(pin.difference(model, end[0], q)), v - end[1]

    columns = [column for name in names for column in differences.columns_of(name)]
    assert list(got.parameters) == columns
    # How well both are known: positions to eps times their size, over what a column changes.
    known = differences.ROUNDING * np.array([1.0, max(1.0, float(np.abs(end[1]).max()))])
    eye, errors = np.eye(nv), {}

    def bound(name: str) -> float:
        # At its bound, 0, a number is differenced to one side.
        at_bound = name in columns and differences.scale_of(scene, name, depth)[1]
        return 10.0 * tolerance if at_bound else tolerance

    def check(name: str, column: Array, f: Callable[[float], tuple[Array, Array]], **more) -> None:  # type: ignore[no-untyped-def]
        for part, rows in enumerate((slice(0, nv), slice(nv, 2 * nv))):
            errors[f"{'qv'[part]} by {name}"] = differences.off(
                column[rows],
                lambda x, part=part: f(x)[part],
                tolerance=bound(name),
                known=float(known[part]),
                **more,
            )

    floor = 1e-2
    for k, e in enumerate(eye):
        by_q, by_v = got.by_state[:, k], got.by_state[:, nv + k]
        move = lambda x, e=e: after(q=pin.integrate(model, q, x * e))  # noqa: E731
        check(f"q{k}", by_q, move, scale=depth, floor=floor)
        check(f"v{k}", by_v, lambda x, e=e: after(v=v + x * e), scale=fast, floor=floor * DT)
        check(f"tau{k}", got.by_tau[:, k], lambda x, e=e: after(tau=tau + x * e), scale=1e3)
    # Along the surface a place may not matter, and rounding is that of the others.
    places = [k for k, column in enumerate(columns) if differences.is_place(column)]
    among = 1e-2 * float(np.abs(got.by_parameters[:, places]).max(initial=0.0))
    for k, column in enumerate(columns):
        size = DT * among if k in places else 0.0
        scale, ahead = differences.scale_of(scene, column, depth)
        f = lambda x, c=column: after(scene=differences.changed(scene, c, x))  # noqa: E731
        check(column, got.by_parameters[:, k], f, scale=scale, ahead=ahead, floor=size)
    wrong = {name: error for name, error in errors.items() if not error <= bound(name[5:])}
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


@every_stepper
@pytest.mark.parametrize("friction", BRISTLES)
def test_bristles_are_stretched_within_the_step(friction: str, stepper: str) -> None:
    scene, q, v = in_bowl(LAWS["impact"], FRICTIONS[friction])
    assert_step(scene, STEPPERS[stepper], q, v)


@every_stepper
def test_two_spheres(stepper: str) -> None:
    scene = two_spheres(LAWS["impact"], COULOMB)
    assert_step(scene, STEPPERS[stepper], *in_touch(3))


@every_stepper
def test_joint_components(stepper: str) -> None:
    scene, q, v = in_bowl(LAWS["impact"], COULOMB, joints=STOPS)
    assert_step(scene, STEPPERS[stepper], q, v)


@every_stepper
@pytest.mark.parametrize("name", mostly_studies(MIMIC, lambda name: name != "panda"))
def test_mimic_joints(name: str, stepper: str) -> None:
    make, tip, other = MIMIC[name]
    scene = with_contact(make()[0], tip, other)
    # Less deep than half a radius.
    scene = differences.changed(scene, f"{scene.pairs[0].name}.placement.vz", -0.45)
    rng, nv = np.random.default_rng(3), scene.model.nv
    q, v = rng.uniform(-0.3, 0.3, scene.model.nq), 0.1 * rng.normal(size=nv)
    assert len(scene.contacts(q, v)) == 1
    assert_step(scene, STEPPERS[stepper], q, v)


@every_stepper
def test_nothing_touches(stepper: str) -> None:
    scene = two_free_bodies(LAWS["impact"], COULOMB)
    got = assert_step(scene, STEPPERS[stepper], *two_free_state(depth=-0.2))
    assert not got.by_parameters.any()


@every_stepper
def test_a_ballistic_step_in_closed_form(stepper: str) -> None:
    """A sliding mass in gravity: q + dt v + ..., v + dt (tau / m - g)."""
    scene = models.on_plate(models.slider(mass=2.0), LAWS["impact"])
    simulation = sp.Simulation(scene, STEPPERS[stepper])
    got = simulation.step_derivatives([1.0], [0.3], [0.7])
    np.testing.assert_allclose(got.by_state, [[1.0, DT], [0.0, 1.0]], rtol=0, atol=1e-15)
    half = 0.5 if stepper == "runge-kutta" else 1.0
    np.testing.assert_allclose(got.by_tau, [[half * DT**2 / 2.0], [DT / 2.0]], rtol=1e-12)
    assert got.v[0] == pytest.approx(0.3 + DT * (0.35 - 9.81), rel=1e-14)
    assert got.parameters == ()
    assert got.by_parameters.shape == (2, 0)


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
    """One step of the own loop, with what ten steps have stretched; the next step's state moves."""
    (scene, q, v), state = stuck()
    model, tau = scene.model, np.array([0.3, -0.2, 0.1])
    simulation = sp.Simulation(scene, STEPPERS["semi-implicit"])
    names = [name for name in differences.names_of(scene) if name.endswith(".stiffness")]
    got = simulation.step_derivatives(q, v, tau, parameters=names, state=state)

    def after(q: Array, v: Array, tau: Array) -> tuple[Array, Array]:
        v = v + DT * differences.acceleration(scene, q, v, tau, state)
        return np.asarray(pin.integrate(model, q, DT * v)), v

    end = after(q, v, tau)
    np.testing.assert_allclose(got.q, end[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(got.v, end[1], rtol=0, atol=1e-12)
    without = simulation.step_derivatives(q, v, tau)
    assert np.abs(without.v - got.v).max() > 1e-5
    for k, e in enumerate(np.eye(3)):
        moves = {
            "q": (got.by_state[:, k], lambda x, e=e: after(q + x * e, v, tau), 5e-3),
            "v": (got.by_state[:, 3 + k], lambda x, e=e: after(q, v + x * e, tau), 0.01),
            "tau": (got.by_tau[:, k], lambda x, e=e: after(q, v, tau + x * e), 1e3),
        }
        for column, f, scale in moves.values():
            for part, rows in enumerate((slice(0, 3), slice(3, 6))):
                one = lambda x, f=f, part=part: f(x)[part] - end[part]  # noqa: E731
                error = differences.off(
                    column[rows], one, scale, floor=1e-2 * DT, known=differences.ROUNDING
                )
                assert error <= 1e-6
    # One evaluation a step: the velocity changes by dt times the accelerations.
    step = DT * scene.dynamics_derivatives(q, v, tau, parameters=names, state=state).by_parameters
    size = np.abs(step).max(axis=0)
    assert np.abs((got.by_parameters[3:] - step) / size).max() <= 1e-12
    assert np.abs((got.by_parameters[:3] - DT * step) / (DT * size)).max() <= 1e-12


def test_matrices_of_steps_in_a_row_are_those_of_a_run() -> None:
    """The product over ten steps, against differences of a run of ten steps."""
    scene, q, v = in_bowl(LAWS["impact"], COULOMB)
    model, zero, count = scene.model, np.zeros(3), 10
    for integrator in STEPPERS.values():
        simulation = sp.Simulation(scene, integrator)
        whole, at, speed = np.eye(6), q, v
        for _ in range(count):
            step = simulation.step_derivatives(at, speed)
            whole, at, speed = step.by_state @ whole, step.q, step.v

        def end(q: Array, v: Array, simulation: sp.Simulation = simulation) -> Array:
            run = simulation.run(q, v, count * DT, lambda *_: zero)
            return np.r_[run.q[-1], run.v[-1]]

        for k, e in enumerate(np.eye(3)):
            start = end(q, v)
            by_q = lambda x, e=e, s=start: end(pin.integrate(model, q, x * e), v) - s  # noqa: E731
            by_v = lambda x, e=e, s=start: end(q, v + x * e) - s  # noqa: E731
            for column, f, scale in ((k, by_q, 5e-3), (3 + k, by_v, 0.4)):
                known = differences.ROUNDING
                assert differences.off(whole[:, column], f, scale, known=known) <= 1e-6


@pytest.mark.parametrize("integrator", [sp.Adaptive(), sp.Implicit()], ids=["adaptive", "implicit"])
def test_an_integrator_of_variable_step_is_refused(integrator: object) -> None:
    scene, q, v = in_bowl(LAWS["impact"], COULOMB)
    with pytest.raises(InvalidParameter, match="SemiImplicitEuler"):
        sp.Simulation(scene, integrator).step_derivatives(q, v)  # type: ignore[arg-type]


def test_bad_input() -> None:
    scene, q, v = in_bowl(LAWS["impact"], COULOMB)
    simulation = sp.Simulation(scene, sp.RungeKutta4(DT))
    with pytest.raises(NameNotFound, match=r"tip\.law\.stiffness"):
        simulation.step_derivatives(q, v, parameters=["tip.law.stifness"])
    with pytest.raises(NameNotFound):
        simulation.step_derivatives(q, v, parameters=["v0"])
    with pytest.raises(InvalidParameter, match=r"tip\.law\.stiffness"):
        simulation.step_derivatives(q, v, parameters=["tip.law.stiffness"] * 2)
    with pytest.raises(InvalidParameter, match="tau"):
        simulation.step_derivatives(q, v, np.zeros(2))
    with pytest.raises(InvalidParameter, match="v = "):
        simulation.step_derivatives(q, np.zeros(4))
    other, *_ = arm_on(models.plate(), np.zeros(3), np.eye(3)[2], LAWS["impact"], BRISTLE)
    with pytest.raises(InvalidParameter, match="state of this scene"):
        simulation.step_derivatives(q, v, state=other.state(ARM_Q, ARM_V))
    got = simulation.step_derivatives(q, v)
    with pytest.raises(FrozenInstanceError):
        got.by_tau = got.by_state  # type: ignore[misc]
