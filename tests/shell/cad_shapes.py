"""Small CAD shapes and files, made with OpenCASCADE's own primitives [mm]."""

from pathlib import Path
from typing import Any

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_NurbsConvert,
    BRepBuilderAPI_Transform,
)
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepGProp import BRepGProp
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.BRepTools import BRepTools
from OCP.collections import Array1_double, Array1_int, Array2_gp_Pnt
from OCP.Geom import Geom_BSplineSurface
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.IGESControl import IGESControl_Writer
from OCP.Interface import Interface_Static
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_DocumentTool

BALL, TUBE, RING = 12.0, 3.0, 9.0
"""Radius of the ball; radii of the tube of the ring and of its circle [mm]."""


def box(x: float = 20.0, y: float = 30.0, z: float = 10.0) -> Any:
    return BRepPrimAPI_MakeBox(x, y, z).Shape()


def ball(radius: float = BALL) -> Any:
    return BRepPrimAPI_MakeSphere(radius).Shape()


def cylinder(radius: float = 5.0, length: float = 20.0) -> Any:
    return BRepPrimAPI_MakeCylinder(radius, length).Shape()


def cone(radius: float = 6.0, height: float = 10.0) -> Any:
    return BRepPrimAPI_MakeCone(radius, 0.0, height).Shape()


def ring() -> Any:
    return BRepPrimAPI_MakeTorus(RING, TUBE).Shape()


def rounded_box() -> Any:
    """A box with all edges rounded by 2 mm: planes, cylinders and balls, tangent to each other."""
    shape = box()
    fillet = BRepFilletAPI_MakeFillet(shape)
    for edge in parts(shape, TopAbs_EDGE):
        fillet.Add(2.0, TopoDS.Edge(edge))
    return fillet.Shape()


def drilled_plate() -> Any:
    """A plate with a round hole: its borders are hollow, seen from the plate."""
    axis = gp_Ax2(gp_Pnt(20.0, 20.0, -1.0), gp_Dir(0.0, 0.0, 1.0))
    hole = BRepPrimAPI_MakeCylinder(axis, 10.0, 7.0).Shape()
    return BRepAlgoAPI_Cut(box(40.0, 40.0, 5.0), hole).Shape()


def bent_bar(turns: tuple[float, ...], length: float = 20.0) -> Any:
    """A bar 5 mm wide whose upper side is made of planes that turn by few degrees each."""
    x, y, angle = 0.0, 0.0, 0.0
    outline = BRepBuilderAPI_MakePolygon()
    outline.Add(gp_Pnt(x, y, 0.0))
    for turn in (0.0, *turns):
        angle += np.deg2rad(turn)
        x, y = x + length * np.cos(angle), y + length * np.sin(angle)
        outline.Add(gp_Pnt(x, y, 0.0))
    for corner in ((x, -30.0), (0.0, -30.0)):
        outline.Add(gp_Pnt(*corner, 0.0))
    outline.Close()
    base = BRepBuilderAPI_MakeFace(outline.Wire()).Face()
    return BRepPrimAPI_MakePrism(base, gp_Vec(0.0, 0.0, 5.0)).Shape()


def nurbs(shape: Any) -> Any:
    """The same shape with all surfaces as splines."""
    return BRepBuilderAPI_NurbsConvert(shape).Shape()


def parts(shape: Any, kind: Any) -> list[Any]:
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
        move = gp_Trsf()
        move.SetTranslation(gp_Vec(100.0 * k, 0.0, 0.0))
        label = tool.AddShape(BRepBuilderAPI_Transform(shape, move, True).Shape(), False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
    for row, name in faces:
        part = tool.AddSubShape(label, parts(tool.GetShape_s(label), TopAbs_FACE)[row])
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
    poles = Array2_gp_Pnt(1, 5, 1, 2)
    bend = np.array([0.0, 0.5, 1.0, 0.5, 0.0]) * height
    for i in range(5):
        for j in range(2):
            poles.SetValue(i + 1, j + 1, gp_Pnt(5.0 * i, 10.0 * j, bend[i]))
    surface = Geom_BSplineSurface(
        poles,
        _array(Array1_double, (0.0, 0.5, 1.0)),
        _array(Array1_double, (0.0, 1.0)),
        _array(Array1_int, (3, 2, 3)),
        _array(Array1_int, (2, 2)),
        2,
        1,
    )
    return BRepBuilderAPI_MakeFace(surface, 1e-7).Face()


def _array(kind: Any, values: tuple[float, ...]) -> Any:
    filled = kind(1, len(values))
    for k, value in enumerate(values, 1):
        filled.SetValue(k, value)
    return filled
