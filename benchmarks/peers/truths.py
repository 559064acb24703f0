"""What a scene is, and the truth of each kind of scene, which no engine computes.

The ball is solid, I = 2/5 m r^2; its law is a linear spring and dashpot, force = k depth +
c d(depth)/dt, never pulling. One point counts for both bodies, the closest point of the surface:
the lever of friction about the center is a = r - depth, and b = I / (m a^2) stands where a hard
ball has 2/5.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers import shapes
from benchmarks.peers.engine import Trajectory
from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report import swing

Vector = tuple[float, float, float]
GRAVITY = 9.81
RADIUS, MASS, STIFFNESS = swing.RADIUS, swing.MASS, swing.STIFFNESS  # 10 mm, 50 g, 1e4 N/m
DAMPING = 5.0  # [N s/m]: a tenth of the critical one, 2 sqrt(k m) = 45
MU = 0.8
DROP: Vector = (0.0, 0.0, -GRAVITY)


@dataclass(frozen=True)
class BallScene(ABC):
    """A ball on a surface: SI units, world frame.

    `rolls`: whether the ball can turn (else it moves along x, y, z alone); `mu` = 0 means no
    friction; `table_speed` [rad/s] turns the surface about z, whatever touches it.
    `dts` [s] are time steps worth trying, from coarse to fine.
    """

    name: str
    title: str
    surface: shapes.Surface
    duration: float
    position: Vector
    record_dt: float = 1e-3
    dts: tuple[float, ...] = (1e-3, 2e-4, 1e-4, 5e-5)
    velocity: Vector = (0.0, 0.0, 0.0)
    angular_velocity: Vector = (0.0, 0.0, 0.0)
    radius: float = RADIUS
    mass: float = MASS
    stiffness: float = STIFFNESS
    damping: float = DAMPING
    mu: float = MU
    gravity: Vector = DROP
    rolls: bool = True
    table_speed: float = 0.0
    unit: ClassVar[str] = "CPU s / s"

    @property
    def inertia(self) -> float:
        """I of the ball about its center [kg m^2]."""
        return 0.4 * self.mass * self.radius**2

    @property
    def weight(self) -> float:
        """Weight of the ball [N]."""
        return self.mass * float(np.linalg.norm(self.gravity))

    def b(self, depth: float) -> float:
        """I / (m a^2) at this depth [m]; 2/5 at none."""
        return self.inertia / (self.mass * (self.radius - depth) ** 2)

    def variants(self) -> tuple[BallScene, ...]:
        """Return the runs that make up the scene; their errors are joined by `joined`."""
        return (self,)

    @abstractmethod
    def errors(self, found: Trajectory) -> dict[str, float]:
        """Return the errors of a run by name; dimensionless unless the name has a unit."""

    @staticmethod
    def joined(errors: list[dict[str, float]]) -> dict[str, float]:
        """Return the errors of all variants as one: the root of the mean square of each."""
        names = dict.fromkeys(name for one in errors for name in one)
        values = {name: np.array([e[name] for e in errors if name in e]) for name in names}
        return {name: float(np.sqrt(np.mean(v**2))) for name, v in values.items()}


def late(found: Trajectory, share: float = 1 / 3) -> NDArray[np.bool_]:
    """Return which rows lie in the last `share` of the run."""
    late: NDArray[np.bool_] = found.t >= found.t[-1] * (1 - share)
    return late


def slope_of(t: Array, x: Array) -> float:
    """Return the slope of the straight line through the rows, by least squares."""
    return float(np.polyfit(t - t.mean(), x, 1)[0])


@dataclass(frozen=True)
class Plate(BallScene):
    """Pressed by its weight into a plate of triangles far smaller than the contact disc.

    Truth: k depth = m g, force = m g, no force sideways.
    """

    def errors(self, found: Trajectory) -> dict[str, float]:
        """Return `depth`, `force` of the last third; `side force` / weight, from the drift."""
        last = late(found)
        depth = float(np.mean(self.radius - found.position[last, 2]))
        aside = np.linalg.norm(found.position[-1, :2] - found.position[0, :2])
        errors = {"depth": abs(depth * self.stiffness / self.weight - 1)}
        if found.force is not None:
            errors["force"] = abs(float(found.force[last, 2].mean()) / self.weight - 1)
        errors["side force"] = float(2 * aside / (GRAVITY * found.t[-1] ** 2))
        return errors


@dataclass(frozen=True)
class Bowl(BallScene):
    """The swing of the report: 40 degrees, no friction, four periods, eight azimuths.

    Truth: the period, by a code of its own, and a constant energy.
    """

    azimuth: float = 0.0

    def variants(self) -> tuple[BallScene, ...]:
        """Return one swing for each azimuth."""
        return tuple(
            replace(self, azimuth=float(a), position=tuple(swing.start(float(a)).tolist()))
            for a in swing.AZIMUTHS
        )

    def errors(self, found: Trajectory) -> dict[str, float]:
        """Return `period` and `energy`: the largest change / energy of the swing.

        What the contact stores is taken in the way that favours the engine: as the engine reports,
        or k depth^2 / 2 in the exact bowl, or only where the ball turns round: there the load, and
        with it the stored energy of any law, is that of the start.
        """
        along = np.array([math.cos(self.azimuth), math.sin(self.azimuth), 0.0])
        x, vx = found.position @ along, found.velocity @ along
        period = swing.mean_period(found.t, x, vx, swing.PERIODS)
        moving = 0.5 * self.mass * (found.velocity**2).sum(axis=1)
        moving += 0.5 * self.inertia * (found.angular_velocity**2).sum(axis=1)
        free = moving + self.mass * GRAVITY * found.position[:, 2]
        depth = np.maximum(np.linalg.norm(found.position, axis=1) - swing.ARM, 0.0)
        turning = np.flatnonzero(np.diff(np.sign(vx[1:])) != 0) + 1
        accounts = [free + 0.5 * self.stiffness * depth**2, free[[0, *turning]]]
        if found.energy is not None:
            accounts.append(found.energy)
        changes = [float(np.abs(e - e[0]).max()) / swing.ENERGY for e in accounts if len(e) > 1]
        return {"period": abs(period / swing.PERIOD - 1), "energy": min(changes)}

    @staticmethod
    def joined(errors: list[dict[str, float]]) -> dict[str, float]:
        """Return root mean square of the periods' errors, mean of the energies'."""
        periods, energies = (np.array([e[name] for e in errors]) for name in ("period", "energy"))
        return {"period": float(np.sqrt(np.mean(periods**2))), "energy": float(energies.mean())}


ORBIT = 40.0  # [rad/s]


@dataclass(frozen=True)
class Cylinder(BallScene):
    """Rolls round inside a vertical cylinder: instead of falling it goes up and down.

    Truth: z = -drop / 2 (1 - cos(n t)), n = sqrt(b / (1 + b)) times the rate of the orbit
    (sqrt(2/7) of a hard ball), drop = 2 g / (b rate^2).
    """

    depth: float = 0.0

    @property
    def rate(self) -> float:
        """Angular rate of the oscillation [rad/s]."""
        b = self.b(self.depth)
        return ORBIT * math.sqrt(b / (1 + b))

    @property
    def drop(self) -> float:
        """How far it falls before it turns [m]."""
        return 2 * GRAVITY / (self.b(self.depth) * ORBIT**2)

    def errors(self, found: Trajectory) -> dict[str, float]:
        """Return `rate` of the oscillation; `path`: largest error of z / drop."""
        t, z = found.t, found.position[:, 2]
        exact = -0.5 * self.drop * (1 - np.cos(self.rate * t))
        path = float(np.abs(z - exact).max() / self.drop)
        # A ball that fell out does not oscillate.
        rate = abs(fitted_rate(t, z, self.rate) / self.rate - 1) if path < 1 else math.inf
        return {"rate": rate, "path": path}


def fitted_rate(t: Array, z: Array, guess: float) -> float:
    """Return the rate of the sinusoid (with a mean) nearest to the rows, by least squares."""
    rate = guess
    for _ in range(20):
        cos, sin = np.cos(rate * t), np.sin(rate * t)
        (_, p, q), *_ = np.linalg.lstsq(np.c_[np.ones_like(t), cos, sin], z, rcond=None)
        columns = np.c_[np.ones_like(t), cos, sin, t * (q * cos - p * sin)]
        step = float(np.linalg.lstsq(columns, z, rcond=None)[0][3])
        rate += min(max(step, -0.1 * guess), 0.1 * guess)
        if abs(step) < 1e-13 * guess:
            break
    return rate


@dataclass(frozen=True)
class Turntable(BallScene):
    """Rolls on a turning table, in circles.

    Truth: they are circles, at b / (1 + b) of the table's rate (2/7 of a hard ball; Weckesser,
    Am. J. Phys. 65 (1997) 736). The run is one of them.
    """

    def errors(self, found: Trajectory) -> dict[str, float]:
        """Return `rate` of the circle, and `closure`: the gap at the end / radius of the circle."""
        b = self.b(self.weight / self.stiffness)
        rate = b / (1 + b) * self.table_speed
        angle = np.unwrap(np.arctan2(found.velocity[:, 1], found.velocity[:, 0]))
        radius = float(np.linalg.norm(self.velocity)) / rate
        end = np.array([np.interp(self.duration, found.t, p) for p in found.position[:, :2].T])
        return {
            "rate": abs(slope_of(found.t, angle) / rate - 1),
            "closure": float(np.linalg.norm(end - self.position[:2])) / radius,
        }


@dataclass(frozen=True)
class Groove(BallScene):
    """Lies in a V: two contacts, one on each wall, each wall at `opening` from the middle [rad].

    Truth: each carries m g / (2 sin opening).
    """

    opening: float = math.pi / 4

    @property
    def load(self) -> float:
        """Force of each contact [N]."""
        return self.weight / (2 * math.sin(self.opening))

    def errors(self, found: Trajectory) -> dict[str, float]:
        """Return `depth`; `force`: of the worse wall; `side force` / weight, as on the plate."""
        last = late(found)
        height = float(found.position[last, 2].mean())
        depth = self.radius - height * math.sin(self.opening)
        errors = {"depth": abs(depth * self.stiffness / self.load - 1)}
        if found.contact_forces is not None:
            forces = np.asarray(found.contact_forces)
            walls = [np.linalg.norm(forces[side].sum(axis=0)) for side in sides(forces)]
            errors["force"] = max(abs(float(wall) / self.load - 1) for wall in walls)
        aside = abs(found.position[-1, 1] - found.position[0, 1])
        errors["side force"] = float(2 * aside / (GRAVITY * found.t[-1] ** 2))
        return errors


def sides(forces: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which forces (k, 3) push to the left, and which to the right."""
    return forces[:, 0] < 0, forces[:, 0] > 0


@dataclass(frozen=True)
class Slope(BallScene):
    """On a slope inside the cone of friction: a ball rolls down, a body that cannot turn stays.

    Truth: acceleration g sin A / (1 + b) (5/7 of a hard ball); no creep. Gravity is tilted, not
    the plate.
    """

    def variants(self) -> tuple[BallScene, ...]:
        """Return the ball, and the same without turning."""
        return self, replace(self, rolls=False)

    def errors(self, found: Trajectory) -> dict[str, float]:
        """Return `acceleration`, or `creep [m/s]`, of the last two thirds of the run."""
        last = late(found, 2 / 3)
        x = found.position[last, 0] if not self.rolls else found.velocity[last, 0]
        slope = slope_of(found.t[last], x)
        if not self.rolls:
            return {"creep [m/s]": abs(slope)}
        b = self.b(self.mass * abs(self.gravity[2]) / self.stiffness)
        return {"acceleration": abs(slope / (self.gravity[0] / (1 + b)) - 1)}


@dataclass(frozen=True)
class Impact(BallScene):
    """Impact at a thin sheet, from 16 distances that differ by less than a step's way.

    Truth: it bounces off with the speed with which it came.
    """

    def variants(self) -> tuple[BallScene, ...]:
        """Return one impact for each distance."""
        way = abs(self.velocity[2]) * max(self.dts)
        start = self.position[2]
        return tuple(
            replace(self, position=(*self.position[:2], start + way * k / 16)) for k in range(16)
        )

    def errors(self, found: Trajectory) -> dict[str, float]:
        """Return `passed`: 1 if it went through; else `speed`, the change / speed."""
        if not found.position[-1, 2] > 0:
            return {"passed": 1.0}
        before, after = np.linalg.norm(self.velocity), np.linalg.norm(found.velocity[-1])
        return {"passed": 0.0, "speed": abs(float(after / before) - 1)}

    @staticmethod
    def joined(errors: list[dict[str, float]]) -> dict[str, float]:
        """Return the share that passed; largest change of speed of the others."""
        speeds = [e["speed"] for e in errors if "speed" in e]
        passed = float(np.mean([e["passed"] for e in errors]))
        return {"passed": passed} | ({"speed": max(speeds)} if speeds else {})
