"""Forces and depth of each pair over time, as curves."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result import Result

FloatArray = NDArray[np.float64]

MOST_POINTS = 20_000


@dataclass(frozen=True)
class PairSeries:
    """Forces [N] and depth [m] of one pair at every recorded row, zero where nothing touches.

    Where a row has several contacts (`count`), the forces are their sums, the depth the largest:
    neighbors that take over a share of the load let the depth dip while the force stays.
    """

    name: str
    normal: FloatArray
    friction: FloatArray
    depth: FloatArray
    count: FloatArray

    @property
    def touches(self) -> bool:
        """Whether the pair is ever in contact."""
        return bool(np.any(self.depth > 0.0) or np.any(self.normal > 0.0))

    @property
    def peak(self) -> float:
        """Largest normal force [N]."""
        return float(self.normal.max(initial=0.0))

    @classmethod
    def of(cls, result: Result, pair: int) -> PairSeries:
        """Join the contacts of pair number `pair`: normal forces add, friction as vectors."""
        log, rows = result.contacts, len(result.t)
        own = np.asarray(log.pair) == pair
        row = np.asarray(log.row, dtype=np.int64)[own]
        normal = np.zeros(rows)
        np.add.at(normal, row, np.asarray(log.normal_force, dtype=float)[own])
        friction = np.zeros((rows, 3))
        np.add.at(friction, row, np.asarray(log.friction_force_world, dtype=float)[own])
        depth = np.zeros(rows)
        np.maximum.at(depth, row, np.asarray(log.depth, dtype=float)[own])
        count = np.bincount(row, minlength=rows).astype(np.float64)
        size = np.linalg.norm(friction, axis=1)
        return cls(str(result.pairs[pair]), normal, size, depth, count)


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
