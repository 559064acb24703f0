"""Triangles of a solid's faces as OpenCASCADE meshes them, with what CAD knows of each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools

from sphshell_pin.base.arrays import Array
from sphshell_pin.shell import raw
from sphshell_pin.shell.cad.face_mesh import FaceMesh, take_mesh
from tests.parts.occ import OccFailed, Solid, faces

Ints = NDArray[np.int64]

MM = 1e-3
"""Parts are in millimeters, shells in meters."""

KINDS = (*raw.KINDS, "spline")
"""Of the surfaces below faces; all that is none of the first five counts as the last."""

MOST_TRIANGLES = 30_000


@dataclass(frozen=True)
class Face:
    """One CAD face: its `shape`, its `kind`, and the triangles `mesh` that are laid on it."""

    shape: Solid
    kind: str
    mesh: FaceMesh


@dataclass(frozen=True)
class CadMesh:
    """The triangles of all faces, welded [mm].

    Attributes
    ----------
    vertices : (n, 3); triangles : (t, 3), outer sides out
    face : (t,) row of the CAD face; kind : (t,) row in KINDS of its surface
    normals : (t, 3, 3) exact ones of the CAD faces at the corners
    """

    vertices: Array
    triangles: Ints
    face: Ints
    kind: Ints
    normals: Array

    @property
    def size(self) -> float:
        """Diagonal of the box."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    @property
    def areas(self) -> Array:
        doubled = raw.area_vectors(self.vertices[self.triangles])
        return np.asarray(np.linalg.norm(doubled, axis=1) / 2)


def meshed_faces(solid: Solid, deflection: float, angle: float) -> list[Face]:
    """Mesh a solid [mm, rad]; OpenCASCADE's deflection is no guarantee.

    Raises
    ------
    OccFailed
        If a face gets no triangles.
    """
    BRepTools.Clean_s(solid)
    BRepMesh_IncrementalMesh(solid, deflection, False, angle, False)
    found = []
    for shape in faces(solid):
        mesh = take_mesh(shape)
        if mesh is None:
            raise OccFailed("a face without triangles")
        # OpenCASCADE numbers the kinds of surfaces in this order.
        number = int(BRepAdaptor_Surface(shape).GetType())
        found.append(Face(shape, KINDS[min(number, len(KINDS) - 1)], mesh))
    return found


def coarse_enough(solid: Solid, deflection: float, angle: float) -> tuple[list[Face], float]:
    """Mesh with the deflection stated, or the first larger one of few enough triangles."""
    while True:
        found = meshed_faces(solid, deflection, angle)
        if sum(len(face.mesh.triangles) for face in found) <= MOST_TRIANGLES:
            return found, deflection
        deflection, angle = 2 * deflection, min(1.4 * angle, 0.6)


def joined(found: list[Face]) -> CadMesh:
    """Weld the triangles of faces; those that become lines are left out."""
    points = np.concatenate([face.mesh.points for face in found])
    size = np.linalg.norm(np.ptp(points, axis=0))
    cells = np.round(points / (1e-8 * size))
    _, first, place = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    starts = np.cumsum([0, *(len(face.mesh.points) for face in found)]).tolist()
    rows = [face.mesh.triangles[:, _turn(face)] + k for face, k in zip(found, starts, strict=False)]
    triangles = place.ravel()[np.concatenate(rows)]
    there = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    count = [len(face.mesh.triangles) for face in found]
    normals = np.concatenate([face.mesh.corner_normals()[:, _turn(face)] for face in found])
    return CadMesh(
        vertices=points[first],
        triangles=triangles[there],
        face=np.repeat(np.arange(len(found)), count)[there],
        kind=np.repeat([KINDS.index(face.kind) for face in found], count)[there],
        normals=normals[there],
    )


def _turn(face: Face) -> list[int]:
    return [0, 2, 1] if face.mesh.reversed else [0, 1, 2]
