"""Distances by trying every triangle: slow, obvious, and nothing of the compiled core."""

import numpy as np
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from sphshell_pin.base.arrays import Array, Longs, Mask


def distances(points: Array, corners: Array) -> Array:
    """Return the distance (n, t) [m] of each of points (n, 3) to each triangle (t, 3, 3)."""
    return np.array([np.linalg.norm(closest(point, corners) - point, axis=1) for point in points])


def closest(point: Array, corners: Array) -> Array:
    """Return the point (t, 3) of each triangle (t, 3, 3) that is closest to `point` (3,)."""
    same = np.broadcast_to(point, (len(corners), 3))
    return np.asarray(trimesh.triangles.closest_point(corners, same))  # type: ignore[no-untyped-call]


def closest_inside(point: Array, corners: Array) -> tuple[Longs, Array]:
    """Return the triangles (k,) of (t, 3, 3) closest to `point` (3,) at their inside, and where.

    Points (k, 3) well inside: there the distance has a strict minimum, whatever the neighbors are.
    """
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(u, v)
    twice = np.einsum("tx,tx->t", normal, normal)
    away = point - a
    first = np.einsum("tx,tx->t", np.cross(away, v), normal) / twice
    second = np.einsum("tx,tx->t", np.cross(u, away), normal) / twice
    margin = 1e-6
    inside = np.flatnonzero((first > margin) & (second > margin) & (first + second < 1 - margin))
    return inside, (a + first[:, None] * u + second[:, None] * v)[inside]


def pieces(triangles: Longs, touched: Mask) -> list[Longs]:
    """Split the `touched` (t,) among triangles (t, 3) into pieces that hang together by vertices.

    Returns the indices of the triangles of each piece.
    """
    rows = np.flatnonzero(touched)
    corners = triangles[rows].astype(np.int64)
    size, first = int(triangles.max()) + 1, corners[:, [0, 0]].ravel()
    joined = coo_array((np.ones(first.size), (first, corners[:, 1:].ravel())), (size, size))
    label = connected_components(joined, directed=False)[1][corners[:, 0]]
    return [rows[label == one] for one in np.unique(label)]


def crossed(start: Array, end: Array, corners: Array) -> Longs:
    """Return the triangles (t, 3, 3) through which the path from `start` (3,) to `end` (3,) leads.

    By Moeller and Trumbore (1997); a path within a triangle's plane crosses nothing.
    """
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    way = end - start
    across = np.cross(way, v)
    det = np.einsum("tx,tx->t", u, across)
    safe = np.where(det == 0.0, 1.0, det)
    from_a = start - a
    first = np.einsum("tx,tx->t", from_a, across) / safe
    other = np.cross(from_a, u)
    second = other @ way / safe
    share = np.einsum("tx,tx->t", v, other) / safe
    hit = (first >= 0) & (second >= 0) & (first + second <= 1) & (share >= 0) & (share <= 1)
    return np.flatnonzero(hit & (det != 0.0))


def samples(corners: Array, count: int, rng: np.random.Generator) -> Array:
    """Return `count` random points (count, 3) of triangles (t, 3, 3), spread by area."""
    spans = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(spans, axis=1)
    chosen = rng.choice(len(corners), count, p=area / area.sum())
    return np.asarray(np.einsum("nk,nkx->nx", rng.dirichlet(np.ones(3), count), corners[chosen]))
