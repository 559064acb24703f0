"""What a page plays: rows of forces, from a run that goes on or from a finished one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene import SceneContacts

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rows:
    """What was recorded since the last call, for a chart.

    `t` (n,) [s]; of each pair the sum of the `normal_force` and the size of the summed
    `friction_force` [N], and the largest `depth` [m], each (n, pairs) and zero where nothing
    touches.
    """

    t: Array
    normal_force: Array
    friction_force: Array
    depth: Array

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.t)

    @classmethod
    def empty(cls, pairs: int) -> Rows:
        """Return no rows for that many pairs."""
        none = np.zeros((0, pairs))
        return cls(np.zeros(0), none, none, none)

    @classmethod
    def of(
        cls,
        t: Array,
        pairs: int,
        contacts: SceneContacts,
        row: NDArray[np.int64] | int,
    ) -> Rows:
        """Sum `contacts` into rows at the instants `t` (n,) [s]; contact k belongs to `row[k]`."""
        shape = (len(t), pairs)
        normal, friction, deepest = np.zeros(shape), np.zeros((*shape, 3)), np.zeros(shape)
        place = (np.broadcast_to(row, contacts.pair.shape), contacts.pair)
        np.add.at(normal, place, contacts.normal_force)
        np.add.at(friction, place, contacts.friction_force_world)
        np.maximum.at(deepest, place, contacts.depth)
        return cls(np.asarray(t, dtype=float), normal, np.linalg.norm(friction, axis=2), deepest)

    def select(self, chosen: slice) -> Rows:
        """Return the rows that `chosen` picks."""
        return Rows(
            self.t[chosen],
            self.normal_force[chosen],
            self.friction_force[chosen],
            self.depth[chosen],
        )
