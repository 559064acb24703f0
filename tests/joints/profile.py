"""Outlines of lines and arcs in a plane, turned about an axis or extruded, and spheres on them.

A point at distance `x` from the axis stands for a circle, or in an extruded solid for a line. The
distance from a center grows along both to either side of the point in the center's own plane: the
part of a circle or a line inside a sphere is connected. So the surface inside the sphere has as
many components as the outline inside a circle, a problem in one dimension. Every number is a
closed form.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sphshell_pin.base.arrays import Array

KNOTS = 4
"""Places of a piece between which the distance is monotonic: both ends and two places between."""

TINY = 1e-300


@dataclass(frozen=True)
class Piece:
    """A line from `begin` to `end`, or the arc about `middle` that turns by `turn` [rad]."""

    begin: Array
    end: Array
    middle: Array | None = None
    turn: float = 0.0

    @cached_property
    def length(self) -> float:
        if self.middle is None:
            return float(np.linalg.norm(self.end - self.begin))
        return float(abs(self.turn) * np.linalg.norm(self.begin - self.middle))

    def at(self, along: Array) -> tuple[Array, Array]:
        """Points (n, 2) at lengths (n,) from the begin, and the normals to the left."""
        if self.middle is None:
            way = (self.end - self.begin) / np.linalg.norm(self.end - self.begin)
            points = self.begin + along[:, None] * way
            return points, np.broadcast_to([-way[1], way[0]], points.shape)
        away = self.begin - self.middle
        radius = np.linalg.norm(away)
        angle = np.arctan2(away[1], away[0]) + np.sign(self.turn) * along / radius
        out = np.column_stack([np.cos(angle), np.sin(angle)])
        return self.middle + radius * out, -np.sign(self.turn) * out

    def knots(self, centers: Array) -> Array:
        """Points (n, KNOTS, 2): the distance from centers (n, 2) is monotonic between them."""
        first, last = (np.broadcast_to(p, centers.shape) for p in (self.begin, self.end))
        if self.middle is None:
            way = (self.end - self.begin) / self.length
            near = np.clip((centers - self.begin) @ way, 0.0, self.length)
            inner = self.begin + near[:, None] * way
            inner = np.where((near == self.length)[:, None], last, inner)
            return np.stack([first, inner, inner, last], axis=1)
        away, toward = self.begin - self.middle, centers - self.middle
        radius, sense = np.linalg.norm(away), np.sign(self.turn)
        start = np.arctan2(away[1], away[0])
        angle = np.arctan2(toward[:, 1], toward[:, 0])
        inner, place = [], []
        for half in (0.0, np.pi):
            after = np.mod(sense * (angle + half - start), 2 * np.pi)
            within = after <= abs(self.turn)
            out = np.column_stack([np.cos(angle + half), np.sin(angle + half)])
            # Outside the arc the place is at an end of it, where it changes nothing.
            inner.append(np.where(within[:, None], self.middle + radius * out, first))
            place.append(np.where(within, after, 0.0))
        swap = (place[0] > place[1])[:, None]
        one, two = np.where(swap, inner[1], inner[0]), np.where(swap, inner[0], inner[1])
        return np.stack([first, one, two, last], axis=1)


@dataclass(frozen=True)
class Truth:
    """What spheres touch, one row a sphere, by the definition of docs/contact.md.

    Attributes
    ----------
    depth : (n,) of the deepest point; piece : (n,) on which it is
    count : (n,) components of the surface inside the sphere
    minima : (n,) places where the distance is a local minimum: components grow together
    energy, force : (n,) and (n, 2) of a law whose energy is the cube of the depth
    """

    depth: Array
    piece: Array
    count: Array
    minima: Array
    energy: Array
    force: Array


@dataclass(frozen=True)
class Profile:
    """An outline of connected pieces: closed, or open with both ends on the axis."""

    pieces: tuple[Piece, ...]

    @cached_property
    def closed(self) -> bool:
        return bool(np.allclose(self.pieces[0].begin, self.pieces[-1].end, rtol=0.0, atol=1e-12))

    def joints(self) -> list[tuple[int, int]]:
        """Return the rows of pieces that meet, of the one that ends first."""
        count = len(self.pieces)
        return [(k, (k + 1) % count) for k in range(count if self.closed else count - 1)]

    def angle(self, joint: tuple[int, int]) -> float:
        """Angle by which the outline turns to the left at a joint [rad]."""
        one, two = (self.pieces[k] for k in joint)
        n = one.at(np.array([one.length]))[1][0]
        m = two.at(np.array([0.0]))[1][0]
        return float(np.arctan2(n[0] * m[1] - n[1] * m[0], n @ m))

    def truth(self, centers: Array, radii: Array) -> Truth:
        """What spheres with centers (n, 2) and radii (n,) touch."""
        points = np.concatenate([piece.knots(centers) for piece in self.pieces], axis=1)
        away = centers[:, None] - points
        distance = np.linalg.norm(away, axis=2)
        depth = radii[:, None] - distance
        normal = away / np.maximum(distance, TINY)[..., None]
        touched = np.maximum(depth, 0.0)
        push = 3 * touched[..., None] ** 2 * normal
        # Between two knots the deeper one is the deepest point; inner knots connect.
        here, after = touched[:, :-1], touched[:, 1:]
        deeper = (here >= after)[..., None]
        count = (np.maximum(here, after) > 0).sum(axis=1) - (touched[:, 1:-1] > 0).sum(axis=1)
        energy = (np.maximum(here, after) ** 3).sum(axis=1) - (touched[:, 1:-1] ** 3).sum(axis=1)
        force = np.where(deeper, push[:, :-1], push[:, 1:]).sum(axis=1) - push[:, 1:-1].sum(axis=1)
        if self.closed:
            # The first knot is the last one too, and of a whole loop the shallowest connects none.
            rows, last = np.arange(len(centers)), touched.argmin(axis=1)
            count += (touched.min(axis=1) > 0).astype(int) - (touched[:, 0] > 0)
            energy += touched[rows, last] ** 3 - touched[:, 0] ** 3
            force += push[rows, last] - push[:, 0]
        best = depth.argmax(axis=1)
        minima = self._minima(touched)
        return Truth(depth.max(axis=1), best // KNOTS, count, minima, energy, force)

    def _minima(self, touched: Array) -> Array:
        """How often the depth (n, knots) rises and falls again above zero."""
        change = np.sign(np.diff(touched, axis=1))
        rising = np.ones(len(touched), bool)
        # Once round for the state in which a closed outline begins.
        for _ in range(2 if self.closed else 1):
            count = np.zeros(len(touched), int)
            for column in change.T:
                count += rising & (column < 0)
                rising = np.where(column == 0, rising, column > 0)
        if not self.closed:
            count += rising & (touched[:, -1] > 0)
        return count


def outline(corners, radii, missed=None, cut=None, closed=False):
    """Round or cut corners of a polygon (k, 2).

    missed : angles [rad] by which the arc at a corner misses the tangents of both lines
    cut : widths of chamfers
    """
    corners, missed, cut = np.asarray(corners, float), missed or {}, cut or {}
    count = len(corners)
    entry = {k: corners[k] for k in range(count)}
    leave = dict(entry)
    between: dict[int, Piece] = {}
    for k in {*radii, *cut}:
        a, b, c = corners[k - 1], corners[k], corners[(k + 1) % count]
        u, v = (b - a) / np.linalg.norm(b - a), (c - b) / np.linalg.norm(c - b)
        if k in cut:
            entry[k], leave[k] = b - cut[k] * u, b + cut[k] * v
            between[k] = Piece(entry[k], leave[k])
            continue
        radius, (one, two) = radii[k], missed.get(k, (0.0, 0.0))
        sense = np.sign(u[0] * v[1] - u[1] * v[0])
        n, m = sense * np.array([-u[1], u[0]]), sense * np.array([-v[1], v[0]])
        # The center is off both lines by the radius, less what the arc cuts them.
        off = radius * np.cos([one, two])
        middle = b + np.linalg.solve(np.array([n, m]), off)
        entry[k] = middle - off[0] * n - radius * np.sin(one) * u
        leave[k] = middle - off[1] * m + radius * np.sin(two) * v
        p, q = entry[k] - middle, leave[k] - middle
        turn = float(np.arctan2(p[0] * q[1] - p[1] * q[0], p @ q))
        between[k] = Piece(entry[k], leave[k], middle, turn)
    pieces = []
    for k in range(count):
        if k in between:
            pieces.append(between[k])
        if closed or k < count - 1:
            begin, end = leave[k], entry[(k + 1) % count]
            if np.linalg.norm(end - begin) > 1e-12:
                pieces.append(Piece(begin, end))
    return Profile(tuple(pieces))
