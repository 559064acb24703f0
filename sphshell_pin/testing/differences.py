"""Analytic derivatives against central differences on the tangent space."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin.base import named_numbers
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics import Scene
from sphshell_pin.testing.finding import Finding, Optional, worst
from sphshell_pin.testing.forces import accelerations, joint_jacobian, joint_names


def names_of(scene: Scene) -> list[str]:
    """Return the names of all numbers of all pairs, as "PAIR.law.stiffness"."""
    known = named_numbers.names_of_pairs(scene.pairs)
    return [name for name, number in known.items() if number.ends is not None]


def is_place(column: str) -> bool:
    """Whether a column is a coordinate of an offset or of a placement."""
    return column.rpartition(".")[2] in (*named_numbers.AXES, *named_numbers.TWIST)


def scale_of(scene: Scene, column: str, depth: float) -> tuple[float, bool]:
    """Return on what a scene changes with a number, and whether that is at its lower bound, 0.

    It is the number itself, of places and lengths the `depth` [m].
    """
    number, _, value = _found(scene, column)
    if number.path[0] not in ("law", "friction"):
        return depth, False
    return abs(value) or 1.0, value == 0.0


def changed(scene: Scene, column: str, by: float) -> Scene:
    """Return the scene with one number changed `by` so much.

    A placement is multiplied by pinocchio.exp6 of a twist, from the right.
    """
    number, place, value = _found(scene, column)
    if isinstance(value, pin.SE3):
        value = value * pin.exp6(pin.Motion(by * np.eye(6)[place]))
    elif number.shape:
        value = tuple((np.asarray(value) + by * np.eye(3)[place]).tolist())
    else:
        value += by
    pairs = list(scene.pairs)
    pairs[number.at] = named_numbers.with_value(pairs[number.at], number.path, value)
    return scene.with_pairs(tuple(pairs))


def _found(scene: Scene, column: str) -> tuple[named_numbers.NamedNumber, int, Any]:
    """Return the number that a column is of, its place in it, and the whole value."""
    number, place = named_numbers.every_column(named_numbers.names_of_pairs(scene.pairs))[column]
    return number, place, functools.reduce(getattr, number.path, scene.pairs[number.at])


# Central differences of order 4: places, in steps, and weights.
_PLACES = ((-2.0, 1.0 / 12.0), (-1.0, -2.0 / 3.0), (1.0, 2.0 / 3.0), (2.0, -1.0 / 12.0))

# Differences of a number at its bound, from its one side.
_AHEAD = ((0.0, -25.0 / 12.0), (1.0, 4.0), (2.0, -3.0), (3.0, 4.0 / 3.0), (4.0, -0.25))

# What rounding leaves of a force or an acceleration at least, relative to the largest, and how much
# larger than that, over the step, a derivative must be to be seen with 1e-7.
_EPS, _SEEN = float(np.finfo(float).eps), 1e7

# Steps, as shares of depth and speed, and the error from which on no further one is tried.
_STEPS, _AGREED = (1e-3, 1e-4, 1e-5), 1e-7

_Function = Callable[[Array, Array], Array]
_Pair = tuple[Array, Array]


def derivatives(scene: Scene, q: ArrayLike, v: Optional = None, tau: Optional = None) -> Finding:
    """Compare derivatives of contact forces and accelerations to differences.

    `scene.contact_derivatives` by q and v, and `scene.dynamics_derivatives` by q, v, tau and all
    numbers of the contacts, against central differences of order 4 of J^T f and of ABA with
    `scene.external_forces`. Steps are 1e-3 of the least depth [m or rad], of the largest joint
    speed, of a number's value; where that does not agree 1e-4 and 1e-5 too, and the best counts: a
    kink nearby or rounding spoils one of them, a wrong derivative none. The error of a column is
    relative to the column's largest entry, or to a hundredth of the matrix's; columns that rounding
    hides from differences count less.
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

    def acceleration(q: Array, v: Array, tau: Array = tau, scene: Scene = scene) -> Array:
        torques = tau + scene.joint_forces(q, v)
        return accelerations(model, data, q, v, torques, scene.external_forces(q, v))

    numbers = names_of(scene)
    got = scene.dynamics_derivatives(q, v, tau, parameters=numbers)
    findings = [
        _at_best(scene, q, v, "contact forces", force, scene.contact_derivatives(q, v)),
        _at_best(scene, q, v, "accelerations", acceleration, (got.by_q, got.by_v)),
    ]
    # By torques they are linear: one step will do.
    pushes = np.eye(model.nv)
    by_tau = [acceleration(q, v, tau + 0.5 * e) - acceleration(q, v, tau - 0.5 * e) for e in pushes]
    rounding = _rounding(acceleration, q, v)
    names = joint_names(model)
    findings.append(
        _compare("accelerations by tau", got.by_tau, np.transpose(by_tau), rounding, names)
    )
    deep = _depth(scene, q, v)
    sizes = np.abs(got.by_parameters).max(axis=0, initial=0.0)
    for column, one in zip(got.parameters, got.by_parameters.T, strict=True):
        scale, ahead = scale_of(scene, column, deep)
        # Along the surface a place may not matter, and rounding is that of the others.
        alike = [is_place(name) for name in got.parameters] if is_place(column) else [False]
        floor = 1e-2 * float(sizes[np.flatnonzero(alike)].max(initial=0.0))

        def moved(x: float, column: str = column) -> Array:
            return acceleration(q, v, scene=changed(scene, column, x))

        findings.append(_number_at_best(column, one, moved, scale, rounding, floor, ahead=ahead))
    return worst(findings, "nothing was compared")


def differentiated(f: Callable[[float], Array], step: float, *, ahead: bool = False) -> Array:
    """Return the derivative of f at 0 by differences, with `ahead` from values at and above 0."""
    return np.asarray(sum(w * f(p * step) for p, w in (_AHEAD if ahead else _PLACES)) / step)


def _depth(scene: Scene, q: Array, v: Array) -> float:
    return float(scene.contacts(q, v).depth.min(initial=1e-2))


def _number_at_best(
    column: str,
    got: Array,
    f: Callable[[float], Array],
    scale: float,
    rounding: float,
    floor: float,
    *,
    ahead: bool,
) -> Finding:
    """Compare the derivative `got` of `f` by one number with the step that agrees best.

    What is smaller than `floor`, or than what differences can see, counts as that large.
    """

    def with_step(share: float) -> Finding:
        step = share * scale
        expected = differentiated(f, step, ahead=ahead)
        size = max(float(np.abs(expected).max(initial=0.0)), floor, _SEEN * rounding / step)
        off = np.abs(got - expected)
        k = int(np.argmax(np.where(np.isfinite(off), off, np.inf)))
        where = (
            f"the accelerations by '{column}': entry {k} is {got[k]:.9g}, by differences "
            f"{expected[k]:.9g}"
        )
        return Finding(float(off[k]) / size if size > 0.0 else float(off[k]), where)

    return _best(with_step)


def _best(with_step: Callable[[float], Finding]) -> Finding:
    """Return the finding with the step that agrees best, of those that have to be tried."""
    found: list[Finding] = []
    for share in _STEPS:
        found.append(with_step(share))
        if found[-1].error <= _AGREED:
            break
    return min(found, key=lambda one: one.error)


def _rounding(f: _Function, q: Array, v: Array) -> float:
    """Return what rounding leaves of f(q, v) -> (m,): it may be ill-conditioned."""
    value, rng = f(q, v), np.random.default_rng(0)
    nudges = [[1.0 + _EPS * rng.integers(-2, 3, len(x)) for x in (q, v)] for _ in range(8)]
    nudged = [f(q * by_q, v * by_v) - value for by_q, by_v in nudges]
    return 4.0 * float(np.max([2.0 * _EPS * np.abs(value), *np.abs(nudged)], initial=0.0))


def _at_best(scene: Scene, q: Array, v: Array, what: str, f: _Function, got: _Pair) -> Finding:
    """Compare derivatives `got` of `f` by q and v with the step that agrees best."""
    model = scene.model
    names = joint_names(model)
    deep = _depth(scene, q, v)
    fast = max(float(np.abs(v).max(initial=0.0)), 1e-2)
    rounding = _rounding(f, q, v)

    def with_step(share: float) -> Finding:
        steps = share * deep, share * fast
        expected = differences(f, model, q, v, *steps)
        parts = zip("qv", got, expected, steps, strict=True)
        return worst(
            [_compare(f"{what} by {x}", a, b, rounding / h, names) for x, a, b, h in parts], what
        )

    return _best(with_step)


def differences(
    f: _Function, model: pin.Model, q: Array, v: Array, step_q: float, step_v: float
) -> tuple[Array, Array]:
    """Return central differences (m, nv) of f(q, v) -> (m,), by the tangent of q and by v."""
    moved = [lambda x, e=e: f(pin.integrate(model, q, x * e), v) for e in np.eye(model.nv)]
    faster = [lambda x, e=e: f(q, v + x * e) for e in np.eye(model.nv)]
    by_q = [differentiated(one, step_q) for one in moved]
    return np.transpose(by_q), np.transpose([differentiated(one, step_v) for one in faster])


def _compare(what: str, got: Array, expected: Array, rounding: float, names: list[str]) -> Finding:
    floor = max(1e-2 * float(np.abs(expected).max()), _SEEN * rounding)
    sizes = np.maximum(np.abs(expected).max(axis=0), floor)
    off = np.abs(got - expected) / np.where(sizes > 0.0, sizes, 1.0)
    off = np.where(np.isfinite(off), off, np.inf)
    row, column = np.unravel_index(int(np.argmax(off)), off.shape)
    where = (
        f"the {what}: of joint '{names[row]}' by joint '{names[column]}' (entry {row}, {column}) "
        f"is {got[row, column]:.9g}, by differences {expected[row, column]:.9g}"
    )
    return Finding(float(off[row, column]), where)
