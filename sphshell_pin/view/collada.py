"""Robot meshes in Collada files, made small: their numbers as quantised differences of bytes.

Everything else of the file (materials, nodes, units) stays as it is, so that the page's own loader
draws what it would have drawn.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.view.nodes import Json

# A list of numbers in a Collada file: coordinates, or indices of corners.
_NUMBERS = re.compile(r"(<(?:float_array|p|vcount)\b[^>]*>)([^<]*)(</)")
MARK = "$$"  # where a list was taken out; no Collada file has two dollars
LEAST = 64  # shorter lists stay as they are
LEVELS = 65_535  # steps between the least and the largest coordinate of a mesh
LEVELS_OF_NORMALS = 1023


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


def pack_numbers(values: NDArray[np.float64], *, exact: bool) -> Json:
    """Describe `values` (n,) as `low` + `step` * integers, these as differences that compress well.

    An integer is told by its difference to the one `stride` before it, the signs folded (0, -1, 1,
    -2, ... are 0, 1, 2, 3, ...), component after component; `bytes` holds the lowest bytes of all
    of them, then the next, `width` of them.
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


def _fold(whole: NDArray[np.int64], stride: int) -> NDArray[np.int64]:
    """Return the differences to the number `stride` before, without signs, by component."""
    steps = np.diff(whole.reshape(-1, stride), axis=0, prepend=np.zeros((1, stride), np.int64))
    folded: NDArray[np.int64] = ((steps << 1) ^ (steps >> 63)).T.reshape(-1)
    return folded


def _are_normals(values: NDArray[Any]) -> bool:
    if len(values) % 3:
        return False
    return bool(np.all(np.abs(np.linalg.norm(values.reshape(-1, 3), axis=1) - 1.0) < 1e-2))
