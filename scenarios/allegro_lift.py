"""Figures of the lifted part: how high, by what force, and how far it moves in the hand."""

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sphshell_pin import Result, Scene

Rows = NDArray[np.intp]

PART, PALM = "valve_body/root_joint", "hand/palm_link"
HELD = 10.0
"""The last part of the run [s], in which nothing may creep: it begins 2 s after the lift."""


def lifted_height(result: Result, scene: Scene) -> float:
    """Return how far [m] the part is above its start in the end."""
    z = scene.model.joints[scene.model.getJointId(PART)].idx_q + 2
    return float(result.q[-1, z] - result.q[0, z])


def carried_weight(result: Result, scene: Scene) -> float:
    """Return the mean vertical force [N] of the fingertips on the part while they hold it."""
    log, held = result.contacts, held_rows(result)
    on_tips = log.normal_force[:, None] * log.normal_world + log.friction_force_world
    tips = np.isin(log.pair, [i for i, pair in enumerate(result.pairs) if not is_foot(pair)])
    return float(-on_tips[np.isin(log.row, held) & tips, 2].sum() / len(held))


def creep(result: Result, scene: Scene) -> float:
    """Return the longest way [m] of a point of the part, as the palm sees it, while it is held."""
    model = scene.model
    data, palm = model.createData(), model.getFrameId(PALM)
    part = model.getJointId(PART)
    # On its axis and at the rim of its flange [m].
    points = np.array([[0, 0, 0], [0, 0, 0.144], [0.042, 0, 0], [-0.042, 0, 0], [0, 0.042, 0]])
    seen = []
    for q in result.q[held_rows(result)]:
        pin.framesForwardKinematics(model, data, q)
        pose = data.oMf[palm].actInv(data.oMi[part])
        seen.append(points @ pose.rotation.T + pose.translation)
    return float(np.linalg.norm(np.array(seen) - seen[0], axis=2).max())


def feet_in_touch(result: Result, scene: Scene) -> float:
    """Return how long [s] the part stands on the table."""
    pairs = result.stats.pairs
    return max(pairs[pair].contact_time for pair in result.pairs if is_foot(pair))


def is_foot(pair: str) -> bool:
    """Whether the contact `pair` is that of a foot with the table."""
    return pair.startswith("feet/")


def held_rows(result: Result) -> Rows:
    """Return the indices of the result's rows in which the part is held."""
    return np.flatnonzero(result.t >= result.t[-1] - HELD - 1e-9)
