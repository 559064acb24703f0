"""Faces with a kink inside: divided along it, so that each piece is smooth."""

from dataclasses import replace

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.collections import Array1_double
from OCP.GeomAbs import GeomAbs_C0, GeomAbs_C1
from OCP.ShapeBuild import ShapeBuild_ReShape
from OCP.ShapeUpgrade import ShapeUpgrade_ShapeDivideContinuity

from sphshell_pin.base.arrays import Array
from sphshell_pin.shell.cad.face_surface import FaceSurface
from sphshell_pin.shell.cad.model import CadFace, CadModel, faces_of
from sphshell_pin.shell.cad.options import Occ
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
