"""Where to look from: close enough to read the contact, far enough to know the robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.sides import PlaneSide
from sphshell_pin.view.nodes import Command
from sphshell_pin.view.robot import check_geometry_model

if TYPE_CHECKING:
    from meshcat import Visualizer

    from sphshell_pin.dynamics.scene.scene import Scene

FIELD_OF_VIEW = 40.0  # vertical [deg]
ASPECT = 1.2  # of the part of the window that legend and controls leave free
REACH = 8.0  # in sizes of the action: what is farther away need not be in the picture
MARGIN = 1.12  # joints are points, links have some width
_WIDTH = 0.05  # of links, in sizes of the robot
_FAR = 2.0  # in sizes of the robot: corners of shells that are farther away may leave the picture

# From the target to the eye, None where it is chosen. From straight above there is no upright: y
# points up in the picture.
DIRECTIONS: dict[str, Array | None] = {
    "fit": None,
    "front": np.array([1.0, 0.0, 0.0]),
    "side": np.array([0.0, -1.0, 0.0]),
    "top": np.array([0.0, -1e-3, 1.0]) / np.hypot(1.0, 1e-3),
}

_CORNERS = np.array(np.meshgrid(*3 * [(-1.0, 1.0)])).reshape(3, -1).T


@dataclass(frozen=True)
class View:
    """A camera at `eye` (3,) that looks at `target` (3,), world frame [m]."""

    eye: Array
    target: Array

    @property
    def distance(self) -> float:
        """From eye to target [m]."""
        return float(np.linalg.norm(self.eye - self.target))

    @classmethod
    def of(
        cls,
        action: Array,
        around: Array,
        normal: Array,
        radius: float,
        reach: float = REACH,
        direction: Array | None = None,
    ) -> View:
        """Choose a view of the points `action` (k, 3) where the contact happens.

        `around` (m, 3) are points of robot and shell worth having in the picture; those farther
        away than `reach` times the size of the action are let go. `normal` (3,) is the mean contact
        normal (zero if there is none): the eye stands on its side, unless a unit `direction` (3,)
        from the target to the eye is given. `radius` [m] is the smallest sphere's. All in the
        world [m].
        """
        middle, half = ball_around(action, 4.0 * radius)
        kept = around[np.linalg.norm(around - middle, axis=1) <= reach * half]
        subject = np.vstack((kept, middle + half * _CORNERS / np.sqrt(3.0)))
        if direction is None:
            direction = _direction(middle, subject, normal)
        # Fit the subject into the picture, upright, as seen along this direction.
        right = np.cross(np.array([0.0, 0.0, 1.0]), direction)
        right /= np.linalg.norm(right)
        axes = np.stack((right, np.cross(direction, right), direction))
        seen = (subject - middle) @ axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        tangent = np.tan(np.deg2rad(0.5 * FIELD_OF_VIEW))
        width, height = 0.5 * (high - low)[:2]
        distance = MARGIN * max(height / tangent, width / (ASPECT * tangent))
        target = middle + 0.5 * (low + high) @ axes
        return cls(target + (distance + 0.3 * (high[2] - low[2])) * direction, target)


def ball_around(points: Array, least: float = 0.0) -> tuple[Array, float]:
    """Return center (3,) and radius, `least` or more, of the ball around the box of points [m]."""
    low, high = points.min(axis=0), points.max(axis=0)
    return 0.5 * (low + high), max(0.5 * float(np.linalg.norm(high - low)), least)


def _direction(target: Array, subject: Array, normal: Array) -> Array:
    """Return the unit vector (3,) from the target to the eye: from where the surface is seen."""
    reach = np.linalg.norm(subject - target, axis=1).max()
    outward = np.array([target[0], target[1], 0.0])
    if np.linalg.norm(outward) < 0.3 * reach:
        outward = np.array([0.9, -0.45, 0.0])
    outward /= np.linalg.norm(outward)
    # Well to the side of straight ahead, so that neither arm nor arrows hide the contact.
    turn = np.deg2rad(-50.0)
    cosine, sine = np.cos(turn), np.sin(turn)
    sideways = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 0.0]]) @ outward
    # The flatter the subject lies, the more from above: a turntable, a pair of gears.
    extent = np.ptp(subject, axis=0)
    flatness = 1.0 - min(1.0, float(extent[2] / max(extent[0], extent[1], 1e-12)))
    direction = sideways + 0.35 * normal + np.array([0.0, 0.0, 0.3 + 0.6 * flatness])
    if direction @ normal < 0.25:
        direction = direction + 0.8 * normal
    # Straight from above or below there is no upright.
    direction[2] = np.clip(direction[2], -1.5, 1.5)
    if np.hypot(direction[0], direction[1]) < 0.3:
        direction[:2] += 0.5 * outward[:2]
    return np.asarray(direction / np.linalg.norm(direction))


def choose_view(
    scene: Scene,
    configurations: Array,
    points_world: Array | None = None,
    normals_world: Array | None = None,
    visual_model: pin.GeometryModel | None = None,
    reach: float = REACH,
    direction: Array | None = None,
    *,
    whole: bool = False,
) -> View:
    """Choose a camera for the `configurations` (n, nq) and the contacts seen in them, world [m].

    Without contacts the spheres are where things happen; without spheres, the joints. What is
    farther away than `reach` times the size of that need not be in the picture; with `whole` all of
    the robot is, and of the shells what is not far from it. `direction` (3,) leads from the target
    to the eye; without it, it is chosen. Raises InvalidParameter for a `visual_model` that does not
    hang on the scene's joints.
    """
    model, data = scene.model, scene.model.createData()
    boxes = []
    if visual_model is not None:
        check_geometry_model(model, visual_model)
        boxes = _geometry_boxes(visual_model)
    spheres = [one for pair in scene.pairs for one in pair.spheres]
    centers: list[Array] = []
    around: list[Array] = []
    shells: list[Array] = []
    for row in np.unique(np.linspace(0, len(configurations) - 1, 60).astype(int)):
        pin.forwardKinematics(model, data, configurations[row])
        around += [np.array(data.oMi[k].translation) for k in range(1, model.njoints)]
        centers += [data.oMi[one.joint].act(one.in_joint.translation) for one in spheres]
        if row == 0:
            for joint, placement, box in boxes:
                around += list(_corners(data.oMi[joint] * placement, box))
            for pair in scene.pairs:
                for one in pair.shells:
                    where = data.oMi[one.joint] * one.in_joint
                    shells.append(_corners(where, np.asarray(one.shell.box)))
    action = np.array(centers or around or [np.zeros(3)])
    if points_world is not None and len(points_world):
        action = np.vstack((action, points_world)) if centers else points_world
    radius = min((one.radius for one in spheres), default=0.02)
    if whole and around:
        robot = np.array(around + centers)
        (middle, size), (center, half) = ball_around(robot), ball_around(action, 4.0 * radius)
        # Joints are points, links have some width.
        links = robot[:, None] + _WIDTH * size * np.vstack((np.eye(3), -np.eye(3)))
        around += list(links.reshape(-1, 3))
        # A shell is there as a whole, unless it is a floor that would leave little of the rest.
        most = max(_FAR * size, reach * half)
        for k, shell in enumerate(shells):
            near = np.linalg.norm(shell - middle, axis=1) <= _FAR * size
            near |= np.linalg.norm(shell - center, axis=1) <= reach * half
            if not near.any() or ball_around(shell)[1] > most:
                shells[k] = shell[near]
        reach = np.inf
    around += [corner for shell in shells for corner in shell]
    normal = np.zeros(3)
    if normals_world is not None and len(normals_world):
        mean = normals_world.mean(axis=0)
        # Normals on a plane lead into it; the eye stays on the side of the shells.
        below = all(isinstance(pair.side_i, PlaneSide) for pair in scene.pairs)
        normal = (-mean if below else mean) / max(float(np.linalg.norm(mean)), 1e-9)
    return View.of(action, np.array(around).reshape(-1, 3), normal, radius, reach, direction)


def _corners(where: pin.SE3, box: Array) -> Array:
    """Return the corners (8, 3) [m] of a `box` (2, 3) that is placed at `where`."""
    low, high = box
    corners = 0.5 * (low + high) + 0.5 * (high - low) * _CORNERS
    return np.asarray(corners @ where.rotation.T + where.translation)


def _geometry_boxes(geometry_model: pin.GeometryModel) -> list[tuple[int, pin.SE3, Array]]:
    """Return joint, placement and box (2, 3) of geometry whose loaded size can be trusted."""
    boxes = []
    for body in geometry_model.geometryObjects:
        # Coal ignores the length unit that a Collada file states, the page does not.
        if body.meshPath.lower().endswith(".dae"):
            continue
        body.geometry.computeLocalAABB()
        box = body.geometry.aabb_local
        ends = np.array([box.min_, box.max_])
        if np.isfinite(ends).all() and np.abs(ends).max() < 1e6:
            boxes.append((body.parentJoint, body.placement, ends))
    return boxes


def look(visualizer: Visualizer, view: View) -> None:
    """Point the page's camera; the mouse then orbits about the target.

    meshcat 0.3.2's own live page does not know the target yet, and looks at the world's origin.
    """
    path = visualizer["/Cameras/default/rotated"].path.lower()
    camera = {
        "uuid": f"{path}#camera",
        "type": "PerspectiveCamera",
        "fov": FIELD_OF_VIEW,
        "aspect": ASPECT,
        "near": 0.005 * view.distance,
        "far": 200.0 * view.distance,
        "zoom": 1.0,
    }
    placed = {"type": "set_object", "path": path, "object": {"object": camera}}
    visualizer.window.send(Command(placed))
    visualizer["/Cameras/default/rotated/<object>"].set_property("position", _y_up(view.eye))
    target = {"type": "set_target", "path": "", "value": _y_up(view.target)}
    visualizer.window.send(Command(target))


def _y_up(point: Array) -> list[float]:
    """Return `point` (3,) as the page's camera has it, with y up."""
    x, y, z = (float(value) for value in point)
    return [x, z, -y]


def set_surroundings(visualizer: Visualizer) -> None:
    """Give the page a light background; hide the axes at the world's origin and the ground grid.

    The grid lies at z = 0 and would cut through whatever stands there; the page's controls bring
    both back.
    """
    visualizer["/Background"].set_property("top_color", [1.0, 1.0, 1.0])
    visualizer["/Background"].set_property("bottom_color", [0.80, 0.84, 0.88])
    for node in ("/Axes", "/Grid"):
        visualizer[node].set_property("visible", False)
