"""Surfaces of Coal's geometries: meshes as they are, solids tessellated with exact normals.

The shell is in the geometry's own frame: the placement of a pinocchio.GeometryObject is not
applied, as it is where the shell is mounted. Nor is its `meshScale`: Pinocchio applies it when it
loads a mesh, and it is meant for viewers of the file.
"""

import math
from collections.abc import Callable
from dataclasses import replace

import coal
import numpy as np

from sphshell_pin.base.arrays import Array, Ints, Longs, frame_along
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.shell.raw import KINDS, NO_SHAPE, RawSurface, raw_surface

Profile = tuple[float, float]
"""A unit normal in the half-plane of the profile: (radial, axial)."""


class Revolution:
    """Collects rings around the z axis, strips between them and discs inside them, face by face.

    Strips are added with their bottom first, so that the winding is outward. Rings of radius 0 are
    single points, which makes triangles of the elements beside them: none is without area.
    """

    def __init__(self, segments: int) -> None:
        self.segments = segments
        turns = math.pi * np.arange(2 * segments) / segments
        # At whole and half steps around the circle.
        self._circle = np.column_stack([np.cos(turns), np.sin(turns)])
        # Quarter turns are exact: a point meant to lie on an axis does.
        self._circle[np.abs(self._circle) < 1e-15] = 0.0
        self._vertices: list[Array] = []
        self._elements: list[Longs] = []
        self._normals: list[Array] = []
        self._names: list[str] = []
        self._shapes: list[tuple[float, ...]] = []
        self._faces: list[Longs] = []

    def face(
        self, name: str, kind: str | None, height: float, radius: float = 0.0, second: float = 0.0
    ) -> None:
        """Begin a face to which what follows belongs; `kind` of raw.KINDS, None of another.

        Its point is at `height` on the axis [m]; its numbers are as of `Face` [m, rad].
        """
        self._names.append(name)
        place = (0.0, 0.0, height, 0.0, 0.0, 1.0, radius, second)
        self._shapes.append(NO_SHAPE if kind is None else (float(KINDS.index(kind)), *place))

    def ring(self, radius: float, height: float) -> Longs:
        """Add a ring of vertices (radius, height) [m], or a single one on the axis.

        Returns their indices (segments,).
        """
        first = sum(map(len, self._vertices))
        count = self.segments if radius else 1
        points = np.column_stack([radius * self._circle[::2][:count], np.full(count, height)])
        self._vertices.append(points if radius else points * [0.0, 0.0, 1.0])
        return np.resize(np.arange(first, first + count), self.segments)

    def strip(
        self, lower: Longs, upper: Longs, lower_normal: Profile, upper_normal: Profile
    ) -> None:
        """Add the elements between two rings, with the normals at each of them."""
        corners = np.stack([lower, np.roll(lower, -1), np.roll(upper, -1), upper], axis=1)
        steps, profile = [0, 2, 2, 0], [lower_normal, lower_normal, upper_normal, upper_normal]
        # The tip of a cone has no normal: it gets that of the middle of the element.
        if lower[0] == lower[-1]:
            corners = np.column_stack([corners[:, 1:], np.full(self.segments, -1)])
            steps, profile = [1, 2, 0, 0], [lower_normal, upper_normal, upper_normal, (0.0, 0.0)]
        elif upper[0] == upper[-1]:
            corners[:, 3] = -1
            steps, profile = [0, 2, 1, 0], [lower_normal, lower_normal, upper_normal, (0.0, 0.0)]
        places = (2 * np.arange(self.segments)[:, None] + steps) % (2 * self.segments)
        radial, axial = np.array(profile).T
        normals = np.empty((self.segments, 4, 3))
        normals[:, :, :2] = radial[:, None] * self._circle[places]
        normals[:, :, 2] = axial
        self._add(corners, normals)

    def disc(self, ring: Longs, up: bool) -> None:
        """Close a ring with a flat disc of quads from rim to rim (no needles in its middle)."""
        rows = []
        for k in range(self.segments // 2):
            cycle = [k, k + 1, self.segments - k - 1, (self.segments - k) % self.segments]
            corners = list(dict.fromkeys(cycle))
            corners = corners if up else corners[::-1]
            rows.append([*(ring[i] for i in corners), -1][:4])
        self._add(np.array(rows), np.tile([0.0, 0.0, 1.0 if up else -1.0], (len(rows), 4, 1)))

    def _add(self, elements: Longs, normals: Array) -> None:
        self._elements.append(elements)
        self._normals.append(normals)
        self._faces.append(np.full(len(elements), len(self._names) - 1))

    def surface(self, stretch: Array | None = None) -> RawSurface:
        """All that was added, larger by the factors `stretch` (3,) along the axes."""
        vertices, normals = np.concatenate(self._vertices), np.concatenate(self._normals)
        if stretch is not None:
            # Normals go with the inverse transpose; unused fourth corners stay zero.
            vertices, normals = stretch * vertices, normals / stretch
            length = np.linalg.norm(normals, axis=2, keepdims=True)
            normals /= np.where(length > 0.0, length, 1.0)
        raw = raw_surface(vertices, np.concatenate(self._elements), normals)
        return replace(
            raw,
            faces=np.concatenate(self._faces).astype(np.int32),
            face_names=tuple(self._names),
            face_shapes=np.array(self._shapes),
        )


def arc(start: float, stop: float, steps: int) -> list[tuple[float, float]]:
    """Cosine and sine at `steps` + 1 latitudes [rad], exact at the poles and the equator."""
    angles = start + (stop - start) * np.arange(steps + 1) / steps
    table = np.column_stack([np.cos(angles), np.sin(angles)])
    table[np.abs(table) < 1e-15] = 0.0
    return [(c, s) for c, s in table.tolist()]


DEFAULT_CHORD_ERROR = 1e-3
"""Largest distance between tessellation and solid, as a share of the solid's diameter."""

DEFAULT_EXTENT = 10.0
"""Side of the square that stands for a half-space or a plane [m]."""

FEWEST_SEGMENTS = 16
MOST_OF_BALL, MOST_OF_ROD = 1000, 100_000
"""Segments around a full circle: half a million elements, or corners of a cylinder's ends."""


def geometry_surface(
    geometry: object,
    chord_error: float | None = None,
    segments: int | None = None,
    extent: float | None = None,
) -> RawSurface:
    """Polygons of a coal geometry or a pinocchio.GeometryObject, in its own frame.

    Parameters
    ----------
    geometry : a mesh (BVHModel), Convex, Box, Sphere, Cylinder, Capsule, Cone, Ellipsoid,
        Halfspace, Plane or TriangleP; or a pinocchio.GeometryObject that holds one
    chord_error : largest distance between the elements and a round solid [m]; 1e-3 of its diameter
        unless given
    segments : elements around a full circle, instead of `chord_error`; at most 1000 of a solid that
        is round in both directions, 100 000 of a cylinder or a cone
    extent : side [m] of the square that stands for a half-space or a plane; 10 m unless given

    Raises
    ------
    InvalidParameter
        If the geometry is of another kind, or an option is out of range.
    """
    shape = getattr(geometry, "geometry", geometry)
    if segments is not None and (int(segments) != segments or segments < 3):
        raise InvalidParameter("segments", segments, "must be a whole number of at least 3")
    for name, value in (("chord_error", chord_error), ("extent", extent)):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise InvalidParameter(name, value, "must be positive [m]")
    if isinstance(shape, coal.BVHModelBase):
        return _mesh(shape)
    if isinstance(shape, coal.ShapeBase) and shape.getSweptSphereRadius() > 0.0:
        raise InvalidParameter(
            "geometry",
            shape,
            "must have no swept-sphere radius (it rounds the shape; give the sphere that radius)",
        )
    if isinstance(shape, coal.Convex):
        triangles = [shape.polygons(k) for k in range(shape.num_polygons)]
        return raw_surface(np.array(shape.points()), [[t[0], t[1], t[2]] for t in triangles])
    if isinstance(shape, (coal.Halfspace, coal.Plane)):
        return _square(shape, DEFAULT_EXTENT if extent is None else extent)
    for kind, build in _BUILDERS.items():
        if isinstance(shape, kind):
            return build(shape, chord_error, segments)
    known = ["mesh (BVHModel)", "Convex", "Halfspace", "Plane", *(k.__name__ for k in _BUILDERS)]
    raise InvalidParameter("geometry", type(shape).__name__, f"must be one of: {', '.join(known)}")


def coal_tree(vertices: Array, triangles: Ints | Longs) -> coal.BVHModelOBBRSS:
    """Return Coal's tree of a mesh."""
    tree = coal.BVHModelOBBRSS()
    tree.beginModel(len(triangles), len(vertices))
    tree.addVertices(vertices)
    tree.addTriangles(triangles.astype(np.uint32))
    tree.endModel()
    return tree


def _mesh(mesh: coal.BVHModelBase) -> RawSurface:
    if mesh.getModelType() != coal.BVH_MODEL_TRIANGLES or mesh.num_tris == 0:
        raise InvalidParameter("geometry", mesh, "must be a mesh of triangles, not a point cloud")
    triangles = [mesh.tri_indices(k) for k in range(mesh.num_tris)]
    indices: Longs = np.array([(t[0], t[1], t[2]) for t in triangles], np.int64)
    return raw_surface(np.array(mesh.vertices()), indices)


def _round(
    radius: float,
    error_of: Callable[[int], float],
    chord_error: float | None,
    segments: int | None,
    most: int,
) -> int:
    """Fewest segments, a multiple of four, that keep `error_of` within the chord error.

    InvalidParameter if these are more than `most`.
    """
    if segments is not None:
        if segments > most:
            raise InvalidParameter("segments", segments, f"must be at most {most} for this solid")
        return int(segments)
    wanted = chord_error if chord_error is not None else DEFAULT_CHORD_ERROR * 2.0 * radius
    # 1 - cos(pi/n) falls as n^-2: a start close below, then upwards in fours.
    count = max(4.0, math.pi * math.sqrt(error_of(1) / (4.0 * wanted)))
    if count > most:
        raise InvalidParameter(
            "chord_error",
            wanted,
            f"needs more than {most} segments around a circle: take a larger one",
        )
    n = max(FEWEST_SEGMENTS, 4 * math.floor(count / 4.0))
    while error_of(n) > wanted:
        n += 4
    return n


def _sagitta(radius: float) -> Callable[[int], float]:
    # 1 - cos(x) = 2 sin(x/2)^2 keeps its digits for small x.
    return lambda n: radius * 2.0 * math.sin(math.pi / (2.0 * n)) ** 2


def _ball(radius: float) -> Callable[[int], float]:
    # The middle of an element is off by the sagitta along the meridian and that across it.
    return lambda n: 2.0 * _sagitta(radius)(n)


def _box(shape: coal.Box, _: float | None, __: int | None) -> RawSurface:
    half = np.array(shape.halfSide, np.float64)
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    elements = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], float)
    return raw_surface(signs * half, elements, np.repeat(faces[:, None, :], 4, axis=1))


def _ball_shape(
    shape: coal.Sphere | coal.Ellipsoid, chord_error: float | None, segments: int | None
) -> RawSurface:
    """Build a coal.Sphere or coal.Ellipsoid: a unit sphere that is stretched."""
    radii = np.array(
        shape.radii if isinstance(shape, coal.Ellipsoid) else 3 * [shape.radius], np.float64
    )
    longest = float(radii.max())
    body = Revolution(_round(longest, _ball(longest), chord_error, segments, MOST_OF_BALL))
    profile = arc(-0.5 * math.pi, 0.5 * math.pi, max(2, math.ceil(body.segments / 2)))
    if radii.min() == longest:
        body.face("ball", "sphere", 0.0, longest)
    else:
        body.face("ellipsoid", None, 0.0)
    rings = [body.ring(c, s) for c, s in profile]
    for k in range(len(profile) - 1):
        body.strip(rings[k], rings[k + 1], profile[k], profile[k + 1])
    return body.surface(radii)


def _rod(
    shape: coal.Cylinder | coal.Cone, chord_error: float | None, segments: int | None
) -> RawSurface:
    """Build a coal.Cylinder or coal.Cone."""
    r, h = float(shape.radius), float(shape.halfLength)
    top_radius = 0.0 if isinstance(shape, coal.Cone) else r
    body = Revolution(_round(r, _sagitta(r), chord_error, segments, MOST_OF_ROD))
    bottom, top = body.ring(r, -h), body.ring(top_radius, h)
    slant = math.hypot(r - top_radius, 2.0 * h)
    normal = (2.0 * h / slant, (r - top_radius) / slant)
    if top_radius > 0.0:
        body.face("side", "cylinder", 0.0, r)
    else:
        body.face("side", "cone", -h, r, -math.atan2(r, 2.0 * h))
    body.strip(bottom, top, normal, normal)
    body.face("bottom", "plane", -h)
    body.disc(bottom, up=False)
    if top_radius > 0.0:
        body.face("top", "plane", h)
        body.disc(top, up=True)
    return body.surface()


def _capsule(shape: coal.Capsule, chord_error: float | None, segments: int | None) -> RawSurface:
    r, h = float(shape.radius), float(shape.halfLength)
    body = Revolution(_round(r, _ball(r), chord_error, segments, MOST_OF_BALL))
    steps = max(1, math.ceil(body.segments / 4))
    south = arc(-0.5 * math.pi, 0.0, steps)
    north = arc(0.0, 0.5 * math.pi, steps)
    profile = [(c, s, -h) for c, s in south] + [(c, s, h) for c, s in north]
    if h == 0.0:
        profile = profile[: len(south)] + profile[len(south) + 1 :]
    rings = [body.ring(r * c, r * s + middle) for c, s, middle in profile]
    for k in range(len(profile) - 1):
        if k == 0:
            body.face("bottom" if h > 0.0 else "ball", "sphere", -h, r)
        elif k == steps and h > 0.0:
            body.face("side", "cylinder", 0.0, r)
        elif k == steps + 1 and h > 0.0:
            body.face("top", "sphere", h, r)
        body.strip(rings[k], rings[k + 1], profile[k][:2], profile[k + 1][:2])
    return body.surface()


def _triangle(shape: coal.TriangleP, _: float | None, __: int | None) -> RawSurface:
    points = np.array([shape.a, shape.b, shape.c], np.float64)
    normal = np.cross(points[1] - points[0], points[2] - points[0])
    length = float(np.linalg.norm(normal))
    normals = np.broadcast_to(normal / (length if length > 0.0 else 1.0), (1, 3, 3)).copy()
    return raw_surface(points, [[0, 1, 2]], normals)


def _square(shape: coal.Halfspace | coal.Plane, extent: float) -> RawSurface:
    """Return a square around the point nearest to the origin, wound along the shape's normal."""
    normal = np.array(shape.n, np.float64)
    half = 0.5 * extent
    corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    points = float(shape.d) * normal + corners @ -frame_along(normal)[:, :2].T
    raw = raw_surface(points, [[0, 1, 2, 3]], np.broadcast_to(normal, (4, 3)))
    return raw.noting(f"a square of {extent:.6g} m stands for the endless {type(shape).__name__}")


_BUILDERS: dict[type, Callable[..., RawSurface]] = {
    coal.Box: _box,
    coal.Sphere: _ball_shape,
    coal.Cylinder: _rod,
    coal.Capsule: _capsule,
    coal.Cone: _rod,
    coal.Ellipsoid: _ball_shape,
    coal.TriangleP: _triangle,
}
