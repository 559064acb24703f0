"""The trimmed faces of a solid: closest points and local minima of the distance, for many spheres.

Faces are planes, cylinders, cones, spheres and tori with OpenCASCADE's own numbers, and closest
points closed forms; OpenCASCADE says whether one lies within the trimming. Edges that are neither
lines nor circles are approximations in files: from there Newton's method goes on to the curve on
which both faces are zero.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line
from OCP.TopAbs import TopAbs_EDGE, TopAbs_REVERSED
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS

from sphshell_pin.base.arrays import Array
from tests.joints.surfaces import Crossing, Surface, near_minima
from tests.parts.cad_mesh import Ints
from tests.parts.occ import Solid, faces

PERSISTENCE = 1e-5
"""A minimum that is deeper by less than that than a place on an edge counts little [radii]."""

BESIDE_EDGE = 2e-2
"""Beside an edge its own curve decides what is inside [mm]."""

SAMPLES = 129
STEPS = 12


@dataclass
class Edge:
    """An edge with the rows of its faces, and whether each is on the left of its direction."""

    curve: Any
    tolerance: float
    faces: list[int]
    left: list[bool]
    ends: tuple[int, int]
    crossing: Crossing | None = None

    @cached_property
    def span(self) -> tuple[float, float]:
        return self.curve.FirstParameter(), self.curve.LastParameter()

    @cached_property
    def grid(self) -> tuple[Array, Array]:
        at = np.linspace(*self.span, SAMPLES)
        return at, np.array([self.curve.Value(t).Coord() for t in at.tolist()])

    def at(self, parameters: Array) -> tuple[Array, Array]:
        """Points (n, 3) and unit tangents (n, 3)."""
        rows = [self.curve.DN(t, 1).Coord() for t in parameters.tolist()]
        points = np.array([self.curve.Value(t).Coord() for t in parameters.tolist()])
        tangents = np.array(rows)
        return points, tangents / np.linalg.norm(tangents, axis=1)[:, None]

    def near(self, points: Array, reach: Any) -> Ints:
        """Rows of points (n, 3) from which a place of the edge may be in reach."""
        away = np.linalg.norm(points[:, None] - self.grid[1], axis=2).min(axis=1)
        step = np.linalg.norm(np.diff(self.grid[1], axis=0), axis=1).max()
        return np.flatnonzero(away < reach + step)

    def closest(self, centers: Array) -> tuple[Ints, Array, Array]:
        """Local minima of the distance of centers (n, 3): rows, parameters, and whether inside."""
        low, high = self.span
        kind, rows = self.curve.GetType(), np.arange(len(centers))
        if kind == GeomAbs_Line:
            line = self.curve.Line()
            at = (centers - line.Location().Coord()) @ np.array(line.Direction().Coord())
        elif kind == GeomAbs_Circle:
            frame = self.curve.Circle().Position()
            away = centers - frame.Location().Coord()
            x, y = (np.array(one().Coord()) for one in (frame.XDirection, frame.YDirection))
            at = low + np.mod(np.arctan2(away @ y, away @ x) - low, 2 * np.pi)
        else:
            grid, points = self.grid
            rows, near = near_minima(centers, points, self.closed)
            pairs = zip(rows.tolist(), grid[near].tolist(), strict=True)
            at = np.array([self._newton(centers[row], t) for row, t in pairs])
        # Round a closed edge there is no end.
        within = (at > low) & (at < high) | self.closed
        return rows, np.clip(at, low, high), within

    @property
    def closed(self) -> bool:
        return self.ends[0] == self.ends[1]

    def _newton(self, center: Array, at: float) -> float:
        step = (self.span[1] - self.span[0]) / (SAMPLES - 1)
        low, high = at - step, at + step
        for _ in range(STEPS):
            away = np.array(self.curve.Value(at).Coord()) - center
            one, two = (np.array(self.curve.DN(at, k).Coord()) for k in (1, 2))
            bend = one @ one + away @ two
            move = -(away @ one) / (bend if bend > 0 else one @ one)
            at = float(np.clip(at + move, low, high))
            if self.closed:
                begin, end = self.span
                wrapped = begin + (at - begin) % (end - begin)
                low, high, at = low + wrapped - at, high + wrapped - at, wrapped
            if abs(move) < 1e-15:
                break
        return at


@dataclass(frozen=True)
class Minima:
    """Local minima of the distance from one center, with depths above zero.

    `sure` says which are so beyond rounding: not within rounding of a border or of another one.
    `off` is how far the file's curve of an edge, or a vertex, is off its faces, at most: that of a
    minimum, or of a line or circle that the sphere reaches; or how far the ends of edges are apart,
    or off their faces, at a vertex next to which a minimum is.
    """

    points: Array
    depths: Array
    sure: Array
    plane: Array
    off: float


class TrimmedSolid:
    """The faces, edges and vertices of a solid [mm]."""

    def __init__(self, solid: Solid) -> None:
        found = faces(solid)
        self.surfaces = [Surface(face) for face in found]
        self.edges: list[Edge] = []
        self.seams: list[tuple[int, Any]] = []
        shapes: list[Any] = []
        places: list[Any] = []
        for row, surface in enumerate(self.surfaces):
            explorer = TopExp_Explorer(surface.face, TopAbs_EDGE)
            own = []
            while explorer.More():
                own.append(TopoDS.Edge(explorer.Current()))
                explorer.Next()
            for edge in own:
                if BRep_Tool.Degenerated_s(edge):
                    _number(places, TopExp.FirstVertex_s(edge))  # an apex or a pole
                    continue
                if sum(edge.IsSame(other) for other in own) > 1:
                    self.seams.append((row, BRepAdaptor_Curve(edge)))
                    continue
                known = _number(shapes, edge)
                if known == len(self.edges):
                    ends = (TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge))
                    numbers = [_number(places, vertex) for vertex in ends]
                    curve, tolerance = BRepAdaptor_Curve(edge), BRep_Tool.Tolerance_s(edge)
                    self.edges.append(Edge(curve, tolerance, [], [], (numbers[0], numbers[1])))
                self.edges[known].faces.append(row)
                self.edges[known].left.append(edge.Orientation() != TopAbs_REVERSED)
        for edge in self.edges:
            pair = [self.surfaces[k] for k in edge.faces]
            simple = edge.curve.GetType() in (GeomAbs_Line, GeomAbs_Circle)
            if not simple and len(pair) == 2 and all(one.kind for one in pair):
                along = edge.at(edge.grid[0])[1]
                most = 10 * edge.tolerance
                edge.crossing = Crossing.of(*pair, edge.grid[1], along, edge.closed, most)
        self.vertices = np.array([BRep_Tool.Pnt_s(one).Coord() for one in places]).reshape(-1, 3)
        drawn = np.concatenate([edge.grid[1] for edge in self.edges])
        self.size = float(np.linalg.norm(np.ptp(drawn, axis=0)))
        free = [one.samples(1.0) for one in self.surfaces if not one.kind]
        self.free = np.concatenate(free) if free else np.zeros((0, 3))

    def inward(self, edge: Edge, side: int, points: Array, tangents: Array) -> Array:
        """Unit directions (n, 3) from points of an edge into the face on a side of it."""
        _, normal = self.surfaces[edge.faces[side]].closest(points)
        into = np.cross(normal, tangents) * (1.0 if edge.left[side] else -1.0)
        return into / np.linalg.norm(into, axis=1)[:, None]

    def minima(self, centers: Array, radii: Array) -> list[Minima]:
        """Local minima of the distance of centers (n, 3) that are nearer than radii (n,)."""
        found: list[list[tuple[Array, float, bool, bool, float]]] = [[] for _ in centers]
        passes: list[list[tuple[float, float]]] = [[] for _ in centers]
        for number, surface in enumerate(self.surfaces):
            if surface.kind:
                self._on_face(number, centers, radii, found)
        for edge in self.edges:
            self._on_edge(edge, centers, radii, found, passes)
        self._on_vertices(centers, radii, found, passes)
        out = []
        for rows, saddles, r in zip(found, passes, radii.tolist(), strict=True):
            rows.sort(key=lambda one: -one[1])
            points = np.array([row[0] for row in rows]).reshape(-1, 3)
            depths = np.array([row[1] for row in rows], float)
            sure, plane = (np.array([row[k] for row in rows], bool) for k in (2, 3))
            if saddles and len(rows):
                # As deep as a place on an edge, or a corner: it ends there, or merges with another.
                apart = np.abs(depths[:, None] - np.array(saddles)[:, 0]).min(axis=1)
                sure &= (apart > PERSISTENCE * r) | (depths == depths.max())
            off = max([row[4] for row in rows] + [miss for _, miss in saddles], default=0.0)
            out.append(Minima(points, depths, sure, plane, off))
        return out

    def _on_face(self, number: int, centers: Array, radii: Array, found: Any) -> None:
        surface = self.surfaces[number]
        distance, normal = surface.closest(centers)
        points = centers - distance[:, None] * normal
        rows = np.flatnonzero(np.abs(distance) < radii)
        uv = surface.parameters(points[rows])
        states = np.array([surface.state(one) for one in uv], int)
        self._beside_edges(number, points[rows], states)
        for row, state in zip(rows.tolist(), states.tolist(), strict=True):
            if state >= 0:
                depth = radii[row] - abs(distance[row])
                found[row].append((points[row], depth, state > 0, surface.kind == "Plane", 0.0))

    def _beside_edges(self, number: int, points: Array, states: Ints) -> None:
        """Decide by the edges themselves about points (n, 3) of a face that are beside one.

        OpenCASCADE is off by up to 5e-3 mm beside edges whose parameter curves are splines.
        """
        nearest = np.full(len(points), np.inf)
        own = [edge for edge in self.edges if number in edge.faces]
        # It is off within the tolerance of any edge, also beside the end of another one.
        most = max([BESIDE_EDGE, *(10 * edge.tolerance for edge in own)])
        for edge in own if len(points) else []:
            rows = edge.near(points, most)
            if not len(rows):
                continue
            which, on, tangents, inside = self._nearest(edge, points[rows])
            rows = rows[which]
            away = points[rows] - on
            off = np.linalg.norm(away, axis=1)
            into = self.inward(edge, edge.faces.index(number), on, tangents)
            within = np.einsum("nx,nx->n", away, into)
            for k in np.flatnonzero((off < most) & (off < nearest[rows])).tolist():
                if off[k] < nearest[rows[k]]:
                    nearest[rows[k]] = off[k]
                    # At an end of the edge it is another one that decides.
                    if inside[k]:
                        states[rows[k]] = 0 if abs(within[k]) < 1e-9 else np.sign(within[k])

    def _on_edge(self, edge: Edge, centers: Array, radii: Array, found: Any, passes: Any) -> None:
        rows = edge.near(centers, radii)
        if not len(rows):
            return
        which, points, tangents, inside = self._nearest(edge, centers[rows])
        rows, points, tangents = rows[which][inside], points[inside], tangents[inside]
        if not len(rows):
            return
        away = points - centers[rows]
        distance = np.linalg.norm(away, axis=1)
        known = [self.surfaces[k] for k in edge.faces if self.surfaces[k].kind]
        offs = [surface.closest(points)[0] for surface in known]
        # Into both faces the distance grows.
        rise = [
            np.einsum("nx,nx->n", away, self.inward(edge, k, points, tangents)) / distance
            for k in range(len(edge.faces))
            if self.surfaces[edge.faces[k]].kind
        ]
        least = np.min(rise, axis=0) if rise else np.full(len(rows), -1.0)
        simple = edge.curve.GetType() in (GeomAbs_Line, GeomAbs_Circle)
        for k, row in enumerate(rows.tolist()):
            off = max((float(abs(d[k])) for d in offs), default=0.0)
            # Where the faces cross may be nearer by that than the file's line or circle.
            if distance[k] < radii[row] + (off if simple else 0.0):
                passes[row].append((radii[row] - distance[k], off if simple else 0.0))
                if distance[k] < radii[row] and least[k] > -1e-6:
                    depth, sure = radii[row] - distance[k], bool(least[k] > 1e-6)
                    found[row].append((points[k], depth, sure, False, off))

    def _nearest(self, edge: Edge, centers: Array) -> tuple[Ints, Array, Array, Array]:
        """Rows of centers, the closest points of an edge, tangents, and whether inside it."""
        if edge.crossing is not None:
            return edge.crossing.closest(centers)
        rows, at, inside = edge.closest(centers)
        points, tangents = edge.at(at)
        return rows, points, tangents, inside

    def _on_vertices(self, centers: Array, radii: Array, found: Any, passes: Any) -> None:
        leave: list[list[Array]] = [[] for _ in self.vertices]
        off, spread = np.zeros((2, len(self.vertices)))
        for edge in self.edges:
            for t, end, sign in zip(edge.span, edge.ends, (1.0, -1.0), strict=True):
                at, along = edge.at(np.array([t]))
                leave[end].append(sign * along[0])
                apart = np.linalg.norm(at[0] - self.vertices[end])
                spread[end] = max(spread[end], float(apart))
                for surface in (self.surfaces[k] for k in edge.faces if self.surfaces[k].kind):
                    miss = surface.closest(self.vertices[[end]])[0]
                    off[end] = max(off[end], abs(float(miss[0])))
        for k, (vertex, ways) in enumerate(zip(self.vertices, leave, strict=True)):
            away = vertex - centers
            distance = np.linalg.norm(away, axis=1)
            for row in np.flatnonzero(distance < radii).tolist():
                rise = np.array(ways).reshape(-1, 3) @ away[row] / distance[row]
                depth = radii[row] - distance[row]
                passes[row].append((depth, 0.0))
                if rise.min(initial=0.0) > -1e-6:
                    # Between two edges the distance may fall where they turn by more than half.
                    found[row].append((vertex, depth, False, False, off[k]))
                # Edges that end apart from each other, or off a face that is tangent there, leave
                # open where the faces beside them end.
                near = 2 * spread[k] + np.sqrt(2 * off[k] * radii[row])
                if any(np.linalg.norm(one[0] - vertex) < near for one in found[row]):
                    passes[row].append((depth, max(off[k], spread[k])))


def _number(known: list[Any], shape: Any) -> int:
    """Return the place of a vertex or edge in a list, to which a new one is added."""
    if not any(shape.IsSame(one) for one in known):
        known.append(shape)
    return next(k for k, one in enumerate(known) if shape.IsSame(one))
