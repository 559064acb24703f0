"""What the press of fingertip_on_blade is judged by: the force after the touch."""

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import Result, Scene

SETTLED = 0.3  # [s]: by then the bounce of the first touch has ended


def _forces(result: Result) -> NDArray[np.float64]:
    force = np.asarray(result.row_columns()["pairs.tip-blade.normal_force [N]"], dtype=float)
    return force[result.t >= SETTLED]


def least_force(result: Result, scene: Scene) -> float:
    """Return the least normal force after the touch [N]."""
    return float(_forces(result).min())


def greatest_force(result: Result, scene: Scene) -> float:
    """Return the greatest normal force after the touch [N]."""
    return float(_forces(result).max())
