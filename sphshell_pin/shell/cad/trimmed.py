"""Stationary points of the distance to the trimmed faces of a CAD file, by Newton's method.

They are what contacts stand for: closest points, and saddles between two of them. BRepExtrema of
OpenCASCADE misses some on real files; here a search starts next to each contact, on every face that
comes near, and on the edges and vertices of these faces.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.gp import gp_Pnt, gp_Pnt2d, gp_Vec
from OCP.IntTools import IntTools_FClass2d
from OCP.TopAbs import TopAbs_EDGE, TopAbs_OUT
from OCP.TopoDS import TopoDS

from sphshell_pin.shell.cad.model import subshapes
from sphshell_pin.shell.cad.reference import TRIMMING, corner_weights
from sphshell_pin.shell.shell import Shell

if TYPE_CHECKING:
    from sphshell_pin.shell.cad.surface import CadSurface
    from sphshell_pin.shell.raw import Floats, Longs

REACH = 4.0
"""Faces are tried that come as near to a contact as this many times the tessellation's error."""

AWAY = 100.0
"""A stationary point farther from the contact, in the same unit, is that of another place."""

EDGE_SEEDS = 65
MOST_STEPS = 30
SETTLED = 1e-12
"""Newton's steps are the last when they are shorter than this share of the size, or of the range of
an edge's parameter."""


@dataclass(frozen=True)
class Foot:
    """A stationary point of the distance: `point` (3,), and the unit `normal` (3,) of the surface.

    The normal is None on edges and vertices, where it is the way to the point asked for.
    """

    point: Floats
    normal: Floats | None


@dataclass(frozen=True)
class _Edge:
    """One edge of a face: its curve, and points (k, 3) at parameters (k,) along it."""

    curve: Any
    at: Floats
    points: Floats


class TrimmedFaces:
    """The trimmed faces that a tessellation stands for [units of the model]."""

    def __init__(self, cad: CadSurface) -> None:
        self._cad = cad
        self._error = max(cad.found.error, cad.stated)
        raw = cad.polygons()
        points = raw.vertices / cad.model.metres
        self._shell = Shell(points, raw.corners.reshape(-1, 3), crease_angle=0.0)
        counts = [0 if mesh is None else len(mesh.triangles) for mesh in cad.found.meshes]
        self._starts = np.cumsum([0, *counts])
        self._inside = cache(lambda face: IntTools_FClass2d(cad.sewn.faces[face], TRIMMING))
        self._edges = cache(lambda face: tuple(_edges_of(cad.sewn.faces[face])))

    def foot(self, center: Floats, contact: Floats) -> Foot | None:
        """Return the stationary point of the distance from `center` next to `contact`, (3,) each.

        None if there is none near it.
        """
        touched = self._shell.contacts(contact, REACH * self._error, method="elements")
        polygon = self._shell.source_element[touched.element]
        found: list[Foot] = []
        faces = np.searchsorted(self._starts, polygon, side="right") - 1
        # Contacts come deepest first: the first of each face is the nearest.
        for face, row in zip(*np.unique(faces, return_index=True), strict=True):
            found += self._on_face(int(face), int(polygon[row]), touched.point[row], center)
            found += self._on_edges(int(face), center, contact)
        away = np.array([np.linalg.norm(one.point - contact) for one in found])
        if not len(away) or away.min() > AWAY * self._error:
            return None
        best = found[int(np.argmin(away))]
        if best.normal is None:
            # An edge beside which a face is nearer to the centre is not where they touch.
            length = np.array([np.linalg.norm(one.point - center) for one in found])
            on_face = np.array([one.normal is not None for one in found])
            nearer = on_face & (away <= REACH * self._error)
            nearer &= length < np.linalg.norm(best.point - center)
            if nearer.any():
                return found[int(np.argmin(np.where(nearer, away, np.inf)))]
        return best

    def _on_face(self, face: int, polygon: int, near: Floats, center: Floats) -> Iterator[Foot]:
        mesh = self._cad.found.meshes[face]
        assert mesh is not None  # it has triangles
        nodes: Longs = mesh.triangles[polygon - self._starts[face]][None]
        weights = corner_weights(mesh.points[nodes], near[None])
        uv = np.einsum("nk,nkx->nx", weights, mesh.parameters(nodes))[0]
        at = mesh.surface.foot(center, uv, SETTLED * self._cad.size)
        if at is None or self._inside(face).Perform(gp_Pnt2d(*at.tolist())) == TopAbs_OUT:
            return
        points, normals = mesh.surface.nodes(at[None])
        if normals.any():
            yield Foot(points[0], normals[0])

    def _on_edges(self, face: int, center: Floats, contact: Floats) -> Iterator[Foot]:
        """Stationary points on the edges of a face, and their ends."""
        for edge in self._edges(face):
            nearest = int(np.argmin(np.linalg.norm(edge.points - contact, axis=1)))
            at = _foot_on_curve(edge, center, float(edge.at[nearest]))
            if at is not None:
                yield Foot(np.array(edge.curve.Value(at).Coord()), None)
            yield Foot(edge.points[0], None)
            yield Foot(edge.points[-1], None)


def _edges_of(face: Any) -> Iterator[_Edge]:
    for part in subshapes(face, TopAbs_EDGE):
        edge = TopoDS.Edge(part)
        if not BRep_Tool.Degenerated_s(edge):
            curve = BRepAdaptor_Curve(edge, face)
            at = np.linspace(curve.FirstParameter(), curve.LastParameter(), EDGE_SEEDS)
            yield _Edge(curve, at, np.array([curve.Value(t).Coord() for t in at.tolist()]))


def _foot_on_curve(edge: _Edge, center: Floats, seed: float) -> float | None:
    """Parameter between the ends of an edge at which the way to `center` is upright, if any."""
    place, first, second = gp_Pnt(), gp_Vec(), gp_Vec()
    at, low, high = seed, float(edge.at[0]), float(edge.at[-1])
    for _ in range(MOST_STEPS):
        edge.curve.D2(at, place, first, second)
        offset, way = np.array(place.Coord()) - center, np.array(first.Coord())
        square = float(way @ way)
        bend = square + float(offset @ np.array(second.Coord()))
        # Near a centre of curvature, or at a place where the curve stands still.
        bend = bend if abs(bend) > 1e-3 * square else square
        if bend == 0.0:
            return None
        step = -float(offset @ way) / bend
        moved = min(max(at + step, low), high)
        if abs(moved - at) <= SETTLED * (high - low):
            return moved if low < moved < high else None
        at = moved
    return None
