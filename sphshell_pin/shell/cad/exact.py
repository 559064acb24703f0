"""The trimmed faces of a CAD file: distances to them, points on them, and stationary points.

A tessellation finds the face and the place near a point; Newton's method goes on from there on the
exact surface or curve. BRepExtrema of OpenCASCADE misses closest points on real files.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from OCP.gp import gp_Pnt2d
from OCP.IntTools import IntTools_FClass2d
from OCP.TopAbs import TopAbs_OUT

from sphshell_pin.base.arrays import Array, Ints
from sphshell_pin.shell.cad.face_mesh import FaceMesh
from sphshell_pin.shell.cad.face_surface import stationary_parameters
from sphshell_pin.shell.cad.surface import CadSurface
from sphshell_pin.shell.raw import random_places
from sphshell_pin.shell.shell import Shell

TRIMMING = 1e-9
"""Points nearer to the border than this, in parameters, are inside."""

BETWEEN = 1.1
"""Between the points measured the tessellation may be that many times farther off."""

SETTLED, SETTLED_SQUARE = 1e-12, 1e-9
"""Shares of the size: Newton's steps that are shorter are the last; nearer to a surface than the
second, no other is looked for."""

REACH = 4.0
"""Faces are tried that come as near to a contact as this many times the tessellation's error."""

AWAY = 100.0
"""A stationary point farther from the contact, in the same unit, is that of another place."""


@dataclass(frozen=True)
class StationaryPoint:
    """A stationary point of the distance: `point` (3,), and the unit `normal` (3,) of the surface.

    The normal is None on edges and vertices, where it is the direction to the point asked for.
    """

    point: Array
    normal: Array | None


class TrimmedFaces:
    """The trimmed faces that a tessellation approximates [units of the model]."""

    def __init__(self, cad: CadSurface) -> None:
        self._cad = cad
        raw = cad.polygons()
        points, triangles = raw.vertices / cad.model.meters, raw.corners.reshape(-1, 3)
        self._corners = points[triangles]
        self._shell = Shell(points, triangles, crease_angle=0.0)
        self._inside = cache(lambda face: IntTools_FClass2d(cad.sewn.faces[face], TRIMMING))

    @property
    def extent(self) -> tuple[float, float]:
        """Box diagonal and area of the tessellation."""
        return self._shell.size, self._shell.health.area

    def distances(self, points: Array) -> Array:
        """Distances (n,) of points (n, 3).

        Where the closest point of a surface is beyond the border of its face, the distance from the
        tessellation, less its own error, replaces it.
        """
        near = self._shell.closest_points(points, method="facets")
        found = self._to_surfaces(points, self._shell.source_element[near.elements], near.points)
        error = BETWEEN * self._cad.found.error
        # Near a border the nearest face may not be that of the nearest triangle.
        for k in np.flatnonzero(found > SETTLED_SQUARE * self._cad.size).tolist():
            polygons, places = self._faces_near(points[k], abs(near.distances[k]) + 2.0 * error)
            same = np.repeat(points[k : k + 1], len(polygons), axis=0)
            found[k] = min(found[k], *self._to_surfaces(same, polygons, places))
        return np.maximum(found, np.abs(near.distances) - error)

    def samples(self, count: int, rng: np.random.Generator) -> Array:
        """Random points (n <= count, 3) of the exact surfaces, spread by area."""
        points = []
        for face, mesh, _, uv in self._cad.found.locate(*random_places(self._corners, count, rng)):
            # Along a hollow border the triangles reach beyond the face.
            points.append(mesh.surface.nodes(uv[[self._holds(face, one) for one in uv]])[0])
        return np.concatenate(points)

    def stationary_point(self, center: Array, contact: Array) -> StationaryPoint | None:
        """Return the stationary point of the distance from `center` next to `contact`, (3,) each.

        A closest point or a saddle between two of them; None if there is none near the contact.
        """
        error = max(self._cad.found.error, self._cad.stated)
        polygons, places = self._faces_near(contact, REACH * error)
        found: list[StationaryPoint] = []
        for face, mesh, _, uv in self._cad.found.locate(polygons, places):
            at = mesh.surface.stationary(center, uv[0], SETTLED * self._cad.size)
            if at is not None and self._holds(face, at):
                points, normals = mesh.surface.nodes(at[None])
                if normals.any():
                    found.append(StationaryPoint(points[0], normals[0]))
            found += self._on_edges(mesh, center, contact)
        if not found:
            return None
        away = np.array([np.linalg.norm(one.point - contact) for one in found])
        best = found[int(np.argmin(away))]
        if away.min() > AWAY * error:
            return None
        if best.normal is None:
            # An edge beside which a face is nearer to the center is not where they touch.
            length = np.array([np.linalg.norm(one.point - center) for one in found])
            on_face = np.array([one.normal is not None for one in found])
            nearer = on_face & (away <= REACH * error)
            nearer &= length < np.linalg.norm(best.point - center)
            if nearer.any():
                return found[int(np.argmin(np.where(nearer, away, np.inf)))]
        return best

    def _faces_near(self, point: Array, radius: float) -> tuple[Ints, Array]:
        """Nearest triangle (k,) of each face within `radius` of a point, and its place (k, 3)."""
        touched = self._shell.contacts(point, radius, method="elements")
        polygons = self._shell.source_element[touched.element]
        # Contacts come deepest first: the first of each face is the nearest.
        _, first = np.unique(self._cad.found.face_of(polygons), return_index=True)
        return polygons[first], touched.point[first]

    def _to_surfaces(self, points: Array, polygons: Ints, near: Array) -> Array:
        """Distances (n,) of points from the surfaces below triangles, next to points `near`."""
        found = np.full(len(points), np.inf)
        for _, mesh, own, uv in self._cad.found.locate(polygons, near):
            found[own] = mesh.surface.distances(points[own], uv, SETTLED * self._cad.size)
        return found

    def _holds(self, face: int, uv: Array) -> bool:
        """Whether a face holds the point of its surface at parameters uv (2,)."""
        return bool(self._inside(face).Perform(gp_Pnt2d(*uv.tolist())) != TopAbs_OUT)

    def _on_edges(self, mesh: FaceMesh, center: Array, near: Array) -> Iterator[StationaryPoint]:
        """Stationary points on the edges of a face, and their ends."""
        for border in mesh.borders:
            away = np.linalg.norm(mesh.points[border.nodes] - near, axis=1)
            seed, low, high = (float(border.at[k]) for k in (np.argmin(away), 0, -1))
            ends = min(low, high), max(low, high)
            settled, seeds = SETTLED * self._cad.size, np.array([seed])
            curves, between = [border.curve], np.array([ends])
            at = stationary_parameters(curves, center[None], seeds, between, settled)
            for parameter in (*ends, *at[np.isfinite(at)].tolist()):
                yield StationaryPoint(np.array(border.curve.Value(parameter).Coord()), None)
