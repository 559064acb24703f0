"""What spheres are thrown at, and geometry that shares nothing with the package: plain NumPy."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report import surfaces
from tests import meshes
from tests.oracle.geometry import Long, gaps
from tests.shell.surfaces import tetrahedron

Mesh = tuple[Array, NDArray[np.int32]]

BOX, TUBE = 4.0, 3.0


@dataclass(frozen=True)
class Target:
    """A surface for a sphere of radius one; `interior` draws a place that the sphere fits into."""

    name: str
    mesh: Mesh
    curved: bool = False
    closed: bool = False
    interior: Callable[[np.random.Generator], Array] | None = None


def _in_box(rng: np.random.Generator) -> Array:
    return rng.uniform(-0.9, 0.9, 3) * (BOX / 2 - 1)


def _in_torus(rng: np.random.Generator) -> Array:
    along, around = rng.uniform(0, 2 * np.pi, 2)
    out = np.array([np.cos(along), np.sin(along), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    off = rng.uniform(0, 0.9) * (TUBE - 1)
    return np.asarray(2 * TUBE * out + off * (np.cos(around) * out + np.sin(around) * up))


def all_targets() -> list[Target]:
    """Return thin open sheets first, then closed bodies."""
    plate, large = meshes.random_plate(32, seed=3, size=12.0), meshes.grid_plate(1, 1, 400.0)
    cube_points, cube_sides = meshes.cube(BOX)
    ring = surfaces.torus(2 * TUBE, TUBE, 1.2)
    small = tetrahedron(0.5, at=(-0.125, -0.125, -0.125))
    x, y, halves = surfaces.random_grid(15, 4.0)
    wave = np.sin(0.7 * x + 0.3) * np.cos(0.6 * y) + 0.2 * np.sin(0.5 * x - 0.8 * y)
    return [
        Target("flat sheet", plate),
        Target("flat sheet of two triangles, 400 r", large),
        Target("dome", meshes.dome(8, 10.0, 8.0), True),
        Target("bowl", meshes.bowl(8, 5.0, 4.0), True),
        Target("wavy sheet, moved vertices", (np.c_[x, y, 0.3 * wave], halves), True),
        Target("box", (cube_points, cube_sides), closed=True, interior=_in_box),
        Target("plate of 0.2 r", (cube_points * [3.0, 3.0, 0.05], cube_sides), closed=True),
        Target("tetrahedron of r / 2", (small[0], small[1].astype(np.int32)), closed=True),
        Target("torus, moved vertices", (ring.vertices, ring.triangles), True, True, _in_torus),
    ]


def borders(elements: NDArray[np.int32]) -> NDArray[np.int64]:
    """Return the sides (n, 2) of triangles that belong to one of them only; of all if none does."""
    sides = np.sort(elements[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    found, count = np.unique(sides, axis=0, return_counts=True)
    return np.asarray(found[count == 1] if (count == 1).any() else found, dtype=np.int64)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("...i,...i", a, b))


def _first(along: Array, valid: NDArray[np.bool_]) -> float:
    kept = along[valid & (along >= 0)]
    return float(kept.min()) if kept.size else np.inf


def _enters(a: Array, b: Array, c: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return where a x^2 + 2 b x + c first vanishes, falling, and whether it does."""
    square = b * b - a * c
    valid = (square >= 0) & (a > 0)
    return (-b - np.sqrt(np.where(valid, square, 0))) / np.where(a > 0, a, 1), valid


def sweep(start: Array, along: Array, radius: float, corners: Array) -> float:
    """Return how far along the unit vector `along` a sphere first touches triangles (m, 3, 3).

    The boundary of the set of centers that touch consists of two offset planes for each triangle,
    a cylinder for each side and a sphere for each corner.
    """
    if gaps(start[None], corners.astype(Long)).min() <= radius:
        return 0.0
    a = corners
    sides = np.roll(corners, -1, axis=1) - a
    normal = np.cross(sides[:, 0], sides[:, 1])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    best = np.inf
    rate = _dot(normal, along)
    for offset in (radius, -radius):
        moving = rate != 0
        t = (offset - _dot(start - a[:, 0], normal)) / np.where(moving, rate, 1)
        projection = start + t[:, None] * along - offset * normal
        inside = (_dot(np.cross(sides, projection[:, None] - a), normal[:, None]) >= 0).all(axis=1)
        best = min(best, _first(t, inside & moving))
    away = start - a
    length = np.linalg.norm(sides, axis=2)
    axis = sides / length[..., None]
    u = along - _dot(axis, along)[..., None] * axis
    w = away - _dot(axis, away)[..., None] * axis
    t, valid = _enters(_dot(u, u), _dot(u, w), _dot(w, w) - radius**2)
    at = _dot(axis, away) + t * _dot(axis, along)
    best = min(best, _first(t, valid & (at >= 0) & (at <= length)))
    t, valid = _enters(np.ones(away.shape[:2]), _dot(away, along), _dot(away, away) - radius**2)
    return min(best, _first(t, valid))


def crossings(starts: Array, ends: Array, corners: Array) -> NDArray[np.bool_]:
    """Return which of the segments (n, 3) go through any of the triangles (m, 3, 3).

    The signs of volumes decide: a segment's ends lie on different sides of the triangle, and its
    line passes all three sides in the same sense.
    """
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    level = _dot(a, normal)
    above, below = starts @ normal.T - level, ends @ normal.T - level
    through = above * below < 0
    out = np.zeros(len(starts), dtype=bool)
    i, j = np.nonzero(through)
    p, d = starts[i], ends[i] - starts[i]
    turns = [_dot(d, np.cross(x[j] - p, y[j] - p)) for x, y in ((a, b), (b, c), (c, a))]
    same = (np.min(turns, axis=0) >= 0) | (np.max(turns, axis=0) <= 0) if len(i) else i > 0
    out[i[same]] = True
    return out


def winding(points: Array, corners: Array) -> NDArray[np.int64]:
    """Return how often a closed surface goes round each point (n, 3): 0 outside.

    Sum of solid angles (van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30, 1983).
    """
    a, b, c = (corners[None, :, k] - points[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=2) for x in (a, b, c))
    volume = _dot(a, np.cross(b, c))
    base = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
    total = 2 * np.arctan2(volume, base).sum(axis=1) / (4 * np.pi)
    return np.rint(total).astype(np.int64)
