"""The numbers of a scene's contact pairs, one by one, and the scene with one of them changed."""

import functools
from typing import Any

import numpy as np
import pinocchio as pin

from sphshell_pin.base.named_numbers import with_value
from sphshell_pin.base.parameters import parameters_of
from sphshell_pin.dynamics import Scene
from sphshell_pin.dynamics.scene.pairs import ContactPair

_AXES = {"offset": ("x", "y", "z"), "placement": ("vx", "vy", "vz", "wx", "wy", "wz")}


def names_of(scene: Scene) -> list[str]:
    """Return the names of all numbers of all pairs, as "PAIR.law.stiffness"."""
    names = []
    for pair in scene.pairs:
        for part in ("law", "friction"):
            whole = getattr(pair, part)
            names += [
                f"{pair.name}.{part}.{field}"
                for field in parameters_of(whole)
                if isinstance(getattr(whole, field), float)
            ]
        for end, _ in zip(("sphere", "other_sphere"), pair.spheres, strict=False):
            names += [f"{pair.name}.{end}.radius", f"{pair.name}.{end}.offset"]
        names += [f"{pair.name}.placement" for _ in pair.shells]
    return names


def columns_of(name: str) -> list[str]:
    """Return the coordinates of what is called `name`: three of an offset, six of a placement."""
    ends = _AXES.get(name.rpartition(".")[2])
    return [name] if ends is None else [f"{name}.{end}" for end in ends]


def is_place(column: str) -> bool:
    """Whether a column is a coordinate of an offset or of a placement."""
    return column.rpartition(".")[2] in (*_AXES["offset"], *_AXES["placement"])


def scale_of(scene: Scene, column: str, depth: float) -> tuple[float, bool]:
    """Return on what a scene changes with a number, and whether that is at its lower bound, 0.

    It is the number itself, of places and lengths the `depth` [m].
    """
    pair, part, field = _found(scene, column)
    if part not in ("law", "friction"):
        return depth, False
    value = abs(float(getattr(getattr(pair, part), field)))
    return value or 1.0, value == 0.0


def changed(scene: Scene, column: str, by: float) -> Scene:
    """Return the scene with one number changed `by` so much.

    A placement is multiplied by pinocchio.exp6 of a twist, from the right.
    """
    pair, part, field = _found(scene, column)
    path = pair.parts[part]
    whole: Any = functools.reduce(getattr, path, pair)
    if isinstance(whole, pin.SE3):
        twist = pin.Motion(by * np.eye(6)[_AXES[part].index(field)])
        new = with_value(pair, path, whole * pin.exp6(twist))
    elif field in _AXES["offset"]:
        x, y, z = np.asarray(whole.offset) + by * np.eye(3)["xyz".index(field)]
        new = with_value(pair, (*path, "offset"), (float(x), float(y), float(z)))
    else:
        new = with_value(pair, (*path, field), getattr(whole, field) + by)
    return scene.with_pairs(tuple(new if one is pair else one for one in scene.pairs))


def _found(scene: Scene, column: str) -> tuple[ContactPair, str, str]:
    """Return the pair, its part and the last word of a column; a pair's name may have dots."""
    found = [
        (pair, column.removeprefix(f"{pair.name}.").split("."))
        for pair in scene.pairs
        if column.startswith(f"{pair.name}.")
    ]
    parts = ("law", "friction", "sphere", "other_sphere", "placement")
    pair, words = min((one for one in found if one[1][0] in parts), key=lambda one: len(one[1]))
    return pair, words[0], words[-1]
