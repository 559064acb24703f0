"""Recursions over the joints of a model, as blocks of expressions: one step of one joint each."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from sphshell_pin.dynamics.compiled.joint_motion import (
    Block,
    Expression,
    JointMotion,
    Pose,
    Storage,
    casadi,
    constant_pose,
    cross_force,
    cross_motion,
    joint_motion,
    skew,
    sparse,
)


@dataclass(frozen=True)
class SpatialInertia:
    """Momentum of a body by its velocity (v, w): p = m v + h w, angular h^T v + j w; all (3, 3)."""

    m: Expression
    h: Expression
    j: Expression

    @classmethod
    def of_body(cls, inertia: pin.Inertia) -> SpatialInertia:
        """Return that of one body, about the origin of its frame."""
        whole = np.array(inertia.matrix())
        return cls(sparse(whole[:3, :3]), sparse(whole[:3, 3:]), sparse(whole[3:, 3:]))

    @classmethod
    def of_entries(cls, entries: Expression) -> SpatialInertia:
        """Return the one whose `entries` these are."""
        m, j = (_symmetric(entries[k : k + 6]) for k in (0, 6))
        return cls(m, casadi().reshape(entries[12:21], 3, 3), j)

    def entries(self) -> Expression:
        """Return the 21 numbers of the symmetric matrix."""
        ca = casadi()
        full = [ca.densify(part) for part in (self.m, self.j, self.h)]
        upper = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]
        return ca.vertcat(*(part[k] for part in full[:2] for k in upper), ca.vec(full[2]))

    def times(self, motion: Expression) -> Expression:
        """Return the momentum (6, n) of motions (6, n)."""
        return casadi().vertcat(
            self.m @ motion[:3, :] + self.h @ motion[3:, :],
            self.h.T @ motion[:3, :] + self.j @ motion[3:, :],
        )

    def plus(self, other: SpatialInertia) -> SpatialInertia:
        """Return that of both bodies together."""
        return SpatialInertia(self.m + other.m, self.h + other.h, self.j + other.j)

    def less(self, columns: Expression, rows: Expression) -> SpatialInertia:
        """Return it without the symmetric product of `columns` (6, n) and `rows` (n, 6)."""
        product = columns @ rows
        return SpatialInertia(
            _mirrored(self.m - product[:3, :3]),
            self.h - product[:3, 3:],
            _mirrored(self.j - product[3:, 3:]),
        )

    def seen_from(self, pose: Pose) -> SpatialInertia:
        """Return it in the outer frame of `pose`, about the origin there."""
        turn, shift = pose.rotation, skew(pose.translation)
        m = _turned(turn, self.m)
        h = turn @ self.h @ turn.T
        moved = h - m @ shift
        j = _turned(turn, self.j) - h.T @ shift + shift @ moved
        return SpatialInertia(m, moved, _mirrored(j))


def _turned(turn: Expression, matrix: Expression) -> Expression:
    # Multiples of 1, as the mass of a body, stay what they are.
    off = matrix - matrix[0, 0] * casadi().SX.eye(3)
    if off.is_constant() and float(casadi().norm_fro(casadi().DM(off))) == 0.0:
        return matrix
    return _mirrored(turn @ matrix @ turn.T)


def _mirrored(matrix: Expression) -> Expression:
    """Return a symmetric matrix (3, 3) of which only one triangle is computed."""
    return casadi().triu2symm(casadi().triu(casadi().sparsify(matrix)))


def _symmetric(entries: Expression) -> Expression:
    ca, (a, b, c, d, e, f) = casadi(), (entries[k] for k in range(6))
    rows = ((a, b, c), (b, d, e), (c, e, f))
    return ca.sparsify(ca.vertcat(*(ca.horzcat(*row) for row in rows)))


@dataclass
class Body:
    """A joint, its body, and what the steps before leave of it."""

    joint: int
    parent: int
    motion: JointMotion
    placement: Pose
    inertia: SpatialInertia
    numbers: Expression = None
    velocity: Expression = None
    acceleration: Expression = None
    # Sums over the children, by the names where they are kept; None before the first child.
    carried: tuple[list[str], Expression] | None = None
    pushed: tuple[list[str], Expression] | None = None

    @property
    def axes(self) -> Expression:
        """The constant axes (6, n), as fast as the velocities of the model move them."""
        return sparse(self.motion.axes * self.motion.ratio)

    @property
    def columns(self) -> range:
        """Where the joint's velocities are in those of the model."""
        return range(self.motion.index_v, self.motion.index_v + self.motion.axes.shape[1])

    def to_parent(self, inertia: SpatialInertia) -> SpatialInertia:
        """Return an inertia in the frame of the parent joint."""
        return inertia.seen_from(self.motion.pose(self.numbers)).seen_from(self.placement)

    def force_to_parent(self, force: Expression) -> Expression:
        """Return a force (6, 1) in the frame of the parent joint."""
        return self.placement.act(self.motion.pose(self.numbers).act(force))

    def from_parent(self, motion: Expression) -> Expression:
        """Return a motion (6, 1) of the parent joint's frame in that of this one."""
        return self.motion.pose(self.numbers).act_inverse(self.placement.act_inverse(motion))


@dataclass
class Robot:
    """The bodies of a model, and its inputs as C names: q, v, tau, f and the output a."""

    model: pin.Model
    bodies: list[Body]
    storage: Storage = field(default_factory=lambda: Storage("w"))

    @classmethod
    def of(cls, model: pin.Model) -> Robot | str:
        """Return the robot, or the name of a joint of a kind that is not known."""
        q = _input("q", range(model.nq))
        bodies = []
        for j in range(1, model.njoints):
            motion = joint_motion(model.joints[j], q)
            if motion is None:
                return str(model.names[j])
            placement = constant_pose(model.jointPlacements[j])
            inertia = SpatialInertia.of_body(model.inertias[j])
            bodies.append(Body(j, int(model.parents[j]), motion, placement, inertia))
        return cls(model, bodies)

    def parent(self, body: Body) -> Body | None:
        """Return the body that carries this one; None for the world."""
        return self.bodies[body.parent - 1] if body.parent else None

    def rates(self, body: Body) -> Expression:
        """Return the velocity (6, 1) of the joint itself."""
        return body.axes @ _input("v", body.columns)

    def drift(self, body: Body) -> Expression:
        """Return the acceleration (6, 1) that follows from velocities alone."""
        return cross_motion(body.velocity, self.rates(body))

    def forward(self, body: Body) -> Block:
        """Place the joint, and compute the velocity of its body."""
        block, parent = Block(), self.parent(body)
        body.numbers = body.motion.numbers
        velocity = self.rates(body)
        if parent is not None:
            velocity = velocity + body.from_parent(parent.velocity)
        numbers, body.numbers = body.numbers, None
        body.numbers = block.keep(self.storage, numbers)
        body.velocity = block.keep(self.storage, velocity)
        return block

    def bias(self, body: Body) -> Expression:
        """Return the force (6, 1) that the body's motion takes, less that on it from outside."""
        momentum = body.inertia.times(body.velocity)
        outside = _input("f", range(6 * body.joint, 6 * body.joint + 6))
        return cross_force(body.velocity, momentum) - outside

    def fall(self) -> Expression:
        """Return the acceleration (6, 1) of a world that stands for the weight."""
        return sparse(-np.array(self.model.gravity.vector).reshape(6, 1))

    def add(self, block: Block, name: str, body: Body, values: Expression) -> None:
        """Add `values` to the sum called `name` of a body."""
        known = getattr(body, name)
        targets = self.storage.take(int(values.shape[0])) if known is None else known[0]
        block.write(targets, values if known is None else known[1] + values)
        names = casadi().vertcat(*(casadi().SX.sym(target) for target in targets))
        setattr(body, name, (targets, names))


def _input(name: str, indices: range) -> Expression:
    return casadi().vertcat(*(casadi().SX.sym(f"{name}[{k}]") for k in indices))


def articulated(robot: Robot) -> list[Block]:
    """Return Featherstone's articulated-body algorithm (2008, section 7.3), from q, v, tau, f to a.

    It is computed in the frames of the joints, where constants of the bodies stay constant.
    """
    blocks = [robot.forward(body) for body in robot.bodies]
    answers = {}
    for body in reversed(robot.bodies):
        block, parent, axes = Block(), robot.parent(body), body.axes
        inertia, force = body.inertia, robot.bias(body)
        if body.carried is not None and body.pushed is not None:
            inertia = inertia.plus(SpatialInertia.of_entries(body.carried[1]))
            force = force + body.pushed[1]
        across = inertia.times(axes)
        armature = np.array(robot.model.armature)[list(body.columns)]
        held = axes.T @ across + sparse(np.diag(armature))
        torque = _input("tau", body.columns) - axes.T @ force
        solved = _solve(held, casadi().horzcat(across.T, torque))
        rows, free = solved[:, :6], solved[:, 6]
        if parent is not None:
            rest = inertia.less(across, rows)
            force = force + rest.times(robot.drift(body)) + across @ free
            robot.add(block, "carried", parent, body.to_parent(rest).entries())
            robot.add(block, "pushed", parent, body.force_to_parent(force))
        names = robot.storage
        answers[body.joint] = (block.keep(names, rows), block.keep(names, free))
        blocks.append(block)
    for body in robot.bodies:
        block, parent = Block(), robot.parent(body)
        rows, free = answers[body.joint]
        above = robot.fall() if parent is None else parent.acceleration
        carried = body.from_parent(above) + robot.drift(body)
        rate = free - rows @ carried
        block.write([f"a[{k}]" for k in body.columns], rate)
        body.acceleration = block.keep(robot.storage, carried + body.axes @ rate)
        blocks.append(block)
    return blocks


def _solve(matrix: Expression, right: Expression) -> Expression:
    """Return X of a symmetric, positive definite system, by L D L^T without pivots."""
    ca = casadi()
    diagonal, upper, order = ca.ldl(ca.densify(matrix), False)
    return ca.ldl_solve(ca.densify(right), diagonal, upper, order)


def composite(robot: Robot) -> list[Block]:
    """Return the mass matrix m (nv, nv) and the bias forces b (nv), also where joints mimic others.

    Composite-rigid-body and recursive Newton-Euler algorithms (Featherstone 2008, sections 6.2,
    5.3); what joints of the same velocity exert is added up, as G^T M G. m and b begin with the
    armature and zeros; only the lower triangle of m is filled.
    """
    blocks = []
    for body in robot.bodies:
        block, parent = robot.forward(body), robot.parent(body)
        blocks.append(block)
        block = Block()
        above = robot.fall() if parent is None else parent.acceleration
        carried = body.from_parent(above) + robot.drift(body)
        body.acceleration = block.keep(robot.storage, carried)
        blocks.append(block)
    for body in reversed(robot.bodies):
        block, parent = Block(), robot.parent(body)
        inertia = body.inertia
        force = robot.bias(body) + inertia.times(body.acceleration)
        if body.carried is not None and body.pushed is not None:
            inertia = inertia.plus(SpatialInertia.of_entries(body.carried[1]))
            force = force + body.pushed[1]
        along = body.axes.T @ force
        _add_to(block, {f"b[{k}]": along[row] for row, k in enumerate(body.columns)})
        _add_to(block, _mass_columns(robot, body, inertia))
        if parent is not None:
            robot.add(block, "carried", parent, body.to_parent(inertia).entries())
            robot.add(block, "pushed", parent, body.force_to_parent(force))
        blocks.append(block)
    return blocks


def _mass_columns(robot: Robot, body: Body, inertia: SpatialInertia) -> dict[str, Expression]:
    """Return what the body, with all beyond it, adds to the mass matrix."""
    out: dict[str, Expression] = {}
    nv = robot.model.nv
    momentum, above = inertia.times(body.axes), body
    while True:
        product = above.axes.T @ momentum
        for column, i in enumerate(body.columns):
            for row, k in enumerate(above.columns):
                # Another joint's entry stands on both sides of the diagonal, which may be one.
                twice = 2 if i == k and above is not body else 1
                if above is body and k < i:
                    continue
                name = f"m[{max(i, k) * nv + min(i, k)}]"
                out[name] = out.get(name, 0) + twice * product[row, column]
        parent = robot.parent(above)
        if parent is None:
            return out
        columns = [above.force_to_parent(momentum[:, c]) for c in range(momentum.shape[1])]
        momentum, above = casadi().horzcat(*columns), parent


def _add_to(block: Block, sums: dict[str, Expression]) -> None:
    for name, value in sums.items():
        block.write([name], casadi().SX.sym(name) + value)


def placing(robot: Robot, body: Body, storage: Storage) -> tuple[Block, Block]:
    """Return how a joint's placement o and velocity s follow from those of its parent."""
    ca, k, parent = casadi(), body.joint, robot.parent(body)
    place, move = Block(), Block()
    numbers = place.keep(storage, body.motion.numbers)
    joint = body.motion.pose(numbers)
    pose, velocity = body.placement.times(joint), robot.rates(body)
    if parent is not None:
        p = parent.joint
        above = Pose(
            ca.reshape(_input("o", range(12 * p, 12 * p + 9)), 3, 3),
            _input("o", range(12 * p + 9, 12 * p + 12)),
        )
        pose = above.times(pose)
        carried = body.placement.act_inverse(_input("s", range(6 * p, 6 * p + 6)))
        velocity = velocity + joint.act_inverse(carried)
    place.write(
        [f"o[{12 * k + i}]" for i in range(12)],
        ca.vertcat(ca.vec(ca.densify(pose.rotation)), pose.translation),
    )
    move.write([f"s[{6 * k + i}]" for i in range(6)], velocity)
    return place, move
