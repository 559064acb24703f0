"""Surfaces of the five kinds with OpenCASCADE's own numbers, and the curves in which two cross."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Pnt2d
from OCP.IntTools import IntTools_FClass2d
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_IN, TopAbs_OUT
from OCP.TopoDS import TopoDS

from sphshell_pin.base.arrays import Array
from tests.parts.cad_mesh import Ints

KINDS = ("Plane", "Cylinder", "Cone", "Sphere", "Torus")
TRIMMING = 1e-9
"""Closest points nearer to a border than this, in parameters, may be on either face."""

TANGENT, LEAST_SINE = 1e-4, 1e-6
"""Surfaces at a smaller angle along a curve are tangent; at an end of it as near to it as that."""

STEPS = 16
REACH = 1.5
"""From the nearest of the points the closest one is no farther away [points]."""

HAIR = 1e-4
"""A step for the derivative of a normal [mm]; Newton's method needs it roughly."""


class Surface:
    """The surface below a face [mm], without its trimming if it is of one of the five kinds."""

    def __init__(self, face: Any) -> None:
        self.face = TopoDS.Face(face.Oriented(TopAbs_FORWARD))
        self.adaptor = BRepAdaptor_Surface(self.face)
        number = int(self.adaptor.GetType())
        self.kind = KINDS[number] if number < len(KINDS) else ""
        self.inner = IntTools_FClass2d(self.face, TRIMMING)
        self.radius = self.second = 0.0
        if not self.kind:
            return
        shape = getattr(self.adaptor, self.kind)()
        frame = shape.Position()
        self.point = np.array(frame.Location().Coord())
        ways = frame.XDirection(), frame.YDirection(), frame.Direction()
        self.x, self.y, self.axis = (np.array(way.Coord()) for way in ways)
        # The surface's own normal is du x dv.
        self.sense = 1.0 if frame.Direct() else -1.0
        if self.kind in ("Cylinder", "Sphere"):
            self.radius = shape.Radius()
        elif self.kind == "Cone":
            self.radius, self.second = shape.RefRadius(), shape.SemiAngle()
        elif self.kind == "Torus":
            self.radius, self.second = shape.MajorRadius(), shape.MinorRadius()

    def closest(self, points: Array) -> tuple[Array, Array]:
        """Signed distances (n,) of points (n, 3) and the normals (n, 3), which are du x dv."""
        away = points - self.point
        high = away @ self.axis
        if self.kind == "Plane":
            return self.sense * high, np.broadcast_to(self.sense * self.axis, points.shape)
        if self.kind == "Sphere":
            length = np.linalg.norm(away, axis=1)
            normal = away / np.maximum(length, 1e-300)[:, None]
            return self.sense * (length - self.radius), self.sense * normal
        across = away - high[:, None] * self.axis
        wide = np.linalg.norm(across, axis=1)
        out = across / np.maximum(wide, 1e-300)[:, None]
        if self.kind == "Cylinder":
            return self.sense * (wide - self.radius), self.sense * out
        if self.kind == "Cone":
            c, s = np.cos(self.second), np.sin(self.second)
            distance = (wide - self.radius) * c - high * s
            return self.sense * distance, self.sense * (c * out - s * self.axis)
        beside = wide - self.radius
        length = np.hypot(beside, high)
        normal = (beside[:, None] * out + high[:, None] * self.axis) / length[:, None]
        return self.sense * (length - self.second), self.sense * normal

    def parameters(self, points: Array) -> Array:
        """Parameters (n, 2) of points (n, 3) on the surface."""
        away = points - self.point
        x, y, z = away @ self.x, away @ self.y, away @ self.axis
        if self.kind == "Plane":
            return np.column_stack([x, y])
        turn = np.mod(np.arctan2(y, x), 2 * np.pi)
        if self.kind == "Cylinder":
            return np.column_stack([turn, z])
        if self.kind == "Cone":
            return np.column_stack([turn, z / np.cos(self.second)])
        if self.kind == "Sphere":
            return np.column_stack([turn, np.arctan2(z, np.hypot(x, y))])
        tilt = np.mod(np.arctan2(z, np.hypot(x, y) - self.radius), 2 * np.pi)
        return np.column_stack([turn, tilt])

    def state(self, uv: Array) -> int:
        """1 inside, 0 on the border, -1 outside."""
        found = self.inner.Perform(gp_Pnt2d(*uv.tolist()))
        return 1 if found == TopAbs_IN else -1 if found == TopAbs_OUT else 0

    def samples(self, spacing: float) -> Array:
        """Points (n, 3) of a grid within the bounds of the parameters."""
        u0, u1, v0, v1 = BRepTools.UVBounds_s(self.face)
        grid = np.stack(np.meshgrid(np.linspace(u0, u1, 30), np.linspace(v0, v1, 30)), -1)
        return np.array([self.adaptor.Value(u, v).Coord() for u, v in grid.reshape(-1, 2).tolist()])


@dataclass(frozen=True)
class Crossing:
    """The curve on which two surfaces are zero, next to points (k, 3) along a file's curve.

    `along` (k, 3) are that curve's unit tangents.

    Edges of files that are neither lines nor circles are splines off both faces by a tolerance; a
    closest point of the spline is off that of the curve by more.
    """

    one: Surface
    two: Surface
    points: Array
    along: Array
    closed: bool

    @staticmethod
    def of(one, two, points, along, closed, most):
        """Return None if both are tangent between the ends, or farther than `most` away."""
        moved = _onto_both(one, two, points)
        away = np.linalg.norm(moved - points, axis=1)
        tangent = np.cross(one.closest(moved)[1], two.closest(moved)[1])[1:-1]
        if not (np.linalg.norm(tangent, axis=1).min() > TANGENT and away.max() <= most):
            return None
        return Crossing(one, two, moved, along, closed)

    def tangents(self, points: Array, along: Array) -> Array:
        """Unit tangents (n, 3) that point along directions (n, 3)."""
        tangent = np.cross(self.one.closest(points)[1], self.two.closest(points)[1])
        # At an end where both are tangent the file's is all that is known.
        sine = np.linalg.norm(tangent, axis=1)[:, None]
        tangent = np.where(sine > LEAST_SINE, tangent, along)
        tangent = tangent / np.linalg.norm(tangent, axis=1)[:, None]
        return np.asarray(np.where(_dot(tangent, along)[:, None] < 0, -tangent, tangent))

    def closest(self, centers: Array) -> tuple[Ints, Array, Array, Array]:
        """Rows of centers, local minima of the distance, tangents there, and whether inside."""
        chords = np.diff(self.points, axis=0)
        rows, near = near_minima(centers, self.points, self.closed)
        last = len(chords)
        at = near.astype(float)
        low, high = at - REACH, at + REACH
        if not self.closed:
            low, high = np.maximum(low, 0.0), np.minimum(high, last)
        for _ in range(STEPS):
            x, along, length = self._at(at, chords)
            tangent, away = self.tangents(x, along), x - centers[rows]
            n, m = self.one.closest(x)[1], self.two.closest(x)[1]
            # The curvature of the curve has what both surfaces bend along it.
            p, q = (
                -_dot(tangent, s.closest(x + HAIR * tangent)[1] - normal) / HAIR
                for s, normal in ((self.one, n), (self.two, m))
            )
            cosine, rest = _dot(n, m), np.maximum(_sine2(n, m), LEAST_SINE**2)
            bend = 1 + ((p - cosine * q) * _dot(n, away) + (q - cosine * p) * _dot(m, away)) / rest
            step = -_dot(tangent, away) / np.where(bend > 1e-3, bend, 1.0)
            step = np.clip(step / length, -0.5, 0.5)
            moved = np.clip(at + step, low, high)
            if np.abs(moved - at).max(initial=0.0) < 1e-14 * last:
                break
            at = moved
        x, along, _ = self._at(at, chords)
        inside = np.full(len(at), True) if self.closed else (at > 0) & (at < last)
        return rows, x, self.tangents(x, along), inside

    def _at(self, at: Array, chords: Array) -> tuple[Array, Array, Array]:
        """Points of the curve next to places (n,) of its chords, directions, lengths of those."""
        k = np.floor(at).astype(int) if self.closed else np.clip(at.astype(int), 0, len(chords) - 1)
        s = (at - k)[:, None]
        k = k % len(chords)
        length = np.linalg.norm(chords[k], axis=1)
        one, two = self.along[k], self.along[k + 1]
        # Hermite's cubic, as next to ends where both are tangent points stay where they are.
        x = self.points[k] + s * s * (3 - 2 * s) * chords[k]
        x = x + s * (1 - s) * length[:, None] * ((1 - s) * one - s * two)
        return _onto_both(self.one, self.two, x), (1 - s) * one + s * two, length


def near_minima(centers: Array, points: Array, closed: bool) -> tuple[Ints, Ints]:
    """Rows of centers (n, 3), and those of points along a curve that are nearer than beside."""
    far = np.linalg.norm(centers[:, None] - points, axis=2)
    if closed:
        far = far[:, :-1]
        before, after = np.roll(far, 1, 1), np.roll(far, -1, 1)
    else:
        before = np.pad(far[:, :-1], ((0, 0), (1, 0)), constant_values=np.inf)
        after = np.pad(far[:, 1:], ((0, 0), (0, 1)), constant_values=np.inf)
    rows, near = np.nonzero((far <= before) & (far < after))
    return rows, near


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("nx,nx->n", a, b))


def _sine2(n: Array, m: Array) -> Array:
    across = np.cross(n, m)
    return _dot(across, across)


def _onto_both(one: Surface, two: Surface, points: Array) -> Array:
    """Points (n, 3) moved onto both surfaces; those stay where both are tangent."""
    x = points
    for _ in range(STEPS):
        (d, n), (e, m) = one.closest(x), two.closest(x)
        cosine, rest = _dot(n, m), np.maximum(_sine2(n, m), 1e-300)
        a, b = (d - cosine * e) / rest, (e - cosine * d) / rest
        move = np.where(rest[:, None] > LEAST_SINE**2, a[:, None] * n + b[:, None] * m, 0.0)
        x = x - move
        if np.abs(move).max(initial=0.0) < 1e-15:
            break
    return x
