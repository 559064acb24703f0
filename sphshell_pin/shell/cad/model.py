"""The faces of a CAD model: where each belongs, what it is called, and how to choose among them."""

from __future__ import annotations

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
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SOLID
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Compound

from sphshell_pin.errors import NameNotFound
from sphshell_pin.shell.cad.options import Occ
from sphshell_pin.shell.cad.units import HeaderUnit

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
    notes : sentences about the reading
    """

    path: Path
    faces: tuple[CadFace, ...]
    bodies: tuple[Part, ...]
    unit: HeaderUnit
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
                    raise NameNotFound("body", name, self.path.name, names)
            kept = tuple(face for face in kept if names[face.body] in bodies)
        if faces is not None:
            valid = list(dict.fromkeys(face.name for face in kept))
            numbers = {face.number for face in kept}
            for face in faces:
                if face not in (numbers if isinstance(face, int) else valid):
                    raise NameNotFound("face", str(face), self.path.name, valid)
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


def box_size(shape: Occ) -> float:
    """Diagonal of the box around a shape [its units]; 0 if it is empty."""
    quick = []
    for face in faces_of(shape):
        held = Bnd_Box()
        BRepBndLib.Add_s(face, held, False)
        if not held.IsVoid():
            quick.append((held.SquareExtent(), held.CornerMin(), held.CornerMax(), face))
    box = Bnd_Box()
    # The quick box may be far too large, as it holds the poles of the splines. Faces whose quick
    # box lies within the box so far need no other one: the largest come first.
    for _, least, most, face in sorted(quick, key=lambda one: -one[0]):
        if box.IsVoid() or box.IsOut(least) or box.IsOut(most):
            BRepBndLib.AddOptimal_s(face, box, False, False)
    return 0.0 if box.IsVoid() else float(box.SquareExtent() ** 0.5)
