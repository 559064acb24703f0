"""Curves over time, thinned for drawing."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

MOST_POINTS = 20_000


def thinned(t: FloatArray, *columns: FloatArray) -> tuple[FloatArray, ...]:
    """Thin long series without losing a peak: keep each bin's extremes of every column."""
    if len(t) <= MOST_POINTS:
        return (t, *columns)
    edges = np.linspace(0, len(t), MOST_POINTS // (2 * len(columns)) + 1).astype(int)
    kept = {0, len(t) - 1}
    for start, end in pairwise(edges):
        for column in columns:
            kept.add(start + int(np.argmin(column[start:end])))
            kept.add(start + int(np.argmax(column[start:end])))
    rows = np.array(sorted(kept))
    return (t[rows], *(column[rows] for column in columns))
