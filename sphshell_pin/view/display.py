"""A Scene in a meshcat page: robot, shells, spheres, planes, contact points and force arrows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
import pinocchio as pin

from sphshell_pin.dynamics.scene.models import frame_on_joint
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.view.arrows import ArrowKind, ArrowPool, ArrowScale, ContactColumns, pushing
from sphshell_pin.view.bodies import (
    COLORINGS,
    DrawnPlane,
    DrawnShell,
    DrawnSphere,
    PlaneKey,
    ShellKey,
    SphereKey,
    plane_key,
    shell_key,
    sphere_key,
)
from sphshell_pin.view.camera import REACH, View, ball_around, look, set_surroundings
from sphshell_pin.view.distance import Painting, range_text
from sphshell_pin.view.frames import FrameAxes, draw_grid, grid_spacing
from sphshell_pin.view.nodes import (
    FloatArray,
    material,
    new_visualizer,
    node_name,
    set_object,
    show,
    triangle_mesh,
)
from sphshell_pin.view.patches import PatchPool, PatchRows, PatchScale
from sphshell_pin.view.robot import GeometryRobot, SkeletonRobot, check_geometry_model
from sphshell_pin.view.surface import FACE_COLORS, tube

if TYPE_CHECKING:
    from meshcat import Visualizer
    from numpy.typing import ArrayLike

    from sphshell_pin.dynamics.scene.scene import Scene

TRAIL_COLOR = 0x8E1B8E
_WIDTH = 0.05  # of links, in sizes of the robot
_FAR = 2.0  # in sizes of the robot: corners of shells that are farther away may leave the picture


Part = Literal[
    "robot",
    "spheres",
    "arrows",
    "points",
    "wireframe",
    "trails",
    "curved",
    "frames",
    "grid",
    Painting,
]
PARTS: tuple[Part, ...] = get_args(Part)
"""What `Display.show` can show and hide.

"curved" are the curved elements of shells in contact by the method "smooth", in place of the flat
ones.
"""
HIDDEN_AT_FIRST: frozenset[Part] = frozenset({*get_args(Painting), "frames", "grid"})


class Display:
    """Draws `scene` once, then moves it: `update(q, contacts)`.

    `visual_model` is any geometry model of `scene.model`, visual or collision; without one the
    joints are drawn as a skeleton. `visualizer` is an existing `meshcat.Visualizer`; without one
    a page is served as `meshcat.Visualizer()` does. `view` places the camera and sets the sizes of
    arrows and points; without one it is chosen for the neutral configuration. `arrows` shows
    normal and friction force apart ("components") or their sum ("total"); at most `pool` contacts
    at a time. `arrow_scale` and `patch_scale` may be set at any time.

    Raises MissingExtra without meshcat, InvalidParameter for a geometry model that does not fit.
    """

    def __init__(
        self,
        scene: Scene,
        visual_model: pin.GeometryModel | None = None,
        visualizer: Visualizer | None = None,
        *,
        view: View | None = None,
        arrows: ArrowKind = "components",
        arrow_scale: ArrowScale | None = None,
        pool: int = 8,
    ) -> None:
        if arrows not in ("components", "total"):
            raise InvalidParameter("arrows", arrows, 'must be "components" or "total"')
        self.scene = scene
        self.visualizer = new_visualizer() if visualizer is None else visualizer
        self._model = scene.model
        self._data = self._model.createData()
        neutral = pin.neutral(self._model)
        if view is None:
            view = choose_view(scene, neutral[None, :], visual_model=visual_model)
        self.view = view
        self.arrow_scale = ArrowScale() if arrow_scale is None else arrow_scale
        self._hidden: set[Part] = set(HIDDEN_AT_FIRST)
        self._frames: FrameAxes | None = None  # until they are shown
        self._shells: dict[ShellKey, DrawnShell] = {}
        self._spheres: dict[SphereKey, DrawnSphere] = {}
        self._planes: dict[PlaneKey, DrawnPlane] = {}
        self._draw_shells()
        self._draw_spheres()
        self._draw_planes()
        self._visual_model = visual_model
        self._robot = self._make_robot(visual_model)
        self.patch_scale = PatchScale(1.0)
        self._pool = pool
        self._patches: PatchPool | None = None  # until there are some
        self._patches_on = True
        self._arrows = ArrowPool(
            self.visualizer["contacts"], pool, 0.0026 * self.view.distance, arrows
        )
        set_surroundings(self.visualizer)
        look(self.visualizer, self.view)
        self.update(neutral)

    def update(
        self,
        q: ArrayLike,
        contacts: ContactColumns | None = None,
        patches: PatchRows | None = None,
    ) -> None:
        """Show configuration `q` (nq,) and `contacts` (of `scene.contacts`, or None for none).

        `patches` (k,) of the contacts are drawn in place of the contact points.
        """
        configuration = np.asarray(q, dtype=float)
        if configuration.shape != (self._model.nq,):
            raise InvalidParameter(
                "q", configuration.shape, f"must have the shape ({self._model.nq},)"
            )
        pin.forwardKinematics(self._model, self._data, configuration)
        self._robot.update(self._data)
        for shell in self._shells.values():
            shell.update(self._data)
        for ball in self._spheres.values():
            ball.update(self._data)
        for plane in self._planes.values():
            plane.update(self._data)
        if self._frames is not None and "frames" not in self._hidden:
            self._frames.update(self._data)
        pair = getattr(contacts, "pair", None)
        seen = contacts if contacts is None or pair is None else pushing(contacts, pair)
        self._arrows.update(seen, self.arrow_scale)
        if patches is None:
            return
        if self._patches is None:
            self._patches = PatchPool(self.visualizer["pressure"], self._pool)
            self._show_points()
        self._patches.update(contacts, patches, self.patch_scale)

    @property
    def data(self) -> pin.Data:
        """The joints' placements of the last `update`."""
        return self._data

    @property
    def largest_distance(self) -> float:
        """The distance between curved and flat elements that has the last color [m].

        It is the largest of all shells.
        """
        return max((shell.largest_distance for shell in self._shells.values()), default=0.0)

    @property
    def coloring(self) -> str | None:
        """What the colors of the shells mean, if they are those of "distance"."""
        if "distance" in self._hidden:
            return None
        return range_text(self.largest_distance)

    @property
    def grid(self) -> str | None:
        """What the grid shows, if it is shown."""
        step = f"{1e3 * grid_spacing(self.view):g} mm"
        return None if "grid" in self._hidden else f"grid of {step} at z = 0"

    @property
    def face_keys(self) -> list[tuple[str, str]]:
        """The colors of the kinds of faces and their names, if "faces" is shown."""
        names = {"none": "on no face recognized"}
        keys = [(color, names.get(kind, kind)) for kind, color in FACE_COLORS.items()]
        return [] if "faces" in self._hidden else keys

    @property
    def draws_patches(self) -> bool:
        """Whether patches were given to `update`."""
        return self._patches is not None

    @property
    def trail_width(self) -> float:
        """Radius of the lines that `draw_trail` draws [m]."""
        return 0.0014 * self.view.distance

    def draw_trail(
        self, name: str, points: ArrayLike, pair: int | None = None
    ) -> Visualizer | None:
        """Draw a line along `points` (k, 3) [m]; return its node, None if there is no length.

        With `pair`, the index of a contact pair, the points are in its shell's frame and move with
        the shell; else they are in the world.
        """
        path = np.asarray(points, dtype=float).reshape(-1, 3)
        steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
        path = path[np.append(True, steps > 1e-3 * self.trail_width)]
        if len(path) < 2:
            return None
        node = self.trail_node(pair)[node_name(name)]
        vertices, triangles = tube(path, self.trail_width)
        set_object(node, triangle_mesh(vertices, triangles), material("MeshBasic", TRAIL_COLOR))
        return node

    def trail_node(self, pair: int | None = None) -> Visualizer:
        """Return the parent node of trails: on the shell of a `pair`, or in the world."""
        if pair is None:
            return self.visualizer["trail"]
        return self._shells[shell_key(self.scene.pairs[pair])].node["trail"]

    def replace_scene(self, scene: Scene, visual_model: pin.GeometryModel | None) -> bool:
        """Take `scene`, whose model has the same joints, for the one shown; draw what differs.

        Shells and spheres may be others, or sit elsewhere; `update` then places them.
        Returns whether the shells were drawn anew, without trails.
        """
        self.scene = scene
        if scene.model is not self._model:
            self._model, self._data = scene.model, scene.model.createData()
        anew = {shell_key(pair) for pair in scene.pairs if pair.shell} != set(self._shells)
        if anew:
            self.visualizer["shells"].delete()
            self._draw_shells()
        if {sphere_key(one) for pair in scene.pairs for one in pair.spheres} != set(self._spheres):
            self.visualizer["spheres"].delete()
            self._draw_spheres()
        if {plane_key(pair) for pair in scene.pairs if pair.plane} != set(self._planes):
            self.visualizer["planes"].delete()
            self._draw_planes()
        self._show_frames("frames" not in self._hidden)
        if visual_model is not self._visual_model:
            self._visual_model = visual_model
            self.visualizer["robot"].delete()
            self._robot = self._make_robot(visual_model)
            show(self.visualizer["robot"], "robot" not in self._hidden)
        return anew

    def show(self, part: Part, on: bool) -> None:
        """Show or hide one part of the picture; see PARTS."""
        if part not in PARTS:
            raise InvalidParameter("part", part, f"must be one of {', '.join(PARTS)}")
        self._hidden = self._hidden - {part} if on else self._hidden | {part}
        if part == "arrows":
            self._arrows.show_arrows(on)
        elif part == "points":
            self._show_points()
        elif part in ("robot", "spheres"):
            show(self.visualizer[part], on)
        elif part == "frames":
            self._show_frames(on)
        elif part == "grid":
            draw_grid(self.visualizer["grid"], self.view)
            show(self.visualizer["grid"], on)
        else:
            for shell in self._shells.values():
                self._show_of_shell(shell, part, on)

    def _show_frames(self, on: bool) -> None:
        """Draw the axes of the scene of now, or none."""
        if self._frames is not None:
            self.visualizer["frames"].delete()
        self._frames = None
        if on:
            self._frames = FrameAxes(self.visualizer["frames"], self.scene, self.view.distance)
            self._frames.update(self._data)

    def show_patches(self, on: bool) -> None:
        """Draw the patches that `update` is given, or the contact points in their place."""
        self._patches_on = on
        self._show_points()

    def _show_points(self) -> None:
        on = "points" not in self._hidden
        in_place = self._patches is not None and self._patches_on
        self._arrows.show_points(on and not in_place)
        if self._patches is not None:
            show(self.visualizer["pressure"], on and in_place)

    def grips(self) -> dict[str, str]:
        """Return the nodes that show moving bodies: their paths, each with a frame of its body."""
        held = [(one.node, one.joint) for one in self._shells.values()]
        held += [(one.node, one.joint) for one in self._spheres.values()]
        found = {}
        for node, joint in held:
            frame = frame_on_joint(self._model, joint)
            if joint and frame is not None:
                found[node.path.lower()] = frame
        return found | self._robot.grips()

    def _show_of_shell(self, shell: DrawnShell, part: Part, on: bool) -> None:
        if part in COLORINGS:
            shell.show_coloring(part, on, self.largest_distance if on else 0.0)
        elif part == "curved":
            shell.show_curved(on)
            show(shell.node["elements"], "wireframe" not in self._hidden)
        else:
            show(shell.node["elements" if part == "wireframe" else "trail"], on)

    def _draw_shells(self) -> None:
        self._shells.clear()
        for pair in self.scene.pairs:
            if pair.shell is not None and shell_key(pair) not in self._shells:
                drawn = DrawnShell(self.visualizer["shells"], pair, len(self._shells))
                self._shells[shell_key(pair)] = drawn
                for part in ("curved", "wireframe", "trails"):
                    if part in self._hidden:
                        self._show_of_shell(drawn, part, False)
        colorings: tuple[Part, ...] = get_args(Painting)
        for coloring in colorings:
            if coloring not in self._hidden:
                for drawn in self._shells.values():
                    self._show_of_shell(drawn, coloring, True)

    def _draw_spheres(self) -> None:
        self._spheres.clear()
        for pair in self.scene.pairs:
            for one in pair.spheres:
                if sphere_key(one) not in self._spheres:
                    drawn = DrawnSphere(
                        self.visualizer["spheres"], pair.name, one, len(self._spheres)
                    )
                    self._spheres[sphere_key(one)] = drawn
        if "spheres" in self._hidden:
            show(self.visualizer["spheres"], False)

    def _draw_planes(self) -> None:
        self._planes.clear()
        for pair in self.scene.pairs:
            if pair.plane is not None and plane_key(pair) not in self._planes:
                drawn = DrawnPlane(self.visualizer["planes"], pair, len(self._planes))
                self._planes[plane_key(pair)] = drawn

    def _make_robot(self, visual_model: pin.GeometryModel | None) -> GeometryRobot | SkeletonRobot:
        if visual_model is not None and len(visual_model.geometryObjects):
            return GeometryRobot(self.visualizer, self._model, visual_model)
        tips = [
            (one.joint, one.placement.translation)
            for pair in self.scene.pairs
            for one in pair.spheres
        ]
        drawn = {one.joint for one in self._spheres.values()}
        drawn |= {one.joint for one in self._shells.values()}
        return SkeletonRobot(self.visualizer, self._model, 0.5 * self.view.distance, tips, drawn)


def choose_view(
    scene: Scene,
    configurations: FloatArray,
    points_world: FloatArray | None = None,
    normals_world: FloatArray | None = None,
    visual_model: pin.GeometryModel | None = None,
    reach: float = REACH,
    direction: FloatArray | None = None,
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
    boxes = [
        (pair.joint_j, pair.placement_j, *np.asarray(pair.shell.box))
        for pair in scene.pairs
        if pair.shell is not None
    ]
    shells = len(boxes)
    if visual_model is not None:
        check_geometry_model(model, visual_model)
        boxes += _geometry_boxes(visual_model)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    centers: list[FloatArray] = []
    around: list[FloatArray] = []
    on_shells: list[FloatArray] = []
    radii = [one.radius for pair in scene.pairs for one in pair.spheres]
    for row in np.unique(np.linspace(0, len(configurations) - 1, 60).astype(int)):
        pin.forwardKinematics(model, data, configurations[row])
        for joint in range(1, model.njoints):
            around.append(np.array(data.oMi[joint].translation))
        for pair in scene.pairs:
            for one in pair.spheres:
                centers.append(data.oMi[one.joint].act(one.placement.translation))
        if row == 0:
            for k, (joint, placement, low, high) in enumerate(boxes):
                where = data.oMi[joint] * placement
                (on_shells if k < shells else around).extend(
                    where.act(low + corner * (high - low)) for corner in corners
                )
    touched = points_world is not None and len(points_world)
    action = np.array(centers) if centers else np.array(around or [np.zeros(3)])
    if touched and points_world is not None:
        action = points_world if not centers else np.vstack((action, points_world))
    radius = min(radii, default=0.02)
    if whole and around:
        robot = np.array(around + centers)
        (middle, size), (center, half) = ball_around(robot), ball_around(action, 4.0 * radius)
        # Joints are points, links have some width.
        links = robot[:, None] + _WIDTH * size * np.vstack((np.eye(3), -np.eye(3)))
        around += list(links.reshape(-1, 3))
        # A shell is there as a whole, unless it is a floor that would leave little of the rest.
        most = max(_FAR * size, reach * half)
        for k in range(0, len(on_shells), len(corners)):
            shell = np.array(on_shells[k : k + len(corners)])
            near = np.linalg.norm(shell - middle, axis=1) <= _FAR * size
            near |= np.linalg.norm(shell - center, axis=1) <= reach * half
            around += list(shell if near.any() and ball_around(shell)[1] <= most else shell[near])
        on_shells = []
        reach = np.inf
    around += on_shells
    normal = np.zeros(3)
    if touched and normals_world is not None:
        mean = normals_world.mean(axis=0)
        # Normals on a plane lead into it; the eye stays on the side of the shells.
        below = all(pair.plane is not None for pair in scene.pairs)
        normal = (-mean if below else mean) / max(float(np.linalg.norm(mean)), 1e-9)
    return View.of(action, np.array(around).reshape(-1, 3), normal, radius, reach, direction)


def _geometry_boxes(
    geometry_model: pin.GeometryModel,
) -> list[tuple[int, pin.SE3, FloatArray, FloatArray]]:
    """Return joint, placement and box (low, high) of geometry whose loaded size can be trusted."""
    boxes = []
    for body in geometry_model.geometryObjects:
        # Coal ignores the length unit that a Collada file states, the page does not.
        if body.meshPath.lower().endswith(".dae"):
            continue
        body.geometry.computeLocalAABB()
        box = body.geometry.aabb_local
        low, high = np.array(box.min_), np.array(box.max_)
        if np.isfinite([low, high]).all() and np.abs([low, high]).max() < 1e6:
            boxes.append((body.parentJoint, body.placement, low, high))
    return boxes
