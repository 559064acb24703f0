"""What a result is made of: the contact log, events, the energy audit, and where it came from."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array, Longs, Mask
from sphshell_pin.base.checks import read_only
from sphshell_pin.base.summary import Fact, Summarized
from sphshell_pin.dynamics.scene.scene_contacts import SceneContacts
from sphshell_pin.errors import InvalidParameter

if TYPE_CHECKING:
    from sphshell_pin.dynamics.result.result import Result

RECORDED = ("patch", "torque", "state")
"""What a run records only where it is asked to."""

PATCH = np.dtype(_core.patch_row_type())
"""One patch: `half_axes` (2,) a >= b [m], `axis_world` (3,) the direction of a, `peak_pressure` and
`mean_pressure` [Pa], `approach` [m]. Numbers are nan where a contact's geometry is unknown."""

Patches = NDArray[Any]  # (m,) of PATCH


def check_record(record: Collection[str]) -> frozenset[str]:
    """Return the names of RECORDED in `record`; InvalidParameter if it has others."""
    if isinstance(record, str) or not isinstance(record, Collection):
        raise InvalidParameter("record", record, "must be a list of names, such as ['patch']")
    for name in record:
        if name not in RECORDED:
            valid = " or ".join(f"'{one}'" for one in RECORDED)
            raise InvalidParameter("record", name, f"must be {valid}")
    return frozenset(record)


def patch_columns(patches: Patches) -> dict[str, Array]:
    """Return patches as named scalar columns, units in the names (for CSV, tables)."""
    columns = {f"half_axis_{a} [m]": patches["half_axes"][:, i] for i, a in enumerate("ab")}
    columns |= {f"patch_axis_{a} [1]": patches["axis_world"][:, i] for i, a in enumerate("xyz")}
    pressures = {f"{n} [Pa]": patches[n] for n in ("peak_pressure", "mean_pressure")}
    return columns | pressures | {"approach [m]": patches["approach"]}


_TIME, _STATE = 5, 17  # where a run's numbers have t, and q: see dynamics/run/simulation.cpp


@dataclass(frozen=True, repr=False, eq=False)
class RunState(Summarized):
    """All that the next steps of a run depend on, where one of its steps was accepted.

    `t` [s], `q` (nq,), `v` (nv,); `values` (m,) has these and the rest as numbers: stretches of
    bristles, contacts with their ids and sides, the next step's length, torques that are held, the
    work done. `Result.at` gives one, `Simulation.run` takes it in place of q0. Equal where all
    numbers are.
    """

    t: float
    q: Array
    v: Array
    values: Array

    @classmethod
    def from_values(cls, values: Array, nq: int, nv: int) -> RunState:
        """Return the state that a run with so many coordinates has recorded as `values` (m,)."""
        values = read_only(np.array(values, np.float64))
        q, v = values[_STATE : _STATE + nq], values[_STATE + nq : _STATE + nq + nv]
        return cls(float(values[_TIME]), q, v, values)

    def __eq__(self, other: object) -> bool:
        """Whether a run goes on from both with the same bits."""
        return isinstance(other, RunState) and np.array_equal(self.values, other.values)

    __hash__ = None  # type: ignore[assignment]

    def _facts(self) -> list[Fact]:
        return [Fact("time", self.t, "s"), Fact("numbers", len(self.values))]


def split_states(
    values: NDArray[np.generic] | None, sizes: NDArray[np.generic] | None
) -> tuple[Array, ...] | None:
    """Return the numbers of each row, of which there are `sizes`, one behind the other."""
    if values is None or sizes is None:
        return None
    ends = np.cumsum(sizes.astype(np.int64))[:-1]
    return tuple(read_only(one) for one in np.split(values.astype(np.float64), ends))


@dataclass(frozen=True)
class PairSeries:
    """Forces [N] and depth [m] of one pair at every recorded row, zero where nothing touches.

    Where a row has several contacts, the forces are their sums, the depth the largest:
    neighbors that take over a share of the load let the depth dip while the force stays.
    `friction` (n,) is the size of the sum, `force_world` (n, 3) the whole force on the sphere.
    """

    name: str
    normal: Array
    friction: Array
    depth: Array
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
        size = np.linalg.norm(friction, axis=1)
        return cls(str(result.pairs[pair]), normal, size, depth, force)


@dataclass(frozen=True, repr=False)
class ContactLog(SceneContacts):
    """Every contact of every recorded row: the columns of SceneContacts, and when.

    With m logged contacts: `t` (m,) [s], `row` (m,) index into the result's rows.
    """

    t: Array
    row: Longs

    def select(self, chosen: slice | Longs | Mask) -> Self:
        """Return the entries that `chosen`, a slice, mask or indices, picks."""
        columns: dict[str, Any] = {f.name: getattr(self, f.name) for f in fields(self)}
        for name, one in columns.items():
            columns[name] = None if one is None else one[chosen]
        return type(self)(**columns)

    def of_pair(self, pair: int) -> ContactLog:
        """Return the entries of one pair."""
        return self.select(self.pair == pair)

    def at_row(self, row: int) -> SceneContacts:
        """Return the contacts of one of the result's rows."""
        first, last = np.searchsorted(self.row, (row, row + 1))
        return SceneContacts(
            **{f.name: getattr(self, f.name)[first:last] for f in fields(SceneContacts)}
        )


@dataclass(frozen=True)
class Event:
    """Something that happened at time `t` [s] to the pair, or the joint, called `pair`.

    `kind` of a pair: "touch", "lift_off", "deep" (the depth passed half the sphere's radius),
    "through" (the sphere's center was pushed through the shell; it is pushed back) or
    "beyond_hertz" (HertzLaw's theory no longer holds: the ellipse of contact is more than half as
    long as the sphere, or the shell is a socket of nearly its radius). Of a joint:
    "stop" (it reached the end of its range), "effort_limit" (the controller's torque is cut),
    "speed_limit" (it is too fast), and "stop_left", "effort_limit_left", "speed_limit_left".
    """

    t: float
    pair: str
    kind: str


@dataclass(frozen=True, repr=False)
class EnergyAudit(Summarized):
    """Where the energy is and where it went, (n,) [J] at the result's rows.

    `kinetic` and `potential` (gravity) of the model, `elastic` of the contacts and stops of joints,
    stretched bristles included; since the start: `damping_loss` and `friction_loss` of the contacts
    and joints, `control_work` of the controller.
    """

    kinetic: Array
    potential: Array
    elastic: Array
    damping_loss: Array
    friction_loss: Array
    control_work: Array

    def _facts(self) -> list[Fact]:
        return [
            Fact("rows", len(self.kinetic)),
            Fact("exchanged", self.exchanged, "J"),
            Fact("residual at the end", _last(self.residual), "J"),
        ]

    @property
    def total(self) -> Array:
        """Energy stored and lost, less the controller's work (n,) [J]: it should not change."""
        stored = self.kinetic + self.potential + self.elastic
        return stored + self.damping_loss + self.friction_loss - self.control_work

    @property
    def residual(self) -> Array:
        """Energy that appeared from nowhere since the start (n,) [J]: the integration's error."""
        return self.total - self.total[:1]

    @property
    def exchanged(self) -> float:
        """Energy that changed form [J]: the scale on which to judge the residual.

        Sum over kinetic, potential and elastic energy of what each moved up and down in total
        between rows, halved, plus losses and the work of the controller.
        """
        until = self.exchanged_until
        return float(until[-1]) if len(until) else 0.0

    @property
    def exchanged_until(self) -> Array:
        """The same from the start until each row (n,) [J]."""
        parts = np.array([getattr(self, f.name) for f in fields(self)])
        steps = np.abs(np.diff(parts, axis=1, prepend=parts[:, :1])).sum(axis=0)
        return np.asarray(0.5 * np.cumsum(steps))


@dataclass(frozen=True)
class Kept:
    """What is kept of a scene, so that it can be shown without its files: JSON, and arrays."""

    contents: dict[str, object]
    arrays: Mapping[str, NDArray[np.generic]]


@dataclass(frozen=True)
class Origin:
    """The scenario that ran: `scenario`, a shipped name or a path, with all its `settings`.

    The settings, as JSON knows them, are those of the run, changed ones included. `keep` gives the
    robots and surfaces as they were used; None where they were not kept.
    """

    scenario: str
    settings: dict[str, object]
    keep: Callable[[], Kept] | None = field(default=None, repr=False, compare=False)


def _last(values: Array) -> float:
    return float(values[-1]) if len(values) else np.nan
