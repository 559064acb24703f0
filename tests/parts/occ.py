"""OpenCASCADE's operations on solids, in a few words each [mm]."""

from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from OCP import BRepBuilderAPI, BRepPrimAPI
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
from OCP.BRepGProp import BRepGProp
from OCP.BRepOffsetAPI import BRepOffsetAPI_MakePipe, BRepOffsetAPI_ThruSections
from OCP.collections import Array1_gp_Pnt
from OCP.GeomAPI import GeomAPI_PointsToBSpline
from OCP.gp import gp_Ax1, gp_Ax2, gp_Circ, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

Solid = Any
Edge = Any
Rng = np.random.Generator

ORIGIN, UP = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def parts(shape: Any, kind: Any) -> list[Any]:
    """Return the parts of one kind, each once."""
    explorer, found = TopExp_Explorer(shape, kind), []
    while explorer.More():
        if not any(explorer.Current().IsSame(one) for one in found):
            found.append(explorer.Current())
        explorer.Next()
    return found


def faces(shape: Any) -> list[Any]:
    return [TopoDS.Face(face) for face in parts(shape, TopAbs_FACE)]


def area_and_volume(shape: Any) -> tuple[float, float]:
    """Of OpenCASCADE's own integration [mm^2, mm^3]."""
    surface, inside = GProp_GProps(), GProp_GProps()
    # Without a tolerance trimmed splines are off by percents.
    BRepGProp.SurfaceProperties_s(shape, surface, 1e-6)
    BRepGProp.VolumeProperties_s(shape, inside, 1e-6)
    return surface.Mass(), inside.Mass()


def rough_size(rng: Rng, low: float, high: float) -> float:
    """A length with few digits, as people state them."""
    return float(f"{np.exp(rng.uniform(*np.log([low, high]))):.2g}")


class OccFailed(Exception):
    """OpenCASCADE made no valid solid."""


def checked(solid: Solid) -> Solid:
    """Return the solid, if it is a valid one with a volume."""
    if solid is None or solid.IsNull() or not parts(solid, TopAbs_SOLID):
        raise OccFailed("no solid")
    if not BRepCheck_Analyzer(solid).IsValid():
        raise OccFailed("an invalid solid")
    if not area_and_volume(solid)[1] > 0.0:
        raise OccFailed("a solid without volume")
    return solid


def box(low: ArrayLike, high: ArrayLike) -> Solid:
    return BRepPrimAPI.BRepPrimAPI_MakeBox(_point(low), _point(high)).Shape()


def cylinder(radius: float, length: float, at: ArrayLike = ORIGIN, axis: ArrayLike = UP) -> Solid:
    return BRepPrimAPI.BRepPrimAPI_MakeCylinder(_frame(at, axis), radius, length).Shape()


def cone(low, high, length, at=ORIGIN, axis=UP):
    """Radius `low` at the place `at`, `high` at the other end."""
    return BRepPrimAPI.BRepPrimAPI_MakeCone(_frame(at, axis), low, high, length).Shape()


def ball(radius: float, at: ArrayLike = ORIGIN, axis: ArrayLike = UP) -> Solid:
    return BRepPrimAPI.BRepPrimAPI_MakeSphere(_frame(at, axis), radius).Shape()


def torus(ring: float, tube: float, at: ArrayLike = ORIGIN, axis: ArrayLike = UP) -> Solid:
    return BRepPrimAPI.BRepPrimAPI_MakeTorus(_frame(at, axis), ring, tube).Shape()


def extruded(outline: ArrayLike, height: float) -> Solid:
    """The polygon `outline` (k, 2) from z = 0 to `height`."""
    points = np.asarray(outline, float)
    face = _face(_polygon(np.c_[points, np.zeros(len(points))]))
    return BRepPrimAPI.BRepPrimAPI_MakePrism(face, gp_Vec(0.0, 0.0, height)).Shape()


def turned(profile: ArrayLike, angle: float = 2 * np.pi) -> Solid:
    """The polygon `profile` (k, 2) of radii and heights about z."""
    points = np.asarray(profile, float)
    face = _face(_polygon(np.c_[points[:, 0], np.zeros(len(points)), points[:, 1]]))
    return BRepPrimAPI.BRepPrimAPI_MakeRevol(face, gp_Ax1(gp_Pnt(), gp_Dir(*UP)), angle).Shape()


def turned_spline(profile: ArrayLike) -> Solid:
    """A spline near the points (k, 2) of radii and heights, closed by two lids, about z."""
    points = np.insert(np.asarray(profile, float), 1, 0.0, axis=1)
    face = _below(points, points[-1] * UP, points[0] * UP)
    return BRepPrimAPI.BRepPrimAPI_MakeRevol(face, gp_Ax1(gp_Pnt(), gp_Dir(*UP))).Shape()


def extruded_spline(points: ArrayLike, height: float, depth: float) -> Solid:
    """Below a spline near points (k, 2) that rise along x: `depth` below zero, `height` along z."""
    outline = np.insert(np.asarray(points, float), 2, 0.0, axis=1)
    face = _below(outline, *([x, -depth, 0.0] for x in outline[[-1, 0], 0].tolist()))
    return BRepPrimAPI.BRepPrimAPI_MakePrism(face, gp_Vec(0.0, 0.0, height)).Shape()


def piped(path: ArrayLike, radius: float) -> Solid:
    """A circle along a spline near points (k, 3)."""
    points = np.asarray(path, float)
    frame = gp_Ax2(_point(points[0]), gp_Dir(*(points[1] - points[0]).tolist()))
    circle = BRepBuilderAPI.BRepBuilderAPI_MakeEdge(gp_Circ(frame, radius)).Edge()
    return BRepOffsetAPI_MakePipe(_wire(_spline(points)), _face(_wire(circle))).Shape()


def lofted(sections: Iterable[ArrayLike], ruled: bool) -> Solid:
    """Through polygons (k, 3) of equally many corners."""
    loft = BRepOffsetAPI_ThruSections(True, ruled)
    for section in sections:
        loft.AddWire(_polygon(np.asarray(section, float)))
    loft.Build()
    return loft.Shape()


def fuse(first: Solid, *others: Solid) -> Solid:
    """Return the union, without borders between faces on one surface."""
    return _combined(BRepAlgoAPI_Fuse, first, others)


def cut(first: Solid, *others: Solid) -> Solid:
    return _combined(BRepAlgoAPI_Cut, first, others)


def common(first: Solid, *others: Solid) -> Solid:
    return _combined(BRepAlgoAPI_Common, first, others)


def torus_part(ring: float, tube: float, angle: float) -> Solid:
    """The part of a torus about z from the x axis to `angle`."""
    return BRepPrimAPI.BRepPrimAPI_MakeTorus(_frame(ORIGIN, UP), ring, tube, angle).Shape()


def moved(solid: Solid, by: ArrayLike) -> Solid:
    move = gp_Trsf()
    move.SetTranslation(gp_Vec(*np.asarray(by, float).tolist()))
    return BRepBuilderAPI.BRepBuilderAPI_Transform(solid, move, True).Shape()


def points_of(edge: Edge) -> np.ndarray:
    """Nine points (9, 3) along an edge."""
    curve = BRepAdaptor_Curve(edge)
    at = np.linspace(curve.FirstParameter(), curve.LastParameter(), 9)
    return np.array([curve.Value(t).Coord() for t in at.tolist()])


def span(edge: Edge) -> np.ndarray:
    """Extent (3,) of an edge along the axes."""
    return np.asarray(np.ptp(points_of(edge), axis=0))


def lowest(solid: Solid) -> float:
    """Lowest height of an edge."""
    return min(float(points_of(edge)[:, 2].min()) for edge in edges_where(solid, lambda p: True))


def edges_where(solid: Solid, wanted: Callable[[np.ndarray], bool]) -> list[Edge]:
    """Return the edges of which nine points (9, 3) are as wanted."""
    edges = [TopoDS.Edge(part) for part in parts(solid, TopAbs_EDGE)]
    there = [edge for edge in edges if not BRep_Tool.Degenerated_s(edge)]
    return [edge for edge in there if wanted(points_of(edge))]


def edges_at(solid: Solid, height: float) -> list[Edge]:
    return edges_where(solid, lambda p: bool(np.abs(p[:, 2] - height).max() < 1e-3))


def upright_edges(solid: Solid) -> list[Edge]:
    return edges_where(
        solid, lambda p: bool(np.ptp(p[:, :2], axis=0).max() < 1e-6 < np.ptp(p[:, 2]))
    )


def edges_about_axis(solid, radius, height, middle=(0.0, 0.0)):
    """Return the edges that lie on a circle about an axis along z."""

    def wanted(p: np.ndarray) -> bool:
        off = np.linalg.norm(p[:, :2] - middle, axis=1) - radius
        return bool(max(np.abs(off).max(), np.abs(p[:, 2] - height).max()) < 1e-3)

    return edges_where(solid, wanted)


def filleted(solid: Solid, edges: Iterable[Edge], *radii: float) -> Solid:
    """Round the edges with one radius, or with one that changes along each from first to second."""
    fillet = BRepFilletAPI_MakeFillet(solid)
    for edge in edges:
        fillet.Add(*radii, edge)
    if fillet.NbContours() == 0:
        raise OccFailed("no edge to round")
    return fillet.Shape()


def filleted_each(solid: Solid, radii: Iterable[tuple[Edge, float]]) -> Solid:
    """Round each edge with its own radius."""
    fillet = BRepFilletAPI_MakeFillet(solid)
    for edge, radius in radii:
        fillet.Add(radius, edge)
    return fillet.Shape()


def chamfered(solid: Solid, edges: Iterable[Edge], width: float) -> Solid:
    chamfer = BRepFilletAPI_MakeChamfer(solid)
    for edge in edges:
        chamfer.Add(width, edge)
    return chamfer.Shape()


def placed(solid: Solid, rng: Rng, reach: float) -> Solid:
    """Turned at random, and moved by up to `reach`."""
    turn, move = gp_Trsf(), gp_Trsf()
    axis = gp_Ax1(gp_Pnt(), gp_Dir(*rng.normal(size=3).tolist()))
    turn.SetRotation(axis, float(rng.uniform(0.0, 2 * np.pi)))
    move.SetTranslation(gp_Vec(*rng.uniform(-reach, reach, 3).tolist()))
    return BRepBuilderAPI.BRepBuilderAPI_Transform(solid, move.Multiplied(turn), True).Shape()


def _combined(kind: Any, first: Solid, others: tuple[Solid, ...]) -> Solid:
    for other in others:
        first = kind(first, other).Shape()
    unify = ShapeUpgrade_UnifySameDomain(first, True, True, False)
    unify.Build()
    return unify.Shape()


def _point(at: ArrayLike) -> gp_Pnt:
    return gp_Pnt(*np.asarray(at, float).tolist())


def _frame(at: ArrayLike, axis: ArrayLike) -> gp_Ax2:
    return gp_Ax2(_point(at), gp_Dir(*np.asarray(axis, float).tolist()))


def _polygon(points: np.ndarray) -> Any:
    polygon = BRepBuilderAPI.BRepBuilderAPI_MakePolygon()
    for point in points:
        polygon.Add(_point(point))
    polygon.Close()
    return polygon.Wire()


def _face(wire: Any) -> Any:
    return BRepBuilderAPI.BRepBuilderAPI_MakeFace(wire).Face()


def _below(points: np.ndarray, *corners: ArrayLike) -> Any:
    """The face between a spline near points (k, 3) and lines over corners back to its begin."""
    sides = (map(_point, ends) for ends in pairwise([points[-1], *corners, points[0]]))
    lines = (BRepBuilderAPI.BRepBuilderAPI_MakeEdge(*ends).Edge() for ends in sides)
    return _face(_wire(_spline(points), *lines))


def _wire(*edges: Edge) -> Any:
    made = BRepBuilderAPI.BRepBuilderAPI_MakeWire()
    for edge in edges:
        made.Add(edge)
    return made.Wire()


def _spline(points: np.ndarray) -> Any:
    row = Array1_gp_Pnt(1, len(points))
    for k, point in enumerate(points, 1):
        row.SetValue(k, _point(point))
    return BRepBuilderAPI.BRepBuilderAPI_MakeEdge(GeomAPI_PointsToBSpline(row).Curve()).Edge()
