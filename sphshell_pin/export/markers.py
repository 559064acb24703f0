"""What viewers draw: shells, spheres and the robot's skeleton once, the contacts at every row."""

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.scene import Scene, SceneContacts
from sphshell_pin.export.frames import WORLD, Frames, Message, xyz
from sphshell_pin.view.arrows import FRICTION_COLOR, NORMAL_COLOR, POINT_COLOR, ArrowScale, pushing
from sphshell_pin.view.bodies import SPHERE_COLOR
from sphshell_pin.view.robot import LINK_COLOR
from sphshell_pin.view.surface import SURFACE_COLORS, SurfaceMesh

# Types and actions of visualization_msgs/Marker.
ARROW, SPHERE, LINE_LIST, SPHERE_LIST, TRIANGLE_LIST = 0, 2, 5, 7, 11
DELETEALL = 3

ROD = 0.25  # width of the skeleton's rods and size of the points, in radii of the smallest sphere


def _marker(
    time: int,
    frame: str,
    name: str,
    kind: int,
    scale: Array | tuple[float, float, float],
    color: int,
    points: Array | None = None,
    number: int = 0,
) -> dict[str, object]:
    opacity = 0.6 if kind == SPHERE else 1.0
    return {
        "header": {"stamp": stamp_of(time), "frame_id": frame},
        "ns": name,
        "id": number,
        "type": kind,
        "pose": {"orientation": {"w": 1.0}},
        "scale": xyz(np.array(scale)),
        "color": {c: (color >> k & 255) / 255 for c, k in zip("rgb", (16, 8, 0), strict=True)}
        | {"a": opacity},
        "frame_locked": True,
        "points": [] if points is None else [xyz(point) for point in points],
    }


def stamp_of(time: int) -> Message:
    """Return the time [ns] as a message."""
    return dict(zip(("sec", "nanosec"), divmod(time, 10**9), strict=True))


def shell_markers(scene: Scene, frames: Frames, time: int) -> Message:
    """Return the shells as triangles in their own frames; curved ones as they touch."""
    drawn = {one.key: one for pair in scene.pairs for one in pair.shells}
    markers = []
    for number, (key, one) in enumerate(drawn.items()):
        mesh = SurfaceMesh.of(one.shell, curved=one.is_smooth)
        points = mesh.vertices[mesh.triangles].reshape(-1, 3)
        color, name = SURFACE_COLORS[number % len(SURFACE_COLORS)], frames.names[key]
        markers.append(_marker(time, name, name, TRIANGLE_LIST, np.ones(3), color, points))
    return {"markers": markers}


def body_markers(scene: Scene, frames: Frames, time: int) -> Message:
    """Return the spheres, and a rod from each joint to the joints on it."""
    markers = []
    for pair in scene.pairs:
        for k, ball in enumerate(pair.spheres):
            name = frames.names[pair.name, k]
            markers.append(
                _marker(time, name, name, SPHERE, np.full(3, 2 * ball.radius), SPHERE_COLOR)
            )
    model, width = scene.model, ROD * least_radius(scene)
    for joint in range(1, model.njoints):
        parent = int(model.parents[joint])
        if parent or model.joints[joint].nv == 1:  # no body that flies free of the world
            name, placed = frames.on(parent)
            ends = (np.zeros(3), model.jointPlacements[joint].translation)
            points = np.array([placed.actInv(end) for end in ends])
            rod = f"rods/{model.names[joint]}"
            markers.append(_marker(time, name, rod, LINE_LIST, (width, 0, 0), LINK_COLOR, points))
    return {"markers": markers}


def contact_markers(
    contacts: SceneContacts, pairs: tuple[str, ...], scale: ArrowScale, size: float, time: int
) -> Message:
    """Return what is drawn of the contacts of one row; what was drawn before disappears.

    A point each, `size` [m] wide, and from it two arrows: the normal force and the friction force
    on the sphere, at the lengths of `scale`.
    """
    markers: list[dict[str, object]] = [{"action": DELETEALL}]
    pair = contacts.pair[contacts.normal_force >= 0.0]
    if len(contacts):
        size_of = np.full(3, size)
        points = np.asarray(contacts.point_world)
        markers.append(_marker(time, WORLD, "points", SPHERE_LIST, size_of, POINT_COLOR, points))
    drawn = pushing(contacts)
    for k, point in enumerate(drawn.point):
        for what, color, force in (
            ("normal", NORMAL_COLOR, drawn.normal[k]),
            ("friction", FRICTION_COLOR, drawn.friction[k]),
        ):
            length = float(np.linalg.norm(force)) * scale.meters_per_newton
            if 0.0 < length < np.inf:
                way = force * (scale.meters_per_newton * min(1.0, scale.longest / length))
                ends, shape = np.array([point, point + way]), (0.5 * size, size, 0.0)
                name = f"{what}/{pairs[pair[k]]}"
                markers.append(_marker(time, WORLD, name, ARROW, shape, color, ends, k))
    return {"markers": markers}


def least_radius(scene: Scene) -> float:
    """Return the radius of the smallest sphere [m]; without any, 1 cm."""
    return min((one.radius for pair in scene.pairs for one in pair.spheres), default=0.01)
