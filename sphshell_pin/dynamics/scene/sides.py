"""What each of two bodies that may touch brings: a sphere, a shell, a plane or a contact source."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import as_floats
from sphshell_pin.contact import Method, Plane, Sphere
from sphshell_pin.errors import InvalidParameter, add_origin
from sphshell_pin.shell import Shell

Find = Callable[[pin.SE3, pin.SE3], tuple[ArrayLike, ArrayLike, ArrayLike]]

# Each takes 0.6 kB in every evaluation: more are, as a rule, a mistake of the routine.
_MOST = 1_000_000
# With bristles each contact is compared with all of the step before.
_MOST_WITH_BRISTLES = 1_000

_SHAPES = "must return points (k, 3), normals (k, 3), depths (k,)"


def checked_source(
    find: Find, name: str, bristles: bool = False
) -> Callable[[pin.SE3, pin.SE3], tuple[Array, Array, Array]]:
    """Wrap a user's routine so that the core gets arrays of the right shapes, and unit normals.

    With `bristles` the contacts have a BristleFriction, and fewer are allowed. InvalidParameter
    names the source `name`; exceptions of the routine itself pass, with a note.
    """
    where = f"contact source '{name}'"
    most = _MOST_WITH_BRISTLES if bristles else _MOST

    def checked(pose_i: pin.SE3, pose_j: pin.SE3) -> tuple[Array, Array, Array]:
        try:
            answer = find(pose_i, pose_j)
        except Exception as error:
            places = (np.round(pose.translation, 6).tolist() for pose in (pose_i, pose_j))
            add_origin(error, "{} with its frames at {} m and {} m".format(where, *places))
            raise
        try:
            points, normals, depths = answer
            point, normal, depth = _rows(points), _rows(normals), as_floats(depths)
            count = len(depth)  # what has no length is refused
        except (TypeError, ValueError, OverflowError):
            raise InvalidParameter(where, answer, _SHAPES) from None
        if count > most:
            must = f"but must return {most} at most{' with BristleFriction' if bristles else ''}"
            raise InvalidParameter(where, count, must, f"returns {count} contacts,")
        shapes = point.shape, normal.shape, depth.shape
        if shapes != ((count, 3), (count, 3), (count,)):
            raise InvalidParameter(where, shapes, _SHAPES, f"returns shapes {shapes},")
        if not (np.isfinite(point).all() and np.isfinite(depth).all()):
            raise InvalidParameter(where, point.tolist(), "must return finite points and depths")
        if len(normal) and not np.allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-6):
            raise InvalidParameter(where, normal.tolist(), "must return unit normals")
        return point, normal, depth

    return checked


def _rows(vectors: ArrayLike) -> Array:
    """Return vectors (k, 3); an empty list is none."""
    rows = as_floats(vectors)
    return rows if rows.size else np.zeros((0, 3))


@dataclass(frozen=True)
class Side:
    """A body by its `frame`, at `pose` in `joint`: all that a contact source needs of a body."""

    frame: str
    joint: int
    pose: pin.SE3

    @property
    def in_joint(self) -> pin.SE3:
        """The placement of the geometry in the joint: of a sphere, its center."""
        return self.pose

    @property
    def text(self) -> str:
        """The side in a few words."""
        return f"frame '{self.frame}'"


@dataclass(frozen=True)
class SphereSide(Side):
    """A sphere on a body."""

    sphere: Sphere

    @property
    def radius(self) -> float:
        """The radius of the sphere [m]."""
        return self.sphere.radius

    @cached_property
    def in_joint(self) -> pin.SE3:
        """The center of the sphere in the joint."""
        return self.pose * pin.SE3(np.eye(3), np.array(self.sphere.offset))

    @property
    def text(self) -> str:
        """The sphere and its frame."""
        return f"sphere of radius {self.radius * 1e3:.4g} mm on frame '{self.frame}'"


@dataclass(frozen=True)
class ShellSide(Side):
    """A shell at `placement` in the frame of a body, whose contacts `method` finds.

    Raises NameNotFound for an unknown method.
    """

    shell: Shell
    placement: pin.SE3
    method: str

    def __post_init__(self) -> None:
        """Check the method."""
        Method.from_name(self.method)

    @cached_property
    def in_joint(self) -> pin.SE3:
        """The shell in the joint."""
        return self.pose * self.placement

    @property
    def is_smooth(self) -> bool:
        """Whether contact uses the curved elements."""
        return self.method == "smooth"

    @property
    def key(self) -> tuple[int, int, bytes]:
        """A key: sides with equal keys have the same shell at the same place."""
        place = self.in_joint.homogeneous + 0.0  # no -0.0
        return id(self.shell), self.joint, place.tobytes()

    @property
    def text(self) -> str:
        """The shell and its frame."""
        return f"shell '{self.shell.name}' on frame '{self.frame}'"


@dataclass(frozen=True)
class PlaneSide(Side):
    """A plane on a body."""

    plane: Plane

    @cached_property
    def in_joint(self) -> pin.SE3:
        """The plane in the joint."""
        return self.pose * self.plane.placement

    @property
    def text(self) -> str:
        """The plane and its frame."""
        return f"plane on frame '{self.frame}'"


@dataclass(frozen=True)
class SourceSide(Side):
    """The first body of a contact source, with the routine that says where it touches the other."""

    find: Find
