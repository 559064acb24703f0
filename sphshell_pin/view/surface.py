"""A shell as meshcat draws it: patches smooth, creases sharp, elements outlined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.view.nodes import (
    IntArray,
    Json,
    line_segments,
    material,
    set_object,
    triangle_mesh,
)

if TYPE_CHECKING:
    from meshcat import Visualizer

    from sphshell_pin.shell.shell import Shell

SURFACE_COLORS = (0x7FA8A0, 0xC4A878, 0x9A94C0, 0xB58C8C)
EDGE_COLOR = 0x22302E
FACE_COLORS = {
    "plane": "#9fb4c7",
    "cylinder": "#e0a458",
    "cone": "#6a9e78",
    "sphere": "#b5656a",
    "torus": "#8d7bb0",
    "none": "#dddddd",
}
# The surface is pushed back a little, so that lines on it are not drawn half inside it.
PUSHED_BACK: Json = {"polygonOffset": True, "polygonOffsetFactor": 1.0, "polygonOffsetUnits": 1.0}
MOST_OUTLINED_EDGES = 60_000
# Curved elements are drawn finely up to the first number, and not curved beyond the second: there
# the flat ones look the same.
MOST_FINELY_CURVED = 3_000
MOST_CURVED = 20_000


@dataclass(frozen=True)
class SurfaceMesh:
    """A shell as triangles that share vertices within a patch only, and the lines on it.

    The page averages normals over shared vertices: patches then look smooth and creases sharp.
    `vertices` (n, 3) [m] of the patches `patch` (n,), or of what else tells elements apart,
    `triangles` (t, 3); `segments` (s, 2) between the points `outline` (p, 3) [m].
    """

    vertices: Array
    patch: IntArray
    triangles: IntArray
    outline: Array
    segments: IntArray

    @classmethod
    def of(
        cls, shell: Shell, *, curved: bool = False, patch: IntArray | None = None
    ) -> SurfaceMesh:
        """Build from `shell`; with `curved` from its elements as the method "smooth" has them.

        patch : (m,) of each element, other than `element_patch`
        """
        patch = np.asarray(shell.element_patch) if patch is None else patch
        if not is_curved(shell, curved):
            points, triangles = np.asarray(shell.vertices), np.asarray(shell.triangles)
            owner = np.arange(len(triangles), dtype=np.int32)
            same = np.arange(len(points))
            segments = outlined_edges(shell)
        else:
            from sphshell_pin.shell.curvature import curved_mesh

            points, triangles, owner = curved_mesh(shell, divisions(shell))
            grid = np.round(points / (1e-7 * shell.size)).astype(np.int64)
            same = np.unique(grid, axis=0, return_inverse=True)[1].reshape(-1)
            # A border of an element is a chain of edges that no second small triangle of it has.
            sides = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
            edges, count = np.unique(sides, axis=0, return_counts=True)
            segments = edges[count == 1]
        patch = patch[np.asarray(shell.triangle_element)][owner]
        keys = patch[:, None].astype(np.int64) * len(points) + same[triangles]
        unique, first, corners = np.unique(keys, return_index=True, return_inverse=True)
        vertices = points[triangles.reshape(-1)[first]]
        return cls(vertices, unique // len(points), corners.reshape(-1, 3), points, segments)


def is_curved(shell: Shell, curved: bool) -> bool:
    """Whether `shell`, if `curved`, has few enough elements to be drawn so."""
    return curved and len(shell.triangles) <= MOST_CURVED


def divisions(shell: Shell) -> int:
    """Return into how many pieces a side of a curved element is divided."""
    return 6 if len(shell.triangles) <= MOST_FINELY_CURVED else 2


def outlined_edges(shell: Shell) -> IntArray:
    """Return the edges (e, 2) worth a line: all of a coarse shell, the sharp ones of a fine one."""
    edges = shell.edge_vertices
    if len(edges) <= MOST_OUTLINED_EDGES:
        return edges
    return np.asarray(edges[shell.edge_class != 0])


def draw_shell(node: Visualizer, shell: Shell, index: int, *, curved: bool = False) -> None:
    """Draw `shell` in its own frame below `node`; `index` chooses its color."""
    mesh = SurfaceMesh.of(shell, curved=curved)
    color = SURFACE_COLORS[index % len(SURFACE_COLORS)]
    look = material("MeshPhong", color, specular=0x222222, shininess=20, **PUSHED_BACK)
    set_object(node["surface"], triangle_mesh(mesh.vertices, mesh.triangles), look)
    if len(mesh.segments):
        # The finer the mesh, the lighter its lines, so that the surface stays visible.
        opacity = float(np.clip(5.0 / np.sqrt(len(shell.edge_vertices)), 0.10, 0.45))
        lines = line_segments(mesh.outline, mesh.segments)
        set_object(
            node["elements"], lines, material("LineBasic", EDGE_COLOR, opacity), "LineSegments"
        )


def draw_faces(node: Visualizer, shell: Shell, *, curved: bool = False) -> None:
    """Draw `shell` below `node` with a color for each kind of face in FACE_COLORS, as "faces"."""
    kinds, count = tuple(FACE_COLORS), len(FACE_COLORS)
    kind = np.full(shell.num_elements, count - 1)
    for face in shell.faces:
        kind[face.elements] = kinds.index(face.kind)
    mesh = SurfaceMesh.of(shell, curved=curved, patch=shell.element_patch * count + kind)
    colors = hex_colors(tuple(FACE_COLORS.values()))[mesh.patch % count]
    look = material("MeshPhong", 0xFFFFFF, vertexColors=True, shininess=10, **PUSHED_BACK)
    set_object(node["faces"], triangle_mesh(mesh.vertices, mesh.triangles, colors), look)


def hex_colors(names: Sequence[str]) -> Array:
    """Return colors (n, 3) from 0 to 1 for names like "#7fa8a0"."""
    return np.array([[int(name[k : k + 2], 16) for k in (1, 3, 5)] for name in names]) / 255.0


def ramp_colors(share: Array, ramp: Sequence[str]) -> Array:
    """Return colors (n, 3) from 0 to 1 for shares (n,): 0 the first of `ramp`, 1 the last."""
    at, stops = np.linspace(0.0, 1.0, len(ramp)), hex_colors(ramp)
    return np.stack([np.interp(share, at, stops[:, k]) for k in range(3)], axis=1)


def great_circles(radius: float, points: int = 48) -> tuple[Array, IntArray]:
    """Return vertices (n, 3) [m] and segments (s, 2) of three circles of `radius` [m] about 0."""
    angles = 2.0 * np.pi * np.arange(points) / points
    circle = np.stack((np.cos(angles), np.sin(angles), np.zeros(points)), axis=1) * radius
    vertices = np.concatenate([np.roll(circle, axis, axis=1) for axis in range(3)])
    start = np.arange(points)
    ring = np.stack((start, (start + 1) % points), axis=1)
    return vertices, np.concatenate([ring + points * axis for axis in range(3)])


def between_rings(rings: int, sides: int) -> IntArray:
    """Return the triangles (t, 3) between `rings` of `sides` points each, ring after ring."""
    row, column = np.meshgrid(np.arange(rings - 1), np.arange(sides), indexing="ij")
    first, second = sides * row + column, sides * row + (column + 1) % sides
    halves = (first, second, second + sides), (first, second + sides, first + sides)
    return np.concatenate([np.stack(half, axis=-1).reshape(-1, 3) for half in halves])


def tube(points: Array, radius: float, sides: int = 6) -> tuple[Array, IntArray]:
    """Return vertices (n, 3) and triangles (t, 3) of a tube of `radius` [m] along `points` (k, 3).

    Needs two points or more, no two neighbors equal. A line would be one pixel wide anywhere.
    """
    steps = np.diff(points, axis=0)
    tangents = np.vstack((steps[:1], steps[:-1] + steps[1:], steps[-1:]))
    lengths = np.linalg.norm(tangents, axis=1)
    folded = lengths < 1e-12 * np.linalg.norm(steps, axis=1).max()
    tangents[folded] = steps[np.minimum(np.flatnonzero(folded), len(steps) - 1)]
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    across = np.empty_like(points)
    side = np.cross(tangents[0], np.eye(3)[int(np.argmin(np.abs(tangents[0])))])
    for row, tangent in enumerate(tangents):
        turned = side - tangent * (side @ tangent)
        if np.linalg.norm(turned) < 1e-6:
            turned = np.cross(tangent, np.eye(3)[int(np.argmin(np.abs(tangent)))])
        side = across[row] = turned / np.linalg.norm(turned)
    up = np.cross(tangents, across)
    angles = 2.0 * np.pi * np.arange(sides) / sides
    ring = (
        across[:, None, :] * np.cos(angles)[None, :, None]
        + up[:, None, :] * np.sin(angles)[None, :, None]
    )
    vertices = (points[:, None, :] + radius * ring).reshape(-1, 3)
    return vertices, between_rings(len(points), sides)
