"""What viewers draw: shells, spheres and the robot's skeleton once, the contacts at every row."""

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.scene import Scene, SceneContacts
from sphshell_pin.export.frames import WORLD, Frames, Message, xyz
from sphshell_pin.view.arrows import FRICTION_COLOR, NORMAL_COLOR, POINT_COLOR, ArrowScale, pushing
from sphshell_pin.view.bodies import SPHERE_COLOR
from sphshell_pin.view.robot import LINK_COLOR
from sphshell_pin.view.surface import SURFACE_COLORS, SurfaceMesh

Stamp = tuple[int, int]

# Types and actions of visualization_msgs/Marker.
ARROW, SPHERE, LINE_LIST, SPHERE_LIST, TRIANGLE_LIST = 0, 2, 5, 7, 11
DELETEALL = 3
_COLORS = (("r", 16), ("g", 8), ("b", 0))

ROD = 0.25  # width of the skeleton's rods and size of the points, in radii of the smallest sphere


def _marker(
    stamp: Stamp,
    frame: str,
    name: str,
    number: int,
    kind: int,
    scale: tuple[float, float, float],
    color: int,
    opacity: float = 1.0,
    points: Array | None = None,
) -> dict[str, object]:
    return {
        "header": {"stamp": stamp_of(stamp), "frame_id": frame},
        "ns": name,
        "id": number,
        "type": kind,
        "pose": {"orientation": {"w": 1.0}},
        "scale": xyz(np.array(scale)),
        "color": {"a": opacity} | {c: (color >> k & 255) / 255 for c, k in _COLORS},
        "frame_locked": True,
        "points": [] if points is None else [xyz(point) for point in points],
    }


def stamp_of(stamp: Stamp) -> Message:
    """Return the time [s, ns] as a message."""
    return {"sec": stamp[0], "nanosec": stamp[1]}


def shell_markers(scene: Scene, frames: Frames, stamp: Stamp) -> Message:
    """Return the shells as triangles in their own frames; curved ones as they touch."""
    drawn = {one.key: one for pair in scene.pairs for one in pair.shells}
    markers = []
    for number, (key, one) in enumerate(drawn.items()):
        mesh = SurfaceMesh.of(one.shell, curved=one.is_smooth)
        points = mesh.vertices[mesh.triangles].reshape(-1, 3)
        color = SURFACE_COLORS[number % len(SURFACE_COLORS)]
        name, size = frames.shells[key], (1.0, 1.0, 1.0)
        markers.append(_marker(stamp, name, name, 0, TRIANGLE_LIST, size, color, points=points))
    return {"markers": markers}


def body_markers(scene: Scene, frames: Frames, stamp: Stamp) -> Message:
    """Return the spheres, and a rod from each joint to the joints on it."""
    markers = []
    for of, names in enumerate((frames.spheres, frames.other_spheres)):
        for pair in scene.pairs:
            if pair.name in names:
                size = (2 * pair.spheres[of].radius,) * 3
                name = names[pair.name]
                markers.append(_marker(stamp, name, name, 0, SPHERE, size, SPHERE_COLOR, 0.6))
    model, width = scene.model, ROD * least_radius(scene)
    rods: dict[str, list[Array]] = {}
    for joint in range(1, model.njoints):
        parent = int(model.parents[joint])
        if parent == 0 and model.joints[joint].nv > 1:
            continue  # a body that flies free of the world
        name, placed = frames.on(parent)
        ends = (np.zeros(3), model.jointPlacements[joint].translation)
        rods.setdefault(name, []).extend(placed.actInv(np.array(end)) for end in ends)
    for name, points in rods.items():
        ends_of = np.array(points)
        size = (width, 0.0, 0.0)
        markers.append(
            _marker(stamp, name, f"rods/{name}", 0, LINE_LIST, size, LINK_COLOR, points=ends_of)
        )
    return {"markers": markers}


def contact_markers(
    contacts: SceneContacts, pairs: tuple[str, ...], scale: ArrowScale, size: float, stamp: Stamp
) -> Message:
    """Return what is drawn of the contacts of one row; what was drawn before disappears.

    A point each, `size` [m] wide, and from it two arrows: the normal force and the friction force
    on the sphere, at the lengths of `scale`.
    """
    markers: list[dict[str, object]] = [{"action": DELETEALL}]
    pair = contacts.pair[contacts.normal_force >= 0.0]
    if len(contacts):
        points = np.asarray(contacts.point_world)
        markers.append(
            _marker(stamp, WORLD, "points", 0, SPHERE_LIST, (size,) * 3, POINT_COLOR, points=points)
        )
    drawn = pushing(contacts)
    for k, point in enumerate(drawn.point):
        for what, color, force in (
            ("normal", NORMAL_COLOR, drawn.normal[k]),
            ("friction", FRICTION_COLOR, drawn.friction[k]),
        ):
            length = float(np.linalg.norm(force)) * scale.meters_per_newton
            if not 0.0 < length < np.inf:
                continue
            way = force * (scale.meters_per_newton * min(1.0, scale.longest / length))
            ends = np.array([point, point + way])
            name = f"{what}/{pairs[pair[k]]}"
            shape = (0.5 * size, size, 0.0)  # widths of shaft and head
            markers.append(_marker(stamp, WORLD, name, k, ARROW, shape, color, points=ends))
    return {"markers": markers}


def least_radius(scene: Scene) -> float:
    """Return the radius of the smallest sphere [m]; without any, 1 cm."""
    return min((one.radius for pair in scene.pairs for one in pair.spheres), default=0.01)
