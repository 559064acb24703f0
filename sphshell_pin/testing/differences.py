"""Analytic derivatives against central differences on the tangent space."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from sphshell_pin.dynamics import Scene
from sphshell_pin.testing.finding import Finding, Optional, worst
from sphshell_pin.testing.forces import accelerations, joint_jacobian, joint_names

Array = NDArray[np.float64]

# Central differences of order 4: places, in steps, and weights.
_PLACES = ((-2.0, 1.0 / 12.0), (-1.0, -2.0 / 3.0), (1.0, 2.0 / 3.0), (2.0, -1.0 / 12.0))

# What rounding leaves of a force or an acceleration, relative to the largest, and how much larger
# than that, over the step, a derivative must be to be seen with 1e-7.
_ROUNDING, _SEEN = 8.0 * float(np.finfo(float).eps), 1e7

# Steps, as shares of depth and speed, and the error from which on no further one is tried.
_STEPS, _AGREED = (1e-3, 1e-4, 1e-5), 1e-7

_Function = Callable[[Array, Array], Array]
_Pair = tuple[Array, Array]
_Compared = tuple[str, _Function, _Pair]


def derivatives(scene: Scene, q: ArrayLike, v: Optional = None, tau: Optional = None) -> Finding:
    """Compare the derivatives of contact forces and accelerations by q and by v to differences.

    `scene.contact_derivatives` and the Jacobian of the accelerations on which `Implicit` runs,
    against central differences of order 4 of J^T f and of ABA with `scene.external_forces`. Steps
    are 1e-3 of the least depth [m or rad] and of the largest joint speed; where that does not agree
    1e-4 and 1e-5 too, and the best counts: a kink nearby or rounding spoils one of them, a wrong
    derivative none. The error of a column is relative to the column's largest entry, or to a
    hundredth of the matrix's; columns that rounding hides from differences count less.

    Accelerations are left out where a contact has bristles, which the scene's state does not hold.
    """
    q, v = scene.check_state(q, v)
    model, data = scene.model, scene.model.createData()
    tau = np.zeros(model.nv) if tau is None else np.asarray(tau, dtype=float)
    # On no other joint there is a wrench: `forces.balance` sees to that.
    pushed = {j for pair in scene.pairs for j in (pair.joint_i, pair.joint_j)} - {0}

    def force(q: Array, v: Array) -> Array:
        pin.computeJointJacobians(model, data, q)
        total = np.zeros(model.nv)
        forces = scene.external_forces(q, v)
        for joint in pushed:
            jacobian = joint_jacobian(model, data, joint, pin.ReferenceFrame.LOCAL)
            total += jacobian.T @ forces[joint].vector
        return total

    def acceleration(q: Array, v: Array) -> Array:
        return accelerations(model, data, q, v, tau, scene.external_forces(q, v))

    compared: list[_Compared] = [("contact forces", force, scene.contact_derivatives(q, v))]
    if not any(pair.friction and pair.friction.has_state for pair in scene.pairs):
        whole = scene.core.rate_jacobian(q, v, np.zeros(0), tau)
        both = whole[:, : model.nv], whole[:, model.nv : 2 * model.nv]
        compared.append(("accelerations", acceleration, both))
    return worst([_at_best(scene, q, v, *one) for one in compared], "nothing was compared")


def _at_best(scene: Scene, q: Array, v: Array, what: str, f: _Function, got: _Pair) -> Finding:
    """Compare derivatives `got` of `f` by q and v with the step that agrees best."""
    model = scene.model
    names = joint_names(model)
    depths = scene.contacts(q, v).depth
    deep = float(depths.min()) if len(depths) else 1e-2
    fast = max(float(np.abs(v).max(initial=0.0)), 1e-2)
    rounding = _ROUNDING * float(np.abs(f(q, v)).max(initial=0.0))
    best: Finding | None = None
    for share in _STEPS:
        steps = share * deep, share * fast
        expected = differences(f, model, q, v, *steps)
        finding = worst(
            [
                _compare(f"{what} by {'qv'[k]}", got[k], expected[k], rounding / steps[k], names)
                for k in (0, 1)
            ],
            what,
        )
        if best is None or finding.error < best.error:
            best = finding
        if best.error <= _AGREED:
            break
    assert best is not None
    return best


def differences(
    f: _Function, model: pin.Model, q: Array, v: Array, step_q: float, step_v: float
) -> tuple[Array, Array]:
    """Return central differences (m, nv) of f(q, v) -> (m,), by the tangent of q and by v."""
    by_q = [
        np.sum([w * f(pin.integrate(model, q, p * step_q * e), v) for p, w in _PLACES], axis=0)
        for e in np.eye(model.nv)
    ]
    by_v = [
        np.sum([w * f(q, v + p * step_v * e) for p, w in _PLACES], axis=0) for e in np.eye(model.nv)
    ]
    return np.transpose(by_q) / step_q, np.transpose(by_v) / step_v


def _compare(what: str, got: Array, expected: Array, rounding: float, names: list[str]) -> Finding:
    sizes = np.abs(expected).max(axis=0) + 1e-2 * np.abs(expected).max()
    sizes = np.maximum(sizes, _SEEN * rounding)
    off = np.abs(got - expected) / np.where(sizes > 0.0, sizes, 1.0)
    off = np.where(np.isfinite(off), off, np.inf)
    row, column = np.unravel_index(int(np.argmax(off)), off.shape)
    where = (
        f"the {what}: of joint '{names[row]}' by joint '{names[column]}' (entry {row}, {column}) "
        f"is {got[row, column]:.9g}, by differences {expected[row, column]:.9g}"
    )
    return Finding(float(off[row, column]), where)
