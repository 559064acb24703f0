"""Curves over time, thinned for drawing."""

from sphshell_pin.base.arrays import Array
from sphshell_pin.view.curves import extremes

MOST_POINTS = 20_000


def thinned(t: Array, *columns: Array) -> tuple[Array, ...]:
    """Thin long series without losing a peak: keep each bin's extremes of every column."""
    rows = extremes(MOST_POINTS // (2 * len(columns)), *columns)
    return (t[rows], *(column[rows] for column in columns))
