"""Argument checks of the public functions and classes."""

import math
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import InvalidParameter

T = TypeVar("T")


def check_positive(name: str, value: object, unit: str = "") -> float:
    """Return `value` as a float; raise InvalidParameter unless it is finite and > 0."""
    number = check_finite(name, value)
    if number <= 0:
        raise InvalidParameter(name, value, f"must be positive{_in(unit)}")
    return number


def check_not_negative(name: str, value: object, unit: str = "") -> float:
    """Return `value` as a float; raise InvalidParameter unless it is finite and >= 0."""
    number = check_finite(name, value)
    if number < 0:
        raise InvalidParameter(name, value, f"must not be negative{_in(unit)}")
    return number


def check_finite(name: str, value: object) -> float:
    """Return `value` as a float; raise InvalidParameter unless it is one finite number."""
    if type(value) is float and math.isfinite(value):
        return value
    array = check_floats(name, value, "must be a number")
    if array.ndim:
        raise InvalidParameter(name, value, "must be one number")
    number = float(array)
    if not math.isfinite(number):
        raise InvalidParameter(name, value, "must be finite")
    return number


def check_vector(name: str, value: object, size: int, what: str = "") -> Array:
    """Return a copy of `value` as an array (size,); raise InvalidParameter otherwise."""
    array = check_floats(name, value, f"must hold {size} numbers{what}")
    if array.shape != (size,):
        raise _wrong_shape(name, array.shape, f"({size},){what}")
    if not np.isfinite(array).all():
        raise InvalidParameter(name, value, "must be finite")
    return array


def check_points(name: str, value: object) -> Array:
    """Return a copy of `value` as an array (n, 3); raise InvalidParameter otherwise."""
    array = check_floats(name, value, "must be an array of shape (n, 3)")
    if array.ndim != 2 or array.shape[1] != 3:
        raise _wrong_shape(name, array.shape, "(n, 3)")
    if not np.isfinite(array).all():
        row = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
        raise InvalidParameter(f"{name}[{row}]", array[row].tolist(), "must be finite")
    return array


def check_each_positive(name: str, value: ArrayLike, count: int, unit: str = "") -> Array:
    """Return `value`, one number or (count,), as an array (count,); raise unless all are > 0."""
    try:
        array = np.array(np.broadcast_to(as_floats(value), (count,)))
    except (TypeError, ValueError, OverflowError):
        raise InvalidParameter(
            name, np.shape(value), f"must be one number or have shape ({count},)"
        ) from None
    wrong = np.flatnonzero(~(np.isfinite(array) & (array > 0.0)))
    if wrong.size:
        k = int(wrong[0])
        raise InvalidParameter(f"{name}[{k}]", float(array[k]), f"must be positive{_in(unit)}")
    return array


def check_floats(name: str, value: object, must: str) -> Array:
    """Return a copy of `value` as an array of float64; InvalidParameter says what it `must` be."""
    try:
        return as_floats(value)
    except (TypeError, ValueError, OverflowError):
        raise InvalidParameter(name, value, must) from None


def as_floats(value: object) -> Array:
    """Return a copy of `value` as an array of float64.

    TypeError for truth values, texts, complex numbers and masked ones, which numpy would take.
    """
    if np.ma.is_masked(value):
        raise TypeError("a masked array has numbers that are to be left out")
    given = np.asarray(value)
    odd = given.dtype.kind not in "iufO"
    if odd or any(one is None or isinstance(one, bool | str) for one in _objects(given)):
        raise TypeError(f"real numbers are needed, not {given.dtype}")
    return np.array(given, dtype=np.float64, order="C")


def check_type(name: str, value: object, kind: type[T] | tuple[type[T], ...], must: str) -> T:
    """Return `value`; raise InvalidParameter unless it is an instance of `kind`, as `must` says."""
    if isinstance(value, kind):
        return value
    if isinstance(value, type) and issubclass(value, kind):
        raise InvalidParameter(name, value, f"{must}, not its class: did you forget ()?")
    raise InvalidParameter(name, value, must)


def check_flag(name: str, value: object) -> bool:
    """Return the truth of `value`; InvalidParameter where it has none, as of an array."""
    try:
        return bool(value)
    except (TypeError, ValueError):
        raise InvalidParameter(name, value, "must be True or False") from None


def check_name(name: str, value: object) -> None:
    """Raise InvalidParameter unless `value` is a text."""
    check_type(name, value, str, "must be a name (str)")


def check_names(name: str, value: object) -> tuple[str, ...]:
    """Return `value` as a tuple of texts; raise InvalidParameter for others and for repeats."""
    if isinstance(value, str):
        raise InvalidParameter(name, value, f"must be a list of names: write [{value!r}]")
    try:
        names: tuple[str, ...] = tuple(value)  # type: ignore[arg-type]  # it refuses others
    except TypeError:
        raise InvalidParameter(name, value, "must be a list of names") from None
    for k, one in enumerate(names):
        check_name(f"{name}[{k}]", one)
        if one in names[:k]:
            raise InvalidParameter(f"{name}[{k}]", one, "must not be listed twice")
    return names


def stated_pairs(
    name: str, stated: Mapping[str, T] | Iterable[str], must: str
) -> list[tuple[str, T | str]]:
    """Return keys and values of a mapping, of texts KEY=VALUE, or of a single one.

    InvalidParameter says what `name` `must` be where a text has no key or no "=".
    """
    if isinstance(stated, Mapping):
        return list(stated.items())
    pairs: list[tuple[str, T | str]] = []
    for text in [stated] if isinstance(stated, str) else stated:
        key, equals, value = (one.strip() for one in text.partition("="))
        if not (key and equals):
            raise InvalidParameter(name, text, must)
        pairs.append((key, value))
    return pairs


def check_placement(name: str, value: object) -> pin.SE3:
    """Return a copy of `value` (None: the identity).

    InvalidParameter unless it is a pinocchio.SE3 of finite numbers with a rotation: orthonormal to
    1e-6 and right-handed.
    """
    if value is None:
        return pin.SE3.Identity()
    is_matrix = getattr(value, "shape", None) == (4, 4)
    how = "; of a 4x4 array: pinocchio.SE3(array)" if is_matrix else ""
    pose = check_type(name, value, pin.SE3, f"must be a pinocchio.SE3{how}")
    if not np.isfinite(pose.homogeneous).all():
        raise InvalidParameter(name, pose.homogeneous.tolist(), "must be finite")
    rotation = np.array(pose.rotation)
    if np.abs(rotation.T @ rotation - np.eye(3)).max() > 1e-6 or np.linalg.det(rotation) < 0:
        raise InvalidParameter(
            f"{name}.rotation", rotation.tolist(), "must be a rotation: orthonormal, determinant +1"
        )
    return pin.SE3(pose)


def check_configuration(name: str, model: pin.Model, value: object, what: str = "") -> Array:
    """Return a copy of `value` as a configuration (nq,) of `model`.

    InvalidParameter for another size, no numbers, or a joint whose quaternion or (cos, sin) pair is
    not of unit length.
    """
    q = check_vector(name, value, model.nq, what)
    if not pin.isNormalized(model, q, 1e-3):
        raise off_unit_length(model, q, name)
    return q


def off_unit_length(model: pin.Model, q: Array, called: str = "q") -> InvalidParameter:
    """Return the error for a `q` (nq,) of `model` that is not normalized.

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
        f"{called}: the {what} of joint '{name}'",
        part.tolist(),
        f"must be of unit length, its length is {float(np.linalg.norm(part)):.6g}",
    )


def check_moved_mass(model: pin.Model) -> None:
    """Raise InvalidParameter for a joint that moves no mass: its acceleration would be infinite."""
    inertias = list(model.inertias)
    if all(inertia.mass > 0 for inertia in inertias[1:]):
        return
    moved = [inertia.mass + float(np.trace(inertia.inertia)) for inertia in inertias]
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


def _objects(array: NDArray[np.generic]) -> list[object]:
    return array.ravel().tolist() if array.dtype == object else []


def _wrong_shape(name: str, shape: tuple[int, ...], must: str) -> InvalidParameter:
    return InvalidParameter(name, shape, f"must have shape {must}", f"has shape {shape},")


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""
