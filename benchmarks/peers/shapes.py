"""The surfaces of the scenes: a mesh, and what engines without concave meshes may take instead."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report import swing
from sphshell_pin.study.report.surfaces import height as wavy_height
from sphshell_pin.study.report.surfaces import random_grid, wavy_sheet

Height = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Box:
    """A box: `center` (3,) [m], `half` sides (3,) [m], `rotation` (3, 3) to the world."""

    center: Array
    half: Array
    rotation: Array


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh in the world, equal only to itself.

    `vertices` (n, 3) [m]; `triangles` (m, 3), counter-clockwise seen from the ball; `normals`
    (n, 3), unit, exact, towards the ball, None where the surface has creases. `height`, if any,
    gives z [m] of the exact surface above x, y, for |x|, |y| <= `reach` [m], and `spacing` [m] is
    about the side of a triangle: for engines with height fields. `boxes`, if any, are convex
    pieces that make the same surface.
    """

    vertices: Array
    triangles: NDArray[np.int32]
    normals: Array | None
    spacing: float
    reach: float
    height: Height | None = None
    boxes: tuple[Box, ...] = ()


def plate(half: float, spacing: float, thickness: float = 0.1) -> Surface:
    """Return the flat square z = 0 of |x|, |y| <= `half` [m], of random triangles.

    The box of the same surface is `thickness` [m] thick.
    """
    cells = 2 * round(half / spacing)
    x, y, triangles = random_grid(cells, half, seed=5)
    vertices = np.c_[x, y, np.zeros(len(x))]
    box = np.array([half, half, thickness / 2])
    return Surface(
        vertices,
        triangles,
        np.tile([0.0, 0.0, 1.0], (len(x), 1)),
        spacing,
        half,
        height=lambda x, y: np.zeros_like(x + y),
        boxes=(Box(np.array([0, 0, -thickness / 2]), box, np.eye(3)),),
    )


def bowl(side: float) -> Surface:
    """Return the sphere of the swing seen from inside; sides of `side` radii of the ball."""
    mesh = swing.bowl(side)

    def height(x: Array, y: Array) -> Array:
        return -np.sqrt(np.maximum(swing.BOWL**2 - x * x - y * y, 0.0))

    # The ball touches up to 40 degrees from the bottom, where the field is not yet steep.
    reach = swing.BOWL * math.sin(swing.ANGLE) * 1.15
    flipped = mesh.triangles[:, ::-1].copy()
    return Surface(mesh.vertices, flipped, -mesh.normals, side * swing.RADIUS, reach, height)


def cylinder(radius: float, bottom: float, top: float, spacing: float) -> Surface:
    """Return the inside of the wall of a vertical cylinder [m], for `bottom` < z < `top`."""
    around = round(2 * math.pi * radius / spacing)
    up = round((top - bottom) / spacing)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(around), np.arange(up + 1), indexing="ij"))
    rng = np.random.default_rng(7)
    inner = (j > 0) & (j < up)
    angle = 2 * math.pi * (i + 0.2 * rng.uniform(-1, 1, len(i))) / around
    z = bottom + (top - bottom) * (j + 0.2 * rng.uniform(-1, 1, len(j)) * inner) / up
    out = np.c_[np.cos(angle), np.sin(angle), np.zeros(len(i))]
    vertices = radius * out
    vertices[:, 2] = z
    below = j < up
    a = np.flatnonzero(below)
    b = (a + up + 1) % len(i)
    c, d = b + 1, a + 1
    # Seen from the axis, b (a step round, counter-clockwise from above) lies to the left of a.
    first = rng.random(len(a)) < 0.5
    halves = np.where(first, [a, c, b], [a, d, b]), np.where(first, [a, d, c], [b, d, c])
    triangles = np.hstack(halves).T.astype(np.int32)
    thick = radius / 4
    half = np.array([thick / 2, radius * math.tan(math.pi / around), (top - bottom) / 2])
    boxes = []
    for k in range(around):
        turn = 2 * math.pi * k / around
        cos, sin = math.cos(turn), math.sin(turn)
        center = np.array([cos, sin, 0.0]) * (radius + thick / 2)
        center[2] = (top + bottom) / 2
        rotation = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        boxes.append(Box(center, half, rotation))
    return Surface(vertices, triangles, -out, spacing, radius, boxes=tuple(boxes))


def groove(opening: float, half: float, spacing: float) -> Surface:
    """Return a V along y with its crease at z = 0, each wall `opening` [rad] from the middle."""
    slope = 1 / math.tan(opening)
    cells = 2 * round(half / spacing)
    x, y, triangles = random_grid(cells, half, seed=6)
    x.reshape(cells + 1, -1)[cells // 2] = 0.0  # the crease
    vertices = np.c_[x, y, slope * np.abs(x)]
    boxes = []
    for sign in (1.0, -1.0):
        along = np.array([sign * math.sin(opening), 0.0, math.cos(opening)])
        normal = np.array([-sign * math.cos(opening), 0.0, math.sin(opening)])
        rotation = np.c_[along, np.cross(normal, along), normal]
        length = half / math.sin(opening) / 2
        center = length * along - half * normal
        boxes.append(Box(center, np.array([length, half, half]), rotation))
    return Surface(
        vertices,
        triangles,
        None,
        spacing,
        half,
        height=lambda x, y: slope * np.abs(x) + 0 * y,
        boxes=tuple(boxes),
    )


def wavy(cells: int, size: float, place: Array) -> Surface:
    """Return the wavy sheet of benchmarks.surfaces, its middle at `place` (3,) [m]."""
    vertices, triangles = wavy_sheet(cells, size)
    x0, y0, z0 = place

    def height(x: Array, y: Array) -> Array:
        return np.asarray(z0 + wavy_height(x - x0, y - y0))

    return Surface(vertices + place, triangles, None, size / cells, size / 2, height)
