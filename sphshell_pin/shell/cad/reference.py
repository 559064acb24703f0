"""Distances to the exact surfaces of a CAD file, and points on them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from OCP.gp import gp_Pnt2d
from OCP.IntTools import IntTools_FClass2d
from OCP.TopAbs import TopAbs_OUT

from sphshell_pin.shell.cad.options import CadOptions
from sphshell_pin.shell.cad.surface import CadSurface, load_cad
from sphshell_pin.shell.raw import Floats, Ints
from sphshell_pin.shell.shell import Shell

TRIMMING = 1e-9
"""Points nearer to the border than this, in parameters, are inside."""

BETWEEN = 1.1
"""Between the points measured the tessellation may be that many times farther off."""

SETTLED = 1e-9
"""Nearer to a surface than this share of the size, no other is looked for."""


class ExactSurface:
    """The trimmed surfaces of a CAD file [m].

    A tessellation finds the face and the place near a point; Newton's method goes on to the foot
    on the exact surface. Where the foot is beyond the border of the face, the distance from the
    tessellation, less its own error, takes over.
    """

    def __init__(self, path: Path, unit: str | None, options: CadOptions) -> None:
        self._cad: CadSurface = load_cad(path, unit, options)
        self.model, self.unit = self._cad.whole, self._cad.unit
        self.notes = self._cad.notes()
        raw = self._cad.polygons()
        self._shell = Shell(raw.vertices, raw.corners.reshape(-1, 3), crease_angle=0.0)
        self._face = raw.faces if raw.faces is not None else np.zeros(0, np.int32)
        starts = np.searchsorted(self._face, np.arange(len(self._cad.found.meshes)))
        self._row = np.arange(len(self._face)) - starts[self._face]

    @property
    def count(self) -> tuple[int, str]:
        """How many CAD faces there are."""
        return len(self.model.faces), "CAD faces"

    @property
    def extent(self) -> tuple[float, float]:
        """Box diagonal [m] and area [m^2] of the tessellation."""
        return self._shell.size, self._shell.health.area

    def shell(self) -> Shell:
        """Return the tessellation, with exact normals, cleaned."""
        raw = self._cad.polygons()
        elements = raw.corners.reshape(-1, 3)
        normals = None if raw.normals is None else raw.normals.reshape(-1, 3, 3)
        return Shell(raw.vertices, elements, normals, name=self.model.path.stem)

    def distances(self, points: Floats) -> Floats:
        """Distances (n,) of points (n, 3) [m]."""
        near = self._shell.closest_points(points, method="facets")
        triangle = self._shell.source_element[near.elements]
        feet = self._to_surface(points, triangle, near.points)
        error = BETWEEN * self._cad.found.error * self._cad.model.metres
        # Near a border the nearest face may not be that of the nearest triangle.
        doubtful = np.flatnonzero(feet > SETTLED * self._shell.size)
        for k in doubtful.tolist():
            radius = abs(near.distances[k]) + 2.0 * error
            touched = self._shell.contacts(points[k], radius, method="elements")
            rows = self._shell.source_element[touched.element]
            _, first = np.unique(self._face[rows], return_index=True)  # the nearest of each face
            place = np.repeat(points[k : k + 1], len(first), axis=0)
            other = self._to_surface(place, rows[first], touched.point[first])
            feet[k] = min(feet[k], *other)
        return np.maximum(feet, np.abs(near.distances) - error)

    def _to_surface(self, points: Floats, triangle: Ints, near: Floats) -> Floats:
        """Distances (n,) of points from the surfaces below triangles, next to points `near`."""
        metres = self._cad.model.metres
        found = np.full(len(points), np.inf)
        for face in np.unique(self._face[triangle]):
            mesh = self._cad.found.meshes[face]
            if mesh is None:
                continue
            chosen = self._face[triangle] == face
            rows = mesh.triangles[self._row[triangle[chosen]]]
            weights = corner_weights(mesh.points[rows], near[chosen] / metres)
            uv = np.einsum("nk,nkx->nx", weights, mesh.parameters(rows))
            step = 1e-12 * self._cad.size
            found[chosen] = mesh.surface.distances(points[chosen] / metres, uv, step) * metres
        return found

    def samples(self, count: int, rng: np.random.Generator) -> Floats:
        """Random points (n <= count, 3) of the exact surfaces, spread by area [m]."""
        meshes = [(k, mesh) for k, mesh in enumerate(self._cad.found.meshes) if mesh is not None]
        areas = [_areas(mesh.points[mesh.triangles]) for _, mesh in meshes]
        share = np.concatenate(areas)
        owner = np.repeat(np.arange(len(meshes)), [len(area) for area in areas])
        starts = np.cumsum([0, *(len(area) for area in areas)])
        chosen = rng.choice(len(share), count, p=share / share.sum())
        weights = rng.dirichlet((1.0, 1.0, 1.0), count)
        points = []
        for row, (face, mesh) in enumerate(meshes):
            own = owner[chosen] == row
            corners = mesh.triangles[chosen[own] - starts[row]]
            uv = np.einsum("nk,nkx->nx", weights[own], mesh.parameters(corners))
            # Along a hollow border the triangles reach beyond the face.
            inside = IntTools_FClass2d(self._cad.sewn.faces[face], TRIMMING)
            within = [inside.Perform(gp_Pnt2d(u, v)) != TopAbs_OUT for u, v in uv.tolist()]
            points.append(mesh.surface.nodes(uv[np.array(within, np.bool_)])[0])
        return np.concatenate(points) * self._cad.model.metres


def _areas(corners: Floats) -> Floats:
    spans = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(0.5 * np.linalg.norm(spans, axis=1))


def corner_weights(corners: Floats, points: Floats) -> Floats:
    """Barycentric weights (n, 3) of points in the planes of their triangles (n, 3, 3)."""
    spans = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    square = np.maximum(np.einsum("nx,nx->n", spans, spans), np.finfo(float).tiny)
    offset = points - corners[:, 0]
    second = np.einsum("nx,nx->n", np.cross(offset, corners[:, 2] - corners[:, 0]), spans) / square
    third = np.einsum("nx,nx->n", np.cross(corners[:, 1] - corners[:, 0], offset), spans) / square
    weights = np.clip(np.stack([1.0 - second - third, second, third], axis=1), 0.0, 1.0)
    return np.asarray(weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-12))
