"""What the text formats have in common."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sphshell_pin.base import regular_file
from sphshell_pin.base.arrays import Array, Ints, Longs
from sphshell_pin.errors import InvalidShell, ShellFileError
from sphshell_pin.shell import raw


def read_text(path: Path) -> str:
    """Return the text of a file, with any line ends and without a byte-order mark."""
    return read_bytes(path).decode("utf-8-sig", errors="replace")


def read_bytes(path: Path) -> bytes:
    """Return the contents of a file; ShellFileError if it cannot be read."""
    try:
        return regular_file.read_bytes(path)
    except OSError as error:
        raise ShellFileError(path, f"cannot be read ({error.strerror})") from error


def check_ascii(words: Sequence[object]) -> None:
    """Raise ValueError for words that are numbers in Python alone."""
    text = "".join(map(str, words))
    if "_" in text or not text.isascii():
        raise ValueError("an underscore or a foreign digit in a number")


def real_numbers(words: Sequence[object]) -> Array:
    """Return words of a file as numbers; ValueError, also for 1_0, which is one in Python alone."""
    if words and isinstance(words[0], str):
        check_ascii(words)
    return np.array(words, np.float64)


def pack_polygons(
    counts: Sequence[int] | Longs, corners: Sequence[int] | Longs
) -> tuple[Longs, Ints]:
    """Offsets and corners from corner counts and indices from 0, see `indices`."""
    return raw.offsets_of(np.asarray(counts, np.int64)), indices(corners)


def indices(values: Sequence[int] | Longs) -> Ints:
    """Whole numbers as 32-bit indices; those too large for that stay invalid."""
    try:
        whole = np.asarray(values, np.int64)
    except OverflowError:  # Python's have no end
        whole = np.array([min(max(i, -1), raw.LARGEST_COUNT) for i in values], np.int64)
    return np.clip(whole, -raw.LARGEST_COUNT, raw.LARGEST_COUNT).astype(np.int32)


def finish(
    path: Path,
    vertices: Array,
    offsets: Longs,
    corners: Ints,
    normals: Array | None = None,
    notes: tuple[str, ...] = (),
) -> raw.RawSurface:
    """Check what every file must fulfil: enough points, all finite, indices in range."""
    counts = np.diff(offsets)
    try:
        if len(counts) == 0:
            raise InvalidShell("holds no elements")
        raw.check_vertices(vertices, 1)
        if counts.min() < 3:
            row = int(np.argmax(counts < 3))
            raise InvalidShell(
                f"element {row + 1} has {int(counts[row])} corners; it needs at least three"
            )
        raw.check_indices(offsets, corners, len(vertices), 1)
    except InvalidShell as error:
        raise ShellFileError(path, str(error)) from None
    points = np.ascontiguousarray(vertices, np.float64)
    return raw.RawSurface(points, offsets, corners, normals, notes, rounding=raw.rounding(points))
