"""Axes of frames and a grid on the ground: what tells where things are, and how they are turned."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from sphshell_pin.view import nodes
from sphshell_pin.view.arrows import nice

if TYPE_CHECKING:
    from meshcat import Visualizer

    from sphshell_pin.dynamics.scene.scene import Scene
    from sphshell_pin.view.camera import View

AXIS_COLORS = (0xD9484F, 0x2F9E44, 0x2B7FD4)
PALE_AXIS_COLORS = (0xE79A9A, 0x97CC99, 0x8FBFEA)  # where they are always there, beside arrows
GRID_COLOR = 0x7B8794
FEW = 20  # more axes are shorter
LINES = 20  # of the grid, on each side of its middle


def draw_axes(node: Visualizer, width: float, length: float, looks: list[nodes.Json]) -> None:
    """Draw x, y and z of `length` [m] and half `width` [m] below `node`, with a look for each."""
    for axis, look in enumerate(looks):
        arm = node["xyz"[axis]]
        nodes.set_object(arm, nodes.rod(0.45, 0.45), look, order=9)
        arm.set_transform(nodes.rod_along(np.zeros(3), length * np.eye(3)[axis], width))


class FrameAxes:
    """The axes of the world, of each joint, and of the spheres and shells of `scene`.

    x is red, y green and z blue, over whatever hides them; those of the world are twice as long.
    """

    def __init__(self, visualizer: Visualizer, scene: Scene, size: float) -> None:
        model = scene.model
        places = [(joint, pin.SE3.Identity()) for joint in range(model.njoints)]
        for pair in scene.pairs:
            places += [(one.joint, one.in_joint) for one in (*pair.spheres, *pair.shells)]
        length = (0.05 if len(places) <= FEW else 0.025) * size
        looks = [nodes.on_top(color) for color in AXIS_COLORS]
        self._drawn: dict[tuple[int, bytes], nodes.OnJoint] = {}
        for joint, placement in places:
            key = joint, placement.homogeneous.tobytes()
            if key not in self._drawn:
                node = visualizer[f"frame_{len(self._drawn)}"]
                draw_axes(node, 0.06 * length, length if self._drawn else 2.0 * length, looks)
                self._drawn[key] = nodes.OnJoint(node, joint, placement)

    def update(self, data: pin.Data) -> None:
        """Place them where forward kinematics left the joints in `data`."""
        for one in self._drawn.values():
            one.update(data)


def grid_spacing(view: View) -> float:
    """Return the distance of two lines of the grid [m]."""
    return nice(view.distance / 12.0)


def floor_height(scene: Scene, data: pin.Data) -> float:
    """Return the height [m] of the floor: 0, where the robot stands, or below the lowest shell.

    The shells are where forward kinematics left the joints in `data`.
    """
    lowest = 0.0
    for one in (one for pair in scene.pairs for one in pair.shells):
        placement = data.oMi[one.joint] * one.in_joint
        low, high = np.asarray(one.shell.box)
        down = placement.rotation[2]
        reach = 0.5 * np.abs(down) @ (high - low)
        height = placement.translation[2] + 0.5 * down @ (low + high) - reach
        lowest = min(lowest, float(height))
    return lowest


def draw_grid(node: Visualizer, view: View, height: float) -> None:
    """Draw a grid at a `height` [m] below `node`, around what `view` looks at."""
    step = grid_spacing(view)
    points, segments = nodes.lattice(np.arange(-LINES, LINES + 1.0))
    points = step * (points + np.round(np.array([*view.target[:2], 0.0]) / step))
    points[:, 2] = height
    look = nodes.material("LineBasic", GRID_COLOR, 0.45, depthWrite=False)
    nodes.set_object(node, nodes.line_segments(points, segments), look, "LineSegments")
