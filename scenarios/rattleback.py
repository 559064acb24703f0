"""When the rattleback turns round."""

import numpy as np
import pinocchio as pin

from sphshell_pin import Result, Scene


def turned(result: Result, scene: Scene) -> float:
    """Return when the spin about the vertical is zero for the last time [s]."""
    up = [pin.Quaternion(q[3:7]).matrix()[2] for q in result.q]
    spin = np.sum(up * result.v[:, 3:6], axis=1)
    return float(result.t[np.flatnonzero(spin[1:] * spin[:-1] < 0)[-1]])
