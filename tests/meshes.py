"""Small surfaces the tests share; every builder returns (vertices (n,3), elements (m,3|4))."""

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

Mesh = tuple[NDArray[np.float64], NDArray[np.int32]]


def _cells(rows: int, columns: int) -> NDArray[np.int64]:
    """Corners (rows*columns, 4), counter-clockwise seen from +z, of a grid's cells."""
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    corner = (i * (columns + 1) + j).ravel()
    return np.stack([corner, corner + columns + 1, corner + columns + 2, corner + 1], axis=1)


def _split(cells: NDArray[np.int64], other_diagonal: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Cut each cell in two along one of its diagonals."""
    a, b, c, d = cells.T
    first = np.where(other_diagonal[:, None], np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(other_diagonal[:, None], np.stack([b, c, d], 1), np.stack([a, c, d], 1))
    return np.stack([first, second], axis=1).reshape(-1, 3).astype(np.int32)


def grid_plate(rows: int = 1, columns: int = 1, size: float = 1.0, quads: bool = False) -> Mesh:
    """Plate z = 0 over [-size/2, size/2]^2, normals +z; x runs with the rows."""
    sides = (np.linspace(-0.5, 0.5, count + 1) for count in (rows, columns))
    x, y = np.meshgrid(*sides, indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1) * size
    cells = _cells(rows, columns)
    if quads:
        return vertices, cells.astype(np.int32)
    return vertices, _split(cells, np.zeros(len(cells), dtype=bool))


def ribbon(rails: ArrayLike, closed: bool = False) -> Mesh:
    """Rows of quads between rails (k, n, 3), counter-clockwise where the next is above; maybe
    closed along the rails."""
    points = np.asarray(rails, float)
    number = np.arange(points.size // 3).reshape(points.shape[:2])
    after = np.roll(number, -1, axis=1)
    quads = np.stack([number[:-1], after[:-1], after[1:], number[1:]], axis=-1)
    quads = quads if closed else quads[:, :-1]
    return points.reshape(-1, 3), quads.reshape(-1, 4).astype(np.int32)


def random_plate(elements, seed=0, size=1.0, jitter=0.45, slivers=True):
    """Plate z = 0 of about `elements` triangles: jittered grid, random diagonals, slivers.

    Slivers: a tenth of the rows and columns are squeezed to a thousandth of their width, and no two
    neighbors of them are, so that no triangle folds over.
    """
    rng = np.random.default_rng(seed)
    n = max(1, round((elements / 2) ** 0.5))
    widths = np.ones((2, n))
    if slivers and n > 4:
        for row in widths:
            row[rng.permutation(np.arange(1, n - 1, 2))[: max(1, n // 10)]] = 1e-3
    x, y = (np.concatenate([[0.0], np.cumsum(w)]) / w.sum() - 0.5 for w in widths)
    # A vertex moves less than a quarter of the smaller cell beside it: no diagonal can fold.
    inner = (np.minimum(w[1:], w[:-1]) / w.sum() / 2 * jitter for w in widths)
    reach = [np.concatenate([[0.0], one, [0.0]]) for one in inner]
    gx, gy = np.meshgrid(x, y, indexing="ij")
    gx = gx + rng.uniform(-1, 1, gx.shape) * reach[0][:, None]
    gy = gy + rng.uniform(-1, 1, gy.shape) * reach[1][None, :]
    vertices = np.stack([gx.ravel(), gy.ravel(), np.zeros(gx.size)], axis=1) * size
    cells = _cells(n, n)
    return vertices, _split(cells, rng.random(len(cells)) < 0.5)


def delaunay_plate(elements: int, seed: int = 0, size: float = 1.0) -> Mesh:
    """Plate z = 0: Delaunay triangulation of random points (needs scipy)."""
    from scipy.spatial import Delaunay

    rng = np.random.default_rng(seed)
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    plane = np.concatenate([square, rng.uniform(-0.5, 0.5, (max(0, elements // 2 - 1), 2))])
    vertices = np.concatenate([plane, np.zeros((len(plane), 1))], axis=1) * size
    return vertices, Delaunay(plane).simplices.astype(np.int32)


def cube(size: float = 1.0, quads: bool = False) -> Mesh:
    """Closed cube about the origin, outward winding."""
    ends = (-0.5, 0.5)
    corners = np.array([[x, y, z] for x in ends for y in ends for z in ends])
    sides = ("0132", "4675", "0451", "2376", "0264", "1573")
    faces = np.array([[int(corner) for corner in side] for side in sides])
    elements = faces if quads else np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    return corners * size, elements.astype(np.int32)


def icosphere(subdivisions: int = 1, radius: float = 1.0) -> Mesh:
    """Closed icosphere about the origin, outward winding."""
    ball = trimesh.creation.icosphere(subdivisions, radius)
    return np.array(ball.vertices), np.array(ball.faces, dtype=np.int32)


def revolved(profile: ArrayLike, columns: int | NDArray[np.float64]) -> Mesh:
    """Surface of revolution round z through rows (k, 2) of radii and heights, rows of two triangles
    a column, of which the number or the angles are given; a radius of zero is one vertex. Wound
    outward where the heights rise."""
    radius, height = np.transpose(profile)
    turn = 2 * np.pi * np.arange(columns) / columns if np.ndim(columns) == 0 else columns
    ring, columns = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1), len(turn)
    size = np.where(radius > 0, columns, 1)
    points = [(r * ring + [0, 0, z])[:n] for r, z, n in zip(radius, height, size, strict=True)]
    number = (np.cumsum(size) - size)[:, None] + np.arange(columns) % size[:, None]
    a, d = number[:-1], number[1:]
    b, c = np.roll(a, -1, axis=1), np.roll(d, -1, axis=1)
    triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
    return np.concatenate(points), triangles.astype(np.int32)


def needles(count: int = 24, aspect: float = 1e4, seed: int = 0) -> Mesh:
    """Strip of long thin triangles (length 1, width 1/aspect) folded at random small angles."""
    angle = np.cumsum(np.random.default_rng(seed).uniform(-0.3, 0.3, count + 1))
    step = np.stack([np.zeros(count + 1), np.cos(angle), np.sin(angle)], axis=1) / aspect
    rail = np.cumsum(step, axis=0)
    left = rail - np.array([0.5, 0.0, 0.0])
    right = rail + np.array([0.5, 0.0, 0.0])
    vertices = np.empty((2 * (count + 1), 3))
    vertices[0::2], vertices[1::2] = left, right
    pair = np.array([[0, 1, 3], [0, 3, 2]], dtype=np.int32)
    return vertices, (pair + 2 * np.arange(count, dtype=np.int32)[:, None, None]).reshape(-1, 3)


def fan(blades: int = 5, seed: int = 0) -> Mesh:
    """Non-manifold book: `blades` pairs of triangles that share the edge x in [-0.5, 0.5]."""
    angles = np.sort(np.random.default_rng(seed).uniform(0, 2 * np.pi, blades))
    vertices = [np.array([-0.5, 0.0, 0.0]), np.array([0.5, 0.0, 0.0])]
    triangles = []
    for angle in angles:
        k = len(vertices)
        arm = np.array([0.0, np.cos(angle), np.sin(angle)])
        vertices += [arm * 0.8 + [-0.4, 0, 0], arm * 0.9 + [0.5, 0, 0]]
        triangles += [(0, 1, k + 1), (0, k + 1, k)]
    return np.array(vertices), np.array(triangles, dtype=np.int32)


def v_groove(angle: float = 0.5, size: float = 1.0, cells: int = 1) -> Mesh:
    """Valley along y whose sides rise by `angle` [rad]; z = |x| tan(angle)."""
    vertices, triangles = grid_plate(2 * cells, 2 * cells, size)
    vertices = vertices.copy()
    vertices[:, 2] = np.abs(vertices[:, 0]) * np.tan(angle)
    return vertices, triangles


def l_plate(cells: int = 1) -> Mesh:
    """Flat L at z = 0: the square [-0.5, 0.5]^2 without its quarter x, y > 0 (reentrant corner)."""
    vertices, triangles = grid_plate(2 * cells, 2 * cells)
    center = vertices[triangles].mean(axis=1)
    kept = triangles[(center[:, 0] < 0) | (center[:, 1] < 0)]
    used, mapped = np.unique(kept, return_inverse=True)
    return vertices[used], mapped.reshape(-1, 3).astype(np.int32)


def dome(cells: int = 8, size: float = 1.0, radius: float = 2.0) -> Mesh:
    """Grid plate bent on a sphere of `radius` below it: convex seen from +z, top at the origin."""
    vertices, triangles = random_plate(2 * cells * cells, seed=cells, size=size, slivers=False)
    vertices = vertices.copy()
    vertices[:, 2] = np.sqrt(radius**2 - vertices[:, 0] ** 2 - vertices[:, 1] ** 2) - radius
    return vertices, triangles


def bowl(cells: int = 8, size: float = 1.0, radius: float = 2.0) -> Mesh:
    """`dome` turned over: concave seen from +z, bottom at the origin."""
    vertices, triangles = dome(cells, size, radius)
    return vertices * [1.0, 1.0, -1.0], triangles


def soup(triangles: int = 40, seed: int = 0, spread: float = 0.6) -> Mesh:
    """Unconnected random triangles in the unit box, many of them through each other."""
    rng = np.random.default_rng(seed)
    center = rng.uniform(-0.5, 0.5, (triangles, 1, 3))
    vertices = (center + rng.uniform(-spread, spread, (triangles, 3, 3))).reshape(-1, 3)
    return vertices, np.arange(3 * triangles, dtype=np.int32).reshape(-1, 3)


def crumpled(cells: int = 4, seed: int = 0, height: float = 0.15) -> Mesh:
    """Connected grid with random heights: convex, concave and saddle vertices."""
    rng = np.random.default_rng(seed)
    vertices, triangles = random_plate(2 * cells * cells, seed=seed, slivers=False)
    vertices = vertices.copy()
    vertices[:, 2] = rng.uniform(-height, height, len(vertices))
    return vertices, triangles


def random_rotation(seed: int) -> NDArray[np.float64]:
    """Proper rotation matrix, uniform enough for tests."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    q[:, 0] *= np.sign(np.linalg.det(q))
    return np.asarray(q)
