"""What of a run can be measured: quantities by the names of the columns that exports have."""

from collections.abc import Collection

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.tables import quantity_of
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.scenario.running.rows import held

# Times that differ by less than this part of the step between them are one.
_SAME = 1e-6
# Rows for each of the data's steps, where these do not lie on one grid.
_FINER = 8
# A grid of times may be so much finer than the steps between them.
_FINEST = 16
# So many rows for each time at most.
_MOST_ROWS = 64
_OF_FRAME = [f"{part}{axis}" for part in ("", "v", "w") for axis in "xyz"]
_UNITS_OF_FRAME = ["m"] * 3 + ["m/s"] * 3 + ["rad/s"] * 3


def quantities_of(
    result: Result, scene: Scene, t: Array, wanted: Collection[str] | None = None
) -> dict[str, tuple[str, Array]]:
    """Return unit and values (n,) at the times `t` (n,) [s] of what a run can be measured by.

    By name, these are the columns of its rows, with lines between them, and the last readings of
    its sensors that had arrived, as SENSOR.COLUMN, nan before the first one; of each frame, along
    the axes of the world, `frames.FRAME.x` (position), `.vx` (velocity), `.wx` (angular velocity).
    `wanted` are the names to return (None: all).
    """
    found: dict[str, tuple[str, Array]] = {}
    for title, column in result.row_columns(scene).items():
        name, unit = quantity_of(title)
        if name and name != "t" and (wanted is None or name in wanted):
            found[name] = unit, np.interp(t, result.t, column)
    for sensor, log in result.sensors.items():
        # A time as a file has it may be rounded down.
        late = _SAME * float(np.diff(log.t).min(initial=np.inf)) if len(log) > 1 else 0.0
        readings = held(log, t + late, None).T
        for (name, unit), values in zip(map(quantity_of, log.columns), readings, strict=True):
            found[f"{sensor}.{name}"] = unit, values
    for frame in dict.fromkeys(one.name for one in scene.model.frames[1:]):
        names = [f"frames.{frame}.{one}" for one in _OF_FRAME]
        if wanted is None or not set(names).isdisjoint(wanted):
            moved = (np.interp(t, result.t, one) for one in _motion(result, scene.model, frame))
            found |= dict(zip(names, zip(_UNITS_OF_FRAME, moved, strict=True), strict=True))
    return found


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


def _motion(result: Result, model: pin.Model, name: str) -> Array:
    """Return position, velocity and angular velocity (9, n) of a frame along the world's axes."""
    data, out, frame = model.createData(), np.zeros((len(result.t), 9)), find_frame(model, name)
    for row, q, v in zip(out, result.q, result.v, strict=True):
        pin.forwardKinematics(model, data, q, v)
        row[:3] = pin.updateFramePlacement(model, data, frame).translation
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        row[3:] = pin.getFrameVelocity(model, data, frame, aligned).vector
    return out.T
