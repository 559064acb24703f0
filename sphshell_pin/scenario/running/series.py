"""What a chart can show of a run: curves of forces, depths, joints, sensors and energy.

A curve is described once, by a Series: its names, its unit, and how its values follow from what a
player records. Nothing is computed for a curve that nobody looks at.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.tables import quantity_of
from sphshell_pin.dynamics.result.result_columns import coordinates
from sphshell_pin.dynamics.sensing.sensor_log import SensorLog
from sphshell_pin.scenario.running.player import Rows

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
