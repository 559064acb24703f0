"""How joints move, as expressions of CasADi; spatial vectors are (linear, angular)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import import_extra

if TYPE_CHECKING:
    from casadi import SX

_BINARY = {"OP_ADD": "+", "OP_SUB": "-", "OP_MUL": "*", "OP_DIV": "/"}
_UNARY = {
    "OP_ASSIGN": "{0}",
    "OP_NEG": "-{0}",
    "OP_SQ": "{0} * {0}",
    "OP_TWICE": "{0} + {0}",
    "OP_INV": "1. / {0}",
    "OP_SIN": "sin({0})",
    "OP_COS": "cos({0})",
    "OP_SQRT": "sqrt({0})",
}


@dataclass
class Storage:
    """Numbers that one block of a function leaves to the next, as `name`[0], `name`[1], ..."""

    name: str
    size: int = 0

    def take(self, count: int) -> list[str]:
        """Return C names of `count` more numbers."""
        self.size += count
        return [f"{self.name}[{self.size - count + k}]" for k in range(count)]


@dataclass
class Block:
    """Statements in one scope, which read and write numbers by their C names."""

    targets: list[str] = field(default_factory=list)
    values: list[Expression] = field(default_factory=list)

    def write(self, targets: list[str], values: Expression) -> None:
        """Write the entries of `values`, by columns, to `targets`."""
        entries = casadi().vec(casadi().densify(casadi().SX(values)))
        self.targets += targets
        self.values += [entries[k] for k in range(len(targets))]

    def keep(self, storage: Storage, values: Expression) -> Expression:
        """Write what is not constant of `values` to `storage`; return them for later blocks."""
        ca = casadi()
        known = ca.densify(values)
        kept = ca.SX(known)
        for row in range(known.shape[0]):
            for column in range(known.shape[1]):
                if not known[row, column].is_constant():
                    target = storage.take(1)
                    self.write(target, known[row, column])
                    kept[row, column] = ca.SX.sym(target[0])
        return ca.sparsify(kept)

    def text(self) -> tuple[str, int]:
        """Return the statements, and how many there are."""
        if not self.values:
            return "", 0
        ca = casadi()
        values = ca.cse(ca.vertcat(*self.values))
        read = ca.symvar(values)
        function = ca.Function("f", [ca.vertcat(*read)] if read else [ca.SX(0, 1)], [values])
        names = [one.name() for one in read]
        operations = _operations(ca)
        lines = [
            _line(function, k, operations, names, self.targets)
            for k in range(function.n_instructions())
        ]
        scratch = ", ".join(f"a{k}" for k in range(function.sz_w()))
        return "\n".join(["{", f"double {scratch};", *lines, "}"]), len(lines)


def _operations(ca: object) -> dict[int, str]:
    known = (*_BINARY, *_UNARY, "OP_INPUT", "OP_OUTPUT", "OP_CONST")
    return {int(getattr(ca, name)): name for name in known}


def _line(
    function: Expression, k: int, operations: dict[int, str], read: list[str], targets: list[str]
) -> str:
    """Return one statement; LookupError for an operation that no robot needs."""
    operation = operations[function.instruction_id(k)]
    into, of = function.instruction_output(k), function.instruction_input(k)
    if operation == "OP_OUTPUT":
        return f"{targets[into[1]]} = a{of[0]};"
    if operation == "OP_INPUT":
        value = read[of[1]]
    elif operation == "OP_CONST":
        number = float(function.instruction_constant(k))
        if not math.isfinite(number):
            raise ZeroDivisionError
        value = repr(number)
    elif operation in _BINARY:
        value = f"a{of[0]} {_BINARY[operation]} a{of[1]}"
    else:
        value = _UNARY[operation].format(f"a{of[0]}")
    return f"a{into[0]} = {value};"


def functions(name: str, blocks: list[Block], arguments: str, call: str, most: int) -> str:
    """Return static functions name_0, name_1, ... of at most about `most` statements, and name.

    `arguments` are their parameters in C, `call` the names of these.
    """
    parts: list[str] = []
    held, count = "", 0
    for block in blocks:
        text, size = block.text()
        if held and count + size > most:
            parts.append(held)
            held, count = "", 0
        held, count = held + text + "\n", count + size
    parts.append(held)
    named = [f"static void {name}_{k}({arguments}) {{\n{part}}}\n" for k, part in enumerate(parts)]
    calls = "".join(f"{name}_{k}({call});\n" for k in range(len(parts)))
    return "".join(named) + f"static void {name}({arguments}) {{\n{calls}}}\n"


Expression: TypeAlias = "SX"
"""A matrix of expressions."""

# Joints of several coordinates whose axes are constant in their own frames.
_SEVERAL = {
    "JointModelFreeFlyer": (0, 1, 2, 3, 4, 5),
    "JointModelSpherical": (3, 4, 5),
    "JointModelTranslation": (0, 1, 2),
    "JointModelPlanar": (0, 1, 5),
}
# Entries of rotations that are this close to 0, 1 or -1 are taken as that, and cost nothing.
_ROUNDING = 1e-15


def casadi() -> ModuleType:
    """Return the module; MissingExtra says how to install it."""
    return import_extra("casadi", "compile", "a compiled robot")


@dataclass(frozen=True)
class Pose:
    """Rotation (3, 3) and translation (3, 1) of a frame in another one."""

    rotation: Expression
    translation: Expression

    def act(self, force: Expression) -> Expression:
        """Bring a force (6, 1) of the inner frame into the outer one."""
        linear, angular = self.rotation @ force[:3], self.rotation @ force[3:]
        return _stacked(linear, angular + cross(self.translation, linear))

    def act_inverse(self, motion: Expression) -> Expression:
        """Bring a motion (6, 1) of the outer frame into the inner one."""
        linear = motion[:3] - cross(self.translation, motion[3:])
        return _stacked(self.rotation.T @ linear, self.rotation.T @ motion[3:])

    def times(self, other: Pose) -> Pose:
        """Return the pose of a frame at `other` in this one."""
        return Pose(
            self.rotation @ other.rotation, self.translation + self.rotation @ other.translation
        )


@dataclass(frozen=True)
class JointMotion:
    """A joint: its constant axes (6, n), and where its `n` velocities are in those of the model.

    `numbers` are the expressions that its pose depends on, for instance cosine and sine; `ratio` is
    the speed of a joint that mimics another, per speed of that one; else 1.
    """

    axes: Array
    index_v: int
    ratio: float
    kind: str
    numbers: Expression

    def pose(self, numbers: Expression) -> Pose:
        """Return the pose of the joint's frame in its placement, by `numbers` as of this joint."""
        sx = casadi().SX
        if self.kind == "slide":
            return Pose(sx.eye(3), sx(self.axes[:3]) * numbers[0])
        if self.kind == "turn":  # with the pitch of a helical joint, by the angle behind the two
            axis = self.axes[3:, 0]
            pitch = float(self.axes[:3, 0] @ axis)
            shift = sx(axis) * (pitch * numbers[2]) if pitch else sx(3, 1)
            return Pose(rotation_about(axis, numbers[0], numbers[1]), shift)
        size = int(numbers.shape[0])
        turns = size in (9, 12)
        rotation = casadi().reshape(numbers[:9], 3, 3) if turns else sx.eye(3)
        return Pose(rotation, numbers[size - 3 :] if size != 9 else sx(3, 1))


def joint_motion(joint: pin.JointModel, q: Expression) -> JointMotion | None:
    """Return how `joint` moves with the configuration `q` (nq, 1); None for an unknown kind."""
    ca = casadi()
    kind, at = joint.shortname(), joint.idx_q
    if kind in _SEVERAL:
        axes = np.eye(6)[:, list(_SEVERAL[kind])]
        return JointMotion(axes, joint.idx_v, 1.0, "several", _several(kind, q[at : at + joint.nq]))
    mimics = kind == "JointModelMimic"
    rule = joint.extract()
    ratio, offset = (float(rule.scaling), float(rule.offset)) if mimics else (1.0, 0.0)
    if joint.nvExtended != 1 or ratio == 0.0:
        return None
    # The axis of one velocity is constant: at a place where all of q are numbers of a joint.
    data = joint.createData()
    joint.calc(data, np.full(q.shape[0], 0.5**0.5))
    axis = np.asarray(data.S).reshape(6, 1) / ratio
    turns = bool(np.any(axis[3:]))
    if joint.nq == 2:
        return JointMotion(axis, joint.idx_v, 1.0, "turn", ca.vertcat(q[at], q[at + 1]))
    angle = ratio * q[at] + offset if mimics else q[at]
    numbers = ca.vertcat(ca.cos(angle), ca.sin(angle), angle) if turns else ca.vertcat(angle)
    return JointMotion(axis, joint.idx_v, ratio, "turn" if turns else "slide", numbers)


def _several(kind: str, q: Expression) -> Expression:
    ca = casadi()
    if kind == "JointModelTranslation":
        return q
    if kind == "JointModelPlanar":
        rotation = rotation_about(np.eye(3)[2], q[2], q[3])
        return ca.vertcat(ca.vec(ca.densify(rotation)), q[0], q[1], 0)
    place = q[:3] if kind == "JointModelFreeFlyer" else ca.SX(0, 1)
    return ca.vertcat(ca.vec(_of_quaternion(q[-4:])), place)


def _of_quaternion(q: Expression) -> Expression:
    """Return the rotation (3, 3) of x, y, z, w, as Eigen computes it."""
    ca = casadi()
    x, y, z, w = q[0], q[1], q[2], q[3]
    rows = (
        (1 - (2 * y * y + 2 * z * z), 2 * x * y - 2 * w * z, 2 * x * z + 2 * w * y),
        (2 * x * y + 2 * w * z, 1 - (2 * x * x + 2 * z * z), 2 * y * z - 2 * w * x),
        (2 * x * z - 2 * w * y, 2 * y * z + 2 * w * x, 1 - (2 * x * x + 2 * y * y)),
    )
    return ca.vertcat(*(ca.horzcat(*row) for row in rows))


def rotation_about(axis: Array, cosine: Expression, sine: Expression) -> Expression:
    """Return the rotation (3, 3) about a unit `axis` (Rodrigues), sparse where it is a frame's."""
    ca = casadi()
    k = sparse(pin.skew(axis))
    along = sparse(np.outer(axis, axis))
    across = sparse(np.eye(3) - np.outer(axis, axis))
    return ca.sparsify(cosine * across + sine * k + along)


def sparse(matrix: Array) -> Expression:
    """Return numbers as an expression without their zeros."""
    ca = casadi()
    return ca.sparsify(ca.SX(ca.DM(np.asarray(matrix, dtype=float))))


def constant_pose(placement: pin.SE3) -> Pose:
    """Return `placement`, whose rotation's rounding errors are left out."""
    rotation = np.array(placement.rotation)
    near = np.round(rotation)
    rotation = np.where(np.abs(rotation - near) < _ROUNDING, near, rotation)
    return Pose(sparse(rotation), sparse(placement.translation.reshape(3, 1)))


def skew(vector: Expression) -> Expression:
    """Return the matrix (3, 3) of a cross product from the left."""
    return casadi().skew(vector)


def cross(one: Expression, other: Expression) -> Expression:
    """Return the cross product of two vectors (3, 1)."""
    return skew(one) @ other


def cross_motion(v: Expression, motion: Expression) -> Expression:
    """Return the rate of a `motion` (6, 1) that turns with the velocity v (6, 1)."""
    linear = cross(v[3:], motion[:3]) + cross(v[:3], motion[3:])
    return _stacked(linear, cross(v[3:], motion[3:]))


def cross_force(v: Expression, force: Expression) -> Expression:
    """Return the rate of a `force` (6, 1) that turns with the velocity v (6, 1)."""
    return _stacked(cross(v[3:], force[:3]), cross(v[3:], force[3:]) + cross(v[:3], force[:3]))


def _stacked(linear: Expression, angular: Expression) -> Expression:
    return casadi().vertcat(linear, angular)
