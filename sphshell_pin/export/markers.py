"""What viewers draw once: the shells and the spheres of a scene, in their own frames."""

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.export.frames import Frames, Message, header, xyz
from sphshell_pin.view.bodies import SPHERE_COLOR
from sphshell_pin.view.surface import SURFACE_COLORS, SurfaceMesh

# Types of visualization_msgs/Marker.
SPHERE, TRIANGLE_LIST = 2, 11


def shell_markers(scene: Scene, frames: Frames, time: int) -> Message:
    """Return the shells as triangles; curved ones as they touch."""
    drawn = {one.key: one for pair in scene.pairs for one in pair.shells}
    markers = []
    for number, (key, one) in enumerate(drawn.items()):
        mesh = SurfaceMesh.of(one.shell, curved=one.is_smooth)
        points = mesh.vertices[mesh.triangles].reshape(-1, 3)
        color = SURFACE_COLORS[number % len(SURFACE_COLORS)]
        markers.append(_marker(time, frames.names[key], TRIANGLE_LIST, 1.0, color, points))
    return {"markers": markers}


def sphere_markers(scene: Scene, frames: Frames, time: int) -> Message:
    """Return the spheres."""
    markers = [
        _marker(time, frames.names[pair.name, k], SPHERE, 2 * ball.radius, SPHERE_COLOR)
        for pair in scene.pairs
        for k, ball in enumerate(pair.spheres)
    ]
    return {"markers": markers}


def _marker(
    time: int, frame: str, kind: int, size: float, color: int, points: Array | None = None
) -> Message:
    rgba = *((color >> k & 255) / 255 for k in (16, 8, 0)), 0.6 if kind == SPHERE else 1.0
    return {
        "header": header(time, frame),
        "ns": frame,
        "type": kind,
        "pose": {"orientation": {"w": 1.0}},
        "scale": xyz(np.full(3, size)),
        "color": dict(zip("rgba", rgba, strict=True)),
        "frame_locked": True,
        "points": [] if points is None else [xyz(point) for point in points],
    }
