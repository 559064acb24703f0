"""What a page plays: rows of forces, from a run that goes on or from a finished one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from sphshell_pin.base.arrays import Array, Longs
from sphshell_pin.dynamics.scene.scene import SceneContacts

FORCES = ("normal_force", "friction_force", "depth")


@dataclass(frozen=True)
class Rows:
    """What was recorded since the last call, for a chart.

    `t` (n,) [s]; of each pair the sum of the `normal_force` and the size of the summed
    `friction_force` [N], and the largest `depth` [m], each (n, pairs) and zero where nothing
    touches. `more` has further blocks (n, k) by name, where a player has them: "q", "v", "torque",
    "residual" [J], "sensor.NAME", in SI units.
    """

    t: Array
    normal_force: Array
    friction_force: Array
    depth: Array
    more: Mapping[str, Array] = field(default_factory=dict)

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
        row: Longs | int,
        more: Mapping[str, Array] | None = None,
    ) -> Rows:
        """Sum `contacts` into rows at the instants `t` (n,) [s]; contact k belongs to `row[k]`."""
        shape = (len(t), pairs)
        normal, friction, deepest = np.zeros(shape), np.zeros((*shape, 3)), np.zeros(shape)
        place = (np.broadcast_to(row, contacts.pair.shape), contacts.pair)
        np.add.at(normal, place, contacts.normal_force)
        np.add.at(friction, place, contacts.friction_force_world)
        np.maximum.at(deepest, place, contacts.depth)
        size = np.linalg.norm(friction, axis=2)
        return cls(np.asarray(t, dtype=float), normal, size, deepest, more or {})

    def block(self, name: str) -> Array | None:
        """Return one of FORCES, or one of `more`; None where it was not recorded."""
        found: Array | None = getattr(self, name) if name in FORCES else self.more.get(name)
        return found

    def select(self, chosen: slice) -> Rows:
        """Return the rows that `chosen` picks."""
        return Rows(
            self.t[chosen],
            self.normal_force[chosen],
            self.friction_force[chosen],
            self.depth[chosen],
            {name: block[chosen] for name, block in self.more.items()},
        )

    @classmethod
    def joined(cls, pieces: Sequence[Rows]) -> Rows:
        """Join pieces, at least one, that follow each other; what one of them lacks is nan."""
        if len(pieces) == 1:
            return pieces[0]
        widths = {name: one.shape[1] for rows in pieces for name, one in rows.more.items()}
        more = {
            name: np.concatenate(
                [rows.more.get(name, np.full((len(rows), width), np.nan)) for rows in pieces]
            )
            for name, width in widths.items()
        }
        columns = {
            name: np.concatenate([getattr(one, name) for one in pieces]) for name in ("t", *FORCES)
        }
        return cls(**columns, more=more)
