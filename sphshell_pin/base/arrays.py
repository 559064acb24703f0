"""The arrays of numbers that the package computes with; shapes are stated where they are used."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import DTypeLike, NDArray

Array = NDArray[np.float64]
"""Double precision."""
Ints = NDArray[np.int32]
Longs = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Mask = NDArray[np.bool_]

Kind = tuple[DTypeLike, tuple[str | int, ...]]
"""The numbers of an array and its shape; a letter is a size that several arrays share."""
Announced = tuple[np.dtype[np.generic], tuple[int, ...]]
"""Those of an array that is there."""


def misfit(arrays: Mapping[str, Announced], wanted: Mapping[str, Kind]) -> str:
    """Return which of the `wanted` arrays has other numbers or another shape, or ""."""
    sizes: dict[str | int, tuple[int, str]] = {}
    for name, (numbers, letters) in wanted.items():
        kind, shape = arrays[name]
        if kind != np.dtype(numbers):
            return f"'{name}' holds {kind}, not {np.dtype(numbers)}"
        called = f"({', '.join(map(str, letters))}{',' * (len(letters) == 1)})"
        if len(shape) != len(letters):
            return f"'{name}' has the shape {shape}, not {called}"
        for size, letter in zip(shape, letters, strict=True):
            first = (letter, "") if isinstance(letter, int) else (size, name)
            known, owner = sizes.setdefault(letter, first)
            if size != known:
                of = f" with {letter} = {known} as of '{owner}'" if owner else ""
                return f"'{name}' has the shape {shape}, not {called}{of}"
    return ""


def frame_along(z: Array) -> Array:
    """Return a rotation (3, 3) whose third column is the unit vector `z`."""
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.column_stack((x, np.cross(z, x), z))
