"""Derivatives of accelerations, of steps and of contact forces, by the state and by parameters."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import _core
from sphshell_pin.dynamics.scene.explain import explain_pairs, relaxation_time
from sphshell_pin.dynamics.scene.scene_contacts import Rows, SceneContacts
from sphshell_pin.dynamics.scene.variations import Variations, numbers_of
from sphshell_pin.errors import InvalidParameter, NameNotFound
from sphshell_pin.summary import Summarized

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene.pairs import ContactPair
    from sphshell_pin.dynamics.scene.scene import Scene

Array = NDArray[np.float64]

_PARTS = ("law", "friction", "sphere", "other_sphere", "placement")
_AXES = ("x", "y", "z")
_TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
# Of Parameter in C++.
_FIELD, _RADIUS, _BALL, _OFFSET, _PLACEMENT = range(5)
# Steps of central differences, and of one-sided ones at a bound, relative to the number; a law is a
# smooth function of its numbers, at a contact that is held.
_STEP, _STEP_AT_BOUND = 1e-5, 1e-7


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
        force = force.reshape(-1, 3, normal.shape[1])
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


def parameter_columns(scene: Scene, names: object, others: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Return the columns that the parameters called `names` have, in their order.

    Names are those of Simulation.rollout's `vary` for single numbers, and "PAIR.placement" (six
    columns). One column of several can be named, too: "PAIR.sphere.offset.z".

    Raises InvalidParameter for what are no names and for one given twice, NameNotFound for another:
    it lists `others`, which the caller knows, too.
    """
    if isinstance(names, str | bytes) or not isinstance(names, Iterable):
        raise InvalidParameter("parameters", names, "must be names, as ['PAIR.law.stiffness']")
    columns_of = _columns_of(scene)
    valid = set(columns_of) | {one for columns in columns_of.values() for one in columns}
    found: list[str] = []
    for name in names:
        if not isinstance(name, str) or name not in valid:
            raise NameNotFound("parameter", str(name), "the scene", [*columns_of, *others])
        for column in columns_of.get(name, (name,)):
            if column in found:
                raise InvalidParameter("parameters", column, "must not be named twice")
            found.append(column)
    return tuple(found)


def core_parameters(
    scene: Scene, columns: Iterable[str], start: tuple[Array, Array] | None
) -> list[_core.Parameter]:
    """Return what the compiled core needs to know of each column.

    `start`: q (nq,), v (nv,) of the run or state that is differentiated, from which bristles take
    how fast an impact is; None where they do not.
    """
    return [_core_parameter(scene, column, start) for column in columns]


def _columns_of(scene: Scene) -> dict[str, tuple[str, ...]]:
    """Return the columns of each name."""
    out: dict[str, tuple[str, ...]] = {}
    for name, shape in numbers_of(scene).items():
        out[name] = tuple(f"{name}.{axis}" for axis in _AXES) if shape else (name,)
    for pair in scene.pairs:
        if pair.shell is not None:
            name = f"{pair.name}.placement"
            out[name] = tuple(f"{name}.{one}" for one in _TWIST)
    return out


def _core_parameter(
    scene: Scene, column: str, start: tuple[Array, Array] | None
) -> _core.Parameter:
    pair, what = _place_of(scene, column)
    if what[0] == "placement":
        return _core.Parameter(pair, _PLACEMENT, _TWIST.index(what[1]))
    if what[1] == "offset":
        axis = _AXES.index(what[2])
        # The ball's center is the origin of what stands for the shell's frame.
        return _core.Parameter(pair, _OFFSET if what[0] == "sphere" else _PLACEMENT, axis)
    kind = _FIELD
    if what[0] in ("sphere", "other_sphere"):
        kind = _RADIUS if what[0] == "sphere" else _BALL
    value = getattr(getattr(scene.pairs[pair], what[0]), what[1])

    def changed(number: float) -> _core.Pair | None:
        try:
            pairs = Variations(scene, {column: [number]}, 1).pairs(0)
        except InvalidParameter:
            return None
        return _core_pair(scene, pairs, pair, start)

    step = _STEP * (abs(value) or 1.0)
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
    return _core.Parameter(pair, kind, 0, less, more, step, abs(value) or 1.0)


def _place_of(scene: Scene, column: str) -> tuple[int, list[str]]:
    """Return the number of a column's pair, whose name may have dots, and the words behind it."""
    found: dict[int, list[str]] = {}
    for k, pair in enumerate(scene.pairs):
        words = column.removeprefix(f"{pair.name}.").split(".")
        if column.startswith(f"{pair.name}.") and words[0] in _PARTS:
            found[k] = words
    return min(found.items(), key=lambda one: len(one[1]))


def _core_pair(
    scene: Scene, pairs: tuple[ContactPair, ...], at: int, start: tuple[Array, Array] | None
) -> _core.Pair:
    core = pairs[at].to_core()
    friction = pairs[at].friction
    if start is not None and friction is not None and friction.has_state:
        figures = explain_pairs(scene.with_pairs(pairs), *start)
        core.relaxation = relaxation_time(pairs[at], figures[at])
    return core
