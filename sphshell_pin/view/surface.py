"""A shell as meshcat draws it: patches smooth, creases sharp, elements outlined."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sphshell_pin.view.nodes import (
    FloatArray,
    IntArray,
    line_segments,
    material,
    set_object,
    triangle_mesh,
    typed_array,
)

if TYPE_CHECKING:
    from sphshell_pin.shell.shell import Shell

SURFACE_COLORS = (0x7FA8A0, 0xC4A878, 0x9A94C0, 0xB58C8C)
EDGE_COLOR = 0x22302E
MOST_OUTLINED_EDGES = 60_000
# Curved elements are drawn finely up to the first number, and not curved beyond the second: there
# the flat ones look the same.
MOST_FINELY_CURVED = 3_000
MOST_CURVED = 20_000


def split_at_creases(shell: Shell) -> tuple[FloatArray, IntArray]:
    """Return vertices (n, 3) [m] and triangles (t, 3) that share vertices within a patch only.

    The page averages normals over shared vertices: patches then look smooth and creases sharp.
    """
    triangles = np.asarray(shell.triangles, dtype=np.int64)
    patch = np.asarray(shell.element_patch, dtype=np.int64)[
        np.asarray(shell.triangle_element, dtype=np.int64)
    ]
    keys = patch[:, None] * len(shell.vertices) + triangles
    unique, corners = np.unique(keys, return_inverse=True)
    vertices = np.asarray(shell.vertices)[unique % len(shell.vertices)]
    return vertices, corners.reshape(-1, 3)


def outlined_edges(shell: Shell) -> IntArray:
    """Return the edges (e, 2) worth a line: all of a coarse shell, the sharp ones of a fine one."""
    edges = shell.edge_vertices
    if len(edges) <= MOST_OUTLINED_EDGES:
        return edges
    sharp: IntArray = edges[shell.edge_class != 0]
    return sharp


def curved_surface(shell: Shell) -> tuple[FloatArray, IntArray, FloatArray, IntArray]:
    """Return the curved elements of the method "smooth" as fine triangles, and their outlines.

    Vertices (n, 3) [m], triangles (t, 3), points of the outlines (p, 3) [m], segments (s, 2).
    """
    from sphshell_pin.shell.curved import curved_mesh

    divisions = 6 if len(shell.triangles) <= MOST_FINELY_CURVED else 2
    points, triangles, owner = curved_mesh(shell, divisions)
    # Points of one patch at one place become one, for the page to average their normals.
    patch = np.asarray(shell.element_patch)[np.asarray(shell.triangle_element)][owner]
    grid = np.round(points / (1e-7 * shell.size)).astype(np.int64)
    of_point = np.zeros(len(points), np.int64)
    of_point[triangles] = patch[:, None]
    keys = np.column_stack((of_point, grid))
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    vertices, corners = points[first], number.reshape(-1)[triangles]
    # A border of an element is a chain of small edges that no second small triangle of it has.
    small = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, count = np.unique(small, axis=0, return_counts=True)
    return vertices, corners, points, edges[count == 1]


def draw_shell(visualizer: Any, shell: Shell, index: int, *, curved: bool = False) -> None:
    """Draw `shell` in its own frame below `visualizer`; `index` chooses its colour.

    With `curved` the elements are drawn as the method "smooth" touches them.
    """
    curved = curved and len(shell.triangles) <= MOST_CURVED
    if curved:
        vertices, triangles, outline, edges = curved_surface(shell)
    else:
        vertices, triangles = split_at_creases(shell)
        outline, edges = np.asarray(shell.vertices), outlined_edges(shell)
    # The surface is pushed back a little, so that lines on it are not drawn half inside it.
    look = material(
        "MeshPhong",
        SURFACE_COLORS[index % len(SURFACE_COLORS)],
        specular=0x222222,
        shininess=20,
        polygonOffset=True,
        polygonOffsetFactor=1.0,
        polygonOffsetUnits=1.0,
    )
    set_object(visualizer["surface"], triangle_mesh(vertices, triangles), look)
    if len(edges):
        # The finer the mesh, the lighter its lines, so that the surface stays visible.
        opacity = float(np.clip(5.0 / np.sqrt(len(shell.edge_vertices)), 0.10, 0.45))
        lines = line_segments(outline, edges)
        set_object(
            visualizer["elements"],
            lines,
            material("LineBasic", EDGE_COLOR, opacity),
            "LineSegments",
        )


def draw_patches(visualizer: Any, shell: Shell, *, curved: bool = False) -> None:
    """Draw `shell` below `visualizer` with a colour for each patch, as "patches"."""
    if curved and len(shell.triangles) <= MOST_CURVED:
        from sphshell_pin.shell.curved import curved_mesh

        divisions = 6 if len(shell.triangles) <= MOST_FINELY_CURVED else 2
        points, triangles, owner = curved_mesh(shell, divisions)
    else:
        points, triangles = np.asarray(shell.vertices), np.asarray(shell.triangles)
        owner = np.arange(len(triangles), dtype=np.int32)
    patch = np.asarray(shell.element_patch)[np.asarray(shell.triangle_element)][owner]
    # A point of each patch for every point: colours, and the page's normals, end at patches.
    keys = patch[:, None].astype(np.int64) * len(points) + triangles
    unique, corners = np.unique(keys, return_inverse=True)
    geometry = triangle_mesh(points[unique % len(points)], corners.reshape(-1, 3))
    colors = patch_colors(int(patch.max(initial=0)) + 1)[unique // len(points)]
    geometry["data"]["attributes"]["color"] = typed_array(colors)
    look = material("MeshPhong", 0xFFFFFF, vertexColors=True, shininess=10)
    look |= {"polygonOffset": True, "polygonOffsetFactor": 1.0, "polygonOffsetUnits": 1.0}
    set_object(visualizer["patches"], geometry, look)


def patch_colors(count: int) -> FloatArray:
    """Return `count` colours (n, 3) from 0 to 1, calm ones, neighbours in number well apart."""
    # Hues by the golden ratio: no two of any few in a row are close.
    hue = (0.47 + 0.618033988749895 * np.arange(count)) % 1.0
    ramp = np.abs((hue[:, None] * 6.0 + np.array([0.0, 4.0, 2.0])) % 6.0 - 3.0) - 1.0
    return np.asarray(0.40 + 0.30 * np.clip(ramp, 0.0, 1.0))


def great_circles(radius: float, points: int = 48) -> tuple[FloatArray, IntArray]:
    """Return vertices (n, 3) [m] and segments (s, 2) of three circles of `radius` [m] about 0."""
    angles = 2.0 * np.pi * np.arange(points) / points
    circle = np.stack((np.cos(angles), np.sin(angles), np.zeros(points)), axis=1) * radius
    vertices = np.concatenate([np.roll(circle, axis, axis=1) for axis in range(3)])
    start = np.arange(points)
    ring = np.stack((start, (start + 1) % points), axis=1)
    return vertices, np.concatenate([ring + points * axis for axis in range(3)])


def tube(points: FloatArray, radius: float, sides: int = 6) -> tuple[FloatArray, IntArray]:
    """Return vertices (n, 3) and triangles (t, 3) of a tube of `radius` [m] along `points` (k, 3).

    Needs two points or more, no two neighbours equal. A line would be one pixel wide anywhere.
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
    first = (sides * np.arange(len(points) - 1))[:, None] + np.arange(sides)[None, :]
    second = (sides * np.arange(len(points) - 1))[:, None] + (np.arange(sides) + 1)[None, :] % sides
    triangles = np.concatenate(
        (
            np.stack((first, second, second + sides), axis=-1).reshape(-1, 3),
            np.stack((first, second + sides, first + sides), axis=-1).reshape(-1, 3),
        )
    )
    return vertices, triangles
