"""Curves over time, thinned for drawing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.view.curves import extremes

FloatArray = NDArray[np.float64]

MOST_POINTS = 20_000


def thinned(t: FloatArray, *columns: FloatArray) -> tuple[FloatArray, ...]:
    """Thin long series without losing a peak: keep each bin's extremes of every column."""
    rows = extremes(MOST_POINTS // (2 * len(columns)), *columns)
    return (t[rows], *(column[rows] for column in columns))
