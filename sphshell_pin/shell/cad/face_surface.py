"""The surface below a CAD face, at many places at once."""

import math
from functools import cached_property

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_BSplineSurface, GeomAbs_C0
from OCP.gp import gp_Pnt, gp_Vec

from sphshell_pin.base.arrays import Array, Longs
from sphshell_pin.shell.cad.options import Occ
from sphshell_pin.shell.raw import KINDS, NO_SHAPE, shape_distances


class SplineSurface:
    """Points and derivatives of a B-spline surface that is not periodic.

    low, high : (2,) parameters of the face, whose ends take the derivatives inside
    """

    def __init__(self, surface: Occ, low: Array, high: Array) -> None:
        count = surface.NbUPoles(), surface.NbVPoles()
        places = [(i, j) for i in range(1, count[0] + 1) for j in range(1, count[1] + 1)]
        poles = np.array([surface.Pole(*place).Coord() for place in places])
        self._rational = bool(surface.IsURational() or surface.IsVRational())
        if self._rational:
            weights = np.array([surface.Weight(*place) for place in places])[:, None]
            poles = np.hstack([weights * poles, weights])
        self._poles = poles.reshape(*count, -1)
        u, v = (np.array(list(one)) for one in (surface.UKnotSequence(), surface.VKnotSequence()))
        self._bases = (
            _Basis(u, surface.UDegree(), float(low[0]), float(high[0])),
            _Basis(v, surface.VDegree(), float(low[1]), float(high[1])),
        )

    def derivatives(self, uv: Array) -> tuple[Array, Array, Array]:
        """Points and derivatives by u and by v at parameters uv (n, 2), (n, 3) each."""
        (rows, u, along_u), (columns, v, along_v) = (
            basis.at(one) for basis, one in zip(self._bases, uv.T, strict=True)
        )
        net = self._poles[rows[:, :, None], columns[:, None, :]]
        across, slopes = (np.einsum("ni,nijx->njx", one, net) for one in (u, along_u))
        pairs = ((v, across), (v, slopes), (along_v, across))
        point, by_u, by_v = (np.einsum("nj,njx->nx", *pair) for pair in pairs)
        if self._rational:
            weight, slope_u, slope_v = point[:, 3:], by_u[:, 3:], by_v[:, 3:]
            point = point[:, :3] / weight
            by_u = (by_u[:, :3] - slope_u * point) / weight
            by_v = (by_v[:, :3] - slope_v * point) / weight
        return point, by_u, by_v


class _Basis:
    """The basis functions of one parameter, between its values `low` and `high`."""

    def __init__(self, knots: Array, degree: int, low: float, high: float) -> None:
        self._knots, self._degree = knots, degree
        most = len(knots) - degree - 2
        self._first = int(np.clip(np.searchsorted(knots, low, "right") - 1, degree, most))
        self._last = int(np.clip(np.searchsorted(knots, high) - 1, self._first, most))

    def at(self, places: Array) -> tuple[Longs, Array, Array]:
        """Numbers, values and derivatives (n, degree + 1) of those that are not zero."""
        knots, degree = self._knots, self._degree
        span = np.searchsorted(knots, places, "right") - 1
        span = np.clip(span, self._first, self._last)
        values, none = [np.ones(len(places))], np.zeros(len(places))
        shares: list[Array] = []
        # Cox and de Boor's recursion, as in Piegl and Tiller, The NURBS Book (1997), A2.2.
        for order in range(1, degree + 1):
            ends = [(knots[span + 1 - order + k], knots[span + 1 + k]) for k in range(order)]
            shares = [one / (b - a) for one, (a, b) in zip(values, ends, strict=True)]
            rising = [(places - a) * one for one, (a, _) in zip(shares, ends, strict=True)]
            falling = [(b - places) * one for one, (_, b) in zip(shares, ends, strict=True)]
            values = [down + up for down, up in zip([*falling, none], [none, *rising], strict=True)]
        slopes = [a - b for a, b in zip([none, *shares], [*shares, none], strict=True)]
        numbers = span[:, None] + np.arange(-degree, 1)
        return numbers, np.stack(values, axis=1), degree * np.stack(slopes, axis=1)


class TurnedSurface:
    """Points and derivatives of the five kinds with closed forms, as OpenCASCADE's ElSLib has them.

    u turns a profile about the third axis, along which v moves; a plane has u and v as coordinates.
    """

    def __init__(self, kind: str, surface: Occ) -> None:
        self._kind, shape = kind, getattr(surface, kind.capitalize())()
        place = shape.Position()
        self._place, *self._axes = (
            np.array(one.Coord())
            for one in (place.Location(), place.XDirection(), place.YDirection(), place.Direction())
        )
        sizes = {"cone": ("RefRadius", "SemiAngle"), "torus": ("MajorRadius", "MinorRadius")}
        names = sizes.get(kind, () if kind == "plane" else ("Radius",))
        self._sizes = [getattr(shape, name)() for name in names]

    def derivatives(self, u: Array, v: Array) -> tuple[Array, Array, Array]:
        """Points and derivatives by u and by v at parameters u, v (n,), (n, 3) each."""
        x, y, z = self._axes
        if self._kind == "plane":
            point = u[:, None] * x + v[:, None] * y + self._place
            return point, np.tile(x, (len(u), 1)), np.tile(y, (len(u), 1))
        away, along, by_away, by_along = (
            np.broadcast_to(one, v.shape)[:, None] for one in self._profile(v)
        )
        cosine, sine = np.cos(u)[:, None], np.sin(u)[:, None]
        out, around = cosine * x + sine * y, cosine * y - sine * x
        return away * out + along * z + self._place, away * around, by_away * out + by_along * z

    def _profile(self, v: Array) -> tuple[Array | float, ...]:
        """How far the profile is from the axis, and along it, and the derivatives of both by v."""
        radius, *second = self._sizes
        if self._kind == "cylinder":
            return radius, v, 0.0, 1.0
        if self._kind == "cone":
            sine, cosine = math.sin(second[0]), math.cos(second[0])
            return radius + v * sine, v * cosine, sine, cosine
        middle, round_ = (0.0, radius) if self._kind == "sphere" else (radius, second[0])
        cosine, sine = round_ * np.cos(v), round_ * np.sin(v)
        return middle + cosine, sine, -sine, cosine


MOST_STEPS = 8
"""Most steps of Newton's method to a closest point; it starts next to it."""

MOST_STATIONARY_STEPS = 40
"""Most steps of Newton's method toward a stationary point of the distance."""

SINGULAR = 1e-10
"""Where |du x dv| is below this share of the largest |du| |dv|, a surface has no normal."""


class FaceSurface:
    """The surface below a face: points and derivatives at many places at once."""

    def __init__(self, face: Occ) -> None:
        self._surface = BRepAdaptor_Surface(face)
        surface = self._surface
        self.low = np.array([surface.FirstUParameter(), surface.FirstVParameter()])
        self.high = np.array([surface.LastUParameter(), surface.LastVParameter()])
        # Around a closed surface a step may cross its seam.
        endless = np.array([surface.IsUPeriodic(), surface.IsVPeriodic()])
        self._lowest = np.where(endless, -np.inf, self.low)
        self._highest = np.where(endless, np.inf, self.high)
        self._scale = 0.0
        self._shape = self.shape()
        self.has_closed_form = self._shape[0] >= 0
        self.flat = self._shape[0] == KINDS.index("plane")
        self.kinked = GeomAbs_C0 in (surface.UContinuity(), surface.VContinuity())

    @cached_property
    def _spline(self) -> SplineSurface | None:
        surface = self._surface
        if surface.GetType() != GeomAbs_BSplineSurface or np.isinf(self._highest).any():
            return None
        return SplineSurface(surface.BSpline(), self.low, self.high)

    @cached_property
    def _turned(self) -> TurnedSurface | None:
        kind = int(self._shape[0])
        return TurnedSurface(KINDS[kind], self._surface) if self.has_closed_form else None

    def shape(self) -> list[float]:
        """Kind, point, axis and two radii of it, as `CleanedSurface.face_shapes` has them (9,)."""
        number = int(self._surface.GetType())  # OpenCASCADE begins with the same kinds
        if number >= len(KINDS):
            return list(NO_SHAPE)
        kind = KINDS[number]
        shape = getattr(self._surface, kind.capitalize())()
        radius = second = 0.0
        if kind == "cone":
            radius, second = shape.RefRadius(), shape.SemiAngle()
            # The one of its two halves that the face is on has a positive radius.
            middle = 0.5 * (self.low[1] + self.high[1])
            if radius + middle * np.sin(second) < 0.0:
                radius, second = -radius, -second
        elif kind == "torus":
            radius, second = shape.MajorRadius(), shape.MinorRadius()
            if radius <= second:
                return list(NO_SHAPE)  # it cuts itself
        elif kind != "plane":
            radius = shape.Radius()
        place = shape.Location().Coord()
        axis = (0.0, 0.0, 1.0) if kind == "sphere" else shape.Axis().Direction().Coord()
        return [float(number), *place, *axis, radius, second]

    def nodes(self, uv: Array) -> tuple[Array, Array]:
        """Points and unit normals (n, 3) at parameters uv (n, 2); zero where there is no normal."""
        points, by_u, by_v = self.derivatives(uv)
        return points, self.normals(by_u, by_v)

    def normals(self, by_u: Array, by_v: Array) -> Array:
        """Return unit normals (n, 3) by the derivatives, zero where there is none."""
        normal = np.cross(by_u, by_v)
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        largest = np.linalg.norm(by_u, axis=1, keepdims=True)
        largest = largest * np.linalg.norm(by_v, axis=1, keepdims=True)
        if self._scale == 0.0:
            self._scale = float(largest.max(initial=0.0))
        defined = length > SINGULAR * self._scale
        return np.where(defined, normal / np.where(defined, length, 1.0), 0.0)

    def derivatives(self, uv: Array) -> tuple[Array, Array, Array]:
        """Points and derivatives by u and by v at parameters uv (n, 2), (n, 3) each."""
        if self._spline is not None:
            return self._spline.derivatives(uv)
        if self._turned is not None:
            return self._turned.derivatives(*uv.T)
        place, by_u, by_v = gp_Pnt(), gp_Vec(), gp_Vec()
        rows, first = [], self._surface.D1
        for u, v in uv.tolist():
            first(u, v, place, by_u, by_v)
            rows.append(place.Coord() + by_u.Coord() + by_v.Coord())
        table = np.array(rows).reshape(-1, 9)
        return table[:, :3], table[:, 3:6], table[:, 6:]

    def distances(self, points: Array, uv: Array | None, tolerance: float) -> Array:
        """Distances (n,) of points next to the surface at uv (n, 2), without its trimming.

        Newton's steps go on while they are longer than `tolerance`: less changes the distance by
        far less, as the surface is nearly flat within it. Closed forms need no `uv`.
        """
        kind, *shape = self._shape
        if self.has_closed_form:
            return shape_distances(KINDS[int(kind)], np.array(shape), points)
        assert uv is not None
        distance = np.full(len(points), np.inf)
        at, left = uv.copy(), np.arange(len(points))
        for _ in range(MOST_STEPS):
            place, by_u, by_v = self.derivatives(at[left])
            offset = points[left] - place
            uu, vv, mixed = (dot(a, b) for a, b in ((by_u, by_u), (by_v, by_v), (by_u, by_v)))
            along_u, along_v = dot(offset, by_u), dot(offset, by_v)
            area = uu * vv - mixed * mixed
            regular = area > 1e-20 * uu * vv
            area = np.where(regular, area, 1.0)
            step = np.stack([along_u * vv - along_v * mixed, along_v * uu - along_u * mixed], 1)
            step = np.where(regular, step.T / area, 0.0).T
            moved = step[:, :1] * by_u + step[:, 1:] * by_v
            # To the tangent plane if it is near, to the point itself in any case.
            near = np.linalg.norm(moved, axis=1) <= tolerance
            away = np.linalg.norm(np.where(near[:, None], offset - moved, offset), axis=1)
            distance[left] = np.minimum(distance[left], away)
            at[left] = np.clip(at[left] + step, self._lowest, self._highest)
            left = left[~near & regular]
            if left.size == 0:
                break
        return distance


def stationary_parameters(
    curves: list[Occ], points: Array, seeds: Array, ends: Array, settled: float
) -> Array:
    """Parameters (n,) of stationary points of the distances from points (n, 3) to n curves, or nan.

    Between the parameters `ends` (n, 2), next to `seeds` (n,); Newton's method ends with a step
    shorter than `settled`.
    """
    place, first, second = gp_Pnt(), gp_Vec(), gp_Vec()
    at, found, left = seeds.copy(), np.full(len(seeds), np.nan), np.arange(len(seeds))
    lowest, highest = ends.T
    for _ in range(MOST_STATIONARY_STEPS):
        rows = []
        for k, one in zip(left.tolist(), at[left].tolist(), strict=True):
            curves[k].D2(one, place, first, second)
            rows.append(place.Coord() + first.Coord() + second.Coord())
        table = np.array(rows).reshape(-1, 9)
        offset, tangent = table[:, :3] - points[left], table[:, 3:6]
        square = dot(tangent, tangent)
        bend = square + dot(offset, table[:, 6:])
        # Near a center of curvature, or at a place where the derivative vanishes.
        bend = np.where(np.abs(bend) > 1e-3 * square, bend, square)
        step = dot(offset, tangent) / np.where(bend == 0.0, 1.0, bend)
        low, high = lowest[left], highest[left]
        moved = np.clip(at[left] - step, low, high)
        last = np.abs(moved - at[left]) * np.sqrt(square) <= settled
        inner = last & (bend != 0.0) & (low < moved) & (moved < high)
        found[left[inner]] = moved[inner]
        at[left] = moved
        left = left[~last & (bend != 0.0)]
        if left.size == 0:
            break
    return found


def dot(a: Array, b: Array) -> Array:
    """Scalar products (n,) of vectors (n, k)."""
    return np.asarray(np.einsum("ij,ij->i", a, b))
