"""The arrays of numbers that the package computes with; shapes are stated where they are used."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Double precision."""
Ints = NDArray[np.int32]
Longs = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Mask = NDArray[np.bool_]


def frame_along(z: Array) -> Array:
    """Return a rotation (3, 3) whose third column is the unit vector `z`."""
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.column_stack((x, np.cross(z, x), z))
