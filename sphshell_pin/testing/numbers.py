"""The numbers of a scene's contact pairs, one by one, and the scene with one of them changed."""

import functools
from typing import Any

import numpy as np
import pinocchio as pin

from sphshell_pin.base.named_numbers import (
    AXES,
    TWIST,
    NamedNumber,
    every_column,
    names_of_pairs,
    with_value,
)
from sphshell_pin.dynamics import Scene


def names_of(scene: Scene) -> list[str]:
    """Return the names of all numbers of all pairs, as "PAIR.law.stiffness"."""
    known = names_of_pairs(scene.pairs)
    return [name for name, number in known.items() if number.ends is not None]


def is_place(column: str) -> bool:
    """Whether a column is a coordinate of an offset or of a placement."""
    return column.rpartition(".")[2] in (*AXES, *TWIST)


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
    pairs[number.at] = with_value(pairs[number.at], number.path, value)
    return scene.with_pairs(tuple(pairs))


def _found(scene: Scene, column: str) -> tuple[NamedNumber, int, Any]:
    """Return the number that a column is of, its place in it, and the whole value."""
    number, place = every_column(names_of_pairs(scene.pairs))[column]
    return number, place, functools.reduce(getattr, number.path, scene.pairs[number.at])
