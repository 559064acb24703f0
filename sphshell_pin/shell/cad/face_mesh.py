"""The triangles of one CAD face, and how far they are from its exact surface.

OpenCASCADE's deflection is no guarantee, so the distance is measured: at points inside each
triangle and along each side against the surface, and along the border against its exact curves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line
from OCP.TopAbs import TopAbs_EDGE, TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS

from sphshell_pin.base.arrays import Array, Longs, Mask
from sphshell_pin.shell.cad.face_surface import SINGULAR, FaceSurface, dot
from sphshell_pin.shell.cad.model import subshapes
from sphshell_pin.shell.cad.options import Occ
from sphshell_pin.shell.raw import area_vectors

ALONG = (0.25, 0.5, 0.75)
"""Where along a side the distance is measured."""

LIMIT_STEP = 1e-4
"""Share of the distance to the middle of the triangle at which the limit of a normal is taken."""


@dataclass(frozen=True)
class Border:
    """The sides along one edge of a face.

    `nodes` (b,), their parameters `at` (b,), and the exact `curve` on the face's surface.
    """

    nodes: Longs
    at: Array
    curve: Occ

    def turned(self) -> Border:
        """Return the same sides, the other way."""
        return replace(self, nodes=self.nodes[::-1], at=self.at[::-1])

    def error(self, points: Array) -> float:
        """Largest distance of the curve from the polyline through `points` of the nodes."""
        if self.curve.GetType() == GeomAbs_Line:
            ends = ((points[self.nodes[k]], self.curve.Value(self.at[k])) for k in (0, -1))
            return max(math.dist(node, exact.Coord()) for node, exact in ends)
        corners = points[self.nodes]
        start, span = corners[:-1], np.diff(corners, axis=0)
        shares = np.array((0.0, *ALONG))[:, None]
        places = ((1.0 - shares) * self.at[:-1] + shares * self.at[1:]).ravel()
        exact = _curve_points(self.curve, places)
        own = np.tile(np.arange(len(start)), len(shares))
        away = _to_segments(exact, start[own], span[own])
        # Where curve and polyline run at different speeds, another side is the nearest. The
        # farthest first: it seldom takes more than a few to know the largest distance.
        largest = 0.0
        for k in np.argsort(-away):
            if away[k] <= largest:
                break
            largest = max(largest, float(_to_segments(exact[k], start, span).min()))
        return largest


@dataclass(frozen=True)
class FaceMesh:
    """Triangles of one face.

    Attributes
    ----------
    surface : the exact one below
    points : (n, 3) nodes [units of the model]
    exact : (n, 3) the surface at the nodes' parameters: the same points, but for the tolerance of
        the file along the border
    uv : (n, 2) parameters
    free : (n, 2) where a parameter means nothing, as one does at the pole of a sphere
    normals : (n, 3) unit, along du x dv, zero where the surface has none
    triangles : (t, 3) nodes, anticlockwise in uv
    borders : the sides along each edge of the face
    reversed : the face's outer side is where du x dv points away from
    """

    surface: FaceSurface
    points: Array
    exact: Array
    uv: Array
    free: Mask
    normals: Array
    triangles: Longs
    borders: tuple[Border, ...]
    reversed: bool

    @cached_property
    def border_nodes(self) -> Longs:
        """Nodes on the border, ascending."""
        rows = [border.nodes for border in self.borders]
        return np.unique(np.concatenate(rows)) if rows else np.zeros(0, np.int64)

    def border_error(self, tolerance: float) -> float:
        """Largest distance of the exact border from its sides, of its nodes from the surface."""
        nodes = self.border_nodes
        off = self.surface.distances(self.points[nodes], self.uv[nodes], tolerance)
        sides = [border.error(self.points) for border in self.borders]
        return max(float(off.max(initial=0.0)), *sides, 0.0)

    def sides(self) -> tuple[Longs, Longs]:
        """Sides (s, 2) as pairs of nodes, and the three (t, 3) of each triangle."""
        ends = np.stack([self.triangles, np.roll(self.triangles, -1, axis=1)], axis=2)
        low, high = np.sort(ends.reshape(-1, 2), axis=1).T
        keys, place = np.unique(low * len(self.points) + high, return_inverse=True)
        return np.stack(np.divmod(keys, len(self.points)), axis=1), place.reshape(-1, 3)

    def refined(self, tolerance: float, rounds: int) -> tuple[FaceMesh, float]:
        """Halve sides inside the face until all points measured are within `tolerance`.

        Returns the mesh and the largest distance measured. Sides on the border stay: the face
        across them has the same.
        """
        if self.surface.flat:
            return self, float(np.linalg.norm(self.points - self.exact, axis=1).max(initial=0.0))
        mesh, largest = self, 0.0
        for turn in range(rounds + 1):
            sides, of_triangle = mesh.sides()
            at_sides, middles = mesh._errors(sides, tolerance)
            largest = max(at_sides.max(initial=0.0), middles.max(initial=0.0))
            inner = np.bincount(of_triangle.ravel(), minlength=len(sides)) == 2
            marked: Mask = inner & (at_sides > tolerance)
            # A triangle too far in its middle alone: its longest side inside the face.
            length = np.linalg.norm(mesh.points[sides[:, 0]] - mesh.points[sides[:, 1]], axis=1)
            longest = np.argmax(np.where(inner, length, -1.0)[of_triangle], axis=1)
            wanted = (middles > tolerance) & ~marked[of_triangle].any(axis=1)
            marked[of_triangle[wanted, longest[wanted]]] = True
            marked &= inner
            if turn == rounds or not marked.any():
                break
            mesh = mesh._split(sides, of_triangle, marked)
        return mesh, float(largest)

    def corner_normals(self) -> Array:
        """Exact unit normals (t, 3, 3) at the corners, on the face's outer side.

        Where the surface has none, as at the pole of a sphere or the tip of a cone, or several, as
        along a kink, it is the limit from the middle of the triangle.
        """
        corners = self.normals[self.triangles]
        limits: Mask = np.asarray(~corners.any(axis=2) | self.surface.kinked, np.bool_)
        if limits.any():
            corners[limits] = self._limits(limits)
        return -corners if self.reversed else corners

    def parameters(self, nodes: Longs) -> Array:
        """Parameters (k, c, 2) of the c nodes of k sides or triangles.

        A pole takes those of the other nodes: the parameters between them belong to points between.
        """
        uv, free = self.uv[nodes], self.free[nodes]
        if not free.any():
            return np.asarray(uv)
        count = (~free).sum(axis=1, keepdims=True)
        mean = np.where(free, 0.0, uv).sum(axis=1, keepdims=True) / np.maximum(count, 1)
        return np.where(free & (count > 0), mean, uv)

    def parameters_at(self, triangles: Longs, points: Array) -> Array:
        """Parameters (n, 2) of points (n, 3) near `triangles` (n,)."""
        nodes = self.triangles[triangles]
        corners = self.points[nodes]
        spans = area_vectors(corners)
        square = np.maximum(dot(spans, spans), np.finfo(float).tiny)
        offset, one, two = (at - corners[:, 0] for at in (points, corners[:, 1], corners[:, 2]))
        second = dot(np.cross(offset, two), spans) / square
        third = dot(np.cross(one, offset), spans) / square
        weights = np.clip(np.stack([1.0 - second - third, second, third], axis=1), 0.0, 1.0)
        weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-12)
        return np.asarray(np.einsum("nk,nkx->nx", weights, self.parameters(nodes)))

    def _errors(self, sides: Longs, tolerance: float) -> tuple[Array, Array]:
        """Largest distance to the surface along each side, and at the middle of each triangle."""

        def along(ends: Array, corners: Array) -> Array:
            on_sides = [(1.0 - share) * ends[:, 0] + share * ends[:, 1] for share in ALONG]
            return np.concatenate([*on_sides, corners.mean(axis=1)])

        points, uv = along(self.points[sides], self.points[self.triangles]), None
        if not self.surface.has_closed_form:
            uv = along(self.parameters(sides), self.parameters(self.triangles))
        away = self.surface.distances(points, uv, tolerance)
        count = len(ALONG) * len(sides)
        return away[:count].reshape(len(ALONG), -1).max(axis=0), away[count:]

    def _split(self, sides: Longs, of_triangle: Longs, marked: Mask) -> FaceMesh:
        """Halve the sides where `marked` (s,) holds, with new nodes on the surface."""
        uv = self.parameters(sides[marked]).mean(axis=1)
        points, normals = self.surface.nodes(uv)
        node = np.full(len(sides), -1)
        node[marked] = len(self.points) + np.arange(len(uv))
        halves = node[of_triangle]
        count = (halves >= 0).sum(axis=1)
        pieces = [self.triangles[count == 0]]
        for number in (1, 2, 3):
            corners, middles = self.triangles[count == number], halves[count == number]
            # Turned so that a lone half is on the first side, a lone whole on the last.
            lone = (middles >= 0) if number == 1 else (middles < 0)
            first = np.argmax(lone, axis=1) + (1 if number == 2 else 0)
            turn = (first[:, None] + np.arange(3)) % 3
            a, b, c = np.take_along_axis(corners, turn, axis=1).T
            ab, bc, ca = np.take_along_axis(middles, turn, axis=1).T
            rows = {
                1: [(a, ab, c), (ab, b, c)],
                2: [(ab, b, bc), (a, ab, bc), (a, bc, c)],
                3: [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)],
            }[number]
            pieces += [np.stack(row, axis=1) for row in rows]
        return replace(
            self,
            points=np.concatenate([self.points, points]),
            exact=np.concatenate([self.exact, points]),
            uv=np.concatenate([self.uv, uv]),
            free=np.concatenate([self.free, np.zeros((len(uv), 2), np.bool_)]),
            normals=np.concatenate([self.normals, normals]),
            triangles=np.concatenate(pieces),
        )

    def _limits(self, chosen: Mask) -> Array:
        uv = self.parameters(self.triangles)
        start = uv[chosen]
        toward = np.broadcast_to(uv.mean(axis=1)[:, None], uv.shape)[chosen] - start
        near, far = (self.surface.nodes(start + k * LIMIT_STEP * toward)[1] for k in (1.0, 2.0))
        # Extrapolated from two places, the limit is exact to second order.
        limit = 2.0 * near - far
        length = np.linalg.norm(limit, axis=1, keepdims=True)
        return np.asarray(limit / np.where(length > 0.0, length, 1.0))


def count_laid(face: Occ) -> int:
    """Count the triangles that OpenCASCADE has laid on a face, 0 if it could not."""
    found = BRep_Tool.Triangulation_s(face, TopLoc_Location())
    return found.NbTriangles() if found is not None and found.HasUVNodes() else 0


def take_mesh(face: Occ) -> FaceMesh | None:
    """Return the triangles that OpenCASCADE has laid on a face, None if it could not."""
    if count_laid(face) == 0:
        return None
    location = TopLoc_Location()
    found = BRep_Tool.Triangulation_s(face, location)
    count = range(1, found.NbNodes() + 1)
    nodes = [found.Node(k) for k in count]
    if not location.IsIdentity():
        place = location.Transformation()
        nodes = [node.Transformed(place) for node in nodes]
    uv = np.array([found.UVNode(k).Coord() for k in count])
    rows = [found.Triangle(k).Get() for k in range(1, found.NbTriangles() + 1)]
    surface = FaceSurface(face)
    exact, *along = surface.derivatives(uv)
    lengths = np.stack([np.linalg.norm(by, axis=1) for by in along], axis=1)
    return FaceMesh(
        surface=surface,
        points=np.array([node.Coord() for node in nodes]),
        exact=exact,
        uv=uv,
        free=lengths <= SINGULAR * lengths.max(axis=0),
        normals=surface.normals(*along),
        triangles=np.array(rows) - 1,
        borders=tuple(_borders(face, found, location)),
        reversed=face.Orientation() == TopAbs_REVERSED,
    )


def _borders(face: Occ, found: Occ, location: Occ) -> Iterator[Border]:
    for part in subshapes(face, TopAbs_EDGE):
        edge = TopoDS.Edge(part)
        polygon = BRep_Tool.PolygonOnTriangulation_s(edge, found, location)
        if polygon is None or BRep_Tool.Degenerated_s(edge) or not polygon.HasParameters():
            continue
        count = range(1, polygon.NbNodes() + 1)
        yield Border(
            nodes=np.array([polygon.Node(k) for k in count]) - 1,
            at=np.array([polygon.Parameter(k) for k in count]),
            curve=BRepAdaptor_Curve(edge, face),
        )


def _curve_points(curve: Occ, at: Array) -> Array:
    """Points (n, 3) of a curve at parameters (n,)."""
    if curve.GetType() != GeomAbs_Circle:
        return np.array([curve.Value(one).Coord() for one in at.tolist()]).reshape(-1, 3)
    circle = curve.Circle()
    place, x, y = (
        np.array(one.Coord())
        for one in (circle.Location(), circle.XAxis().Direction(), circle.YAxis().Direction())
    )
    cosine, sine = np.cos(at)[:, None], np.sin(at)[:, None]
    return np.asarray(place + circle.Radius() * (cosine * x + sine * y))


def _to_segments(point: Array, start: Array, span: Array) -> Array:
    """Distances of points (3,) or (n, 3) from segments (n, 3)."""
    square = np.maximum(dot(span, span), np.finfo(float).tiny)
    along = np.clip(dot(point - start, span) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(point - start - along[:, None] * span, axis=1))
