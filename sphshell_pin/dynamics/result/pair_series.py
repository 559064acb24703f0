"""Forces and depth of each pair over time, as curves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result.result import Result


@dataclass(frozen=True)
class PairSeries:
    """Forces [N] and depth [m] of one pair at every recorded row, zero where nothing touches.

    Where a row has several contacts (`count`), the forces are their sums, the depth the largest:
    neighbors that take over a share of the load let the depth dip while the force stays.
    `friction` (n,) is the size of the sum, `force_world` (n, 3) the whole force on the sphere.
    """

    name: str
    normal: Array
    friction: Array
    depth: Array
    count: Array
    force_world: Array

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
        along = np.asarray(log.normal_force, dtype=float)[own]
        across = np.asarray(log.friction_force_world, dtype=float)[own]
        normal, depth = np.zeros(rows), np.zeros(rows)
        friction, force = np.zeros((rows, 3)), np.zeros((rows, 3))
        np.add.at(normal, row, along)
        np.add.at(friction, row, across)
        np.add.at(force, row, along[:, None] * np.asarray(log.normal_world)[own] + across)
        np.maximum.at(depth, row, np.asarray(log.depth, dtype=float)[own])
        count = np.bincount(row, minlength=rows).astype(np.float64)
        size = np.linalg.norm(friction, axis=1)
        return cls(str(result.pairs[pair]), normal, size, depth, count, force)
