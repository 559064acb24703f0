"""What a page plays: rows of forces and states, and the curves that charts can show of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array, Longs
from sphshell_pin.base.tables import quantity_of
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_columns import coordinates
from sphshell_pin.dynamics.scene.scene import SceneContacts
from sphshell_pin.dynamics.sensing.sensor_log import SensorLog

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

    @classmethod
    def from_result(
        cls, result: Result, residual: Array, readings: dict[str, Array] | None = None
    ) -> Rows:
        """Take the rows (n,) of a result, with its energy `residual` (n,) [J].

        `readings` are each sensor's last one before it; they become those at its end.
        """
        readings = {} if readings is None else readings
        more = {"q": result.q, "v": result.v, "residual": residual[:, None]}
        if result.torque is not None:
            more["torque"] = result.torque
        for name, log in result.sensors.items():
            more[f"sensor.{name}"] = held(log, result.t, readings.get(name))
            if len(log):
                readings[name] = log.values[-1]
        return cls.of(result.t, len(result.pairs), result.contacts, result.contacts.row, more)

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


# Units of charts, as people read them: the factor from SI units, and the name.
_SHOWN = {
    "rad": (180.0 / np.pi, "deg"),
    "rad/s": (180.0 / np.pi, "deg/s"),
    "m": (1e3, "mm"),
    "m/s": (1e3, "mm/s"),
}
_TORQUES = {"rad/s": "N m", "m/s": "N"}


@dataclass(frozen=True)
class Series:
    """A curve that a chart can show.

    `key` names it among all; `quantity` is what it is one of and `name` which one, `unit` that of
    its values. `of` gives the values (n,) from the block `source` (n, k) of Rows. `color` is
    "normal" or "friction" where the picture has a color for it; `from_zero` whether the axis of a
    chart begins at zero.
    """

    key: str
    quantity: str
    name: str
    unit: str
    source: str
    of: Callable[[Array], Array]
    color: str = ""
    from_zero: bool = False

    def values(self, rows: Rows) -> Array:
        """Return the values (n,) of `rows`, nan where they were not recorded."""
        block = rows.block(self.source)
        return np.full(len(rows), np.nan) if block is None else self.of(block)


def force_series(pairs: Sequence[str]) -> tuple[Series, ...]:
    """Return the curves of normal and friction forces [N] and depths [mm] of the pairs so named.

    Of several pairs there are also those of their sum, and of the deepest.
    """
    kinds = {"normal": "normal_force", "friction": "friction_force"}
    several = len(pairs) > 1
    found = []
    for kind, source in kinds.items():
        name = f"{kind}, all pairs" if several else kind
        found.append(Series(kind, "Force", name, "N", source, _sum, kind, from_zero=True))
    for k, pair in enumerate(pairs if several else ()):
        for kind, source in kinds.items():
            key, name = f"{kind}.{pair}", f"{kind}, {pair}"
            found.append(Series(key, "Force", name, "N", source, _column(k), from_zero=True))
    for k, pair in enumerate(pairs):
        read = _column(k, 1e3)
        found.append(Series(f"depth.{pair}", "Depth", pair, "mm", "depth", read, from_zero=True))
    return tuple(found)


def motion_series(model: pin.Model, *, torque: bool) -> tuple[Series, ...]:
    """Return the curves of joint positions and velocities, and of the controller's torques.

    Angles are in degrees, lengths in mm; of a joint that turns without end the angle from -180 to
    180 degrees.
    """
    in_q, in_v = (list(map(_split, names)) for names in coordinates(model))
    endless = {joint.idx_q for joint in model.joints if (joint.nq, joint.nv) == (2, 1)}
    found = []
    for k, (column, si) in enumerate(in_q):
        if k - 1 in endless or not column:
            continue
        name = column.removesuffix(".0") if k in endless else column
        factor, unit = _SHOWN["rad"] if k in endless else _SHOWN.get(si, (1.0, si))
        read = _angle(k, factor) if k in endless else _column(k, factor)
        found.append(Series(f"q.{name}", "Joint position", name, unit, "q", read))
    for k, (name, si) in enumerate(in_v):
        factor, unit = _SHOWN.get(si, (1.0, si))
        found.append(Series(f"v.{name}", "Joint velocity", name, unit, "v", _column(k, factor)))
    for k, (name, si) in enumerate(in_v if torque else ()):
        unit, read = _TORQUES.get(si, si), _column(k)
        found.append(Series(f"torque.{name}", "Controller torque", name, unit, "torque", read))
    return tuple(one for one in found if one.name)


def _sensor_series(columns: Mapping[str, Sequence[str]]) -> tuple[Series, ...]:
    """Return the curves of the sensors whose columns, with their units, these are."""
    return tuple(
        Series(f"sensor.{one}.{name}", f"Sensor {one}", name, unit, f"sensor.{one}", _column(k))
        for one, names in columns.items()
        for k, (name, unit) in enumerate(map(_unit, names))
    )


def series_of(
    pairs: Sequence[str], model: pin.Model, sensors: Mapping[str, Sequence[str]], *, torque: bool
) -> tuple[Series, ...]:
    """Return all curves: forces, joints, the columns of `sensors`, and the energy residual."""
    return (
        *force_series(pairs),
        *motion_series(model, torque=torque),
        *_sensor_series(sensors),
        Series("residual", "Energy residual", "residual", "J", "residual", _column(0)),
    )


def held(log: SensorLog, t: Array, before: Array | None) -> Array:
    """Return the last reading (n, k) that had arrived at each time `t` (n,) [s].

    `before` (k,) is the one from before the log; without it times before its first reading get nan.
    """
    first = np.full(len(log.columns), np.nan) if before is None else before
    return np.asarray(np.vstack((first, log.values))[np.searchsorted(log.t, t, side="right")])


def _sum(block: Array) -> Array:
    return np.asarray(block.sum(axis=1))


def _column(k: int, factor: float = 1.0) -> Callable[[Array], Array]:
    return lambda block: factor * block[:, k]


def _angle(k: int, factor: float) -> Callable[[Array], Array]:
    return lambda block: factor * np.arctan2(block[:, k + 1], block[:, k])


def _split(column: str) -> tuple[str, str]:
    """Return name and unit of a column of `coordinates`, "q.NAME [UNIT]"."""
    name, unit = _unit(column)
    return name[2:], unit


def _unit(column: str) -> tuple[str, str]:
    name, unit = quantity_of(column)
    return name, "" if unit == "1" else unit
