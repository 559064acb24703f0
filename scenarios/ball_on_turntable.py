"""The figure that ball_on_turntable is known for."""

import numpy as np

from sphshell_pin import Result, Scene


def orbit_ratio(result: Result, scene: Scene) -> float:
    """Return how fast the ball orbits the axle, by how fast the table turns, in the last second."""
    ball = scene.model.joints[scene.model.getJointId("ball/root_joint")]
    axle = scene.model.joints[scene.model.getJointId("turntable/axle")]
    late = result.t >= result.t[-1] - 1.0
    x, y = result.q[late, ball.idx_q], result.q[late, ball.idx_q + 1]
    angle = np.unwrap(np.arctan2(y, x))
    time = result.t[late][-1] - result.t[late][0]
    return float((angle[-1] - angle[0]) / time / result.v[late, axle.idx_v].mean())
