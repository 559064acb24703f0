"""Writing CAD files: exact surfaces as they were read, or a shell as planar faces."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from OCP import BRepBuilderAPI
from OCP.BRep import BRep_Builder
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Dir, gp_Pln, gp_Pnt, gp_Trsf
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESControl import IGESControl_Writer
from OCP.Interface import Interface_Static
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopoDS import TopoDS, TopoDS_Shell
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from sphshell_pin.errors import InvalidParameter, ShellFileError
from sphshell_pin.shell.cad.model import MILLIMETER, CadModel, Part, compound
from sphshell_pin.shell.cad.options import BREP_SUFFIXES, STEP_SUFFIXES, Occ
from sphshell_pin.shell.shell import Shell
from sphshell_pin.units import meters_per_unit

MOST_FACETS = 20_000
"""A face takes about 1 kB in a STEP file, and CAD programs fail on more of them."""

STEP_UNITS = {"mm": "MM", "m": "M", "cm": "CM", "in": "INCH", "ft": "FT", "km": "KM", "um": "UM"}
IGES_UNITS = {"mm": "MM", "m": "M", "cm": "CM", "in": "IN", "ft": "FT", "km": "KM", "um": "UM"}
"""How the writers call the units their headers can state."""

BREP_OF_SOLIDS = 1
"""IGES entities of solids and shells, whose faces share their borders, not of loose faces."""


def parts_of(model: CadModel, whole: bool) -> list[Part]:
    """Names and shapes of the bodies of a model; unless `whole`, of the faces chosen alone."""
    used = sorted({face.body for face in model.faces})
    if whole:
        return [model.bodies[k] for k in used]
    return [
        (model.bodies[k][0], compound([face.shape for face in model.faces if face.body == k]))
        for k in used
    ]


def cad_content(path: Path, parts: Sequence[Part], meters: float, unit: str) -> bytes:
    """Return a file of named shapes, of `meters` per number, in the format the suffix names.

    Raises
    ------
    InvalidParameter
        If the format cannot state `unit`.
    ShellFileError
        If OpenCASCADE cannot write the shapes in this format.
    """
    suffix, stream = path.suffix.lower(), io.BytesIO()
    if suffix in BREP_SUFFIXES:
        shapes = [_scaled(shape, meters / meters_per_unit(unit)) for _, shape in parts]
        stream.write(b"DBRep_DrawableShape\n")
        BRepTools.Write_s(shapes[0] if len(shapes) == 1 else compound(shapes), stream)
        done = True
    else:
        names = STEP_UNITS if suffix in STEP_SUFFIXES else IGES_UNITS
        known = [name for name in names if meters_per_unit(name) == meters_per_unit(unit)]
        if not known:
            raise InvalidParameter("unit", unit, f"must be one of: {', '.join(names)}")
        parts = [(name, _scaled(shape, meters / MILLIMETER)) for name, shape in parts]
        write = _write_step if suffix in STEP_SUFFIXES else _write_iges
        done = write(stream, parts, names[known[0]])
    if not done:
        raise ShellFileError(path, "cannot be written: its shapes have no form in this format")
    return stream.getvalue()


def faceted(shell: Shell) -> Occ:
    """Return a shell as a solid, or an open shell, of planar faces [mm].

    Raises
    ------
    InvalidParameter
        If there are too many elements for a CAD file.
    """
    if shell.num_elements > MOST_FACETS:
        raise InvalidParameter(
            "elements",
            shell.num_elements,
            f"are too many for a CAD file, each would be a face of its own: at most {MOST_FACETS}",
        )
    builder = BRep_Builder()
    whole = TopoDS_Shell()
    builder.MakeShell(whole)
    points = [gp_Pnt(*point) for point in (shell.vertices / MILLIMETER).tolist()]
    vertices = [BRepBuilderAPI.BRepBuilderAPI_MakeVertex(point).Vertex() for point in points]
    edges: dict[tuple[int, int], Occ] = {}
    first = np.searchsorted(shell.triangle_element, np.arange(shell.num_elements))
    normals = shell.triangle_normals[first]
    for row, normal in zip(shell.elements.tolist(), normals.tolist(), strict=True):
        loop = [k for k in row if k >= 0]
        wire = BRepBuilderAPI.BRepBuilderAPI_MakeWire()
        for a, b in zip(loop, loop[1:] + loop[:1], strict=True):
            key = (min(a, b), max(a, b))
            if key not in edges:
                edges[key] = BRepBuilderAPI.BRepBuilderAPI_MakeEdge(
                    vertices[key[0]], vertices[key[1]]
                ).Edge()
            wire.Add(edges[key] if a < b else TopoDS.Edge(edges[key].Reversed()))
        plane = gp_Pln(points[loop[0]], gp_Dir(*normal))
        builder.Add(whole, BRepBuilderAPI.BRepBuilderAPI_MakeFace(plane, wire.Wire(), True).Face())
    whole.Closed(shell.is_closed)
    single = shell.is_closed and shell.health.components == 1
    return BRepBuilderAPI.BRepBuilderAPI_MakeSolid(whole).Solid() if single else whole


def _scaled(shape: Occ, factor: float) -> Occ:
    if abs(factor - 1.0) < 1e-12:
        return shape
    larger = gp_Trsf()
    larger.SetScale(gp_Pnt(0.0, 0.0, 0.0), factor)
    return BRepBuilderAPI.BRepBuilderAPI_Transform(shape, larger, True).Shape()


def _write_step(stream: io.BytesIO, parts: Sequence[Part], unit: str) -> bool:
    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    for name, shape in parts:
        label = tool.AddShape(shape, False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
    writer = STEPCAFControl_Writer()
    writer.SetNameMode(True)
    Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
    Interface_Static.SetCVal_s("write.step.unit", unit)
    try:
        if not writer.Transfer(document, STEPControl_AsIs):
            return False
        return bool(writer.WriteStream(stream) == IFSelect_RetDone)
    finally:
        Interface_Static.SetCVal_s("write.step.unit", "MM")


def _write_iges(stream: io.BytesIO, parts: Sequence[Part], unit: str) -> bool:
    Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
    writer = IGESControl_Writer(unit, BREP_OF_SOLIDS)
    for _, shape in parts:
        if not writer.AddShape(shape):
            return False
    writer.ComputeModel()
    return bool(writer.Write(stream))
