"""The figure that sphere_on_shell is known for."""

import numpy as np

from sphshell_pin import Result, Scene


def swing_period(result: Result, scene: Scene) -> float:
    """Return the period [s] of the rolling: twice the time between passages of the middle."""
    x, t = result.q[:, 0], result.t
    passed = np.flatnonzero(x[:-1] * x[1:] < 0)
    times = t[passed] - x[passed] * (t[passed + 1] - t[passed]) / (x[passed + 1] - x[passed])
    return float(2 * np.diff(times).mean()) if len(times) > 1 else float("nan")
