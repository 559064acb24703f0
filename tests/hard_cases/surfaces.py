"""Shells of analytic surfaces with exact vertex normals, for the ball of `balls.RADIUS`.

Lengths in meters; `side` is that of the elements over the ball's radius (h / r). Vertices are
moved along the surface and diagonals drawn at random, so that no symmetry of a mesh hides an error.
"""

import math
from collections.abc import Callable

import numpy as np

from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
from sphshell_pin.study.report.surfaces import Mesh
from sphshell_pin.study.report.swing import turned_icosphere
from tests import meshes
from tests.contact.smooth import surfaces as unit
from tests.hard_cases.balls import RADIUS

Place = Callable[[Array, Array], tuple[Array, Array]]
SIDE = 0.15


def shell_of(mesh: Mesh) -> Shell:
    """Wind the triangles as the normals say."""
    corners = mesh.vertices[mesh.triangles]
    wound = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flipped = (wound * mesh.normals[mesh.triangles].sum(axis=1)).sum(axis=1) < 0
    triangles = np.where(flipped[:, None], mesh.triangles[:, ::-1], mesh.triangles)
    return Shell(mesh.vertices, triangles, normals=mesh.normals)


def grid(place, u, v, rows, columns, ring):
    """Mesh the surface `place`(u, v) -> points, normals; `ring`: the ends of v are one line."""
    at_u, at_v, triangles = unit.jittered_grid(u, v, rows, columns, rows)
    if ring:
        triangles = unit.closed_round(at_v, triangles, columns)
    vertices, normals = place(at_u, at_v)
    vertices, normals, triangles = unit.used(vertices, normals, triangles)
    return shell_of(Mesh(vertices, triangles, normals))


def count(length: float, side: float) -> int:
    """Return the rows of cells over `length` [m] whose triangles have sides of about side * r."""
    return math.ceil(1.15 * length / (side * RADIUS))


def sphere(radius: float, side: float = SIDE) -> Shell:
    """Closed sphere about the origin: a bowl from inside, a dome from outside."""
    level = max(0, round(math.log2(1.16 * radius / (side * RADIUS))))
    return shell_of(turned_icosphere(level, radius))


def cone(half_angle: float, low: float, high: float, side: float = SIDE) -> Shell:
    """Cone round z, apex at the origin, open upward; between the heights `low` and `high`."""
    sine, cosine = math.sin(half_angle), math.cos(half_angle)

    def place(z: Array, angle: Array) -> tuple[Array, Array]:
        out = np.stack([np.cos(angle), np.sin(angle), np.zeros(angle.size)], axis=1)
        points = (z * math.tan(half_angle))[:, None] * out
        points[:, 2] = z
        normals = -cosine * out
        normals[:, 2] = sine
        return points, normals

    rows = count((high - low) / cosine, side)
    columns = count(2 * math.pi * 0.5 * (low + high) * math.tan(half_angle), side)
    return grid(place, (low, high), (0.0, 2 * math.pi), rows, columns, ring=True)


def groove(half_angle: float, size: float = 2.0) -> Shell:
    """V-groove along y: its walls stand at `half_angle` from the plane of symmetry x = 0."""
    return Shell(*meshes.v_groove(math.pi / 2 - half_angle, size))


def cycloid(a: float, phi: Array) -> tuple[Array, Array]:
    """Points (n, 3) of the cycloid x = a (phi + sin phi), z = -a cos phi, normals to its inside."""
    zero = np.zeros_like(phi)
    points = np.stack([a * (phi + np.sin(phi)), zero, -a * np.cos(phi)], axis=1)
    return points, np.stack([-np.sin(phi / 2), zero, np.cos(phi / 2)], axis=1)


def cycloid_trough(a: float, reach: float, width: float, side: float = SIDE) -> Shell:
    """Trough along y on which the ball's center moves on `cycloid`, |phi| < reach.

    That is the parallel curve of the cycloid at the distance of the ball's radius.
    """
    half = 4 * a * math.sin(reach / 2)

    def place(arc: Array, y: Array) -> tuple[Array, Array]:
        centers, normals = cycloid(a, 2 * np.arcsin(arc / (4 * a)))
        points = centers - RADIUS * normals
        points[:, 1] = y
        return points, normals

    rows, columns = count(2 * half + reach * RADIUS, side), count(width, side)
    return grid(place, (-half, half), (-width / 2, width / 2), rows, columns, ring=False)
