"""The ball of the analytic cases, its contacts, and what is read off its runs.

One point counts for both bodies, the contact point on the shell, so the ball rolls on the lever
`r - depth` about its center. Closed forms of rolling hold with it, and with the ball's own
I = 2/5 m r^2.
"""

import numpy as np
import pinocchio as pin

import sphshell_pin as sp
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics import Result
from sphshell_pin.study.report import swing
from sphshell_pin.study.report.swing import GRAVITY, MASS, RADIUS
from tests.rolling import PRECISE, STIFF, Ball, state, velocities

__all__ = [
    "GRAVITY", "INERTIA", "MASS", "PRECISE", "RADIUS", "STIFF", "beta", "bristle", "event_times",
    "free_ball", "scene_of", "spring", "state", "tilted", "velocities",
]  # fmt: skip
BALL = Ball(MASS, RADIUS)
INERTIA = BALL.inertia
# What the module of these runs knows of any ball, for this one.
beta, free_ball, scene_of = BALL.beta, BALL.model, BALL.scene
spring, bristle = BALL.spring, BALL.bristle


def tilted(angle: float) -> pin.SE3:
    """Return the placement of a slope that falls along +x by `angle` [rad]."""
    return pin.SE3(pin.utils.rotate("y", angle), np.zeros(3))


def event_times(result: Result, kind: str) -> list[float]:
    """Return when contacts of a kind of event came [s]."""
    return [event.t for event in result.events if event.kind == kind]


def exact_scene() -> sp.Scene:
    """Return the ball and the exact bowl; what is wrong there is the stepper's."""

    def touch(ball: pin.SE3, _: pin.SE3) -> tuple[list[Array], list[Array], list[float]]:
        center: Array = ball.translation
        out = float(np.linalg.norm(center))
        outward = center / out
        return [swing.BOWL * outward], [-outward], [out - swing.ARM]

    scene = sp.Scene(swing.ball_model())
    scene.add_contact_source(touch, "ball", "universe", swing.LAW)
    return scene
