"""Contact points from the user's own routine, checked on their way to the core."""

from collections.abc import Callable

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import as_floats
from sphshell_pin.errors import InvalidParameter, add_origin

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
