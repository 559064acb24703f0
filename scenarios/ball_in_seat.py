"""The forces on the ball of ball_in_seat at the end."""

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import Result, Scene


def least_force(result: Result, scene: Scene) -> float:
    """Return the least of the normal forces [N]; 0 if there are not three."""
    forces = last_forces(result)
    return float(forces.min()) if len(forces) == 3 else 0.0


def greatest_force(result: Result, scene: Scene) -> float:
    """Return the greatest of the normal forces [N]; 0 if there is none."""
    return float(last_forces(result).max(initial=0.0))


def last_forces(result: Result) -> NDArray[np.float64]:
    """Return the normal forces (k,) [N] of the last row."""
    log = result.contacts
    return np.asarray(log.normal_force[log.row == len(result.t) - 1])
