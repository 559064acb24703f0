"""How far the follower of cam_and_follower is lifted, and how far it is from the law of the cam."""

import numpy as np

from sphshell_pin import Result, Scene

ECCENTRICITY, RADII = 0.015, 0.05  # [m]; radius of the disc and of the roller


def lift(result: Result, scene: Scene) -> float:
    """Return the lift over the turn [m]."""
    return float(np.ptp(result.q[:, 0]))


def deviation(result: Result, scene: Scene) -> float:
    """Return the largest distance of the follower from the law of the cam [m]."""
    height, cosine, sine = result.q.T
    law = np.sqrt(RADII**2 - (ECCENTRICITY * sine) ** 2) - ECCENTRICITY * cosine
    return float(np.abs(height - law).max())
