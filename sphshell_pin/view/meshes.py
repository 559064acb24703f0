"""Robot meshes made small for a recording: their numbers as quantized differences of bytes.

A recording of a robot is 2 to 5 times as large without it: 14 MB instead of 4 MB for a Go1. Of
Collada files everything else (materials, nodes, units) stays as it is, so that the page's own
loader draws what it would have drawn.
"""

import re
from pathlib import Path

import numpy as np

from sphshell_pin.base.arrays import Array, Longs
from sphshell_pin.errors import ShellFileError
from sphshell_pin.shell.readers.mesh import STL_RECORD, stl_corners
from sphshell_pin.view.nodes import Json

# A list of numbers in a Collada file: coordinates, or indices of corners.
_NUMBERS = re.compile(r"(<(?:float_array|p|vcount)\b[^<>]*>)([^<]*)(</)")
MARK = "$$"  # where a list was taken out; no Collada file has two dollars
LEAST = 64  # shorter lists stay as they are
LEVELS = 65_535  # steps between the least and the largest coordinate of a mesh
LEVELS_OF_NORMALS = 1023
STL_HEADER = 84  # bytes: a title of 80, then the number of facets
_LEAST_NORMAL = 0.1  # a shorter normal is none


def take_out_numbers(text: str) -> tuple[str, list[Json]]:
    """Return the Collada `text` with MARK in place of each long list of numbers, and the lists.

    Each is packed with `pack_numbers`: coordinates to 1 / LEVELS of the mesh's size, indices
    exactly. A list that holds anything but finite numbers stays in the text.
    """
    if MARK in text:
        return text, []
    lists: list[Json] = []

    def replace(found: re.Match[str]) -> str:
        start, body, end = found.groups()
        words = body.split()
        if len(words) < LEAST:
            return found.group(0)
        try:
            values = np.array(words, dtype=float)
        except ValueError:
            return found.group(0)
        if not np.isfinite(values).all():
            return found.group(0)
        lists.append(pack_numbers(values, exact=not start.startswith("<float_array")))
        return f"{start}{MARK}{end}"

    return _NUMBERS.sub(replace, text), lists


def pack_facets(data: bytes) -> Json | None:
    """Describe the facets of the binary STL file `data`, packed with `pack_numbers`.

    `points` (p, 3), row by row, and `corners` (f, 3) that number them. Titles, colors and normals
    are left out: the page shows none of the first two, and finds the last. None for what is no
    binary STL file.
    """
    if len(data) <= STL_HEADER:
        return None
    count = int.from_bytes(data[80:STL_HEADER], "little")
    if len(data) != STL_HEADER + STL_RECORD.itemsize * count:
        return None
    soup = np.frombuffer(data, STL_RECORD, count, STL_HEADER)["corners"].reshape(-1, 3)
    if not np.isfinite(soup).all():
        return None
    points, first, number = np.unique(soup, axis=0, return_index=True, return_inverse=True)
    # In the order of the file, where neighbors stand near each other.
    order = np.argsort(first)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return {
        "points": pack_numbers(points[order].astype(float).reshape(-1), exact=False),
        "corners": pack_numbers(place[number.reshape(-1)].astype(float), exact=True),
    }


def lit_facets(data: bytes) -> bytes:
    """Return the STL file `data` with a normal for each facet that states none.

    The page draws facets with the normals of the file, and black where they are zero, as many
    writers leave them. A text file becomes a binary one; what cannot be read stays as it is.
    """
    count = int.from_bytes(data[80:STL_HEADER], "little")
    if len(data) == STL_HEADER + STL_RECORD.itemsize * count:
        facets = np.frombuffer(data, STL_RECORD, count, STL_HEADER).copy()
    else:
        try:
            corners, _ = stl_corners(Path("mesh.stl"), data)
        except ShellFileError:
            return data
        facets = np.zeros(len(corners) // 3, STL_RECORD)
        facets["corners"] = corners.reshape(-1, 3, 3)
    with np.errstate(invalid="ignore"):
        dark = ~(np.linalg.norm(facets["normal"], axis=1) > _LEAST_NORMAL)
    if not dark.any():
        return data
    first, second, third = (facets["corners"][dark, k].astype(float) for k in range(3))
    normals = np.cross(second - first, third - first)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    facets["normal"][dark] = normals / np.where(lengths > 0.0, lengths, 1.0)
    title = b"normals computed from the corners".ljust(80)
    return title + len(facets).to_bytes(4, "little") + facets.tobytes()


def pack_numbers(values: Array, *, exact: bool) -> Json:
    """Describe `values` (n,) as `low` + `step` * integers, these as differences that compress well.

    An integer is stored as its difference to the one `stride` before it, the signs folded (0, -1,
    1, -2, ... are 0, 1, 2, 3, ...), component by component; `bytes` holds the lowest bytes of all,
    then the next, `width` of them.
    """
    low, step = 0.0, 1.0
    if not exact:
        low = float(values.min())
        levels = LEVELS_OF_NORMALS if _are_normals(values) else LEVELS
        step = float(values.max() - low) / levels or 1.0
    whole = np.rint((values - low) / step).astype(np.int64)
    folded, stride = min(
        ((_fold(whole, stride), stride) for stride in (1, 2, 3) if len(whole) % stride == 0),
        key=lambda one: float(np.log2(one[0] + 1.0).sum()),
    )
    width = max(1, -(-int(folded.max()).bit_length() // 8))
    planes = folded.astype("<u8").view(np.uint8).reshape(-1, 8).T[:width]
    return {
        "count": len(values),
        "stride": stride,
        "low": low,
        "step": step,
        "width": width,
        "bytes": planes.tobytes(),
    }


def _fold(whole: Longs, stride: int) -> Longs:
    """Return the differences to the number `stride` before, without signs, by component."""
    steps = np.diff(whole.reshape(-1, stride), axis=0, prepend=np.zeros((1, stride), np.int64))
    folded: Longs = ((steps << 1) ^ (steps >> 63)).T.reshape(-1)
    return folded


def _are_normals(values: Array) -> bool:
    if len(values) % 3:
        return False
    return bool(np.all(np.abs(np.linalg.norm(values.reshape(-1, 3), axis=1) - 1.0) < 1e-2))
