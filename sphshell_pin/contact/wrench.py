"""The force routine for your own contact point (XXXXX1 of the ADAMS technique)."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin import _core
from sphshell_pin.base import checks
from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.friction import Friction, check_friction
from sphshell_pin.contact.normal_law import NormalLaw, check_law
from sphshell_pin.errors import InvalidParameter

# Force, moment and rate where nothing touches.
_NOTHING = (0.0, np.zeros(3), np.zeros(3), np.zeros(3))


class BristleState:
    """The memory of one contact with BristleFriction or MindlinFriction, for `contact_wrench`.

    Evaluations do not change it; `advance` moves it on, once for each accepted step. `radius` [m]
    of the sphere is needed by torsional and by Mindlin's friction; in `relaxation` [s] the bristle
    gives way beyond its limit. It can be copied and pickled.
    """

    def __init__(self, radius: float = 0.0, relaxation: float = 2e-5) -> None:
        self.radius = checks.check_not_negative("radius", radius, "m")
        self.relaxation = checks.check_positive("relaxation", relaxation, "s")
        self.stretch_world: Array = np.zeros(3)
        """Stretch of the bristle (3,) [m]; zero without contact.

        Of MindlinFriction the stretch it would have if the disc of contact had a radius of 1 m.
        """
        self._normal: Array | None = None

    def advance(
        self,
        point: ArrayLike,
        normal: ArrayLike,
        depth: float,
        motion_i: pin.Motion,
        motion_j: pin.Motion,
        law: NormalLaw,
        friction: Friction,
        *,
        dt: float,
    ) -> None:
        """Move on by a step of `dt` >= 0 [s], at whose end the bodies have these motions.

        The other arguments are those of `contact_wrench`. The bristle turns with body j and with
        the normal, and is stretched by the new velocity, as in SemiImplicitEuler (order 1). Where
        `depth` is not positive, it forgets; at a new touch it begins unstretched.
        """
        dt = checks.check_not_negative("dt", dt, "s")
        contact = _Contact(point, normal, depth, motion_i, motion_j, law, friction)
        if contact.depth <= 0 or self._normal is None:
            self.stretch_world = np.zeros(3)
        else:
            turned = pin.exp3(dt * np.array(motion_j.angular))
            relaxation = max(self.relaxation, dt)
            stretch = _with_normal(turned @ self.stretch_world, turned @ self._normal, contact)
            rate = contact.force(stretch, self.radius, relaxation)[3]
            self.stretch_world = stretch + dt * rate
        self._normal = contact.normal if contact.depth > 0 else None

    def stretch_at(self, contact: _Contact) -> Array:
        """Return the stretch (3,) [m], turned with the normal of `contact`."""
        if self._normal is None:
            return np.zeros(3)
        return _with_normal(self.stretch_world, self._normal, contact)


class _Contact:
    """The checked arguments of `contact_wrench`."""

    def __init__(
        self,
        point: ArrayLike,
        normal: ArrayLike,
        depth: float,
        motion_i: pin.Motion,
        motion_j: pin.Motion,
        law: NormalLaw,
        friction: Friction | None,
    ) -> None:
        self.point = checks.check_vector("point", point, 3)
        self.normal = checks.check_vector("normal", normal, 3)
        if abs(np.linalg.norm(self.normal) - 1) > 1e-6:
            raise InvalidParameter("normal", self.normal.tolist(), "must be a unit vector")
        for name, motion in (("motion_i", motion_i), ("motion_j", motion_j)):
            checks.check_type(name, motion, pin.Motion, "must be a pinocchio.Motion")
        check_law(law, "at a lone contact point")
        check_friction(friction)
        self.depth = checks.check_finite("depth", depth)
        self.motion = motion_i - motion_j
        self.law, self.friction = law, friction

    def force(
        self, stretch: Array, radius: float, relaxation: float
    ) -> tuple[float, Array, Array, Array]:
        """Return push [N], friction [N], moment [N m], bristle rate [m/s]."""
        if self.depth <= 0:
            return _NOTHING
        spin = float(self.normal @ self.motion.angular)
        return _core.contact_force(
            self.law._binding,
            None if self.friction is None else self.friction._binding,
            self.depth,
            self.normal,
            self.motion.linear + np.cross(self.motion.angular, self.point),
            spin,
            self.motion.angular - spin * self.normal,
            stretch,
            radius,
            relaxation,
        )


def contact_wrench(
    point: ArrayLike,
    normal: ArrayLike,
    depth: float,
    motion_i: pin.Motion,
    motion_j: pin.Motion,
    law: NormalLaw,
    friction: Friction | None = None,
    state: BristleState | None = None,
) -> tuple[pin.Force, pin.Force]:
    """Return the wrenches on body i and body j that touch at `point`.

    `point` (3,) [m] and `normal` (3,) (unit, from j to i) in the world; `depth` [m], no force
    where it is not positive; `motion_i`, `motion_j`: spatial velocities of the bodies in the world
    frame, about the world origin (data.oMi[j].act(data.v[j])). Both wrenches are pinocchio.Force
    in the world about the world origin, equal and opposite.

    A BristleFriction or MindlinFriction needs a `state`, which holds its stretch (else
    InvalidParameter); call `state.advance` once a step.
    """
    contact = _Contact(point, normal, depth, motion_i, motion_j, law, friction)
    if friction is None or not friction.has_state:
        push, drag, moment, _ = contact.force(np.zeros(3), 0.0, 1.0)
    else:
        if not isinstance(state, BristleState):
            without = (
                f"must be a BristleState, which holds the stretch of {type(friction).__name__}"
            )
            raise InvalidParameter("state", state, without)
        if friction.state_size > len(state.stretch_world):
            raise InvalidParameter(
                "rings", friction.state_size // 3, "must be 1: a BristleState has one"
            )
        if friction.needs_radius and not state.radius:
            kind = "torsional" if friction._binding.torsional else "Mindlin's"
            raise InvalidParameter("state.radius", 0.0, f"must be the sphere's, of {kind} friction")
        stretch = state.stretch_at(contact)
        push, drag, moment, _ = contact.force(stretch, state.radius, state.relaxation)
    force = push * contact.normal + drag
    wrench = pin.Force(force, np.cross(contact.point, force) + moment)
    return wrench, -wrench


def _with_normal(stretch: Array, before: Array, contact: _Contact) -> Array:
    """Turn a stretch by the smallest rotation from the normal `before` to that of `contact`."""
    turn = pin.Quaternion.FromTwoVectors(before, contact.normal).matrix()
    turned = np.asarray(turn @ stretch)
    if contact.friction is not None and contact.friction._binding.torsional:
        return turned
    return turned - (turned @ contact.normal) * contact.normal
