"""Places beside a solid whose distances are exact, and spheres that touch one plane of it.

A place is a point of a face, taken at parameters inside its trimming and offset along the exact
normal: its distance from that point is known. That no other point is nearer is checked with a finer
mesh, whose own error is measured: the surface below every face that comes nearly as near is
projected on, and a place is dropped if one is nearer, within the face or not.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepLProp import BRepLProp_SLProps
from OCP.gp import gp_Pnt2d
from OCP.IntTools import IntTools_FClass2d
from OCP.TopAbs import TopAbs_IN

from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
from sphshell_pin.shell.cad.face_mesh import FaceMesh
from sphshell_pin.shell.cad.tessellation import Tessellation
from tests.parts.cad_mesh import KINDS, CadMesh, Ints, area_vectors, joined, meshed_faces
from tests.parts.occ import OccFailed, Rng, Solid

FINE, FINE_ANGLE = 2e-4, 0.2
"""Deflection of the finer mesh, over the size; its angle [rad]."""

OFFSETS = 2e-3, 1e-2
"""Of places from the surface, over the size."""

LEAST_OFFSET = 5e-4
"""Where the surface is so bent that a place has to be nearer, it is left out."""

BEND = 0.4
"""A place is nearer than that share of the smaller radius of curvature."""

EXACT = 1e-6
"""Relative difference of two distances that are the same."""

RADII = 0.05, 0.02, 0.01, 0.005
"""Of spheres, over the size; the largest that touches nothing but its plane is taken."""

DEPTHS = 2e-5, 1e-4
"""Of spheres in planes, over the size."""


@dataclass(frozen=True)
class Places:
    """Points (n, 3) outside the solid and their exact distances (n,) [mm].

    `kinds` (n,) rows in KINDS of the faces they are beside, and how many were dropped.
    """

    points: Array
    distances: Array
    kinds: Ints
    dropped: int


@dataclass(frozen=True)
class Touches:
    """Spheres that touch one planar face: centers (n, 3), radii (n,), exact depths (n,) [mm]."""

    centers: Array
    radii: Array
    depths: Array


class ExactFaces:
    """The faces of a solid with their finer mesh [mm]."""

    def __init__(self, solid: Solid) -> None:
        coarse = joined(meshed_faces(solid, 1.0, 0.5)).size
        self.faces = meshed_faces(solid, FINE * coarse, FINE_ANGLE)
        self.mesh: CadMesh = joined(self.faces)
        self.size = self.mesh.size
        # Every face has its own points: nothing is repaired, so no triangle loses its face.
        self._found = Tessellation(tuple(face.mesh for face in self.faces), 0.0, 0.0)
        corners = np.concatenate([face.mesh.points[face.mesh.triangles] for face in self.faces])
        rows = np.arange(3 * len(corners)).reshape(-1, 3)
        # In meters for the shell, which only has to find what is near.
        self._shell = Shell(corners.reshape(-1, 3), rows, crease_angle=0.0)
        self.error = 0.0
        self._trimming = cache(lambda k: IntTools_FClass2d(self.faces[k].shape, 1e-9))
        self._adaptor = cache(lambda k: BRepAdaptor_Surface(self.faces[k].shape))

    def places(self, count: int, rng: Rng) -> Places:
        """Return up to `count` places beside faces of all sizes."""
        rows, owners = [], []
        for k in self._faces_at_random(count, rng).tolist():
            if (found := self._beside(k, rng)) is not None:
                rows.append(found)
                owners.append(KINDS.index(self.faces[k].kind))
        if not rows:
            raise OccFailed("no place beside its faces")
        on, normal, offset = (np.array(column) for column in zip(*rows, strict=True))
        nearest = self._shell.closest_points(on, method="facets")
        self.error = 2.0 * float(np.abs(nearest.distances).max()) + 1e-9 * self.size
        points = on + offset[:, None] * normal
        kept = self._is_nearest(points, offset)
        return Places(points[kept], offset[kept], np.array(owners)[kept], int((~kept).sum()))

    def touches(self, count: int, rng: Rng, clear: float) -> Touches:
        """Return up to `count` spheres that touch a plane, each by more than `clear` nothing else.

        clear : largest distance of a mesh from the faces [mm]
        """
        planes = [k for k, face in enumerate(self.faces) if face.kind == "plane"]
        rows = []
        for k in rng.permutation(np.resize(planes, count)).tolist() if planes else []:
            at, normal = self._inside_plane(k, rng)
            depth = self.size * np.exp(rng.uniform(*np.log(DEPTHS)))
            for radius in self.size * np.array(RADII):
                center = at + (radius - depth) * normal
                near = self._nearest_of_faces(center, radius + clear + self.error)
                if near.keys() == {k}:
                    rows.append((center, radius, depth))
                    break
        columns = zip(*rows, strict=True) if rows else (np.zeros((0, 3)), np.zeros(0), np.zeros(0))
        return Touches(*(np.array(column) for column in columns))

    def _faces_at_random(self, count: int, rng: Rng) -> Ints:
        """Half by area, half the same number on every face."""
        area = np.bincount(self.mesh.face, self.mesh.areas, len(self.faces))
        return rng.choice(len(area), count, p=area / area.sum() / 2 + 0.5 / len(area))

    def _beside(self, k: int, rng: Rng) -> tuple[Array, Array, float] | None:
        """Return a random point of a face, the normal there and an offset that the bend allows."""
        mesh = self.faces[k].mesh
        row, weights = _anywhere(mesh, rng)
        uv = weights @ mesh.parameters(mesh.triangles[row : row + 1])[0]
        if self._trimming(k).Perform(gp_Pnt2d(*uv.tolist())) != TopAbs_IN:
            return None
        bend = BRepLProp_SLProps(self._adaptor(k), *uv.tolist(), 2, 1e-9)
        if not bend.IsNormalDefined() or not bend.IsCurvatureDefined():
            return None
        curvature = max(abs(bend.MaxCurvature()), abs(bend.MinCurvature()), 1e-300)
        offset = min(self.size * rng.uniform(*OFFSETS), BEND / curvature)
        if offset < LEAST_OFFSET * self.size:
            return None
        normal = np.array(bend.Normal().Coord()) * (-1.0 if mesh.reversed else 1.0)
        return np.array(bend.Value().Coord()), normal, offset

    def _inside_plane(self, k: int, rng: Rng) -> tuple[Array, Array]:
        mesh = self.faces[k].mesh
        row, weights = _anywhere(mesh, rng)
        return weights @ mesh.points[mesh.triangles[row]], mesh.corner_normals()[row, 0]

    def _is_nearest(self, points: Array, offset: Array) -> np.ndarray:
        """Whether no face is nearer to points (n, 3) than `offset` (n,)."""
        place, triangle, near = [], [], []
        for row, (point, radius) in enumerate(zip(points, offset, strict=True)):
            for one, at in self._nearest_of_faces(point, radius + self.error).values():
                place.append(row)
                triangle.append(one)
                near.append(at)
        rows = np.array(place)
        distance = np.full(len(rows), np.inf)
        for _, mesh, own, uv in self._found.locate(np.array(triangle), np.array(near)):
            distance[own] = mesh.surface.distances(points[rows[own]], uv, 1e-9 * self.size)
        nearest = np.full(len(points), np.inf)
        np.minimum.at(nearest, rows, distance)
        return np.asarray(np.abs(nearest - offset) <= EXACT * offset)

    def _nearest_of_faces(self, point: Array, radius: float) -> dict[int, tuple[int, Array]]:
        """Nearest triangle of each face within `radius` of a point, and its closest point."""
        touched = self._shell.contacts(point, radius, method="elements")
        triangles = self._shell.source_element[touched.element]
        # Contacts come deepest first: the first of each face is the nearest.
        faces, first = np.unique(self._found.face_of(triangles), return_index=True)
        return {
            int(k): (int(triangles[i]), touched.point[i]) for k, i in zip(faces, first, strict=True)
        }


def _anywhere(mesh: FaceMesh, rng: Rng) -> tuple[int, Array]:
    """Return a random triangle of a face, by area, and random weights (3,) of its corners."""
    areas = np.linalg.norm(area_vectors(mesh.points, mesh.triangles), axis=1)
    row = rng.choice(len(areas), p=areas / areas.sum())
    return int(row), rng.dirichlet((1.0, 1.0, 1.0))
