"""Argument checks shared by the package's public face."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sphshell_pin.errors import InvalidParameter

Array = NDArray[np.float64]


def check_positive(name: str, value: float, unit: str = "") -> float:
    """Return `value` as a float; raise InvalidParameter unless it is finite and > 0."""
    number = check_finite(name, value)
    if number <= 0:
        raise InvalidParameter(name, value, f"must be positive{_in(unit)}")
    return number


def check_not_negative(name: str, value: float, unit: str = "") -> float:
    """Return `value` as a float; raise InvalidParameter unless it is finite and >= 0."""
    number = check_finite(name, value)
    if number < 0:
        raise InvalidParameter(name, value, f"must not be negative{_in(unit)}")
    return number


def check_finite(name: str, value: float) -> float:
    """Return `value` as a float; raise InvalidParameter unless it is one finite number."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InvalidParameter(name, value, "must be a number") from None
    if not math.isfinite(number):
        raise InvalidParameter(name, value, "must be finite")
    return number


def check_vector(name: str, value: Any, size: int, what: str = "") -> Array:
    """Return a copy of `value` as an array (size,); raise InvalidParameter otherwise."""
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidParameter(name, value, f"must hold {size} numbers{what}") from None
    if array.shape != (size,):
        raise InvalidParameter(name, array.shape, f"must have shape ({size},){what}")
    if not np.isfinite(array).all():
        raise InvalidParameter(name, value, "must be finite")
    return array


def check_points(name: str, value: Any) -> Array:
    """Return a copy of `value` as an array (n, 3); raise InvalidParameter otherwise."""
    try:
        array = np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise InvalidParameter(name, value, "must be an array of shape (n, 3)") from None
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidParameter(name, array.shape, "must have shape (n, 3)")
    if not np.isfinite(array).all():
        row = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
        raise InvalidParameter(f"{name}[{row}]", array[row].tolist(), "must be finite")
    return array


def off_unit_length(model: Any, q: Array) -> InvalidParameter:
    """Return the fault of a `q` (nq,) of `model` that is not normalised.

    It names the joint whose quaternion or (cos, sin) pair is farthest from unit length.
    """
    parts: list[tuple[str, Array]] = []
    joints = list(zip(model.names, model.joints, strict=True))[1:]
    while joints:
        name, joint = joints.pop()
        kind = joint.shortname()
        if kind == "JointModelComposite":
            joints.extend((name, part) for part in joint.extract().joints)
        elif joint.nq != joint.nv:
            first = {"JointModelFreeFlyer": 3, "JointModelPlanar": 2}.get(kind, 0)
            parts.append((name, q[joint.idx_q + first : joint.idx_q + joint.nq]))
    name, part = max(parts, key=lambda one: abs(float(np.linalg.norm(one[1])) - 1.0))
    what = "quaternion (x, y, z, w)" if len(part) == 4 else "pair (cos, sin)"
    return InvalidParameter(
        f"q: the {what} of joint '{name}'",
        part.tolist(),
        f"must be of unit length, its length is {float(np.linalg.norm(part)):.6g}",
    )


def check_moved_mass(model: pin.Model) -> None:
    """Raise InvalidParameter for a joint that moves no mass: its acceleration would be infinite."""
    moved = [inertia.mass + float(np.trace(inertia.inertia)) for inertia in model.inertias]
    for joint in range(model.njoints - 1, 0, -1):
        if moved[joint] <= 0 and model.joints[joint].nv:
            raise InvalidParameter(
                "model",
                model.names[joint],
                "is a joint that moves no mass: give its link an inertial, or lock the joint",
            )
        moved[model.parents[joint]] += moved[joint]


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return `array` with writing switched off."""
    array.setflags(write=False)
    return array


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""
