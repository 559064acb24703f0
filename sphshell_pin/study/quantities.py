"""What of a run can be measured: quantities by the names of the columns that exports have."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.tables import quantity_of
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_columns import coordinates
from sphshell_pin.dynamics.result.result_parts import PairSeries
from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.scenario.format.build import Built

# What of a pair has a field of PairSeries.
_SERIES = {"normal_force": "normal", "friction_force": "friction", "depth": "depth"}
# Times that differ by less than this part of the step between them are one.
_SAME = 1e-6
# Rows for each of the data's steps, where these do not lie on one grid.
_FINER = 8
# A grid of times may be so much finer than the steps between them.
_FINEST = 16
# So many rows for each time at most.
_MOST_ROWS = 64


@dataclass(frozen=True)
class Quantity:
    """A number of a run over time, in its SI `unit`; "" and "1" for a pure number."""

    name: str
    unit: str
    at: Callable[[Result, Array], Array]
    """Its values (n,) in a result at the times (n,) [s]; nan before the first one."""


def quantities_of(built: Built, sensors: str = "") -> dict[str, Quantity]:
    """Return what can be measured of the runs of a scenario, by name.

    `q.JOINT`, `v.JOINT` (`q.JOINT.0`, ... where a joint has several), `pairs.PAIR.normal_force`,
    `.friction_force` (its size), `.force_x` and on, `.friction_force_x` and on, `.depth`,
    `SENSOR.COLUMN`, with `sensors` before it; of each frame, along the axes of the world,
    `frames.FRAME.x` (position), `.vx` (velocity), `.wx` (angular velocity).
    """
    of_robot = *_of_joints(built), *_of_pairs(built)
    every = *of_robot, *_of_sensors(built, sensors), *_of_frames(built)
    return {one.name: one for one in every if one.name}


def row_step(t: Array) -> float:
    """Return the time between rows [s] that a run needs for values at the times `t` (n,).

    Where all of them are multiples of one step it is that step: the values are then those of rows.
    """
    steps = np.diff(t, prepend=0.0)
    steps = steps[steps > 0.0]
    if not len(steps):
        return 0.0
    least = float(t[-1]) / max(_MOST_ROWS * len(t), 1000)
    for parts in range(1, _FINEST + 1):
        step = float(steps.min()) / parts
        if step < least:
            break
        # The last one defines the step more exactly than the shortest does.
        step = float(t[-1]) / round(float(t[-1]) / step)
        if np.abs(t / step - np.rint(t / step)).max() < _SAME * len(t):
            return step
    return max(float(np.median(steps)) / _FINER, least)


def _at_rows(of: Callable[[Result], Array]) -> Callable[[Result, Array], Array]:
    """Interpolate rows (n,) or (n, p), linearly; at the time of a row it is that row's value."""

    def at(result: Result, t: Array) -> Array:
        def column_at(column: Array) -> Array:
            return np.interp(t, result.t, column)

        return np.asarray(np.apply_along_axis(column_at, 0, of(result)))

    return at


def _of_joints(built: Built) -> list[Quantity]:
    return [
        Quantity(*quantity_of(title), _at_rows(partial(_state, kind, k)))
        for kind, titles in zip("qv", coordinates(built.scene.model), strict=True)
        for k, title in enumerate(titles)
    ]


def _state(kind: str, column: int, result: Result) -> Array:
    return np.asarray(getattr(result, kind)[:, column])


def _of_pairs(built: Built) -> list[Quantity]:
    units = dict.fromkeys(_SERIES, "N") | {"depth": "m"}
    units |= {f"{part}_{a}": "N" for part in ("force", "friction_force") for a in "xyz"}
    return [
        Quantity(f"pairs.{pair.name}.{name}", unit, _at_rows(partial(_of_pair, k, name)))
        for k, pair in enumerate(built.scene.pairs)
        for name, unit in units.items()
    ]


def _of_pair(pair: int, name: str, result: Result) -> Array:
    """Return the sum over the contacts of a pair, or the largest depth; 0 without contact."""
    if name in _SERIES:
        return np.asarray(getattr(PairSeries.of(result, pair), _SERIES[name]))
    contacts = result.contacts.of_pair(pair)
    part, axis = name[:-2], "xyz".index(name[-1])
    forces = contacts.force_world if part == "force" else contacts.friction_force_world
    whole = np.zeros(len(result.t))
    np.add.at(whole, contacts.row, forces[:, axis])
    return whole


def _of_sensors(built: Built, above: str) -> list[Quantity]:
    return [
        Quantity(f"{above}{sensor.name}.{label}", unit, partial(_reading, sensor.name, i))
        for sensor in built.simulation.sensors
        for i, (label, unit) in enumerate(map(quantity_of, sensor.columns(built.scene)))
    ]


def _reading(sensor: str, column: int, result: Result, t: Array) -> Array:
    # The last reading that had arrived, as a controller or a logger has it.
    log = result.sensors[sensor]
    if not len(log):
        return np.full(len(t), np.nan)
    # A time as a file has it may be rounded down.
    late = t + _SAME * float(np.diff(log.t).min(initial=np.inf) if len(log) > 1 else 0.0)
    row = np.searchsorted(log.t, late, side="right") - 1
    return np.where(row >= 0, log.values[np.maximum(row, 0), column], np.nan)


def _of_frames(built: Built) -> list[Quantity]:
    model, out = built.scene.model, []
    for name in dict.fromkeys(frame.name for frame in model.frames[1:]):
        frame = find_frame(model, name)
        for part, unit in (("", "m"), ("v", "m/s"), ("w", "rad/s")):
            for axis in range(3):
                label = f"frames.{name}.{part}{'xyz'[axis]}"
                of = partial(_motion, model, frame, part, axis)
                out.append(Quantity(label, unit, _at_rows(of)))
    return out


def _motion(model: pin.Model, frame: int, part: str, axis: int, result: Result) -> Array:
    """Return position ("") or velocity ("v", "w") of a frame, along an axis of the world."""
    data, out = model.createData(), np.zeros(len(result.t))
    aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    for row, (q, v) in enumerate(zip(result.q, result.v, strict=True)):
        pin.forwardKinematics(model, data, q, v)
        if part:
            velocity = pin.getFrameVelocity(model, data, frame, aligned)
            vector = velocity.linear if part == "v" else velocity.angular
        else:
            vector = pin.updateFramePlacement(model, data, frame).translation
        out[row] = vector[axis]
    return out
