"""Closest points on triangles, in extended precision, by trying everything."""

import numpy as np
from numpy.typing import NDArray

Long = np.longdouble
Array = NDArray[np.longdouble]


def corners_of(vertices: NDArray[np.float64], elements: NDArray[np.int32]) -> tuple[Array, Array]:
    """Triangle corners (t,3,3) and the element (t,) each comes from; quads are cut in two."""
    elements = np.asarray(elements)
    triangles, owner = [], []
    for k, element in enumerate(elements):
        loop = [i for i in element if i >= 0]
        for j in range(1, len(loop) - 1):
            triangles.append([loop[0], loop[j], loop[j + 1]])
            owner.append(k)
    return np.asarray(vertices, dtype=Long)[np.array(triangles)], np.array(owner)


def dot(a: Array, b: Array) -> Array:
    """Row by row scalar product."""
    return np.asarray((a * b).sum(axis=-1))


def norm(a: Array) -> Array:
    """Row by row length."""
    return np.asarray(np.sqrt(dot(a, a)))


def cross(a: Array, b: Array) -> Array:
    """Row by row vector product; NumPy's own spends most of its time on moving axes."""
    left, right = [1, 2, 0], [2, 0, 1]
    return np.asarray(a[..., left] * b[..., right] - a[..., right] * b[..., left])


def closest_on_segment(point: Array, a: Array, b: Array) -> Array:
    """Closest point to `point` on each segment a b."""
    along = b - a
    t = np.clip(dot(point - a, along) / dot(along, along), 0, 1)
    # Measured from the nearer end, so that an end is met exactly.
    from_a, from_b = a + t[..., None] * along, b - (1 - t)[..., None] * along
    return np.asarray(np.where((t < Long(0.5))[..., None], from_a, from_b))


def closest_on_triangles(point: NDArray[np.float64], corners: Array) -> Array:
    """Closest point (t,3) to `point` (one, or one for each triangle) on each triangle.

    The foot of the perpendicular if it lies inside; else the foot on a side it lies beyond, if that
    one is between the side's ends; else the nearest corner. No distances of near-by candidates are
    compared: they differ by the square of their separation, which rounding hides.
    """
    point = np.broadcast_to(np.asarray(point, dtype=Long), (len(corners), 3))
    nearest = norm(corners - point[:, None]).argmin(axis=1)
    best = corners[np.arange(len(corners)), nearest]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = cross(b - a, c - a)
    foot = point - (dot(point - a, normal) / dot(normal, normal))[:, None] * normal
    inside = np.ones(len(corners), dtype=bool)
    for p, q in ((a, b), (b, c), (c, a)):
        beyond = dot(cross(q - p, foot - p), normal) < 0
        between = (dot(point - p, q - p) >= 0) & (dot(point - q, p - q) >= 0)
        best = np.where((beyond & between)[:, None], closest_on_segment(point, p, q), best)
        inside &= ~beyond
    return np.asarray(np.where(inside[:, None], foot, best))


def gaps(points: Array, corners: Array) -> Array:
    """Distance (p, t) of each of several points from each triangle."""
    each = np.repeat(points, len(corners), axis=0)
    away = each - closest_on_triangles(each, np.tile(corners, (len(points), 1, 1)))
    return norm(away).reshape(len(points), len(corners))


def subtended_angle(point: Array, corners: Array, tolerance: float) -> float:
    """Angle of a triangle (3,3) seen from a point of it: 2 pi inside, pi on a side."""
    for k in range(3):
        u, v = corners[k - 1] - corners[k], corners[k - 2] - corners[k]
        if norm(point - corners[k]) <= tolerance:
            return float(np.arctan2(norm(cross(u, v)), dot(u, v)))
    for k in range(3):
        on_side = closest_on_segment(point[None], corners[k - 1][None], corners[k][None])[0]
        if norm(point - on_side) <= tolerance:
            return float(np.pi)
    return float(2 * np.pi)


def feature_normal(point: Array, corners: Array, tolerance: float) -> Array:
    """Unit angle-weighted pseudo-normal at a point of the surface, by the winding."""
    total = np.zeros(3, dtype=Long)
    for triangle in corners:
        if norm(point - closest_on_triangles(point, triangle[None])[0]) <= tolerance:
            normal = cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
            total += subtended_angle(point, triangle, tolerance) * normal / norm(normal)
    length = norm(total)
    return np.asarray(total / length) if length > 0 else total
