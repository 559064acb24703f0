"""Tessellation of trimmed faces within a stated chord error, which is measured."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
from OCP.BRepGProp import BRepGProp
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
from OCP.GeomAbs import GeomAbs_Plane
from OCP.GProp import GProp_GProps
from OCP.IMeshTools import IMeshTools_Parameters
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS

from sphshell_pin.base.arrays import Ints, Longs
from sphshell_pin.errors import InvalidParameter, InvalidShell
from sphshell_pin.shell.cad.face_mesh import FaceMesh, count_laid, take_mesh
from sphshell_pin.shell.cad.model import CadModel, compound, count_open_edges
from sphshell_pin.shell.cad.options import Occ

ANGLE = 0.35
"""Neighboring elements on a face turn by about this at most [rad]: less than the crease angle."""

MARGIN = 0.95
"""Between the points measured the distance may be a little larger."""

MOST_TRIANGLES = 2_000_000
"""More are refused: they would take minutes and gigabytes."""

REFINED = 3.0
"""Real files take one to four times as many triangles as the bend of a coarse mesh asks for."""

MOST_TRIES, MOST_ROUNDS = 4, 6
"""Times to mesh anew, more finely; times to halve the sides inside a face."""

FINER = 0.4
"""Where a face has no triangles the next mesh is so much finer."""

SEWING_TOLERANCES = (1e-6, 1e-5, 1e-4)
"""Shares of the size within which the borders of faces are joined, if that joins more of them."""


@dataclass(frozen=True)
class Tessellation:
    """The triangles of the faces of a model.

    Attributes
    ----------
    meshes : one per face, None where OpenCASCADE finds no triangles
    interior, border : largest distance measured from the surfaces, and from their borders [units
        of the model]
    """

    meshes: tuple[FaceMesh | None, ...]
    interior: float
    border: float

    @property
    def error(self) -> float:
        """The larger of the two."""
        return max(self.interior, self.border)

    @property
    def count(self) -> int:
        """Number of triangles."""
        return int(self.starts[-1])

    @cached_property
    def starts(self) -> Longs:
        """(f + 1,) triangle with which each face begins, if all stand side by side."""
        return np.cumsum([0, *(0 if mesh is None else len(mesh.triangles) for mesh in self.meshes)])

    def face_of(self, triangles: Ints | Longs) -> Longs:
        """(n,) face of each of the `triangles` (n,)."""
        return np.searchsorted(self.starts, triangles, side="right") - 1

    def by_face(self, triangles: Ints | Longs) -> Iterator[tuple[int, FaceMesh, Longs]]:
        """Yield each face of `triangles` (n,), its mesh, and the rows (k,) of `triangles` on it."""
        faces = self.face_of(triangles)
        order = np.argsort(faces, kind="stable")
        for own in np.split(order, np.flatnonzero(np.diff(faces[order])) + 1):
            if len(own):
                mesh = self.meshes[face := int(faces[own[0]])]
                assert mesh is not None  # it has triangles
                yield face, mesh, own


@dataclass(frozen=True)
class Sewn:
    """Faces of a model with their borders joined.

    The `faces` in the order of the model, the `tolerance` taken (0 for none) [units of the model],
    open edges of the faces `before` and `after`.
    """

    faces: tuple[Occ, ...]
    tolerance: float
    before: int
    after: int


def sew(model: CadModel, size: float, tolerance: float | None) -> Sewn:
    """Join faces whose borders lie side by side without being shared.

    size : of the model; tolerance : how far they may be apart, 0 leaves all as it is, and None
    takes the smallest of a few that joins the most [units of the model]
    """
    shape = model.shape
    faces = tuple(face.shape for face in model.faces)
    before = count_open_edges(shape)
    best = Sewn(faces, 0.0, before, before)
    if before == 0 or len(faces) < 2:
        return best
    ladder = [share * size for share in SEWING_TOLERANCES] if tolerance is None else [tolerance]
    for step in ladder:
        if step == 0.0 or best.after == 0:
            break
        sewing = BRepBuilderAPI_Sewing(step)
        sewing.Add(shape)
        sewing.Perform()
        joined = sewing.SewedShape()
        if joined.IsNull():
            continue
        after = count_open_edges(joined)
        # The faces of the sewn shape, which may have reversed them.
        found = ShapeMap()
        TopExp.MapShapes_s(joined, TopAbs_FACE, found)
        rows = [found.FindIndex(sewing.ModifiedSubShape(face)) for face in faces]
        if after < best.after and 0 not in rows:
            images = tuple(TopoDS.Face(found.FindKey(row)) for row in rows)
            best = Sewn(images, step, before, after)
    return best


def tessellate(
    faces: tuple[Occ, ...], size: float, chord_error: float, meters: float
) -> Tessellation:
    """Tessellate faces; refine until they are as near as asked, or no nearer.

    size : the diagonal of all; chord_error : largest distance [their units]; meters : per unit

    Raises
    ------
    InvalidParameter
        If so small a chord error would take millions of triangles.
    InvalidShell
        If no face can be given triangles.
    """
    _check_count(faces, size, chord_error, meters)
    target = MARGIN * chord_error
    deflection = target
    best: Tessellation | None = None
    incomplete: list[tuple[int, float]] = []  # faces without triangles, and the deflection
    for _ in range(MOST_TRIES):
        _lay(faces, deflection)
        missing = _missing(faces, target)
        if missing:
            incomplete.append((missing, deflection))
            if sum(map(count_laid, faces)) > MOST_TRIANGLES // 4:
                break
            deflection *= FINER
            continue
        found = _measure(faces, target)
        stuck = best is not None and found.error > 0.8 * best.error
        if best is None or found.error < MARGIN * best.error:
            best = found
        if best.error <= target or stuck or found.count > MOST_TRIANGLES // 4:
            break
        deflection *= min(max(0.8 * target / found.error, 0.2), 0.7)
    if best is None:
        _lay(faces, min(incomplete)[1])
        best = _measure(faces, target)
    if best.count == 0:
        raise InvalidShell("no face of the model can be given triangles: check it in its CAD")
    return best


def _lay(faces: tuple[Occ, ...], deflection: float) -> None:
    parameters = IMeshTools_Parameters()
    parameters.Deflection = parameters.DeflectionInterior = deflection
    parameters.Angle = parameters.AngleInterior = ANGLE
    # Without it, splines are only measured along their isolines.
    parameters.ControlSurfaceDeflection = True
    BRepTools.Clean_s(compound(faces))
    flat = [BRepAdaptor_Surface(face).GetType() == GeomAbs_Plane for face in faces]
    # Planes need no nodes inside, and are laid several times as fast without: after the others,
    # whose nodes along common edges they take.
    for on_plane in (False, True):
        held = [face for face, one in zip(faces, flat, strict=True) if one is on_plane]
        parameters.InternalVerticesMode = not on_plane
        if held:
            BRepMesh_IncrementalMesh(compound(held), parameters)


def _measure(faces: tuple[Occ, ...], target: float) -> Tessellation:
    meshes = _meet([take_mesh(face) for face in faces])
    interior = border = 0.0
    for k, mesh in enumerate(meshes):
        if mesh is not None:
            border = max(border, mesh.border_error(target))
            meshes[k], error = mesh.refined(target, MOST_ROUNDS)
            interior = max(interior, error)
    return Tessellation(tuple(meshes), interior, border)


def _missing(faces: tuple[Occ, ...], target: float) -> int:
    """Count faces that should have triangles: OpenCASCADE finds some only for a finer mesh."""
    count = 0
    for face in faces:
        if count_laid(face) == 0:
            properties = GProp_GProps()
            BRepGProp.SurfaceProperties_s(face, properties)
            count += abs(properties.Mass()) > target**2
    return count


def _meet(meshes: list[FaceMesh | None]) -> list[FaceMesh | None]:
    """Put nodes that faces share in the middle of where their surfaces have them.

    OpenCASCADE puts them on the curve of the edge, which in files of loose tolerance leaves the
    surfaces so far that the triangles there fold over.
    """
    there = [mesh for mesh in meshes if mesh is not None]
    nodes = [mesh.border_nodes for mesh in there]
    if not sum(map(len, nodes)):
        return meshes
    shared = np.concatenate([mesh.points[rows] for mesh, rows in zip(there, nodes, strict=True)])
    exact = np.concatenate([mesh.exact[rows] for mesh, rows in zip(there, nodes, strict=True)])
    # Faces have the points of an edge in common, to the last bit.
    _, place, count = np.unique(shared, axis=0, return_inverse=True, return_counts=True)
    place = place.ravel()
    middle = np.zeros((len(count), 3))
    np.add.at(middle, place, exact)
    middle = (middle / count[:, None])[place]
    moved: list[FaceMesh | None] = []
    start = 0
    for mesh in meshes:
        if mesh is None:
            moved.append(mesh)
            continue
        rows = mesh.border_nodes
        points = mesh.points.copy()
        points[rows] = middle[start : start + len(rows)]
        moved.append(replace(mesh, points=points))
        start += len(rows)
    return moved


def _check_count(faces: tuple[Occ, ...], size: float, chord_error: float, meters: float) -> None:
    """Refuse what would take too many triangles, judged by how a coarse mesh bends."""
    coarse = 2e-3 * size
    if chord_error >= coarse / 8:
        return
    _lay(faces, coarse)
    meshes = [mesh for mesh in map(take_mesh, faces) if mesh is not None]
    expected = sum(_expected(mesh, chord_error) for mesh in meshes)
    if expected <= MOST_TRIANGLES:
        return
    enough = chord_error
    while sum(_expected(mesh, enough) for mesh in meshes) > MOST_TRIANGLES:
        enough *= 1.1
    raise InvalidParameter(
        "chord_error",
        float(f"{chord_error * meters:.6g}"),
        f"would take about {expected:.2g} triangles, more than {MOST_TRIANGLES:.0e}: take at "
        f"least {enough * meters:.2g} [m]",
    )


def _expected(mesh: FaceMesh, chord_error: float) -> float:
    """Triangles into which those of a coarse mesh would have to be cut.

    A side of length l along which the normal turns by an angle a is off by l a / 8. One that
    bends in a single direction, as on a cylinder, is cut across that alone.
    """
    ends = mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]]
    length = np.linalg.norm(np.diff(mesh.points[ends], axis=2)[:, :, 0], axis=2)
    turn = np.linalg.norm(np.diff(mesh.normals[ends], axis=2)[:, :, 0], axis=2)
    parts = np.maximum(1.0, np.sqrt(length * turn / (8.0 * chord_error)))
    return float(REFINED * (parts.max(axis=1) * parts.min(axis=1)).sum())
