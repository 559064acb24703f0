"""Objects that meshcat's page draws but its Python package lacks: draw order, depth, typed lines.

Every object is a three.js JSON description, sent to any `meshcat.Visualizer` as one command.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import pinocchio as pin

from sphshell_pin._interrupts import interrupts_delayed
from sphshell_pin.base.arrays import Array, Ints, Longs
from sphshell_pin.errors import MissingExtra

if TYPE_CHECKING:
    from meshcat import Visualizer

IntArray = Ints | Longs
Json = dict[str, Any]
Move = Callable[[Array], object]

# Never zero: a transform with a zero scale cannot be decomposed, and its node is lost for good.
HIDDEN_SCALE = 1e-6


class Sent(Protocol):
    """What meshcat sends: its `lower` returns the dictionary that goes over the wire."""

    def lower(self) -> Json:
        """Return the dictionary."""


class Window(Protocol):
    """What meshcat draws in: a server, or one of our windows that keep the scene."""

    def send(self, command: Sent) -> object:
        """Take one command."""


class Command:
    """A meshcat command given as the dictionary that goes over the wire."""

    def __init__(self, data: Json) -> None:
        self._data = data

    def lower(self) -> Json:
        """Return the dictionary; meshcat calls this before it packs a command."""
        return self._data


def new_visualizer(window: Window | None = None) -> Visualizer:
    """Return a meshcat.Visualizer that draws in `window`, by default in a server of its own.

    Raises MissingExtra without meshcat.
    """
    try:
        with interrupts_delayed():
            import meshcat
    except ImportError as missing:
        raise MissingExtra("meshcat", "view", "the picture of a scene") from missing
    return meshcat.Visualizer(window=window)


def viewer_script() -> Path:
    """Return the file of meshcat's viewer for browsers; raise MissingExtra without meshcat."""
    found = importlib.util.find_spec("meshcat")
    if found is None or found.origin is None:
        raise MissingExtra("meshcat", "view", "the picture of a scene")
    return Path(found.origin).parent / "viewer" / "dist" / "main.min.js"


def typed_array(values: Array | IntArray) -> Json:
    """Describe the rows of `values` (n, k) as a three.js buffer attribute (float32 or uint32)."""
    import umsgpack

    floats = np.issubdtype(values.dtype, np.floating)
    name, code, dtype = ("Float32Array", 0x17, "<f4") if floats else ("Uint32Array", 0x16, "<u4")
    return {
        "itemSize": values.shape[1] if values.ndim == 2 else 1,
        "type": name,
        "array": umsgpack.Ext(code, np.ascontiguousarray(values, dtype=dtype).tobytes()),
        "normalized": False,
    }


def triangle_mesh(vertices: Array, triangles: IntArray, colors: Array | None = None) -> Json:
    """Geometry of an indexed mesh: `vertices` (n, 3) [m] of `colors` (n, 3), `triangles` (t, 3)."""
    attributes = {"position": typed_array(vertices)}
    if colors is not None:
        attributes["color"] = typed_array(colors)
    data = {"attributes": attributes, "index": typed_array(triangles.reshape(-1))}
    return {"type": "BufferGeometry", "data": data}


def line_segments(vertices: Array, segments: IntArray) -> Json:
    """Geometry of lines: `segments` (s, 2) index `vertices` (n, 3) [m]."""
    return triangle_mesh(vertices, segments)


def lattice(ticks: Array) -> tuple[Array, IntArray]:
    """Return the crossings (n, 3) of lines at `ticks` (k,) of x and y, z = 0, and the lines (s, 2).

    They are in pieces from crossing to crossing: some browsers lose lines that pass the camera.
    """
    x, y = np.meshgrid(ticks, ticks)
    points = np.stack((x.ravel(), y.ravel(), np.zeros(x.size)), axis=1)
    number = np.arange(x.size, dtype=np.int32).reshape(x.shape)
    ends = ((number[:, :-1], number[:, 1:]), (number[:-1], number[1:]))
    return points, np.concatenate([np.stack(pair, axis=-1).reshape(-1, 2) for pair in ends])


def sphere(radius: float, segments: int = 32) -> Json:
    """Geometry of a sphere of `radius` [m]."""
    return {
        "type": "SphereGeometry",
        "radius": radius,
        "widthSegments": segments,
        "heightSegments": segments // 2,
    }


def rod(radius_start: float, radius_end: float) -> Json:
    """Geometry of a rod or cone along y, one unit long and centered, as three.js has it."""
    return {
        "type": "CylinderGeometry",
        "radiusTop": radius_end,
        "radiusBottom": radius_start,
        "height": 1.0,
        "radialSegments": 24,
    }


def material(kind: str, color: int, opacity: float = 1.0, **properties: object) -> Json:
    """Material `kind` ("MeshPhong", "MeshBasic", "LineBasic"), two-sided by default."""
    return {
        "type": f"{kind}Material",
        "color": color,
        "side": 2,
        "transparent": opacity < 1.0,
        "opacity": opacity,
        **properties,
    }


def css(color: int) -> str:
    """Return a color as style sheets have it."""
    return f"#{color:06x}"


def on_top(color: int, opacity: float = 1.0) -> Json:
    """Material drawn over whatever hides it, unlit: for arrows and contact points."""
    return material(
        "MeshBasic", color, opacity, side=0, depthTest=False, depthWrite=False, transparent=True
    )


def set_object(
    visualizer: Visualizer, geometry: Json, look: Json, kind: str = "Mesh", order: int = 0
) -> None:
    """Put one object at the visualizer's path; larger `order` is drawn later.

    Its identifiers are made from the path, so that equal scenes give equal pages.
    """
    path = visualizer.path.lower()
    geometry = {"uuid": f"{path}#geometry", **geometry}
    look = {"uuid": f"{path}#material", **look}
    entity = {
        "uuid": f"{path}#object",
        "type": kind,
        "geometry": geometry["uuid"],
        "material": look["uuid"],
        "renderOrder": order,
    }
    data = {
        "metadata": {"version": 4.5, "type": "Object"},
        "geometries": [geometry],
        "materials": [look],
        "object": entity,
    }
    visualizer.window.send(Command({"type": "set_object", "path": path, "object": data}))


def mover(visualizer: Visualizer) -> Move:
    """Return the routine that places the visualizer's node at a homogeneous matrix (4, 4).

    A window that needs no command per matrix has its own `mover(path)`.
    """
    short = getattr(visualizer.window, "mover", None)
    move: Move = visualizer.set_transform if short is None else short(visualizer.path.lower())
    return move


def show(visualizer: Visualizer, on: bool) -> None:
    """Show or hide the visualizer's node and all below it."""
    visualizer.set_property("visible", bool(on))


def is_below(path: str, parent: str) -> bool:
    """Whether the node at `path` is the one at `parent`, or below it."""
    return f"{path}/".startswith(parent.rstrip("/") + "/")


def node_name(name: str) -> str:
    """Make `name` one step of a meshcat path, where a slash would open a new level."""
    return name.replace("/", "_") or "_"


def pose(rotation: Array, translation: Array, scale: Array | float = 1.0) -> Array:
    """Homogeneous (4, 4) of `rotation` (3, 3) times diag(`scale`), and `translation` (3,) [m]."""
    matrix = np.zeros((4, 4))
    np.multiply(rotation, scale, out=matrix[:3, :3])
    matrix[:3, 3] = translation
    matrix[3, 3] = 1.0
    return matrix


def hidden_at(place: Array) -> Array:
    """Return the matrix (4, 4) of a node that waits, too small to be seen, at `place` (3,) [m]."""
    return pose(np.eye(3), place, HIDDEN_SCALE)


def rod_along(start: Array, step: Array, width: float) -> Array:
    """Return the matrix (4, 4) that makes a unit rod the one from `start` along `step` (3,) [m].

    `width` [m] is what its radii are multiplied by; `step` must have a length.
    """
    shape = np.array([width, math.hypot(*step.tolist()), width])
    return pose(rotation_to(step), start + 0.5 * step, shape)


class OnJoint:
    """A node that hangs on a `joint` of the model, at `placement` in it."""

    def __init__(self, node: Visualizer, joint: int, placement: pin.SE3 | None = None) -> None:
        self.node, self.joint = node, joint
        self._placement = pin.SE3.Identity() if placement is None else placement
        self._move = mover(node)

    def update(self, data: pin.Data) -> None:
        """Place it where forward kinematics left its joint in `data`."""
        self._move((data.oMi[self.joint] * self._placement).homogeneous)


def rotation_to(direction: Array) -> Array:
    """Return a rotation (3, 3) that takes y, the axis of three.js's cylinders, to `direction`."""
    # Plain numbers: for three of them NumPy takes ten times as long, in every frame of every arrow.
    x, y, z = direction.tolist()
    length = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    # Across: the direction times the axis that is least along it.
    least = min(abs(x), abs(y), abs(z))
    if abs(x) == least:
        across = (0.0, z, -y)
    elif abs(y) == least:
        across = (-z, 0.0, x)
    else:
        across = (y, -x, 0.0)
    length = math.sqrt(1.0 - least * least)
    a, b, c = across[0] / length, across[1] / length, across[2] / length
    return np.array(((a, x, b * z - c * y), (b, y, c * x - a * z), (c, z, a * y - b * x)))
