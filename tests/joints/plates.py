"""Convex plates with a corner of two fillets, whose crossing begins where both touch the top."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sphshell_pin.base.arrays import Array
from tests.parts import occ
from tests.parts.occ import Rng, Solid

TOP = 20.0
GRID = np.geomspace(1e-9, np.pi / 2, 2000)


@dataclass(frozen=True)
class Side:
    """An upright side of a plate [mm], with a fillet of one radius at the top.

    It goes along y at x = `wall`, turned by `turn` about z; if it is `round` [1/mm], bent inward.
    """

    fillet: float
    turn: float
    wall: float = 30.0
    round: float = 0.0

    @property
    def out(self) -> Array:
        return np.array([np.cos(self.turn), np.sin(self.turn)])

    def beyond(self, flat: Array) -> tuple[Array, Array]:
        """How far (n,) points (n, 2) are beyond the end of the top, and which way that is."""
        if not self.round:
            return flat @ self.out - self.wall + self.fillet, np.broadcast_to(self.out, flat.shape)
        away = flat - (self.wall - 1 / self.round) * self.out
        length = np.linalg.norm(away, axis=1)
        return length - 1 / self.round + self.fillet, away / length[:, None]

    def out_of(self, at: Array) -> tuple[float, Array]:
        """The distance from the plate below the fillet, and the nearest point there."""
        (s,), (way,) = self.beyond(at[None, :2])
        w = at[2] - TOP
        if s <= 0:
            return float(w), np.array([at[0], at[1], TOP])
        if w <= -self.fillet:
            away, move = s - self.fillet, np.array([*way, 0.0])
        else:
            length = np.hypot(s, w + self.fillet)
            away, move = length - self.fillet, np.array([*(s * way), w + self.fillet]) / length
        return float(away), at - away * move


@dataclass(frozen=True)
class Plate:
    """The part of a plate that is within two of its sides, next to their corner."""

    name: str
    sides: tuple[Side, Side]

    def solid(self) -> Solid:
        """The solid [mm]; each of its two sides has its own fillet."""
        solid = occ.box([-60, -60, 0], [60, 60, TOP])
        for side in self.sides:
            if side.round:
                center = (side.wall - 1 / side.round) * side.out
                tool = occ.cylinder(1 / side.round, TOP, (*center, 0.0))
            else:
                along = np.array([-side.out[1], side.out[0]])
                far = [side.wall * side.out + k * 200 * along for k in (-1, 1)]
                tool = occ.extruded([*far, far[1] - 300 * side.out, far[0] - 300 * side.out], TOP)
            solid = occ.common(solid, tool)

        def is_on(side: Side) -> Callable[[Array], bool]:
            def found(points: Array) -> bool:
                off = side.beyond(points[:, :2])[0] - side.fillet
                return bool(np.abs(off).max() + np.abs(points[:, 2] - TOP).max() < 1e-6)

            return found

        edges = [(edge, s.fillet) for s in self.sides for edge in occ.edges_where(solid, is_on(s))]
        return occ.checked(occ.filleted_each(solid, edges))

    def corner(self, beyond: Array) -> Array:
        """Points (n, 2) that are so far (n, 2) beyond both sides' ends of the top, by Newton."""
        turn = (self.sides[0].turn + self.sides[1].turn) / 2
        at = np.tile(25.0 * np.array([np.cos(turn), np.sin(turn)]), (len(beyond), 1))
        for _ in range(12):
            (a, n), (b, m) = (side.beyond(at) for side in self.sides)
            off = beyond - np.stack([a, b], axis=1)
            at = at + np.linalg.solve(np.stack([n, m], axis=1), off[:, :, None])[:, :, 0]
        return at

    def curve(self, angles: Array) -> Array:
        """Points (n, 3) on both fillets, by the angle about the axis of the smaller one."""
        small, large = sorted(side.fillet for side in self.sides)
        w = -2 * small * np.sin(angles / 2) ** 2
        beyond = np.stack([small * np.sin(angles), np.sqrt(-w * (2 * large + w))], axis=1)
        if self.sides[0].fillet > self.sides[1].fillet:
            beyond = beyond[:, ::-1]
        return np.column_stack([self.corner(beyond), TOP + w])

    def distance(self, at: Array) -> float:
        """How far a point above the plate is from it."""
        for side, other in (self.sides, self.sides[::-1]):
            away, nearest = side.out_of(at)
            if away > 0 and other.out_of(nearest)[0] <= 0:
                return away
        angles = GRID
        for _ in range(5):
            far = np.linalg.norm(self.curve(angles) - at, axis=1)
            k = int(far.argmin())
            angles = np.linspace(
                angles[k - 1] if k else 0.0, angles[min(k + 1, len(angles) - 1)], 40
            )
        return float(far.min())

    def spheres(self, count: int, rng: Rng) -> tuple[Array, Array]:
        """Centers (n, 3) above the corner and beside it, and how far they are from the plate."""
        centers: list[Array] = []
        far: list[float] = []
        (end,) = self.corner(np.zeros((1, 2)))
        while len(far) < count:
            high, beside = 10 ** rng.uniform(-2, 1), 10 ** rng.uniform(-7, -0.5)
            angle = np.array([min(10 ** rng.uniform(-6, 0), 1.2)])
            on = np.array([*end, TOP]) if rng.random() < 0.5 else self.curve(angle)[0]
            (share,) = rng.choice([0.0, 1.0, rng.random()], 1)
            ways = []
            for side in self.sides:
                (s,), (way,) = side.beyond(on[None, :2])
                ways.append(np.array([*(s * way), on[2] - TOP + side.fillet]) / side.fillet)
            way = share * ways[0] + (1 - share) * ways[1]
            at = on + high * way / np.linalg.norm(way) + beside * rng.normal(size=3)
            if max(side.out_of(at)[0] for side in self.sides) > 1e-6 * high:
                centers.append(at)
                far.append(self.distance(at))
        return np.array(centers), np.array(far)


PLATES = [
    Plate("cylinders", (Side(0.35, 0.0), Side(3.6, np.pi / 2))),
    Plate("cylinders at an angle", (Side(2.4, 0.0), Side(0.7, 1.1))),
    Plate("cylinder and torus", (Side(0.8, 0.0), Side(2.5, np.pi / 2, round=1 / 60))),
    Plate("torus and cylinder", (Side(2.5, 0.0), Side(0.6, 1.3, round=1 / 50))),
    Plate("tori", (Side(0.9, 0.0, round=1 / 45), Side(2.1, np.pi / 2, round=1 / 70))),
    Plate("equal tori", (Side(1.5, 0.0, round=1 / 45), Side(1.5, np.pi / 2, round=1 / 45))),
    Plate("equal torus and cylinder", (Side(1.5, 0.0, round=1 / 45), Side(1.5, np.pi / 2))),
]
