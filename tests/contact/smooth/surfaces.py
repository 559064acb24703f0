"""Analytic surfaces for a sphere of radius one: their meshes, and places whose contact is known.

A sphere whose centre stands at p + (1 - depth) n, p on the surface and n its unit normal, touches
at p alone, with that depth and that normal: no radius of curvature is below three, and no two
parts of a surface are near each other.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
from tests import meshes
from tests.contact.helpers import directions


@dataclass(frozen=True)
class Smooth:
    """A smooth surface: `mesh(h)` gives vertices, elements and unit normals, `sides` of about h;
    `points(rng, n)` n places on it, clear of its borders, with the unit normals of its mesh;
    `sign` is +1 where the sphere is on the side these point to."""

    mesh: Callable[[float], tuple[Array, NDArray[np.int32], Array]]
    points: Callable[[np.random.Generator, int], tuple[Array, Array]]
    sign: float = 1.0

    def probes(self, count: int, depth: float, seed: int = 0) -> tuple[Array, Array]:
        """Sphere centres (n, 3) that touch with `depth`, and the exact normals (n, 3)."""
        point, normal = self.points(np.random.default_rng(seed), count)
        normal = self.sign * normal
        return point + (1.0 - depth) * normal, normal


def mean_edge(vertices: Array, elements: NDArray[np.int32]) -> float:
    """Mean length of the sides."""
    sides = vertices[elements] - vertices[np.roll(elements, 1, axis=1)]
    return float(np.linalg.norm(sides, axis=2).mean())


def jittered_grid(u, v, rows, columns, seed):
    """Parameters (n,), (n,) and triangles of a grid, inner vertices moved by up to a fifth of a
    cell, diagonals at random."""
    rng = np.random.default_rng(seed)
    gu, gv = np.meshgrid(np.linspace(*u, rows + 1), np.linspace(*v, columns + 1), indexing="ij")
    inner = (slice(1, -1), slice(1, -1))
    for grid, ends, cells in ((gu, u, rows), (gv, v, columns)):
        reach = 0.2 * (ends[1] - ends[0]) / cells
        grid[inner] += rng.uniform(-reach, reach, grid[inner].shape)
    cells = meshes._cells(rows, columns)
    return gu.ravel(), gv.ravel(), meshes._split(cells, rng.random(len(cells)) < 0.5)


def closed_round(gv: Array, triangles: NDArray[np.int32], columns: int) -> NDArray[np.int32]:
    """Join the first and the last column of a grid (`gv` is made equal there)."""
    grid = gv.reshape(-1, columns + 1)
    grid[:, -1] = grid[:, 0]
    first = np.arange(gv.size).reshape(-1, columns + 1)
    first[:, -1] = first[:, 0]
    return first.ravel()[triangles].astype(np.int32)


# Sphere of radius 4: the mesh's normals point outward.
BALL = 4.0


def ball_mesh(h: float) -> tuple[Array, NDArray[np.int32], Array]:
    level = max(0, round(np.log2(1.16 * BALL / h)))
    vertices, elements = meshes.icosphere(level, 1.0)
    return vertices * BALL, elements, vertices


def ball_points(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    normal = directions(rng, count)
    return BALL * normal, normal


# Cylinder of radius 3 round z, open at its ends; normals outward.
TUBE, LENGTH = 3.0, 6.0


def _cylinder(z: Array, angle: Array) -> tuple[Array, Array]:
    normal = np.stack([np.cos(angle), np.sin(angle), np.zeros(angle.size)], axis=1)
    point = TUBE * normal
    point[:, 2] = z
    return point, normal


def used(point, normal, triangles):
    """Leave out the vertices that no triangle uses."""
    kept, mapped = np.unique(triangles, return_inverse=True)
    return point[kept], normal[kept], mapped.reshape(-1, 3).astype(np.int32)


def round_mesh(surface, ends: tuple[float, float], length: float, step: int):
    """Mesh of a surface that its second parameter closes; every `step`-th corner in turn."""

    def mesh(h: float) -> tuple[Array, NDArray[np.int32], Array]:
        rows, columns = round(1.15 * length / h), round(1.15 * 2 * np.pi * TUBE / h)
        along, turn, triangles = jittered_grid(ends, (0.0, 2 * np.pi), rows, columns, rows)
        triangles = closed_round(turn, triangles, columns)
        point, normal, elements = used(*surface(along, turn), triangles)
        return point, elements[:, ::step].copy(), normal

    return mesh


cylinder_mesh = round_mesh(_cylinder, (-LENGTH / 2, LENGTH / 2), LENGTH, -1)


def cylinder_points(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    clear = LENGTH / 2 - 1.2
    return _cylinder(rng.uniform(-clear, clear, count), rng.uniform(0, 2 * np.pi, count))


# Sector of a torus: tube radius 3 round a circle of radius 6; normals into the tube, which the
# circle's inside meets with saddles.
RING, SECTOR = 6.0, 0.75


def _torus(along: Array, round_: Array) -> tuple[Array, Array]:
    out = np.stack([np.cos(along), np.sin(along), np.zeros(along.size)], axis=1)
    normal = -(np.cos(round_)[:, None] * out)
    normal[:, 2] = -np.sin(round_)
    return RING * out - TUBE * normal, normal


torus_mesh = round_mesh(_torus, (-SECTOR, SECTOR), 2 * SECTOR * RING, 1)


def torus_points(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    clear = SECTOR - 1.2 / TUBE
    return _torus(rng.uniform(-clear, clear, count), rng.uniform(0, 2 * np.pi, count))


# Sheet z = f(x, y), normals upward.
WAVE, SHEET = 0.3, 4.0


def _wavy(x: Array, y: Array) -> tuple[Array, Array]:
    z = WAVE * (np.sin(0.7 * x + 0.3) * np.cos(0.6 * y) + 0.2 * np.sin(0.5 * x - 0.8 * y))
    zx = WAVE * (0.7 * np.cos(0.7 * x + 0.3) * np.cos(0.6 * y) + 0.1 * np.cos(0.5 * x - 0.8 * y))
    zy = WAVE * (-0.6 * np.sin(0.7 * x + 0.3) * np.sin(0.6 * y) - 0.16 * np.cos(0.5 * x - 0.8 * y))
    normal = np.stack([-zx, -zy, np.ones_like(x)], axis=1)
    return np.stack([x, y, z], axis=1), normal / np.linalg.norm(normal, axis=1)[:, None]


def wavy_mesh(h: float) -> tuple[Array, NDArray[np.int32], Array]:
    cells = round(1.15 * 2 * SHEET / h)
    x, y, triangles = jittered_grid((-SHEET, SHEET), (-SHEET, SHEET), cells, cells, cells)
    point, normal = _wavy(x, y)
    return point, triangles, normal


def wavy_points(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    clear = SHEET - 1.3
    return _wavy(rng.uniform(-clear, clear, count), rng.uniform(-clear, clear, count))


def can(columns: int = 40, rows: int = 4):
    """Cylinder of radius 2 with a flat lid at z = 0; normals per corner."""
    heights = -0.5 * np.arange(rows + 1)
    profile = np.stack([np.full(rows + 1, 2.0), heights], axis=1)
    vertices, triangles = meshes.revolved([(0.0, 0.0), *profile], columns)
    lid = (vertices[triangles][:, :, 2] == 0).all(axis=1)
    normals = np.where(lid[:, None, None], [0, 0, 1], vertices[triangles] * [0.5, 0.5, 0])
    return vertices, triangles[:, ::-1].copy(), normals[:, ::-1].copy()


def given(mesh, **options) -> Shell:
    """Shell with the normals that came with a mesh."""
    return Shell(mesh[0], mesh[1], normals=mesh[2], **options)


SURFACES = {
    "bowl": Smooth(ball_mesh, ball_points, -1.0),
    "dome": Smooth(ball_mesh, ball_points),
    "cylinder inside": Smooth(cylinder_mesh, cylinder_points, -1.0),
    "cylinder outside": Smooth(cylinder_mesh, cylinder_points),
    "torus inside": Smooth(torus_mesh, torus_points),
    "wavy above": Smooth(wavy_mesh, wavy_points),
    "wavy below": Smooth(wavy_mesh, wavy_points, -1.0),
}
SIDES = (1.2, 0.6, 0.3, 0.15)


@cache
def _shell(mesh: Callable[..., object], h: float, exact: bool) -> tuple[Shell, float]:
    vertices, elements, normals = mesh(h)  # type: ignore[misc]
    # What the curved elements are worth by themselves: these surfaces are recognized otherwise.
    shell = Shell(vertices, elements, normals=normals if exact else None, faces=False)
    return shell, mean_edge(vertices, elements)


def shell_of(name: str, h: float, exact: bool = True) -> Shell:
    """Shell of a surface with elements of about `h`; made once."""
    return _shell(SURFACES[name].mesh, h, exact)[0]


def side_of(name: str, h: float) -> float:
    """Mean side of the mesh that `shell_of` uses."""
    return _shell(SURFACES[name].mesh, h, True)[1]
