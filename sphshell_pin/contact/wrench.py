"""The force routine for anybody's own contact point (XXXXX1 of the ADAMS technique)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from sphshell_pin import _core
from sphshell_pin.checks import check_finite, check_type, check_vector
from sphshell_pin.contact.friction import CoulombFriction
from sphshell_pin.contact.normal_law import NormalLaw, check_law
from sphshell_pin.errors import InvalidParameter


def contact_wrench(
    point: Any,
    normal: Any,
    depth: float,
    motion_i: pin.Motion,
    motion_j: pin.Motion,
    law: NormalLaw,
    friction: CoulombFriction | None = None,
) -> tuple[pin.Force, pin.Force]:
    """Return the wrenches on body i and body j that touch at `point`.

    `point` (3,) [m] and `normal` (3,) (unit, from j to i) in the world; `depth` [m], no force
    where it is not positive; `motion_i`, `motion_j`: spatial velocities of the bodies in the world
    frame, about the world origin (data.oMi[j].act(data.v[j])). Both wrenches are pinocchio.Force
    in the world about the world origin, equal and opposite. A BristleFriction raises
    InvalidParameter: its force depends on how the contact came about, which a scene remembers.
    """
    place = check_vector("point", point, 3)
    direction = check_vector("normal", normal, 3)
    if abs(np.linalg.norm(direction) - 1) > 1e-6:
        raise InvalidParameter("normal", direction.tolist(), "must be a unit vector")
    for name, motion in (("motion_i", motion_i), ("motion_j", motion_j)):
        check_type(name, motion, pin.Motion, "must be a pinocchio.Motion")
    check_law(law)
    if friction is not None:
        without = "must be a CoulombFriction or None: bristles need a scene, which remembers them"
        check_type("friction", friction, CoulombFriction, without)
    if check_finite("depth", depth) <= 0:
        return pin.Force.Zero(), pin.Force.Zero()
    relative = (motion_i - motion_j).linear + np.cross((motion_i - motion_j).angular, place)
    push, drag, _ = _core.contact_force(
        law.core, None if friction is None else friction.core, depth, direction, relative
    )
    force = push * direction + drag
    wrench = pin.Force(force, np.cross(place, force))
    return wrench, -wrench
