"""STEP, IGES and BREP files: their faces and bodies, with names and the unit of the header."""

import re
from collections.abc import Callable
from pathlib import Path

from OCP.BRep import BRep_Builder
from OCP.BRepTools import BRepTools
from OCP.collections import Sequence_TDF_Label
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESControl import IGESControl_Reader
from OCP.Interface import Interface_Static
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Shape
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from sphshell_pin.base.texts import free_name
from sphshell_pin.errors import ShellFileError
from sphshell_pin.shell.cad import model as cad_model
from sphshell_pin.shell.cad.framing import check_frame
from sphshell_pin.shell.cad.options import Occ
from sphshell_pin.shell.readers.text import read_bytes

IGES_FACES = (143, 144, 510)
"""IGES entities that stand for a face: bounded surface, trimmed surface, face of a solid."""

_NO_NAME = re.compile(r"|NONE|SOLID|COMPOUND|COMPSOLID|SHELL|FACE|=>.*|Open CASCADE STEP tr.*")
"""What writers put where there is no name."""

_STEP_BODY = re.compile(rb"(?:BREP|BREP_WITH_VOIDS|SURFACE_MODEL|SHELL)\s*\(\s*'([^']+)'")
_STEP_FACE = re.compile(rb"(?:FACE|FACE_SURFACE)\s*\(\s*'([^']+)'")
"""Their names: to find the entity of a shape takes long, so not without need."""

Namer = Callable[[Occ], str]


def read_model(path: Path) -> cad_model.CadModel:
    """Read all faces of a CAD file.

    Raises
    ------
    ShellFileError
        If the file cannot be read, is truncated or damaged, or holds no face.
    """
    data = read_bytes(path)
    kind = check_frame(path)
    try:
        read = {"STEP": _read_step, "IGES": _read_iges, "BREP": _read_brep}[kind]
        model = read(path, data)
    except (ShellFileError, MemoryError):
        raise
    except Exception as error:  # whatever OpenCASCADE throws
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ShellFileError(path, f"is damaged, it cannot be read as {kind} ({reason})") from error
    if not model.faces:
        lost = f"none of its {model.missing} faces can be read: export the part again"
        none = "holds no surface, only curves or points at most: export faces or solids"
        raise ShellFileError(path, lost if model.missing else none)
    return model


def _read_step(path: Path, data: bytes) -> cad_model.CadModel:
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(False)
    Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")  # exists as soon as a reader does
    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    if reader.ReadFile(str(path)) != IFSelect_RetDone or not reader.Transfer(document):
        raise ShellFileError(path, "is damaged, its STEP entities cannot be read")
    unit = cad_model.step_unit(reader.ChangeReader().StepModel())
    labels = Sequence_TDF_Label()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(labels)
    parts: list[cad_model.Part] = []
    for label in labels:
        _walk(label, TopLoc_Location(), parts)
    transfer = reader.ChangeReader().WS().TransferReader()

    def name_of(shape: Occ) -> str:
        entity = transfer.EntityFromShapeResult(shape.Located(TopLoc_Location()), 1)
        text = entity.Name() if entity is not None and hasattr(entity, "Name") else None
        return "" if text is None else _name(text.ToCString())

    namers = (
        name_of if any(_name(text.decode(errors="replace")) for text in found) else _no_name
        for found in (_STEP_BODY.findall(data), _STEP_FACE.findall(data))
    )
    faces, bodies = _sort(parts, *namers)
    missing = _missing(len(re.findall(rb"=\s*(?:ADVANCED_|)FACE(?:_SURFACE|)\s*\(", data)), faces)
    return cad_model.CadModel(path, faces, bodies, unit, missing)


def _walk(label: Occ, location: Occ, parts: list[cad_model.Part]) -> None:
    """Collect the parts of an assembly, each in its place."""
    if XCAFDoc_ShapeTool.IsReference_s(label):
        location = location.Multiplied(XCAFDoc_ShapeTool.GetLocation_s(label))
        referred = TDF_Label()
        XCAFDoc_ShapeTool.GetReferredShape_s(label, referred)
        label = referred
    if XCAFDoc_ShapeTool.IsAssembly_s(label):
        components = Sequence_TDF_Label()
        XCAFDoc_ShapeTool.GetComponents_s(label, components)
        for component in components:
            _walk(component, location, parts)
        return
    shape = XCAFDoc_ShapeTool.GetShape_s(label)
    if shape.IsNull():
        return
    text = TDataStd_Name()
    named = label.FindAttribute(TDataStd_Name.GetID_s(), text)
    name = _name(text.Get().ToExtString()) if named else ""
    # A shape of its own place keeps it below that of the assembly.
    parts.append((name, shape.Moved(location)))


def _read_iges(path: Path, data: bytes) -> cad_model.CadModel:
    reader = IGESControl_Reader()
    Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        raise ShellFileError(path, "is damaged, its IGES entities cannot be read")
    model = reader.IGESModel()
    unit = cad_model.iges_unit(path, model.GlobalSection())
    reader.TransferRoots()
    shape = reader.OneShape()
    transfer = reader.WS().TransferReader()

    def name_of(shape: Occ) -> str:
        entity = transfer.EntityFromShapeResult(shape, 1)
        text = entity.NameValue() if entity is not None and entity.HasName() else None
        return "" if text is None else _name(text.ToCString())

    parts: list[cad_model.Part] = [] if shape is None or shape.IsNull() else [("", shape)]
    entities = range(1, model.NbEntities() + 1)
    named = any(model.Entity(k).HasName() for k in entities)
    faces, bodies = _sort(parts, *2 * [name_of if named else _no_name])
    held = (model.Entity(k).TypeNumber() for k in entities)
    missing = _missing(sum(kind in IGES_FACES for kind in held), faces)
    return cad_model.CadModel(path, faces, bodies, unit, missing)


def _read_brep(path: Path, data: bytes) -> cad_model.CadModel:
    shape = TopoDS_Shape()
    if not BRepTools.Read_s(shape, str(path), BRep_Builder()) or shape.IsNull():
        raise ShellFileError(path, "is damaged, its BREP shape cannot be read")
    faces, bodies = _sort([("", shape)], _no_name, _no_name)
    missing = _missing(sum(1 for _ in cad_model.subshapes(shape, TopAbs_FACE)), faces)
    return cad_model.CadModel(path, faces, bodies, cad_model.NO_UNIT, missing)


def _no_name(_: Occ) -> str:
    return ""


def _name(text: str) -> str:
    """Return a name as the file has it, or "" if it is none."""
    text = " ".join(text.split())
    return "" if _NO_NAME.fullmatch(text) else text


def _missing(held: int, faces: tuple[cad_model.CadFace, ...]) -> int:
    """Count what did not come out of a file that has entities for `held` faces."""
    return max(0, held - len(faces))


def _sort(
    parts: list[cad_model.Part], name_of_body: Namer, name_of_face: Namer
) -> tuple[tuple[cad_model.CadFace, ...], tuple[cad_model.Part, ...]]:
    """Sort faces into bodies: each solid, each shell outside of solids, all loose faces of a part.

    Returns faces and bodies. Names of bodies are made unique; those of faces are as the file has
    them, or "Face 12".
    """
    faces: list[cad_model.CadFace] = []
    bodies: list[cad_model.Part] = []
    for part, shape in parts:
        solids = list(cad_model.subshapes(shape, TopAbs_SOLID))
        shells = list(cad_model.subshapes(shape, TopAbs_SHELL, TopAbs_SOLID))
        loose = list(cad_model.subshapes(shape, TopAbs_FACE, TopAbs_SHELL))
        groups = [*solids, *shells, *([cad_model.compound(loose)] if loose else [])]
        for group in groups:
            own = part if len(groups) == 1 else name_of_body(group)
            name = own or (f"{part} {len(bodies) + 1}" if part else f"Body {len(bodies) + 1}")
            bodies.append((free_name(name, [taken for taken, _ in bodies], " ({})"), group))
            for face in cad_model.subshapes(group, TopAbs_FACE):
                # Endless: what OpenCASCADE makes of one whose surface or borders are damaged.
                if cad_model.quick_box(face).IsOpen():
                    continue
                number = len(faces) + 1
                called = name_of_face(face) or f"Face {number}"
                faces.append(cad_model.CadFace(TopoDS.Face(face), called, number, len(bodies) - 1))
    return tuple(faces), tuple(bodies)
