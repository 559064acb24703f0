"""Distance to trimmed CAD faces, asked of OpenCASCADE's exact geometry: slow and obvious.

Every near face and edge is tried: Newton's method from several seeds on the surface, kept if the
foot lies inside the trimming, and along the edges, whose ends are the vertices. (OpenCASCADE's own
BRepExtrema misses the nearest point on real files.) Seeds are points of a tessellation made here.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.Extrema import Extrema_GenLocateExtPS
from OCP.gp import gp_Pnt, gp_Pnt2d
from OCP.IntTools import IntTools_FClass2d
from OCP.TopAbs import TopAbs_EDGE, TopAbs_OUT
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS
from scipy.optimize import minimize_scalar
from scipy.spatial import cKDTree

from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
from sphshell_pin.shell.cad.model import box_size
from sphshell_pin.shell.curvature import curved_mesh, points_at
from sphshell_pin.shell.raw import area_vectors, random_places
from tests.parts.occ import faces, parts

SEEDS, EDGE_SEEDS = 16, 6
"""How many of the nearest seeds are tried for each point, on faces and on edges."""

SPACING = 1 / 80
"""Distance of seeds from each other, at most, as a share of the size."""

EDGE_POINTS = 129


class ExactShape:
    """A shape, scaled by `meters` per unit, whose faces and edges can be asked for distances."""

    def __init__(self, shape: Any, meters: float = 1e-3, seed_share: float = 2e-3) -> None:
        copy = BRepBuilderAPI_Copy(shape, True, False).Shape()
        self.meters = meters
        self.faces, size = faces(copy), box_size(copy)
        BRepMesh_IncrementalMesh(copy, seed_share * size, False, 0.2, False)
        self.surfaces = [BRepAdaptor_Surface(face) for face in self.faces]
        self.inside = [IntTools_FClass2d(face, 1e-9) for face in self.faces]
        self._triangles = [_triangles(face) for face in self.faces]
        self._reach = 2 * SPACING * size
        self._seeds, self._uv = [], []
        for points, at, rows in self._triangles:
            weights, triangle = _spread(points[rows], SPACING * size)
            self._seeds.append(cKDTree(np.einsum("nk,nkx->nx", weights, points[rows[triangle]])))
            self._uv.append(np.einsum("nk,nkx->nx", weights, at[rows[triangle]]))
        self._curves: list[Any] = []
        places, edge_of, at_edge = [], [], []
        for face in self.faces:
            for edge in parts(face, TopAbs_EDGE):
                if BRep_Tool.Degenerated_s(TopoDS.Edge(edge)):
                    continue
                curve = BRepAdaptor_Curve(TopoDS.Edge(edge), face)
                at = np.linspace(curve.FirstParameter(), curve.LastParameter(), EDGE_POINTS)
                places.append(np.array([curve.Value(t).Coord() for t in at.tolist()]))
                edge_of.append(np.full(EDGE_POINTS, len(self._curves)))
                at_edge.append(at)
                self._curves.append(curve)
        self._edge_seeds = cKDTree(np.concatenate(places)) if places else None
        if places:
            self._edge_reach = max(np.linalg.norm(np.diff(p, axis=0), axis=1).max() for p in places)
            self._edge_of, self._at_edge = np.concatenate(edge_of), np.concatenate(at_edge)

    def distances(self, points: Array) -> Array:
        """Distances (n,) of points (n, 3) from the trimmed faces [m]."""
        places = np.asarray(points, float) / self.meters
        distance = np.full(len(places), np.inf)
        found = [tree.query(places, min(SEEDS, tree.n)) for tree in self._seeds]
        away = np.array([d.reshape(len(places), -1)[:, 0] for d, _ in found])
        near = [rows.reshape(len(places), -1) for _, rows in found]
        for k, point in enumerate(places):
            for face in np.argsort(away[:, k]):
                # No point of the face is farther than that from one of its seeds.
                if away[face, k] - self._reach > distance[k]:
                    break
                rows = near[face][k]
                for seed in rows[np.unique([0, 1, SEEDS // 2, SEEDS - 1]) % len(rows)]:
                    foot, uv = self._foot(int(face), self._uv[face][seed], point)
                    off = float(np.linalg.norm(foot - point))
                    if off < distance[k] and self._holds(int(face), uv):
                        distance[k] = off
        if self._edge_seeds is None:
            return distance * self.meters
        away, near = self._edge_seeds.query(places, min(EDGE_SEEDS, self._edge_seeds.n))
        for k in np.flatnonzero(away[:, 0] - self._edge_reach < distance):
            for edge in np.unique(self._edge_of[near[k]]):
                seed = near[k][np.argmax(self._edge_of[near[k]] == edge)]
                off = self._from_edge(int(edge), float(self._at_edge[seed]), places[k])
                distance[k] = min(distance[k], off)
        return distance * self.meters

    def samples(self, count: int, rng: np.random.Generator) -> Array:
        """Random points (n <= count, 3) of the trimmed faces [m], spread by area."""
        spans = [area_vectors(points[rows]) for points, _, rows in self._triangles]
        areas = [np.linalg.norm(one, axis=1) for one in spans]
        face = np.concatenate([np.full(len(area), k) for k, area in enumerate(areas)])
        row = np.concatenate([np.arange(len(area)) for area in areas])
        share = np.concatenate(areas)
        chosen = rng.choice(len(share), count, p=share / share.sum())
        found = []
        for pick, weights in zip(chosen, rng.dirichlet((1.0, 1.0, 1.0), count), strict=True):
            k = int(face[pick])
            _, uv, rows = self._triangles[k]
            at = weights @ uv[rows[row[pick]]]
            if self._holds(k, at):
                found.append(self.surfaces[k].Value(*at.tolist()).Coord())
        return np.array(found) * self.meters

    def _holds(self, face: int, uv: Array) -> bool:
        return bool(self.inside[face].Perform(gp_Pnt2d(*uv.tolist())) != TopAbs_OUT)

    def _foot(self, face: int, seed: Array, point: Array) -> tuple[Array, Array]:
        """Foot of a point on the untrimmed surface, by Newton's method; else the seed itself."""
        surface = self.surfaces[face]
        search = Extrema_GenLocateExtPS(surface, 1e-12, 1e-12)
        search.Perform(gp_Pnt(*point.tolist()), *seed.tolist(), False)
        at = np.array(search.Point().Parameter()) if search.IsDone() else seed
        return np.array(surface.Value(*at.tolist()).Coord()), at

    def _from_edge(self, edge: int, seed: float, point: Array) -> float:
        """Distance from the nearest point of an edge near a seed."""
        curve = self._curves[edge]
        low, high = curve.FirstParameter(), curve.LastParameter()
        reach = (high - low) / (EDGE_POINTS - 1)
        bounds = max(low, seed - reach), min(high, seed + reach)

        def away(t: float) -> float:
            offset = np.array(curve.Value(t).Coord()) - point
            return float(offset @ offset)

        found = minimize_scalar(away, bounds=bounds, options={"xatol": 1e-12 * (high - low)})
        return float(np.sqrt(found.fun))


@dataclass(frozen=True)
class Deviation:
    """Distances [m] between a shell and the exact shape.

    flat, smooth : of points of the flat and of the curved elements from the shape
    back : of points of the shape from the flat elements
    """

    flat: Array
    smooth: Array
    back: Array


def deviation(shell: Shell, exact: ExactShape, samples: int, seed: int = 0) -> Deviation:
    """Distances of random points of a shell from the exact shape, and the other way."""
    rng = np.random.default_rng(seed)
    corners = shell.vertices[shell.triangles]
    chosen, flat = random_places(corners, samples, rng)
    points, _, _ = curved_mesh(shell, 4)
    smooth = points.reshape(len(corners), -1, 3)
    smooth = smooth[chosen, rng.integers(0, smooth.shape[1], samples)]
    back = shell.closest_points(exact.samples(samples, rng), method="facets").distances
    return Deviation(exact.distances(flat), exact.distances(smooth), np.abs(back))


def curved_places(shell: Shell, count: int, seed: int = 0) -> dict[str, Array]:
    """Points (n, 3) [m] of the curved elements: on border sides of faces, on other sides, inside.

    Half of them where elements stand off the flat ones most, half anywhere; on sides at both
    extremes of an S and in the middle.
    """
    corners = shell.vertices[shell.triangles]
    face = np.asarray(shell.element_face)[shell.triangle_element]
    ends = np.stack([shell.triangles, np.roll(shell.triangles, -1, axis=1)], axis=2)
    keys = np.column_stack([np.sort(ends.reshape(-1, 2), axis=1), np.repeat(face, 3)])
    _, number, owners = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    border = (owners[number.ravel()] == 1).reshape(-1, 3)
    along = np.array([[1 - k, k, 0] for k in (5 / 24, 1 / 2, 19 / 24)])
    inside = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / [[3], [6], [6], [6]]
    weights = np.concatenate([*(np.roll(along, k, axis=1) for k in range(3)), inside])
    points = points_at(shell, np.arange(len(corners)), weights)
    off = np.linalg.norm(points - np.einsum("kc,tcx->tkx", weights, corners), axis=2)
    rng, found = np.random.default_rng(seed), {}
    for name in ("border", "sides", "inside"):
        if name == "inside":
            rows, columns = np.indices((len(corners), 4)).reshape(2, -1)
            columns = columns + 9
        else:
            triangle, side = np.nonzero(border if name == "border" else ~border)
            rows = triangle.repeat(3)
            columns = (3 * side[:, None] + np.arange(3)).ravel()
        some = rng.choice(len(rows), min(count - count // 2, len(rows)), replace=False)
        most = np.argsort(-off[rows, columns], kind="stable")[: count // 2]
        pick = np.concatenate([most, some])
        found[name] = points[rows[pick], columns[pick]]
    return found


def _triangles(face: Any) -> tuple[Array, Array, NDArray[np.int64]]:
    """Points and parameters of the nodes of a face, and its triangles."""
    location = TopLoc_Location()
    found = BRep_Tool.Triangulation_s(face, location)
    if found is None:
        return np.zeros((0, 3)), np.zeros((0, 2)), np.zeros((0, 3), np.int64)
    count = range(1, found.NbNodes() + 1)
    uv = np.array([found.UVNode(k).Coord() for k in count])
    surface = BRepAdaptor_Surface(face)
    points = np.array([surface.Value(*at).Coord() for at in uv.tolist()])
    rows = np.array([found.Triangle(k).Get() for k in range(1, found.NbTriangles() + 1)]) - 1
    return points, uv, rows


def _spread(corners: Array, spacing: float) -> tuple[Array, NDArray[np.int64]]:
    """Weights (n, 3) and triangle (n,) of a grid of points on each triangle."""
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    pieces = np.maximum(2, np.ceil(longest / spacing).astype(int))
    weights, triangle = [], []
    for number in np.unique(pieces):
        grid = [(i, j, number - i - j) for i in range(number + 1) for j in range(number + 1 - i)]
        own = np.flatnonzero(pieces == number)
        weights.append(np.tile(np.array(grid) / number, (len(own), 1)))
        triangle.append(np.repeat(own, len(grid)))
    return np.concatenate(weights), np.concatenate(triangle)
