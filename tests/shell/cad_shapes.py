"""Small CAD shapes and files, made with OpenCASCADE's own primitives [mm]."""

from pathlib import Path
from typing import Any

import numpy as np
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_NurbsConvert
from OCP.BRepTools import BRepTools
from OCP.collections import Array1_double, Array1_int, Array2_gp_Pnt
from OCP.Geom import Geom_BezierSurface, Geom_BSplineSurface
from OCP.gp import gp_Pnt
from OCP.IGESControl import IGESControl_Writer
from OCP.Interface import Interface_Static
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FACE
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from tests.parts import occ

BALL, TUBE, RING = 12.0, 3.0, 9.0
"""Radius of the ball; radii of the tube of the ring and of its circle [mm]."""


def box(x: float = 20.0, y: float = 30.0, z: float = 10.0) -> Any:
    return occ.box((0, 0, 0), (x, y, z))


def ball(radius: float = BALL) -> Any:
    return occ.ball(radius)


def cylinder(radius: float = 5.0, length: float = 20.0) -> Any:
    return occ.cylinder(radius, length)


def cone(radius: float = 6.0, height: float = 10.0) -> Any:
    return occ.cone(radius, 0.0, height)


def ring() -> Any:
    return occ.torus(RING, TUBE)


def rounded_box() -> Any:
    """A box with all edges rounded by 2 mm: planes, cylinders and balls, tangent to each other."""
    shape = box()
    return occ.filleted(shape, occ.edges_where(shape, lambda p: True), 2.0)


def drilled_plate() -> Any:
    """A plate with a round hole: its borders are hollow, seen from the plate."""
    return occ.cut(box(40.0, 40.0, 5.0), occ.cylinder(10.0, 7.0, (20.0, 20.0, -1.0)))


def bent_bar(turns: tuple[float, ...], length: float = 20.0) -> Any:
    """A bar 5 mm wide whose upper side is made of planes that turn by few degrees each."""
    angle = np.cumsum(np.radians((0.0, *turns)))
    upper = length * np.cumsum(np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0)
    return occ.extruded([(0.0, 0.0), *upper, (upper[-1, 0], -30.0), (0.0, -30.0)], 5.0)


def nurbs(shape: Any) -> Any:
    """The same shape with all surfaces as splines."""
    return BRepBuilderAPI_NurbsConvert(shape).Shape()


def write_brep(path: Path, shape: Any) -> Path:
    assert BRepTools.Write_s(shape, str(path))
    return path


def write_iges(path: Path, shape: Any, unit: str = "MM", solids: int = 0) -> Path:
    """Without `solids` every face is written by itself: their borders come apart."""
    writer = IGESControl_Writer(unit, solids)
    assert writer.AddShape(shape)
    writer.ComputeModel()
    assert writer.Write(str(path))
    return path


def write_step(path: Path, *named: tuple[str, Any], unit: str = "MM", faces: Any = ()) -> Path:
    """Bodies with names, one after the other along x, 100 mm apart.

    faces : rows and names of faces of the last one
    """
    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    for k, (name, shape) in enumerate(named):
        label = tool.AddShape(occ.moved(shape, (100.0 * k, 0.0, 0.0)), False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
    for row, name in faces:
        part = tool.AddSubShape(label, occ.parts(tool.GetShape_s(label), TopAbs_FACE)[row])
        TDataStd_Name.Set_s(part, TCollection_ExtendedString(name))
    writer = STEPCAFControl_Writer()
    writer.SetNameMode(True)
    Interface_Static.SetIVal_s("write.stepcaf.subshapes.name", 1)
    Interface_Static.SetCVal_s("write.step.unit", unit)
    assert writer.Transfer(document, STEPControl_AsIs)
    writer.Write(str(path))
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    return path


def roof(height: float = 3.0) -> Any:
    """One spline face of 20 by 10 mm with a kink along its middle, `height` above its rims."""
    rise = np.array([0.0, 0.5, 1.0, 0.5, 0.0]) * height
    poles = _poles([[(5.0 * i, y, rise[i]) for y in (0.0, 10.0)] for i in range(5)])
    knots = [_array(Array1_double, one) for one in ((0.0, 0.5, 1.0), (0.0, 1.0))]
    times = [_array(Array1_int, one) for one in ((3, 2, 3), (2, 2))]
    surface = Geom_BSplineSurface(poles, *knots, *times, 2, 1)
    return BRepBuilderAPI_MakeFace(surface, 1e-7).Face()


def patch(corners: Any) -> Any:
    """The bilinear face between corners (2, 2, 3) [mm]."""
    return BRepBuilderAPI_MakeFace(Geom_BezierSurface(_poles(corners)), 1e-7).Face()


def _poles(points: Any) -> Any:
    """Points (n, m, 3) as OpenCASCADE takes them."""
    rows, columns, _ = np.shape(points)
    poles = Array2_gp_Pnt(1, rows, 1, columns)
    for i, j in np.ndindex(rows, columns):
        poles.SetValue(i + 1, j + 1, gp_Pnt(*map(float, points[i][j])))
    return poles


def _array(kind: Any, values: tuple[float, ...]) -> Any:
    filled = kind(1, len(values))
    for k, value in enumerate(values, 1):
        filled.SetValue(k, value)
    return filled
