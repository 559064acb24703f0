"""Forces against accelerations: Newton's law and action against reaction, without the core's sums.

The contact forces of `Scene.contacts` are carried to the joints by Pinocchio's Jacobians, and the
equations of motion are solved with the mass matrix: a way apart from `Scene.external_forces` and
ABA.
"""

import math

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics import Scene
from sphshell_pin.dynamics.scene.models import mass_matrix
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.testing.finding import Finding, Optional


def point_jacobian(model: pin.Model, data: pin.Data, joint: int, point_world: Array) -> Array:
    """Return the Jacobian (3, nv) of the point of `joint`'s body that is at `point_world` (3,).

    Linear velocity in world axes [m/s]; `data` holds the joints' Jacobians
    (pinocchio.computeJointJacobians). Zero for the universe, joint 0.
    """
    if joint == 0:
        return np.zeros((3, model.nv))
    at_origin = joint_jacobian(model, data, joint, pin.ReferenceFrame.WORLD)
    return np.asarray(at_origin[:3] - pin.skew(point_world) @ at_origin[3:])


def joint_jacobian(model: pin.Model, data: pin.Data, joint: int, axes: pin.ReferenceFrame) -> Array:
    """Return the Jacobian (6, nv) of a joint; Pinocchio gives a vector where nv is one."""
    return np.asarray(pin.getJointJacobian(model, data, joint, axes)).reshape(6, model.nv)


def contact_torques(scene: Scene, data: pin.Data, q: Array, v: Array) -> Array:
    """Return the contact forces as joint torques (nv,): the sum of J^T f over `scene.contacts`."""
    model = scene.model
    pin.computeJointJacobians(model, data, q)
    contacts = scene.contacts(q, v)
    total = np.zeros(model.nv)
    for pair, point, force in zip(
        contacts.pair, contacts.point_world, contacts.force_world, strict=True
    ):
        of = scene.pairs[pair]
        away = point_jacobian(model, data, of.joint_i, point)
        total += (away - point_jacobian(model, data, of.joint_j, point)).T @ force
    return total


def joint_names(model: pin.Model) -> list[str]:
    """Return the name of the joint to which each of the nv velocities belongs."""
    names = [""] * model.nv
    for joint, name in zip(model.joints, model.names, strict=True):
        for k in range(joint.idx_v, joint.idx_v + joint.nv):
            names[k] = name
    return names


def accelerations(
    model: pin.Model, data: pin.Data, q: Array, v: Array, tau: Array, forces: pin.StdVec_Force
) -> Array:
    """Return the accelerations (nv,) under torques and wrenches on the joints, by Pinocchio.

    That is ABA; of models with mimic joints, which ABA has not, M^-1 (tau - rnea).
    """
    if not len(model.mimicking_joints):
        return np.array(pin.aba(model, data, q, v, tau, forces))
    free = tau - pin.rnea(model, data, q, v, np.zeros(model.nv), forces)
    return np.linalg.solve(mass_matrix(model, q), free)


def balance(scene: Scene, q: ArrayLike, v: Optional = None, tau: Optional = None) -> Finding:
    """Compare ABA with `scene.external_forces` to M^-1 (tau - nle + J^T f), with f the contacts'.

    Of models with mimic joints, which ABA has not, recursive Newton-Euler takes its place.

    The error is the difference of the two accelerations relative to what the contacts add to them
    (without contacts, to all of it), both measured by the mass matrix, sqrt(a . M a), so that
    meters and radians, heavy and light links can be measured by one number.

    Raises InvalidParameter for a state or torques of the wrong size, and where the mass matrix is
    singular: forward dynamics has no answer there.
    """
    q, v = scene.check_state(q, v)
    model, data = scene.model, scene.model.createData()
    tau = np.zeros(model.nv) if tau is None else np.asarray(tau, dtype=float)
    if tau.shape != (model.nv,):
        raise InvalidParameter("tau", tau.shape, f"must have shape ({model.nv},)")
    names = joint_names(model)
    mass = mass_matrix(model, q)
    contact = contact_torques(scene, data, q, v)
    free = tau - pin.nonLinearEffects(model, data, q, v)
    try:
        np.linalg.cholesky(mass)
        answers = np.linalg.solve(mass, np.stack([free + contact, contact], axis=1))
    except np.linalg.LinAlgError:
        raise InvalidParameter(
            "q", q.tolist(), "is where the mass matrix is singular: lock the joints that move none"
        ) from None
    expected = answers[:, 0]
    found = accelerations(model, model.createData(), q, v, tau, scene.external_forces(q, v))

    def size(acceleration: Array) -> float:
        return math.sqrt(max(float(acceleration @ mass @ acceleration), 0.0))

    added = size(answers[:, 1])
    scale = added if added > 0.0 else size(expected)
    off = found - expected
    missing = mass @ off
    k = int(np.argmax(np.where(np.isfinite(missing), np.abs(missing), np.inf)))
    where = (
        f"joint '{names[k]}' accelerates with {found[k]:.6g}, but {expected[k]:.6g} balances the "
        f"forces (velocity {k} of {model.nv}): {missing[k]:.3g} N or N m too much"
    )
    return Finding(size(off) / scale if scale > 0.0 else size(off), where)


def reaction(scene: Scene, q: ArrayLike, v: Optional = None) -> Finding:
    """Sum the wrenches of `scene.external_forces` on all bodies, about the contacts' middle.

    The error is relative to the largest wrench, lengths measured by the way from that middle to the
    farthest body that is pushed. InvalidParameter if a pair touches the universe, whose wrench is
    not among them.
    """
    q, v = scene.check_state(q, v)
    for pair in scene.pairs:
        if 0 in (pair.joint_i, pair.joint_j):
            raise InvalidParameter(
                "scene",
                pair.name,
                "touches the universe, whose wrench is not computed: put it on a free body",
            )
    model, data = scene.model, scene.model.createData()
    pin.forwardKinematics(model, data, q)
    contacts = scene.contacts(q, v)
    middle = contacts.point_world.mean(axis=0) if len(contacts) else np.zeros(3)
    about = pin.SE3(np.eye(3), middle)
    total, largest, reach = np.zeros(6), 0.0, 0.0
    for joint, force in enumerate(scene.external_forces(q, v)):
        if joint == 0 or not force.vector.any():
            continue
        wrench = about.actInv(data.oMi[joint].act(force))
        total += wrench.vector
        largest = max(largest, float(np.linalg.norm(wrench.linear)))
        reach = max(reach, float(np.linalg.norm(data.oMi[joint].translation - middle)))
    if largest == 0.0:
        return Finding(0.0 if not total.any() else np.inf, "nothing is pushed")
    lever = max(reach, 1e-9)
    error = max(
        float(np.linalg.norm(total[:3])) / largest,
        float(np.linalg.norm(total[3:])) / (largest * lever),
    )
    where = (
        f"the wrenches about {_text(middle)} m leave a force of {_text(total[:3])} N and a torque "
        f"of {_text(total[3:])} N m, where one body is pushed with {largest:.6g} N"
    )
    return Finding(error, where)


def _text(vector: Array) -> str:
    return "(" + ", ".join(f"{x:.3g}" for x in vector) + ")"
