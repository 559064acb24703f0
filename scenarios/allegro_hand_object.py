"""Figures of the grasp in its last half second: what a held body must show."""

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import Result, Scene

Rows = NDArray[np.intp]

THUMB = "thumb"


def carried_weight(result: Result, scene: Scene) -> float:
    """Return the vertical force [N] that the fingertips exert on the bottle."""
    log, late = result.contacts, late_rows(result)
    on_tips = log.normal_force[:, None] * log.normal_world + log.friction_force_world
    return float(-on_tips[np.isin(log.row, late), 2].sum() / len(late))


def balance(result: Result, scene: Scene) -> float:
    """Return the normal force of the thumb, divided by the sum of the fingers'."""
    log = result.contacts
    late = np.isin(log.row, late_rows(result))
    thumb = log.pair == result.pairs.index(THUMB)
    return float(log.normal_force[late & thumb].sum() / log.normal_force[late & ~thumb].sum())


def creep(result: Result, scene: Scene) -> float:
    """Return the speed [m/s] at which the bottle sinks: this friction law always creeps."""
    late = late_rows(result)
    joint = scene.model.joints[scene.model.getJointId("bottle/root_joint")]
    z, t = result.q[late, joint.idx_q + 2], result.t[late]
    return float((z[0] - z[-1]) / (t[-1] - t[0]))


def late_rows(result: Result) -> Rows:
    """Return the indices of the result's rows in its last half second."""
    return np.flatnonzero(result.t >= result.t[-1] - 0.5)
