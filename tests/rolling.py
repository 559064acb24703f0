"""A solid ball that rolls on a turntable, in a vertical cylinder and in a bowl, with closed forms.

One point counts for both bodies, the contact point on the shell, so the ball rolls on the lever
`r - depth` about its center: `b = I / (m (r - depth)^2)` stands where a hard ball has 2/5.
"""

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sphshell_pin import Adaptive, BristleFriction, ImpactLaw, Scene, Simulation, Sphere
from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics import Result
from sphshell_pin.study.report.models import model_of
from sphshell_pin.study.report.swing import GRAVITY, mean_period

# Damping of springs, as a part of the critical one: their oscillation at the start dies out.
RATIO = 0.5
# Stiffness of contacts whose depth should not count [N/m], and of bristles.
STIFF = 1e7
PRECISE = Adaptive(1e-8)
TABLE_INERTIA = 1e4  # [kg m^2]: the ball does not slow the table
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Ball:
    """A solid ball of `mass` [kg] and `radius` [m] on a free-flyer."""

    mass: float
    radius: float

    @property
    def inertia(self) -> float:
        """2/5 m r^2 [kg m^2]."""
        return 0.4 * self.mass * self.radius**2

    def beta(self, depth: float = 0.0) -> float:
        """Return I / (m (r - depth)^2), 2/5 for depth 0."""
        return self.inertia / (self.mass * (self.radius - depth) ** 2)

    def spring(self, stiffness: float = STIFF, ratio: float = RATIO) -> ImpactLaw:
        """Linear spring and dashpot, which is at its full strength almost from the touch on."""
        return ImpactLaw(stiffness, 1.0, 2 * ratio * math.sqrt(stiffness * self.mass), 1e-10)

    def bristle(self, mu, stiffness=STIFF, mass=None) -> BristleFriction:
        """Bristles of one coefficient; `mass` [kg] that they move: of a round ball 2/7 of its."""
        moved = 2 / 7 * self.mass if mass is None else mass
        return BristleFriction(mu, mu, stiffness, 2 * RATIO * math.sqrt(stiffness * moved))

    def model(self, *others, gravity=GRAVITY):
        """Return the ball, and `others` beside it; the frame "ball" is at its center."""
        inertia = pin.Inertia.FromSphere(self.mass, self.radius)
        return model_of(("ball", pin.JointModelFreeFlyer(), inertia), *others, gravity=gravity)

    def scene(self, shell, law, friction=None, *, model=None, frame="universe", placement=None):
        """Return the ball, on a free-flyer unless `model` is given, and a shell."""
        scene = Scene(self.model() if model is None else model)
        scene.add_contact(Sphere(self.radius, "ball"), shell, frame, placement, law, friction)
        return scene


def state(center, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0)):
    """Return q0, v0 of the unturned free ball; all in the world, [m], [m/s], [rad/s]."""
    q0 = np.concatenate([np.asarray(center, dtype=float), [0.0, 0.0, 0.0, 1.0]])
    return q0, np.concatenate([velocity, spin]).astype(float)


def turned(quaternions: Array, vectors: Array) -> Array:
    """Turn vectors (n, 3) by unit quaternions x y z w (n, 4)."""
    axis, cosine = quaternions[:, :3], quaternions[:, 3:]
    across = 2 * np.cross(axis, vectors)
    out: Array = vectors + cosine * across + np.cross(axis, across)
    return out


def velocities(result: Result) -> Array:
    """Return the velocity (n, 3) of the free ball's center in the world [m/s]."""
    return turned(result.q[:, 3:7], result.v[:, :3])


@dataclass(frozen=True)
class Orbit:
    """A run on the turntable: `ratio` of orbit and table, and the closed form b / (1 + b)."""

    result: Result
    ratio: float
    expected: float


def on_turntable(ball, shell, turn, *, place, velocity, stiffness, bristles):
    """Roll two orbits on a table z = 0 that turns by `turn` [rad/s] about z.

    The ball starts rolling at `place` [m] with `velocity` [m/s]; `stiffness` and `bristles` [N/m].
    It goes round at b / (1 + b) of the table, 2/7 (Weckesser, Am. J. Phys. 65 (1997) 736).
    """
    law = ball.spring(stiffness)
    depth = law.depth_at(ball.mass * GRAVITY)
    b = ball.beta(depth)
    heavy = pin.Inertia(1.0, np.zeros(3), TABLE_INERTIA * np.eye(3))
    model = ball.model(("table", pin.JointModelRUBZ(), heavy))
    scene = ball.scene(shell, law, ball.bristle(0.5, bristles), model=model, frame="table")
    center, along = np.array([*place, ball.radius - depth]), np.array([*velocity, 0.0])
    slip = along - turn * np.cross(UP, center)
    q0, v0 = state(center, along, np.cross(UP, slip) / (ball.radius - depth))
    duration = 4 * math.pi / turn * (1 + 1 / b)
    result = Simulation(scene, PRECISE).run(
        np.append(q0, [1.0, 0.0]), np.append(v0, turn), duration, record_dt=duration / 200
    )
    late = velocities(result)[50:]
    angle = np.unwrap(np.arctan2(late[:, 1], late[:, 0]))
    seen = (angle[-1] - angle[0]) / (result.t[-1] - result.t[50]) / turn
    return Orbit(result, float(seen), b / (1 + b))


@dataclass(frozen=True)
class Bobbing:
    """A run in a vertical cylinder: `ratio` of the vertical frequency and that of the orbit.

    Its closed form is `expected`, sqrt(b / (1 + b)); that of the heights is [-swing, swing] [m],
    and the speed around should stay: `lost` is the share of it that did not.
    """

    result: Result
    ratio: float
    expected: float
    swing: float
    lost: float


def in_cylinder(ball, shell, radius, orbit, *, stiffness, mu=1.5, periods=3):
    """Let the ball roll around inside a cylinder of `radius` [m] about z at `orbit` [rad/s].

    It starts level, without spin about the normal, from the top of the swing about z = 0. The ball
    does not run down: it bobs at sqrt(2/7) of its orbit. The spin about the normal is turned by the
    orbit: r w_r' = orbit z', so that (1 + b) z'' = -g - b orbit r w_r (Routh, Rigid Dynamics II;
    Gualtieri et al., "Golfer's dilemma", Am. J. Phys. 74 (2006) 497). `stiffness` [N/m] is that of
    the contact and of the bristles.
    """
    depth = ball.mass * (radius - ball.radius) * orbit**2 / (stiffness - ball.mass * orbit**2)
    out, b = radius - ball.radius + depth, ball.beta(depth)
    expected = math.sqrt(b / (1 + b))
    swing = GRAVITY / (b * orbit**2)
    spin = [0.0, 0.0, -out * orbit / (ball.radius - depth)]
    q0, v0 = state([out, 0.0, swing], [0.0, out * orbit, 0.0], spin)
    scene = ball.scene(shell, ball.spring(stiffness), ball.bristle(mu, stiffness))
    duration = (periods + 0.4) * 2 * math.pi / (orbit * expected)
    result = Simulation(scene, PRECISE).run(q0, v0, duration, record_dt=1e-3)
    speed = velocities(result)
    period = mean_period(result.t, result.q[:, 2], speed[:, 2], periods)
    angle = np.unwrap(np.arctan2(result.q[:, 1], result.q[:, 0]))
    seen = (angle[-1] - angle[0]) / (result.t[-1] - result.t[0])
    around = np.linalg.norm(speed[:, :2], axis=1)
    lost = float(1 - around[-1] / around[0])
    return Bobbing(result, float(2 * math.pi / (period * seen)), expected, swing, lost)


@dataclass(frozen=True)
class Swinging:
    """A run in a bowl: `period` [s], and its closed form for the ball of this depth."""

    result: Result
    period: float
    expected: float


def in_bowl(ball, shell, radius, angle, *, stiffness, friction=None, periods=2):
    """Let the ball swing, rolling, from rest at `angle` [rad] in a bowl of `radius` [m] about 0.

    The period is 4 sqrt((1 + b) (R - r + depth) / g) K(sin(angle / 2)), and for small angles
    2 pi sqrt(7 (R - r) / (5 g)). `stiffness` [N/m] is that of the contact and of the bristles,
    which another friction law may replace.
    """
    depth = ball.mass * GRAVITY * math.cos(angle) / stiffness
    reach = radius - ball.radius + depth
    start = reach * np.array([math.sin(angle), 0.0, -math.cos(angle)])
    q0, v0 = state(start, np.zeros(3), np.zeros(3))
    expected = swing_period(angle, reach) * math.sqrt(1 + ball.beta(depth))
    bristles = ball.bristle(1.0, stiffness)
    scene = ball.scene(shell, ball.spring(stiffness), bristles if friction is None else friction)
    result = Simulation(scene, PRECISE).run(q0, v0, (periods + 0.35) * expected, record_dt=1e-3)
    seen = mean_period(result.t, result.q[:, 0], velocities(result)[:, 0], periods)
    return Swinging(result, seen, expected)


def swing_period(angle: float, length: float) -> float:
    """Return the period [s] of a pendulum of `length` [m] that swings from rest at `angle` [rad].

    4 sqrt(length / g) K(sin(angle / 2)), K by the arithmetic-geometric mean (Gauss).
    """
    a, c = 1.0, math.cos(angle / 2)
    while abs(a - c) > 1e-15:
        a, c = (a + c) / 2, math.sqrt(a * c)
    return 2 * math.pi / a * math.sqrt(length / GRAVITY)
