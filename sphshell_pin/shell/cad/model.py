"""The faces of a CAD model: where each belongs, what it is called, and how to choose among them."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.collections import (
    IndexedDataMap_TopoDS_Shape_List_TopoDS_Shape_TopTools_ShapeMapHasher as AncestorMap,
)
from OCP.ShapeAnalysis import ShapeAnalysis_ShapeTolerance
from OCP.STEPConstruct import STEPConstruct_UnitContext
from OCP.StepRepr import StepRepr_GlobalUnitAssignedContext
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SOLID
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Compound

from sphshell_pin import errors
from sphshell_pin.base.summary import names as listed
from sphshell_pin.shell.cad.options import Occ
from sphshell_pin.units import METERS_PER_UNIT, meters_per_unit

MILLIMETER = 1e-3
"""OpenCASCADE's tolerances are meant for numbers in millimeters: STEP and IGES are read in them."""

SAME = 1e-9
"""Units whose lengths differ by less than this share are one."""

NAMED = 3
"""Flag of an IGES header whose unit is a name. OpenCASCADE changes it for the names it knows."""


@dataclass(frozen=True)
class HeaderUnit:
    """What the header of a file says about its unit of length.

    Attributes
    ----------
    names : of the units stated: none, one, or several, each applied to its own part of the file
    meters : per unit of the file; of several, and of none, per unit of the shape
    shape_meters : meters per unit of the shape as it was read, 1 if no unit is known
    """

    names: tuple[str, ...]
    meters: float
    shape_meters: float


NO_UNIT = HeaderUnit((), 1.0, 1.0)


def step_unit(model: Occ) -> HeaderUnit:
    """Return the unit in which a STEP file (StepData_StepModel) gives its lengths.

    OpenCASCADE has brought the lengths to millimeters, each by the unit of its own context; where
    there is none it has left them.
    """
    found: list[float] = []
    for row in range(1, model.NbEntities() + 1):
        context = model.Entity(row)
        if hasattr(context, "GlobalUnitAssignedContext"):
            context = context.GlobalUnitAssignedContext()
        if not isinstance(context, StepRepr_GlobalUnitAssignedContext):
            continue
        factors = STEPConstruct_UnitContext()
        factors.ComputeFactors(context)
        meters = factors.LengthFactor() * MILLIMETER
        if factors.LengthDone() and not any(math.isclose(meters, one) for one in found):
            found.append(meters)
    if not found:
        return NO_UNIT
    meters = found[0] if len(found) == 1 else MILLIMETER
    return HeaderUnit(tuple(map(_called, found)), meters, MILLIMETER)


def iges_unit(path: Path, header: Occ) -> HeaderUnit:
    """Return the unit an IGES header (IGESData_GlobalSection) states.

    Raises
    ------
    ShellFileError
        If its flag is none that IGES has: OpenCASCADE would read everything as points.
    """
    meters = float(header.UnitValue()) * MILLIMETER
    if meters == 0.0:
        raise errors.ShellFileError(
            path, f"states a unit of length by flag {header.UnitFlag()}, which IGES does not have"
        )
    if header.UnitFlag() == NAMED:
        return NO_UNIT
    return HeaderUnit((_called(meters),), meters, MILLIMETER)


def take_unit(
    path: Path, header: HeaderUnit, unit: str | None, size: float
) -> tuple[HeaderUnit, str, str]:
    """Return the unit that is valid, its name, and a sentence about it.

    unit : as stated, it wins over that of the header; size : of the shape [its units]

    Raises
    ------
    UnitMissing
        If neither the header nor the user states one.
    InvalidParameter
        If one is stated in place of several.
    """
    names = header.names
    if unit is None:
        if not names:
            raise errors.UnitMissing(path, size, METERS_PER_UNIT)
        if len(names) > 1:
            note = f"units {listed(names)} from the file's header, each for its own part"
            return header, "mm", note
        return header, names[0], f"unit '{names[0]}' from the file's header"
    stated = meters_per_unit(unit)
    if not names:
        return HeaderUnit((unit,), stated, stated), unit, ""
    if len(names) > 1:
        raise errors.InvalidParameter(
            "unit",
            unit,
            f"cannot take the place of the {len(names)} units {listed(names)} that {path.name} "
            "states, each for its own part: leave it out",
        )
    if math.isclose(stated, header.meters, rel_tol=SAME):
        return header, unit, f"unit '{unit}', as the file's header has it"
    # The header's factor taken back: these are the numbers of the file.
    meters = header.shape_meters / header.meters * stated
    note = (
        f"unit '{unit}' as stated, though the file's header says '{names[0]}': the surface "
        f"measures {size * meters:.4g} m, not {size * header.shape_meters:.4g} m"
    )
    warnings.warn(f"{path.name}: {note}", errors.UnitWarning, stacklevel=2)
    return replace(header, meters=stated, shape_meters=meters), unit, note


def _called(meters: float) -> str:
    """Name of a unit, its length if it has none."""
    known = (name for name, one in METERS_PER_UNIT.items() if math.isclose(one, meters))
    return next(known, f"{meters:.9g} m")


LARGEST = 1
"""Makes ShapeAnalysis_ShapeTolerance return the largest tolerance, not the mean."""


Part = tuple[str, Occ]
"""A name and a shape."""


@dataclass(frozen=True)
class CadFace:
    """One trimmed face.

    `shape` (a TopoDS_Face), its `name`, its `number` in the file from 1, and the row of the `body`
    it belongs to.
    """

    shape: Occ
    name: str
    number: int
    body: int


@dataclass(frozen=True)
class CadModel:
    """What a CAD file holds.

    Attributes
    ----------
    path : of the file
    faces : in the order of the file
    bodies : name and shape of each body, a solid if the file has one
    unit : what the header says about the unit of length, and in what `shape` came
    missing : how many faces of the file could not be read
    notes : sentences about the reading
    """

    path: Path
    faces: tuple[CadFace, ...]
    bodies: tuple[Part, ...]
    unit: HeaderUnit
    missing: int = 0
    notes: tuple[str, ...] = ()

    @property
    def meters(self) -> float:
        """Meters per unit of `shape`."""
        return self.unit.shape_meters

    @property
    def shape(self) -> Occ:
        """All faces as one TopoDS_Compound; borders that faces share stay shared."""
        return compound([face.shape for face in self.faces])

    @property
    def solids(self) -> tuple[int, ...]:
        """For each face the row of its body if that is a solid, else -1."""
        kinds = [shape.ShapeType() for _, shape in self.bodies]
        return tuple(f.body if kinds[f.body] == TopAbs_SOLID else -1 for f in self.faces)

    @property
    def tolerance(self) -> float:
        """The file's own tolerance, the largest of any edge or vertex [units of `shape`]."""
        return float(ShapeAnalysis_ShapeTolerance().Tolerance(self.shape, LARGEST))

    def selected(self, bodies: Sequence[str] | None, faces: Sequence[str | int] | None) -> CadModel:
        """Return the model with the bodies and the faces named; with None, with all.

        Raises
        ------
        NameNotFound
            If no body or no face of those bodies has a name; the message lists the valid ones.
        """
        kept = self.faces
        if bodies is not None:
            names = [name for name, _ in self.bodies]
            for name in bodies:
                if name not in names:
                    raise errors.NameNotFound("body", name, self.path.name, names)
            kept = tuple(face for face in kept if names[face.body] in bodies)
        if faces is not None:
            valid = list(dict.fromkeys(face.name for face in kept))
            numbers = {face.number for face in kept}
            for face in faces:
                if face not in (numbers if isinstance(face, int) else valid):
                    raise errors.NameNotFound("face", str(face), self.path.name, valid)
            kept = tuple(face for face in kept if face.name in faces or face.number in faces)
        return replace(self, faces=kept)


def compound(shapes: Sequence[Occ]) -> Occ:
    """Return one TopoDS_Compound of several shapes."""
    builder, whole = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(whole)
    for shape in shapes:
        builder.Add(whole, shape)
    return whole


def subshapes(shape: Occ, kind: Occ, avoid: Occ = None) -> Iterator[Occ]:
    """Iterate over the parts of `shape` of one kind, with their orientation and place in it.

    With `avoid`, without those inside a part of that kind.
    """
    explorer = (
        TopExp_Explorer(shape, kind) if avoid is None else TopExp_Explorer(shape, kind, avoid)
    )
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def faces_of(shape: Occ) -> list[Occ]:
    """All faces of a shape, as TopoDS_Face."""
    return [TopoDS.Face(face) for face in subshapes(shape, TopAbs_FACE)]


def count_open_edges(shape: Occ) -> int:
    """How many edges bound only one face, and that once."""
    owners = AncestorMap()
    TopExp.MapShapesAndAncestors_s(shape, TopAbs_EDGE, TopAbs_FACE, owners)
    return sum(
        owners.FindFromIndex(k).Size() == 1
        and not BRep_Tool.Degenerated_s(TopoDS.Edge(owners.FindKey(k)))
        for k in range(1, owners.Extent() + 1)
    )


def quick_box(face: Occ) -> Occ:
    """Return a Bnd_Box that holds a face, and may be far too large: the poles of splines too."""
    box = Bnd_Box()
    BRepBndLib.Add_s(face, box, False)
    return box


def box_size(shape: Occ) -> float:
    """Diagonal of the box around a shape [its units]; 0 if it is empty."""
    quick = []
    for face in faces_of(shape):
        held = quick_box(face)
        if not held.IsVoid():
            quick.append((held.SquareExtent(), held.CornerMin(), held.CornerMax(), face))
    box = Bnd_Box()
    # Faces whose quick box lies within the box so far need no other one: the largest come first.
    for _, least, most, face in sorted(quick, key=lambda one: -one[0]):
        if box.IsVoid() or box.IsOut(least) or box.IsOut(most):
            BRepBndLib.AddOptimal_s(face, box, False, False)
    return 0.0 if box.IsVoid() else float(box.SquareExtent() ** 0.5)
