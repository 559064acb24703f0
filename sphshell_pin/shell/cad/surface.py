"""A CAD file as polygons with exact normals, ready for the cleaning."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.collections import Array1_double
from OCP.GeomAbs import GeomAbs_C0, GeomAbs_C1
from OCP.ShapeBuild import ShapeBuild_ReShape
from OCP.ShapeUpgrade import ShapeUpgrade_ShapeDivideContinuity

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.texts import counted
from sphshell_pin.shell.cad.face_surface import FaceSurface
from sphshell_pin.shell.cad.model import CadFace, CadModel, box_size, faces_of, take_unit
from sphshell_pin.shell.cad.options import CadOptions, Occ
from sphshell_pin.shell.cad.reading import read_model
from sphshell_pin.shell.cad.tessellation import Sewn, Tessellation, sew, tessellate
from sphshell_pin.shell.raw import NO_SHAPE, RawSurface, moved_shapes
from sphshell_pin.shell.tangent_joints import TANGENT_ANGLE

ACROSS = 1e-6
"""How far on either side of a knot the normals are compared, as a share of the face's range."""

PLACES = 17
"""Where along a knot they are compared."""

SPLIT_TOLERANCE = 1e-7
"""A kink that moving the surface by less removes is none [units of the model]."""


def without_kinks(model: CadModel) -> tuple[CadModel, int]:
    """Divide the faces that have a kink inside, and say how many had one.

    Pieces keep name and number. Most splines that are not differentiable on paper, such as circles
    made of arcs, are smooth in space: these stay whole.
    """
    kinked = [face.shape for face in model.faces if _has_kink(face.shape)]
    if not kinked:
        return model, 0
    context = ShapeBuild_ReShape()
    for shape in kinked:
        divide = ShapeUpgrade_ShapeDivideContinuity(shape)
        divide.SetContext(context)
        divide.SetTolerance(SPLIT_TOLERANCE)
        divide.SetSurfaceCriterion(GeomAbs_C1)
        divide.SetBoundaryCriterion(GeomAbs_C0)
        divide.SetPCurveCriterion(GeomAbs_C0)
        divide.Perform(False)  # in the same context: neighbors get the same new vertices
    faces: list[CadFace] = []
    for face in model.faces:
        pieces = faces_of(context.Apply(face.shape))
        faces += [replace(face, shape=piece) for piece in pieces or [face.shape]]
    return replace(model, faces=tuple(faces)), len(kinked)


def _has_kink(face: Occ) -> bool:
    """Whether the normal of a face jumps along one of its knots."""
    surface, adaptor = FaceSurface(face), BRepAdaptor_Surface(face)
    if not surface.kinked:
        return False
    for column, count, fill in (
        (0, adaptor.NbUIntervals, adaptor.UIntervals),
        (1, adaptor.NbVIntervals, adaptor.VIntervals),
    ):
        number = count(GeomAbs_C1)
        found = Array1_double(1, number + 1)
        fill(found, GeomAbs_C1)
        reach = ACROSS * (surface.high - surface.low)[column]
        for knot in (found.Value(k) for k in range(2, number + 1)):
            before, after = (_normals(surface, column, knot + sign * reach) for sign in (-1, 1))
            defined = before.any(axis=1) & after.any(axis=1)
            along = np.einsum("ij,ij->i", before, after)
            if (defined & (along < np.cos(TANGENT_ANGLE))).any():
                return True
    return False


def _normals(surface: FaceSurface, column: int, value: float) -> Array:
    """Return the normals along the line where the parameter of `column` has a value."""
    other = 1 - column
    uv = np.empty((PLACES, 2))
    uv[:, column] = value
    uv[:, other] = np.linspace(surface.low[other], surface.high[other], PLACES)
    return surface.nodes(uv)[1]


CHORD_ERROR = 1e-3
"""Share of the box diagonal that the elements may be off the exact surface, unless stated."""


@dataclass(frozen=True)
class CadSurface:
    """The tessellated faces of a CAD file.

    Attributes
    ----------
    model : the faces, those that have a kink divided
    size : box diagonal [units of the model]
    unit : the unit taken
    sewn : how borders were joined
    found : the triangles
    stated : chord error asked for [units of the model]
    """

    model: CadModel
    size: float
    unit: str
    sewn: Sewn
    found: Tessellation
    stated: float

    @property
    def factor(self) -> float:
        """Meters per unit of the file."""
        return self.model.unit.meters

    def notes(self) -> tuple[str, ...]:
        """Sentences about what was read and how near it was met."""
        model, sewn, found, meters = self.model, self.sewn, self.found, self.model.meters
        count = len(model.faces)
        notes = [
            *model.notes,
            f"{counted(count, 'CAD face')}, tolerance of the file {model.tolerance * meters:.3g} m",
        ]
        if sewn.tolerance > 0.0:
            notes.append(
                f"borders of faces joined within {sewn.tolerance * meters:.3g} m: open edges of "
                f"the faces {sewn.before} before, {sewn.after} after"
            )
        notes += [
            f"face '{face.name}' could not be given triangles: it is missing"
            for face, mesh in zip(model.faces, found.meshes, strict=True)
            if mesh is None
        ]
        held = (
            "held"
            if found.error <= self.stated
            else f"not held, by a factor {found.error / self.stated:.3g}; finer elements bring no "
            "less, the faces do not meet more exactly"
        )
        return (
            *notes,
            f"chord error {self.stated * meters:.3g} m stated, {found.error * meters:.3g} m "
            f"measured ({found.interior * meters:.3g} m from the surfaces, "
            f"{found.border * meters:.3g} m from their borders): {held}",
        )

    def polygons(self) -> RawSurface:
        """Triangles of all faces side by side [m], outer sides out; each face has its own points.

        Polygons of one face follow each other, in the order of its triangles.
        """
        points, corners, normals, faces = [], [], [], []
        count = 0
        for row, mesh in enumerate(self.found.meshes):
            if mesh is None:
                continue
            turn = (0, 2, 1) if mesh.reversed else (0, 1, 2)
            points.append(mesh.points)
            corners.append(mesh.triangles[:, turn] + count)
            normals.append(mesh.corner_normals()[:, turn])
            faces.append(np.full(len(mesh.triangles), row, np.int32))
            count += len(mesh.points)
        triangles = np.concatenate(corners)
        meshes, of_face = self.found.meshes, np.concatenate(faces)
        shapes = np.array([NO_SHAPE if mesh is None else mesh.surface.shape() for mesh in meshes])
        return RawSurface(
            vertices=np.concatenate(points) * self.model.meters,
            offsets=3 * np.arange(len(triangles) + 1, dtype=np.int64),
            corners=triangles.ravel().astype(np.int32),
            normals=np.concatenate(normals).reshape(-1, 3),
            faces=of_face,
            face_names=tuple(face.name for face in self.model.faces),
            face_shapes=moved_shapes(shapes, self.model.meters, np.eye(3), np.zeros(3)),
            solids=np.array(self.model.solids, np.int32)[of_face],
            missing_faces=self.model.missing + meshes.count(None),
        )


def load_cad(path: Path, unit: str | None, options: CadOptions) -> CadSurface:
    """Read, sew and tessellate a CAD file.

    Raises
    ------
    ShellFileError, InvalidShell
        If the file is damaged, or no surface can be made of what it holds.
    UnitMissing
        If `unit` is not stated where the file has none.
    InvalidParameter, NameNotFound
        If an option is out of range, or names a body or face that is not there.
    """
    model = read_model(path).selected(options.bodies, options.faces)
    size = box_size(model.shape)
    held, taken, note = take_unit(path, model.unit, unit, size)
    notes = (*model.notes, note) if note else model.notes
    model = replace(model, unit=held, notes=notes)
    model, kinked = without_kinks(model)
    if kinked:
        note = f"{kinked} of the faces with a kink inside, divided along it"
        model = replace(model, notes=(*model.notes, note))
    chord_error = options.chord_error
    stated = size * CHORD_ERROR if chord_error is None else chord_error / model.meters
    sewn = sew(model, size, None if options.sew is None else options.sew / model.meters)
    found = tessellate(sewn.faces, size, stated, model.meters)
    return CadSurface(model, size, taken, sewn, found, stated)
