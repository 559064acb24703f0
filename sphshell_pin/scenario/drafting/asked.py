"""What a user asks of a new scenario, as one object."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_points, check_positive, check_vector
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.contact.materials import find_material
from sphshell_pin.errors import InvalidParameter, NameNotFound
from sphshell_pin.scenario.drafting.limb_ends import Tip

PLACES: dict[str, tuple[float, float, float]] = {
    "below": (0.0, 0.0, -1.0),
    "above": (0.0, 0.0, 1.0),
    "+x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
}
"""Where the surface is placed, seen from the tip."""

WORDS = ("plane", "box", "sphere", "cylinder", "bowl")
"""Surfaces that need no file."""

SHAPES = ("line", "circle", "raster")


@dataclass
class Asked:
    """What is asked of `new_scenario`; None: that is chosen.

    InvalidParameter or NameNotFound for what no robot and no surface can do.

    Parameters
    ----------
    robot
        Name of a shipped robot, or path of a URDF, xacro (`xacro_args`: its arguments) or MJCF file
        (`package_dirs`: folders above the packages of its meshes).
    surface
        A surface file, its `unit` where the format has none, or a word of WORDS.
    frame, radius, offset
        Of the sphere: the frame that carries it, its radius [m], and its center (3,) [m] in the
        frame, by default the origin; without a frame it is a known fingertip or foot. A `tip`
        stands for all three.
    bodies, faces
        Of a CAD file: those to take, by name or number; by default all of it.
    material, against
        What the sphere and the surface are made of, names of MATERIALS; by default a free body is
        of steel, any other sphere of rubber, or of plastic where rubber is too soft; the surface of
        steel, or of plastic where a hand cannot hold it.
    press
        Normal force [N] of a robot with a fixed base.
    place
        Where the surface stands as seen from its tip, a key of PLACES; by default below, where the
        joints allow it.
    at
        Where on the surface to touch: a point (3,) [m] in its own coordinates, or a kind of its
        faces, with a radius where there are several ("cylinder 5.5 mm").
    path, length
        Of the tip: points (k, 3) [m] on the surface in its own coordinates, or one of SHAPES from
        the place that is touched, over `length` [m].
    tips
        "all": all fingertips of a hand hold the surface, which then is a free part, of `against`
        all through; its URDF is written beside the scenario, as NAME_part.urdf.
    base
        "fixed" or "floating"; by default as its file states it, but a single limb on a free base is
        an arm, which is fixed, and so is a robot that cannot stand on the surface.
    density
        Of the links of a URDF that state no mass [kg/m^3]: they get that of their geometry. By
        default 2700, where a body that moves has geometry and no mass.
    mimic
        Whether joints that mimic others do so exactly; else they move freely.
    out
        The file to write, by default ROBOT_on_SURFACE.toml here; an existing one is replaced with
        `force` only, and only when all went well.
    tell
        Called with a sentence for each draft that failed, while others are tried.
    """

    robot: StrPath
    surface: StrPath = "plane"
    frame: str | None = None
    radius: float | None = None
    offset: Array | None = None
    tip: Tip | None = None
    unit: str | None = None
    bodies: Sequence[str] | None = None
    faces: Sequence[str | int] | None = None
    material: str | None = None
    against: str | None = None
    press: float | None = None
    place: str | None = None
    at: Array | str | None = None
    path: Array | str | None = None
    length: float | None = None
    tips: Literal["one", "all"] = "one"
    base: Literal["fixed", "floating"] | None = None
    package_dirs: Sequence[StrPath] = ()
    xacro_args: Mapping[str, str] | None = None
    density: float | None = None
    mimic: bool = True
    out: StrPath | None = None
    force: bool = False
    tell: Callable[[str], None] | None = None

    def __post_init__(self) -> None:
        for name, unit in (("radius", "m"), ("press", "N"), ("length", "m"), ("density", "kg/m^3")):
            if getattr(self, name) is not None:
                check_positive(name, getattr(self, name), unit)
        if self.place is not None and self.place not in PLACES:
            raise NameNotFound("place", self.place, "a surface", PLACES)
        for one in (self.material, self.against):
            if one is not None:
                find_material(one)
        if self.offset is not None:
            self.offset = check_vector("offset", self.offset, 3, " [m]")
        if isinstance(self.at, str):
            point = _numbers(self.at)
            self.at = self.at.strip() if point is None else point
        elif self.at is not None:
            self.at = check_vector("at", self.at, 3, " [m]")
        shapes = ", ".join(SHAPES)
        if isinstance(self.path, str) and self.path not in SHAPES:
            rows = [_numbers(one) for one in self.path.split(";") if one.strip()]
            if not rows or any(one is None for one in rows):
                why = f"must be {shapes}, or points [m] of the part: 'x,y,z; x,y,z'"
                raise InvalidParameter("path", self.path, why)
            self.path = np.array(rows)
        elif self.path is not None and not isinstance(self.path, str):
            self.path = check_points("path", self.path)
        if self.length is not None and not isinstance(self.path, str):
            why = f"belongs to a path of {shapes}: name one"
            raise InvalidParameter("length", self.length, why)
        if isinstance(self.path, np.ndarray) and self.at is not None:
            raise InvalidParameter(
                "at", self.at, "the first point of the path says it: leave it out"
            )

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


def _numbers(text: str) -> Array | None:
    """Return the point (3,) that `text` states; None if it does not."""
    try:
        point = np.array([float(one) for one in text.split(",")])
    except ValueError:
        return None
    return point if point.shape == (3,) and np.isfinite(point).all() else None
