"""Contacts as constraints for Pinocchio's ADMM: rolling, sliding, and what they state."""

from itertools import product

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.dynamics.scene.models import mass_matrix
from sphshell_pin.errors import InvalidParameter
from tests.models import ball, on_shell, square

RADIUS, MASS, DT = 0.02, 0.26, 1e-3


def ball_on_a_slope(angle: float, mu: float | None):
    """A steel ball that rests on a slope, turned in its joint, and its configuration."""
    law, turn = sp.HertzLaw.of("steel", "steel"), pin.exp3(np.array([0.0, angle, 0.0]))
    placement = pin.SE3(turn, np.array([0.1, 0.2, 0.3]))
    friction = None if mu is None else sp.CoulombFriction(mu, mu)
    model, more = ball(9.81, MASS, RADIUS), {"radius": RADIUS, "placement": placement}
    scene = on_shell(model, square(), law, friction, **more)
    depth = scene.pairs[0].plane_law.depth_at(MASS * 9.81 * np.cos(angle))
    q = pin.neutral(model)
    q[:3] = placement.translation + (RADIUS - depth) * turn[:, 2]
    q[3:] = pin.Quaternion(pin.exp3(np.array([0.3, 0.2, 0.1]))).coeffs()
    return scene, q, depth


def solved(scene: sp.Scene, q) -> np.ndarray:
    """Return the force [N] of the one contact that ADMM finds for a step from rest, normal last."""
    (constraint,) = scene.constraints(q).models
    model, data = scene.model, scene.model.createData()
    pin.computeJointJacobians(model, data, q)
    mass = mass_matrix(model, q)
    free = -DT * np.linalg.solve(mass, pin.nonLinearEffects(model, data, q, np.zeros(model.nv)))
    models, datas = pin.StdVec_ConstraintModel(), pin.StdVec_ConstraintData()
    models.append(pin.ConstraintModel(constraint))
    datas.append(models[0].createData())
    models[0].calc(model, data, datas[0])
    own = constraint.createData()
    constraint.calc(model, data, own)
    jacobian = constraint.jacobian(model, data, own)
    delassus = pin.DelassusOperatorDense(jacobian @ np.linalg.solve(mass, jacobian.T))
    settings, result = pin.ADMMSolverSettings(), pin.ADMMSolverResult()
    settings.max_iterations = 10_000
    for name in product(("absolute", "relative"), ("feasibility", "complementarity")):
        setattr(settings, "_".join([*name, "tol"]), 1e-14)
    solver = pin.ADMMConstraintSolver()
    assert solver.solve(delassus, jacobian @ free, models, datas, settings, result)
    return np.array(result.retrieveConstraintImpulses()) / DT


@pytest.mark.parametrize("angle", [0.05, 0.3, 0.6])
def test_a_ball_rolls_down_a_slope(angle):
    """T / N = 2/7 tan(angle), as long as friction carries it."""
    scene, q, _ = ball_on_a_slope(angle, mu=0.3)
    force = solved(scene, q)
    assert np.linalg.norm(force[:2]) / force[2] == pytest.approx(2 / 7 * np.tan(angle), abs=1e-8)
    assert force[2] == pytest.approx(MASS * 9.81 * np.cos(angle), rel=1e-9)


@pytest.mark.parametrize("mu", [0.05, None])
def test_a_ball_slides_where_friction_does_not_carry_it(mu):
    scene, q, _ = ball_on_a_slope(0.6, mu)
    force = solved(scene, q)
    assert np.linalg.norm(force[:2]) == pytest.approx((mu or 0.0) * force[2], abs=1e-8)


def test_constraints_are_those_of_the_contacts():
    scene, q, depth = ball_on_a_slope(0.3, mu=0.4)
    found, contacts = scene.constraints(q), scene.contacts(q)
    (made,) = found.models
    assert (made.joint1_id, made.joint2_id) == (0, 1)
    assert made.getFriction() == 0.4
    assert found.depth == pytest.approx([depth], rel=1e-6)
    assert list(found.pair) == [0]
    assert made.joint1_placement.translation == pytest.approx(contacts.point_world[0])
    assert made.joint1_placement.rotation[:, 2] == pytest.approx(contacts.normal_world[0])
    assert np.linalg.norm(made.joint2_placement.translation) == pytest.approx(RADIUS)
    law, step = scene.pairs[0].plane_law, 1e-3 * depth
    slope = (law.normal_force(depth + step) - law.normal_force(depth - step)) / (2 * step)
    assert found.compliance == pytest.approx([1 / slope], rel=1e-4)
    q[2] += 1.0
    assert not scene.constraints(q).models
    with pytest.raises(InvalidParameter):
        scene.constraints(q[:3])
