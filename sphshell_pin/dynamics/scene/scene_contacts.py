"""The contacts of a scene as columns, read from the core's rows with named fields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array, Bytes, Ints
from sphshell_pin.base.checks import read_only
from sphshell_pin.base.summary import Fact, Summarized

Columns = dict[str, NDArray[Any]]  # of numbers of several kinds
Rows = bytes | bytearray | Bytes

ROW = np.dtype(_core.contact_row_type())
"""The structured type of the core's rows: its fields are those of SceneContacts."""


@dataclass(frozen=True, repr=False)
class SceneContacts(Summarized):
    """Contacts of a scene at one state, as columns; vectors and points in the world.

    With k contacts: `pair` (k,) index into scene.pairs; `point_world`, `normal_world` (k, 3) from
    the shell to the sphere; `depth` (k,) [m]; `normal_force` (k,) [N]; `friction_force_world`
    (k, 3) on the sphere [N]; `slip_velocity_world` (k, 3) of the sphere's surface against the
    shell [m/s]; `element` (k,), `feature` (k,) as in ContactSet; `contact_id` (k,): in a run, or
    with a SceneState, a contact keeps its id, which no other of its pair had or will have, while it
    moves over elements and smooth edges; at a single state it is the index in the list of its pair.

    At a saddle, where contacts merge, `normal_force` is negative: the contacts push less
    than they would one by one.
    """

    pair: Ints
    point_world: Array
    normal_world: Array
    depth: Array
    normal_force: Array
    friction_force_world: Array
    slip_velocity_world: Array
    element: Ints
    feature: Bytes
    contact_id: Ints

    def __len__(self) -> int:
        """Return the number of contacts."""
        return len(self.depth)

    def _facts(self) -> list[Fact]:
        return [
            Fact("contacts", len(self)),
            Fact("largest normal force", float(self.normal_force.max(initial=0.0)), "N"),
            Fact("largest depth", float(self.depth.max(initial=0.0)), "m"),
        ]

    @property
    def force_world(self) -> Array:
        """Total force on the sphere of each contact, (k, 3) [N]."""
        return self.normal_force[:, None] * self.normal_world + self.friction_force_world

    @classmethod
    def from_rows(cls, rows: Rows) -> SceneContacts:
        """Build from the memory of the core's rows; a column is made when it is first read."""
        contacts = object.__new__(cls)
        contacts.__dict__["_table"] = rows
        return contacts

    def __getattr__(self, name: str) -> NDArray[Any]:
        """Return a column that has not been read yet."""
        if "_table" not in self.__dict__ or name not in (ROW.names or ()):
            raise AttributeError(f"'{type(self).__name__}' object has no attribute '{name}'")
        column = read_only(np.frombuffer(self.__dict__["_table"], ROW)[name])
        self.__dict__[name] = column
        return column


def columns(rows: Rows) -> Columns:
    """Return the fields of the core's rows, read-only, by name."""
    table = read_only(np.frombuffer(rows, ROW))  # and so are its fields
    return {name: table[name] for name in ROW.names or ()}
