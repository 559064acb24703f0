"""What a user asks of a new scenario, as one object."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_points, check_positive, check_vector
from sphshell_pin.contact.materials import find_material
from sphshell_pin.errors import InvalidParameter, NameNotFound

PLACES: dict[str, tuple[float, float, float]] = {
    "below": (0.0, 0.0, -1.0),
    "above": (0.0, 0.0, 1.0),
    "+x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
}
"""Where the surface is placed, seen from the tip."""

SHAPES = ("line", "circle", "raster")


@dataclass(frozen=True)
class Asked:
    """The arguments of `new_scenario`, checked; None: that is chosen."""

    robot: str | PathLike[str]
    surface: str | PathLike[str]
    frame: str | None
    radius: float | None
    offset: Array | None
    unit: str | None
    bodies: Sequence[str] | None
    faces: Sequence[str | int] | None
    material: str | None
    against: str | None
    press: float | None
    place: str | None
    at: Array | str | None
    """A point of the part (3,) [m], or a kind of its faces, with a radius where there are more."""
    path: Array | str | None
    """Points on the part (k, 3) [m], or one of SHAPES."""
    length: float | None
    """Length of a path of SHAPES [m]."""
    tips: Literal["one", "all"]
    base: Literal["fixed", "floating"] | None
    package_dirs: Sequence[str | PathLike[str]]
    xacro_args: Mapping[str, str] | None
    density: float | None
    """Density of the links whose mass the robot's file does not state [kg/m^3]."""
    mimic: bool
    out: str | PathLike[str] | None
    force: bool
    tell: Callable[[str], None] | None
    """Called with what failed, while the search goes on."""

    @classmethod
    def checked(cls, **given: Any) -> Asked:
        """Return what is asked; InvalidParameter or NameNotFound for what nothing can be."""
        for name, unit in (("radius", "m"), ("press", "N"), ("length", "m"), ("density", "kg/m^3")):
            if given[name] is not None:
                check_positive(name, given[name], unit)
        if given["place"] is not None and given["place"] not in PLACES:
            raise NameNotFound("place", given["place"], "a surface", PLACES)
        for one in (given["material"], given["against"]):
            if one is not None:
                find_material(one)
        at, path = given["at"], given["path"]
        if given["length"] is not None and (not isinstance(path, str) or path not in SHAPES):
            why = f"belongs to a path of {', '.join(SHAPES)}: name one"
            raise InvalidParameter("length", given["length"], why)
        if isinstance(at, str):
            point = _numbers(at)
            at = at.strip() if point is None else point
        elif at is not None:
            at = check_vector("at", at, 3, " [m]")
        if isinstance(path, str) and path not in SHAPES:
            rows = [_numbers(one) for one in path.split(";") if one.strip()]
            if not rows or any(one is None for one in rows):
                why = f"must be {', '.join(SHAPES)}, or points [m] of the part: 'x,y,z; x,y,z'"
                raise InvalidParameter("path", path, why)
            path = np.array(rows)
        elif path is not None and not isinstance(path, str):
            path = check_points("path", path)
        if isinstance(path, np.ndarray) and at is not None:
            raise InvalidParameter("at", at, "the first point of the path says it: leave it out")
        offset = given["offset"]
        offset = None if offset is None else check_vector("offset", offset, 3, " [m]")
        return cls(**{**given, "at": at, "path": path, "offset": offset})

    @property
    def word(self) -> str | None:
        """What stands for a surface that needs no file."""
        return None if Path(self.surface).is_file() else str(self.surface)

    @property
    def inside(self) -> bool:
        """Whether the surface is touched from its inside."""
        return self.word == "bowl"

    @property
    def slides(self) -> bool:
        """Whether a path is asked for."""
        return self.path is not None and len(self.path) > 1

    @property
    def whole(self) -> bool:
        """Whether part of the path will not do."""
        return isinstance(self.path, np.ndarray) or self.path in SHAPES[1:]

    @property
    def fixed(self) -> bool:
        """Whether the place is asked for."""
        return self.at is not None or isinstance(self.path, np.ndarray)


def _numbers(text: str) -> Array | None:
    """Return the point (3,) that `text` states; None if it does not."""
    try:
        point = np.array([float(one) for one in text.split(",")])
    except ValueError:
        return None
    return point if point.shape == (3,) and np.isfinite(point).all() else None
