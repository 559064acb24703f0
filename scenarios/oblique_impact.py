"""How the ball of oblique_impact leaves the plate."""

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sphshell_pin import Result, Scene


def across(result: Result, scene: Scene) -> float:
    """Return the speed along x at the end [m/s]; nothing acts along x in flight."""
    return float(velocity_world(result)[0])


def up(result: Result, scene: Scene) -> float:
    """Return the speed along z when the ball leaves the plate [m/s]: at the end, less the fall."""
    left = result.contacts.t[-1]
    gravity = scene.model.gravity.linear[2]
    return float(velocity_world(result)[2] - gravity * (result.t[-1] - left))


def velocity_world(result: Result) -> NDArray[np.float64]:
    """Return the ball's velocity at the end (3,) [m/s]; that of a free body is in its own frame."""
    return np.asarray(pin.Quaternion(result.q[-1, 3:7]).matrix() @ result.v[-1, :3])
