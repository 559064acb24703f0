"""The surfaces and the sphere positions of the measurements."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import trimesh

from sphshell_pin.base.arrays import Array, Ints

AMPLITUDE, WAVE_X, WAVE_Y = 0.03, 9.0, 7.0


def height(x: Array, y: Array) -> Array:
    """Height of a wavy sheet [m]."""
    return AMPLITUDE * np.sin(WAVE_X * x) * np.cos(WAVE_Y * y)


def wavy_sheet(cells: int, size: float) -> tuple[Array, Ints]:
    """Return vertices and 2 * cells^2 triangles of a square sheet of side `size` [m]."""
    x = np.linspace(-size / 2, size / 2, cells + 1)
    grid_x, grid_y = np.meshgrid(x, x, indexing="ij")
    vertices = np.c_[grid_x.ravel(), grid_y.ravel(), height(grid_x, grid_y).ravel()]
    i = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = i[:-1, :-1].ravel(), i[1:, :-1].ravel(), i[1:, 1:].ravel(), i[:-1, 1:].ravel()
    return vertices, np.concatenate([np.c_[a, b, c], np.c_[a, c, d]]).astype(np.int32)


def touching_centers(count: int, size: float, radius: float, depth: float) -> Array:
    """Return random centers (count, 3) of spheres at about `depth` in the sheet."""
    xy = np.random.default_rng(0).uniform(-0.45 * size, 0.45 * size, (count, 2))
    x, y = xy.T
    by_x = AMPLITUDE * WAVE_X * np.cos(WAVE_X * x) * np.cos(WAVE_Y * y)
    by_y = -AMPLITUDE * WAVE_Y * np.sin(WAVE_X * x) * np.sin(WAVE_Y * y)
    normal = np.c_[-by_x, -by_y, np.ones(count)]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return np.asarray(np.c_[xy, height(x, y)] + normal * (radius - depth))


@dataclass(frozen=True)
class Mesh:
    """Vertices (n, 3) [m], triangles (m, 3) and the exact outward unit normals (n, 3)."""

    vertices: Array
    triangles: Ints
    normals: Array

    @property
    def mean_side(self) -> float:
        """Mean length of the sides [m]."""
        corners = self.vertices[self.triangles]
        return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())


def icosphere(level: int, radius: float) -> Mesh:
    """Return a sphere [m] of 20 * 4^level triangles: an icosahedron, halved `level` times."""
    ball = trimesh.creation.icosphere(level)
    normals = np.array(ball.vertices)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return Mesh(radius * normals, ball.faces.astype(np.int32), normals)


def ball_places(radius: float, rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Return random points (n, 3) of a sphere [m] and their outward unit normals (n, 3)."""
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return radius * normals, normals


def on_torus(ring: float, tube: float, along: Array, around: Array) -> tuple[Array, Array]:
    """Return points (n, 3) of a torus round z [m] and their outward unit normals (n, 3)."""
    out = np.c_[np.cos(along), np.sin(along), np.zeros(len(along))]
    normals = np.cos(around)[:, None] * out
    normals[:, 2] = np.sin(around)
    return ring * out + tube * normals, normals


def torus(ring: float, tube: float, side: float) -> Mesh:
    """Return a closed torus round z [m] of triangles with sides of about `side` [m].

    Vertices are moved by up to a fifth of a cell and diagonals drawn at random, so that no
    symmetry of the mesh cancels an error.
    """
    rng = np.random.default_rng(1)
    rows, columns = (max(6, round(2 * np.pi * length / side)) for length in (ring, tube))
    i, j = (k.ravel() for k in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    moved_i, moved_j = (k + rng.uniform(-0.2, 0.2, len(k)) for k in (i, j))
    turn = 2 * np.pi
    vertices, normals = on_torus(ring, tube, turn * moved_i / rows, turn * moved_j / columns)
    next_i, next_j = (i + 1) % rows, (j + 1) % columns
    a, b = i * columns + j, next_i * columns + j
    c, d = next_i * columns + next_j, i * columns + next_j
    return Mesh(vertices, random_halves(a, b, c, d, rng), normals)


def random_halves(a: Ints, b: Ints, c: Ints, d: Ints, rng: np.random.Generator) -> Ints:
    """Return cells with corners a, b, c, d (n,) in turn as triangles, by diagonals at random."""
    first = rng.random(len(a)) < 0.5
    halves = np.where(first, [a, b, c], [a, b, d]), np.where(first, [a, c, d], [b, c, d])
    return np.hstack(halves).T.astype(np.int32)


def random_grid(cells: int, half: float, seed: int = 1) -> tuple[Array, Array, Ints]:
    """Return moved x, y (n,) over the square of side 2 `half`, and random halves of the cells."""
    rng = np.random.default_rng(seed)
    vertices, triangles = wavy_sheet(cells, 2 * half)
    x, y, _ = vertices.T
    inner = np.maximum(np.abs(x), np.abs(y)) < half * (1 - 1e-9)
    x, y = (k + inner * rng.uniform(-0.4, 0.4, len(k)) * half / cells for k in (x, y))
    (a, b, c), (_, _, d) = (part.T for part in np.split(triangles, 2))
    return x, y, random_halves(a, b, c, d, rng)


def plate(side: float, half: float) -> Mesh:
    """Return the flat plate |x|, |y| <= `half` [m] of random triangles."""
    x, y, triangles = random_grid(max(3, round(1.15 * 2 * half / side)), half)
    up = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    return Mesh(np.c_[x, y, np.zeros(len(x))], triangles, up)


# Surfaces with exact normals, from coarse to fine, under a sphere of RADIUS that lies DEPTH deep.
RADIUS = 0.010  # of the touching sphere [m]
DEPTH = 0.04 * RADIUS
BALL = 4 * RADIUS
RING, TUBE = 6 * RADIUS, 3 * RADIUS
PLATE = 6 * RADIUS  # half the side of the flat plate


@dataclass(frozen=True)
class Surface:
    """Meshes from coarse to fine, random places with outward normals, and where the sphere is."""

    meshes: Callable[[], list[Mesh]]
    places: Callable[[np.random.Generator, int], tuple[Array, Array]]
    inside: bool

    def touching(self, seed: int, count: int) -> tuple[Array, Array]:
        """Return centers (count, 3) of spheres DEPTH deep, and the exact unit forces (count, 3)."""
        points, outward = self.places(np.random.default_rng(seed), count)
        normals = -outward if self.inside else outward
        return points + (RADIUS - DEPTH) * normals, normals


def _on_plate(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    clear = PLATE - 1.3 * RADIUS
    xy = rng.uniform(-clear, clear, (count, 2))
    return np.c_[xy, np.zeros(count)], np.tile([0.0, 0.0, 1.0], (count, 1))


def _balls() -> list[Mesh]:
    return [icosphere(level, BALL) for level in (2, 3, 4, 5, 6)]


_SIDES = tuple(side * RADIUS for side in (1.0, 0.5, 0.25, 0.125, 0.0625))
SURFACES = {
    "bowl": Surface(_balls, partial(ball_places, BALL), inside=True),
    "dome": Surface(_balls, partial(ball_places, BALL), inside=False),
    "torus": Surface(
        lambda: [torus(RING, TUBE, side) for side in _SIDES],
        lambda rng, count: on_torus(RING, TUBE, *rng.uniform(0, 2 * np.pi, (2, count))),
        inside=True,
    ),
    "flat plate": Surface(lambda: [plate(side, PLATE) for side in _SIDES], _on_plate, inside=False),
}
