"""What the text formats have in common."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sphshell_pin.errors import ShellFileError
from sphshell_pin.shell.raw import LARGEST_COUNT, Floats, Ints, Longs, RawSurface, offsets_of


def read_text(path: Path) -> str:
    """Return the text of a file, with any line ends and without a byte-order mark."""
    return read_bytes(path).decode("utf-8-sig", errors="replace")


def read_bytes(path: Path) -> bytes:
    """Return the contents of a file; ShellFileError if it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise ShellFileError(path, f"cannot be read ({error.strerror})") from error


def check_finite(path: Path, vertices: Floats) -> None:
    """Raise ShellFileError for the first vertex that is not finite."""
    wrong = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if wrong.size:
        raise ShellFileError(
            path, f"vertex {int(wrong[0]) + 1} is not finite: {vertices[wrong[0]].tolist()}"
        )


def pack_polygons(
    counts: Sequence[int] | Longs, corners: Sequence[int] | Longs
) -> tuple[Longs, Ints]:
    """Offsets and corners from corner counts and indices from 0, see `indices`."""
    return offsets_of(np.asarray(counts, np.int64)), indices(corners)


def indices(values: Sequence[int] | Longs) -> Ints:
    """Whole numbers as 32-bit indices; those too large for that stay invalid."""
    try:
        whole = np.asarray(values, np.int64)
    except OverflowError:  # Python's have no end
        whole = np.array([min(max(i, -1), LARGEST_COUNT) for i in values], np.int64)
    return np.clip(whole, -LARGEST_COUNT, LARGEST_COUNT).astype(np.int32)


def finish(
    path: Path,
    vertices: Floats,
    offsets: Longs,
    corners: Ints,
    normals: Floats | None = None,
    notes: tuple[str, ...] = (),
) -> RawSurface:
    """Check what every file must fulfil: enough points, all finite, indices in range."""
    count = len(vertices)
    if count < 3 or len(offsets) < 2:
        raise ShellFileError(
            path, f"holds {count} vertices and {len(offsets) - 1} elements: no surface"
        )
    check_finite(path, vertices)
    few = np.flatnonzero(np.diff(offsets) < 3)
    if few.size:
        raise ShellFileError(
            path,
            f"element {int(few[0]) + 1} has {int(np.diff(offsets)[few[0]])} corners; it needs at "
            "least three",
        )
    wrong = np.flatnonzero((corners < 0) | (corners >= count))
    if wrong.size:
        element = int(np.searchsorted(offsets, wrong[0], side="right"))
        raise ShellFileError(
            path,
            f"element {element} uses vertex {int(corners[wrong[0]]) + 1} (counted from 1), but the "
            f"file has {count} vertices",
        )
    return RawSurface(np.ascontiguousarray(vertices, np.float64), offsets, corners, normals, notes)
