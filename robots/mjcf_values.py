"""What MJCF's attributes say: numbers, rotations, defaults, included files."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pinocchio as pin

from sphshell_pin.arrays import Array
from sphshell_pin.regular_file import read_bytes
from sphshell_pin.robots.description import DEEPEST, check_size, parsed

MOST_FILES = 1000
"""Files that an MJCF may include, one as often as it is named."""

MOST_INCLUDED = 64e6
"""What they may have in all [B]."""

_ORIENTATIONS = ("quat", "axisangle", "xyaxes", "zaxis", "euler")


def numbers(text: str, count: int | None = None) -> Array:
    """Return the numbers in `text`; ValueError if they are not `count`."""
    try:
        found = np.array([float(one) for one in text.split()])
    except ValueError:
        raise ValueError(f"'{text}' are no numbers") from None
    if not np.isfinite(found).all():
        raise ValueError(f"'{text}' should be finite")
    if count is not None and len(found) != count:
        raise ValueError(f"'{text}' should be {count} number{'s' if count > 1 else ''}")
    return found


def turned_to(axis: Array) -> Array:
    """Return the smallest rotation (3,3) that turns z to `axis` (3,)."""
    z = np.array([0.0, 0.0, 1.0])
    one = pin.Quaternion.FromTwoVectors(z, axis / np.linalg.norm(axis))
    return np.asarray(one.toRotationMatrix())


def unit_of_angles(compiler: Mapping[str, str]) -> float:
    """Return the unit of angles [rad]."""
    return 1.0 if compiler.get("angle") == "radian" else np.pi / 180.0


def rotation(stated: Mapping[str, str], compiler: Mapping[str, str]) -> Array:
    """Return the rotation (3,3) that an element states in one of MuJoCo's ways."""
    unit = unit_of_angles(compiler)
    if "quat" in stated:
        w, x, y, z = numbers(stated["quat"], 4)
        return np.asarray(pin.Quaternion(w, x, y, z).normalized().toRotationMatrix())
    if "axisangle" in stated:
        *axis, angle = numbers(stated["axisangle"], 4)
        return np.asarray(pin.exp3(unit * angle * np.array(axis) / np.linalg.norm(axis)))
    if "euler" in stated:
        turned = np.eye(3)
        sequence = compiler.get("eulerseq", "xyz")
        if len(sequence) != 3 or set(sequence.lower()) - set("xyz"):
            raise ValueError(f"eulerseq '{sequence}' is no three of x, y, z")
        for letter, angle in zip(sequence, numbers(stated["euler"], 3), strict=True):
            one = pin.exp3(unit * angle * np.eye(3)["xyz".index(letter.lower())])
            # Upper case: about the axes of the parent, which stay.
            turned = one @ turned if letter.isupper() else turned @ one
        return np.asarray(turned)
    if "xyaxes" in stated:
        axes = numbers(stated["xyaxes"], 6).reshape(2, 3)
        x = axes[0] / np.linalg.norm(axes[0])
        y = axes[1] - (axes[1] @ x) * x
        y /= np.linalg.norm(y)
        return np.column_stack([x, y, np.cross(x, y)])
    if "zaxis" in stated:
        return turned_to(numbers(stated["zaxis"], 3))
    return np.eye(3)


def include(
    element: ET.Element, open_files: list[Path], sizes: list[int] | None = None, deep: int = 1
) -> None:
    """Put the content of included files in the place of <include>; `sizes` are theirs so far [B].

    The limits hold in total: of small files that include others twice, the whole doubles each time.
    """
    sizes = [] if sizes is None else sizes
    if deep > DEEPEST or len(open_files) > DEEPEST:
        raise ValueError(f"its elements or included files are nested more than {DEEPEST} deep")
    for k in range(len(element) - 1, -1, -1):
        one = element[k]
        if one.tag != "include":
            include(one, open_files, sizes, deep + 1)
            continue
        stated = one.get("file", "")
        places = [open_files[0].parent / stated, open_files[-1].parent / stated]
        found = next((place for place in places if os.path.isfile(place)), None)
        if found is None:
            raise ValueError(f"it includes {stated}, which is not there")
        if found.resolve() in open_files:
            raise ValueError(f"it includes {stated}, which includes itself")
        text = read_bytes(found, MOST_INCLUDED)
        sizes.append(len(text))
        if len(sizes) > MOST_FILES or sum(sizes) > MOST_INCLUDED:
            raise ValueError(
                f"it includes more than {MOST_FILES} files or {MOST_INCLUDED * 1e-6:g} MB in all, "
                "repeats counted: write each part once"
            )
        check_size(text)
        root = parsed(text)
        include(root, [*open_files, found.resolve()], sizes, deep)
        element[k : k + 1] = list(root)


def overlaid(under: Mapping[str, str], over: Mapping[str, str]) -> dict[str, str]:
    """Return both; of what states a place or an orientation, only that of `over`."""
    kept = dict(under)
    for ways in (_ORIENTATIONS, ("fromto", "pos")):
        if any(way in over for way in ways):
            kept = {key: value for key, value in kept.items() if key not in ways}
    return {**kept, **over}


def limited(stated: Mapping[str, str], key: str, limits: str, compiler: Mapping[str, str]) -> bool:
    """Whether the range `limits` of a joint counts; `key` says so, or the compiler."""
    says = stated.get(key, "auto")
    if says == "auto":
        return limits in stated and compiler.get("autolimits", "true") == "true"
    return says == "true" and limits in stated


def add_inertial(body: ET.Element, inertia: pin.Inertia) -> None:
    """Let `body` state its inertia."""
    i = inertia.inertia
    full = [i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]
    ET.SubElement(
        body,
        "inertial",
        mass=repr(float(inertia.mass)),
        pos=text_of(inertia.lever),
        fullinertia=text_of(np.array(full)),
    )


def posed(pose: pin.SE3) -> dict[str, str]:
    """Return a place as attributes."""
    x, y, z, w = pin.Quaternion(pose.rotation).coeffs()
    return {"pos": text_of(pose.translation), "quat": text_of(np.array([w, x, y, z]))}


def number(text: str | None, usual: float) -> float:
    """Return the number in `text`, or the usual one."""
    return usual if text is None else float(numbers(text, 1)[0])


def text_of(values: Array) -> str:
    """Return numbers as MJCF writes them."""
    return " ".join(repr(float(value)) for value in values)
