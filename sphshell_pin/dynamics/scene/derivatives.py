"""Derivatives of accelerations, of steps and of contact forces, by the state and by parameters."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array, Ints, frame_along
from sphshell_pin.base.named_numbers import NamedNumber, every_column, names_of_pairs, with_value
from sphshell_pin.base.summary import Fact, Summarized
from sphshell_pin.dynamics.scene.explain import explain_pairs, relaxation_time
from sphshell_pin.dynamics.scene.pairs import ContactPair
from sphshell_pin.dynamics.scene.scene_contacts import Rows, SceneContacts
from sphshell_pin.dynamics.scene.sides import PlaneSide
from sphshell_pin.errors import InvalidParameter

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene.scene import Scene


@dataclass(frozen=True, repr=False)
class ContactConstraints(Summarized):
    """The k contacts of a scene for Pinocchio's solvers of constraints.

    `models` are k pinocchio.PointContactConstraintModel: joint 1 carries the shell, joint 2 the
    sphere, at the closest points of both, with z along the normal and the pair's coefficient of
    static friction (0 without friction). `depth` (k,) [m] is how far they overlap, `compliance`
    (k,) [m/N] the inverse slope of the pair's law at that depth, `pair` (k,) the scene's pair.

    Solvers of impulses (pinocchio.ADMMConstraintSolver, PGSConstraintSolver) take a compliance in
    1/kg, that is `compliance` / dt^2, and the overlap as a velocity, `depth` / dt.
    """

    models: list[pin.PointContactConstraintModel]
    depth: Array
    compliance: Array
    pair: Ints

    def _facts(self) -> list[Fact]:
        return [Fact("contacts", len(self.models))]


def constraints_of(
    model: pin.Model, pairs: tuple[ContactPair, ...], q: Array, contacts: SceneContacts
) -> ContactConstraints:
    """Return the constraints of `contacts`, which are those of `pairs` at q (nq,)."""
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    models, compliance = [], []
    columns = contacts.pair, contacts.point_world, contacts.normal_world, contacts.depth
    for k, point, normal, depth in zip(*columns, strict=True):
        pair = pairs[k]
        # The point is on the shell, or on the plane, which has the part of the sphere.
        on_shell = pin.SE3(frame_along(normal), point)
        on_sphere = pin.SE3(on_shell.rotation, point - depth * normal)
        if isinstance(pair.side_i, PlaneSide):
            on_shell, on_sphere = pin.SE3(on_shell.rotation, point + depth * normal), on_shell
        ends = (pair.joint_j, on_shell), (pair.joint_i, on_sphere)
        placed = [one for joint, at in ends for one in (joint, data.oMi[joint].actInv(at))]
        made = pin.PointContactConstraintModel(model, *placed)
        made.setFriction(pair.friction.largest_coefficient if pair.friction else 0.0)
        models.append(made)
        stiffness = pair.plane_law.normal_stiffness(float(depth))
        compliance.append(1.0 / stiffness if stiffness > 0.0 else np.inf)
    return ContactConstraints(models, contacts.depth, np.array(compliance), contacts.pair)


# Values of Parameter in C++.
_FIELD, _RADIUS, _BALL, _OFFSET, _PLACEMENT = range(5)
_PLACES = {
    ("side_j", "placement"): _PLACEMENT,
    ("side_i", "sphere", "offset"): _OFFSET,
    # The ball's center is the origin of what stands for the shell's frame.
    ("side_j", "sphere", "offset"): _PLACEMENT,
}
# Steps of central differences, and of one-sided ones at a bound, relative to the number; a law is a
# smooth function of its numbers, at a contact that is held.
_STEP, _STEP_OF_RADIUS, _STEP_AT_BOUND = 1e-5, 1e-6, 1e-7


@dataclass(frozen=True, repr=False)
class DynamicsDerivatives(Summarized):
    """The acceleration (nv,) at a state, and its derivatives.

    `by_q` (nv, nv) is taken in the tangent space of q, along which pinocchio.integrate moves;
    `by_v` and `by_tau` (nv, nv), `by_parameters` (nv, p) with a column for each of `parameters`.
    """

    acceleration: Array
    by_q: Array
    by_v: Array
    by_tau: Array
    by_parameters: Array
    parameters: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class StepDerivatives(Summarized):
    """Where one fixed step leads, q (nq,) and v (nv,), and its derivatives.

    Changes of a state are those of q in its tangent space and of v, one behind the other: those at
    the end by those at the start are `by_state` (2 nv, 2 nv), by the torques, which are held,
    `by_tau` (2 nv, nv), and `by_parameters` (2 nv, p), a column for each of `parameters`.
    """

    q: Array
    v: Array
    by_state: Array
    by_tau: Array
    by_parameters: Array
    parameters: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class ContactForceDerivatives(Summarized):
    """The m contacts at a state, and the derivatives of their forces and depths.

    `by_q`, `by_v` (m, 3, nv) of the force on the sphere in the world [N], `normal_by_q`,
    `normal_by_v` (m, nv) of its part along the normal, `depth_by_q` (m, nv); `by_parameters`
    (m, 3, p), `normal_by_parameters` and `depth_by_parameters` (m, p), a column for each of
    `parameters`. With respect to q all are taken in its tangent space.
    """

    contacts: SceneContacts
    by_q: Array
    by_v: Array
    normal_by_q: Array
    normal_by_v: Array
    depth_by_q: Array
    by_parameters: Array
    normal_by_parameters: Array
    depth_by_parameters: Array
    parameters: tuple[str, ...]

    @classmethod
    def from_core(
        cls,
        rows: Rows,
        force: Array,
        normal: Array,
        depth: Array,
        nv: int,
        columns: tuple[str, ...],
    ) -> ContactForceDerivatives:
        """Build from the core's matrices: by q, v, bristles and parameters, side by side."""
        contacts = SceneContacts.from_rows(rows)
        force = force.reshape(normal.shape[0], 3, normal.shape[1])
        first = normal.shape[1] - len(columns)
        return cls(
            contacts=contacts,
            by_q=force[..., :nv],
            by_v=force[..., nv : 2 * nv],
            normal_by_q=normal[:, :nv],
            normal_by_v=normal[:, nv : 2 * nv],
            depth_by_q=depth[:, :nv],
            by_parameters=force[..., first:],
            normal_by_parameters=normal[:, first:],
            depth_by_parameters=depth[:, first:],
            parameters=columns,
        )


def core_parameters(
    scene: Scene, columns: Iterable[str], start: tuple[Array, Array] | None
) -> list[_core.Parameter]:
    """Return what the compiled core needs to know of each column.

    `start`: q (nq,), v (nv,) of the run or state that is differentiated, from which bristles take
    how fast an impact is; None where they do not.
    """
    numbers = every_column(names_of_pairs(scene.pairs))
    return [_core_parameter(scene, column, *numbers[column], start) for column in columns]


def _core_parameter(
    scene: Scene, column: str, number: NamedNumber, place: int, start: tuple[Array, Array] | None
) -> _core.Parameter:
    if number.path in _PLACES:
        return _core.Parameter(number.at, _PLACES[number.path], place)
    pair = scene.pairs[number.at]
    value = functools.reduce(getattr, number.path, pair)
    assert isinstance(value, float)
    kind = {"side_i": _RADIUS, "side_j": _BALL}.get(number.path[0], _FIELD)

    def changed(value: float) -> _core.Pair | None:
        try:
            return _core_pair(scene, with_value(pair, number.path, value), number.at, start)
        except InvalidParameter:
            return None

    # A radius changes depths, beside which its step must be small.
    step = (_STEP if kind == _FIELD else _STEP_OF_RADIUS) * (abs(value) or 1.0)
    less, more = changed(value - step), changed(value + step)
    if less is None or more is None:
        # At a bound: from there to one side.
        step = _STEP_AT_BOUND * (abs(value) or 1.0) / 2
        here = changed(value)
        if less is None:
            less, more = here, changed(value + 2 * step)
        else:
            less, more = changed(value - 2 * step), here
    if less is None or more is None:
        must = "cannot be differentiated: neither a larger nor a smaller value is allowed"
        raise InvalidParameter(column, value, must)
    return _core.Parameter(number.at, kind, 0, less, more, step, abs(value) or 1.0)


def _core_pair(
    scene: Scene, pair: ContactPair, at: int, start: tuple[Array, Array] | None
) -> _core.Pair:
    core = pair._bind()
    if start is not None and pair.friction is not None and pair.friction.has_state:
        pairs = (*scene.pairs[:at], pair, *scene.pairs[at + 1 :])
        figures = explain_pairs(scene.with_pairs(pairs), *start)
        core.relaxation = relaxation_time(pair, figures[at])
    return core
