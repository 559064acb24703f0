"""Scenes in CasADi: values and Jacobians against the scene's own, and a program solved."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import InvalidParameter, NameNotFound
from tests import models
from tests.adapters.test_crocoddyl import arm_on_moving_plate, free_ball, with_bristles
from tests.differences import acceleration

casadi = pytest.importorskip("casadi")

from sphshell_pin.adapters.casadi import ForwardDynamics, Step  # noqa: E402

CASES = {"arm": arm_on_moving_plate, "ball": free_ball}
PARAMETERS = ("touch.law.stiffness", "touch.sphere.radius")


def flat(matrix) -> np.ndarray:
    """Return CasADi's matrix as a vector."""
    return np.array(matrix).ravel()


def columns(f, inputs: list[np.ndarray], k: int, steps: np.ndarray) -> np.ndarray:
    """Return central differences of order 4 of the outputs, one behind the other, by input k."""

    def at(e):
        moved = [one + e if i == k else one for i, one in enumerate(inputs)]
        return np.concatenate([flat(out) for out in f.call(moved)])

    out = [
        (8 * (at(e) - at(-e)) - (at(2 * e) - at(-2 * e))) / (12 * e.max()) for e in np.diag(steps)
    ]
    return np.transpose(out)


def jacobian(f, inputs: list[np.ndarray], k: int) -> np.ndarray:
    """Return CasADi's Jacobian of all outputs by input k."""
    symbols = [casadi.MX.sym(f.name_in(i), f.size1_in(i)) for i in range(f.n_in())]
    outputs = casadi.vertcat(*f.call(symbols))
    return np.array(casadi.Function("j", symbols, [casadi.jacobian(outputs, symbols[k])])(*inputs))


@pytest.mark.parametrize("parameters", [(), PARAMETERS], ids=["state", "parameters"])
@pytest.mark.parametrize("kind", ["dynamics", "euler", "runge-kutta"])
@pytest.mark.parametrize("case", CASES)
def test_jacobians_are_those_of_differences(case, kind, parameters):
    scene, x = CASES[case]()
    nq, nv = scene.model.nq, scene.model.nv
    # A start apart from q, so that the chart of CasADi's q is seen.
    q0 = pin.integrate(scene.model, x[:nq], np.linspace(-0.3, 0.4, nv))
    if kind == "dynamics":
        f = ForwardDynamics(scene, q0, parameters=parameters)
    else:
        integrator = sp.SemiImplicitEuler(1e-4) if kind == "euler" else sp.RungeKutta4(1e-4)
        f = Step(sp.Simulation(scene, integrator), q0, parameters=parameters)
    inputs = [pin.difference(scene.model, q0, x[:nq]), x[nq:], np.linspace(-1.0, 1.0, nv)]
    steps = [np.full(nv, step) for step in (1e-6, 1e-6, 1e-2)]
    if parameters:
        inputs.append(np.array([2.1e6, 0.02001]))
        steps.append(1e-6 * inputs[3])
    for k, step in enumerate(steps):
        expected, got = columns(f, inputs, k, step), jacobian(f, inputs, k)
        largest = np.abs(expected).max(axis=0)
        assert largest.any()
        off = np.abs(got - expected).max(axis=0)
        assert (off <= 2e-6 * np.maximum(largest, 1e-6 * largest.max())).all(), (kind, k)


def test_values_are_those_of_the_scene():
    scene, x = free_ball()
    nq, nv = scene.model.nq, scene.model.nv
    q, v, tau = x[:nq], x[nq:], np.linspace(-1.0, 1.0, nv)
    got = flat(ForwardDynamics(scene, q)(np.zeros(nv), v, tau))
    np.testing.assert_allclose(got, acceleration(scene, q, v, tau), rtol=1e-12)
    simulation = sp.Simulation(scene, sp.RungeKutta4(1e-4))
    q_next, v_next = (flat(one) for one in Step(simulation, q)(np.zeros(nv), v, tau))
    run = simulation.run(q, v, 1e-4, lambda t, q, v, contacts: tau)
    np.testing.assert_allclose(pin.integrate(scene.model, q, q_next), run.q[-1], atol=1e-14)
    np.testing.assert_allclose(v_next, run.v[-1], rtol=1e-12, atol=1e-14)


def test_a_nonlinear_program_finds_the_torques_that_hold_a_press():
    """Of all postures in which an arm presses with 3 N, the one with the least torques."""
    model, joint, reach = models.empty(), 0, np.array([0.3, 0.0, 0.0])
    lump = pin.Inertia(0.5, reach / 2, np.diag([2e-4, 2e-4, 2e-4]))
    end = pin.SE3(np.eye(3), reach)
    for name, place in (("arm", None), ("tip", end)):
        more = {"placement": place, "inertia": lump, "frame": end}
        joint = models.add_body(model, name, pin.JointModelRY(), joint, **more)
    scene = sp.Scene(model)
    law = sp.ImpactLaw(2e5, 1.5)
    below = pin.SE3(np.eye(3), np.array([0.0, 0.0, -0.2]))
    table = {"shell": models.square(), "placement": below, "law": law, "name": "touch"}
    scene.add_contact(sp.Sphere(0.02, "tip"), **table)
    f = ForwardDynamics(scene)
    q, tau = casadi.MX.sym("q", 2), casadi.MX.sym("tau", 2)
    height = -0.3 * casadi.sin(q[0]) - 0.3 * casadi.sin(q[0] + q[1])
    problem = {"x": casadi.vertcat(q, tau), "f": casadi.sumsqr(tau)}
    problem["g"] = casadi.vertcat(f(q, np.zeros(2), tau), height)
    ipopt = {"print_level": 0, "hessian_approximation": "limited-memory", "tol": 1e-10}
    solver = casadi.nlpsol("press", "ipopt", problem, {"print_time": False, "ipopt": ipopt})
    wanted = [0.0, 0.0, -0.2 + 0.02 - law.depth_at(3.0)]
    found = flat(solver(x0=[0.0, 0.6, -1.0, 0.0], lbg=wanted, ubg=wanted)["x"])
    assert solver.stats()["success"]
    contacts = scene.contacts(found[:2])
    assert contacts.normal_force.sum() == pytest.approx(3.0, rel=1e-6)
    # Held by gravity and the press alone, by Pinocchio.
    data, axes = model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    weight = pin.computeGeneralizedGravity(model, data, found[:2])
    lever = pin.computeFrameJacobian(model, data, found[:2], model.getFrameId("tip"), axes)
    np.testing.assert_allclose(found[2:], weight - 3.0 * lever[2], atol=1e-5)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda s: ForwardDynamics(s, parameters=["touch.law.stifness"]), r"touch\.law\.stiffness"),
        (lambda s: ForwardDynamics(s, parameters=["touch.sphere.offset"]), "one number"),
        (lambda s: Step(sp.Simulation(s, sp.Adaptive())), "fixed step"),
        (Step, r"must be a sphshell_pin\.Simulation"),
        (lambda s: ForwardDynamics(with_bristles(s)), "bristles in the friction of touch"),
    ],
)
def test_wrong_arguments_get_a_sentence(call, said):
    with pytest.raises((InvalidParameter, NameNotFound), match=said):
        call(free_ball()[0])


def test_bristles_may_be_taken_without_their_history():
    scene, _ = free_ball()
    q0 = scene.neutral
    q0[2] = 0.02 - 2e-4
    loose = ForwardDynamics(with_bristles(scene), q0, without_history=True)
    assert flat(loose(np.zeros(6), np.zeros(6), np.zeros(6)))[2] > 0.0
