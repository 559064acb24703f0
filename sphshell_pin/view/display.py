"""A Scene in a meshcat page: robot, shells, spheres, planes, contact points and force arrows."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import TYPE_CHECKING, Literal, TypeVar, get_args

import numpy as np
import pinocchio as pin

from sphshell_pin.dynamics.result.result_parts import Patches
from sphshell_pin.dynamics.scene.sides import PlaneSide
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.view import nodes
from sphshell_pin.view.arrows import ArrowPool, ArrowScale, pushing
from sphshell_pin.view.bodies import (
    DrawnPlane,
    DrawnShell,
    DrawnSphere,
    drawn_key,
    plane_key,
    sphere_key,
)
from sphshell_pin.view.camera import View, choose_view, look, set_surroundings
from sphshell_pin.view.frames import FrameAxes, draw_grid, floor_height, grid_spacing
from sphshell_pin.view.nodes import show
from sphshell_pin.view.patches import PatchPool, PatchScale
from sphshell_pin.view.robot import GeometryRobot, SkeletonRobot, frame_of_body
from sphshell_pin.view.surface import FACE_COLORS, tube

if TYPE_CHECKING:
    from meshcat import Visualizer
    from numpy.typing import ArrayLike

    from sphshell_pin.dynamics.scene.scene import Scene, SceneContacts

TRAIL_COLOR = 0x8E1B8E

Drawn = TypeVar("Drawn")

OfShells = Literal["wireframe", "trails", "curved", "faces"]
Part = Literal["robot", "spheres", "arrows", "points", "frames", "grid", OfShells]
PARTS: tuple[Part, ...] = get_args(Part)
"""What `Display.show` can show and hide.

"curved" are the curved elements of shells in contact by the method "smooth", in place of the flat
ones.
"""
HIDDEN_AT_FIRST: frozenset[Part] = frozenset({"faces", "frames"})
OF_SHELLS: frozenset[Part] = frozenset(get_args(OfShells))


class Display:
    """Draws `scene` once, then moves it: `update(q, contacts)`.

    `visual_model` is any geometry model of `scene.model`, visual or collision; without one the
    joints are drawn as a skeleton. `visualizer` is an existing `meshcat.Visualizer`; without one
    a page is served as `meshcat.Visualizer()` does. `view` places the camera and sets the sizes of
    arrows and points; without one it is chosen for the neutral configuration. At most
    `pool` contacts have arrows at a time. `arrow_scale` and `patch_scale` may be set at any time.

    Raises MissingExtra without meshcat, InvalidParameter for a geometry model that does not fit.
    """

    def __init__(
        self,
        scene: Scene,
        visual_model: pin.GeometryModel | None = None,
        visualizer: Visualizer | None = None,
        *,
        view: View | None = None,
        arrow_scale: ArrowScale | None = None,
        pool: int = 8,
    ) -> None:
        self.scene = scene
        self.visualizer = nodes.new_visualizer() if visualizer is None else visualizer
        self._model = scene.model
        self._data = self._model.createData()
        neutral = pin.neutral(self._model)
        if view is None:
            view = choose_view(scene, neutral[None, :], visual_model=visual_model)
        self.view = view
        self.arrow_scale = ArrowScale() if arrow_scale is None else arrow_scale
        self._hidden: set[Part] = set(HIDDEN_AT_FIRST)
        self._frames: FrameAxes | None = None  # until they are shown
        self._shells: dict[Hashable, DrawnShell] = {}
        self._spheres: dict[Hashable, DrawnSphere] = {}
        self._planes: dict[Hashable, DrawnPlane] = {}
        self._draw_bodies()
        self._visual_model = visual_model
        self._robot = self._make_robot(visual_model)
        self.patch_scale = PatchScale(1.0)
        self._pool = pool
        self._patches: PatchPool | None = None  # until there are some
        self._patches_on = True
        self._arrows = ArrowPool(self.visualizer["contacts"], pool, 0.0026 * self.view.distance)
        set_surroundings(self.visualizer)
        look(self.visualizer, self.view)
        self.update(neutral)
        self._floor = floor_height(scene, self._data)
        draw_grid(self.visualizer["grid"], self.view, self._floor)

    def update(
        self, q: ArrayLike, contacts: SceneContacts | None = None, patches: Patches | None = None
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
        bodies = self._shells, self._spheres, self._planes
        for one in (one for kind in bodies for one in kind.values()):
            one.update(self._data)
        if self._frames is not None and "frames" not in self._hidden:
            self._frames.update(self._data)
        self._arrows.update(None if contacts is None else pushing(contacts), self.arrow_scale)
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
    def grid(self) -> str | None:
        """What the grid shows, if it is shown."""
        step, height = f"{1e3 * grid_spacing(self.view):g} mm", round(self._floor, 6) + 0.0
        return None if "grid" in self._hidden else f"grid of {step} at z = {height:g} m"

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
        node = self.trail_node(pair)[nodes.node_name(name)]
        vertices, triangles = tube(path, self.trail_width)
        nodes.set_object(
            node, nodes.triangle_mesh(vertices, triangles), nodes.material("MeshBasic", TRAIL_COLOR)
        )
        return node

    def trail_node(self, pair: int | None = None) -> Visualizer:
        """Return the parent node of trails: on the shell of a `pair`, or in the world."""
        if pair is None:
            return self.visualizer["trail"]
        (side,) = self.scene.pairs[pair].shells
        return self._shells[drawn_key(side)].node["trail"]

    def replace_scene(self, scene: Scene, visual_model: pin.GeometryModel | None) -> bool:
        """Take `scene`, whose model has the same joints, for the one shown; draw what differs.

        Shells and spheres may be others, or sit elsewhere; `update` then places them.
        Returns whether the shells were drawn anew, without trails.
        """
        self.scene = scene
        if scene.model is not self._model:
            self._model, self._data = scene.model, scene.model.createData()
        anew = self._draw_bodies()
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
            self._arrows.show("arrows", on)
        elif part == "points":
            self._show_points()
        elif part in ("robot", "spheres", "grid"):
            show(self.visualizer[part], on)
        elif part == "frames":
            self._show_frames(on)
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
        self._arrows.show("points", on and not in_place)
        if self._patches is not None:
            show(self.visualizer["pressure"], on and in_place)

    def grips(self) -> dict[str, str]:
        """Return the nodes that show moving bodies: their paths, each with a frame of its body."""
        bodies = (*self._shells.values(), *self._spheres.values())
        held = [(one.node.path, frame_of_body(self._model, one.joint)) for one in bodies]
        held += self._robot.held()
        return {path.lower(): frame for path, frame in held if frame is not None}

    def _show_of_shell(self, shell: DrawnShell, part: Part, on: bool) -> None:
        if part == "faces":
            shell.show_faces(on)
        elif part == "curved":
            shell.show_curved(on)
            show(shell.node["elements"], "wireframe" not in self._hidden)
        else:
            show(shell.node["elements" if part == "wireframe" else "trail"], on)

    def _draw_bodies(self) -> bool:
        """Draw the bodies of the scene where they differ; return whether shells are drawn anew."""
        pairs = self.scene.pairs
        shells = ((drawn_key(one), one) for pair in pairs for one in pair.shells)
        anew = self._draw("shells", DrawnShell, self._shells, shells)
        for part in PARTS:
            if anew and part in OF_SHELLS and part in self._hidden ^ HIDDEN_AT_FIRST:
                for shell in self._shells.values():
                    self._show_of_shell(shell, part, part not in self._hidden)
        spheres = ((sphere_key(one), pair.name, one) for pair in pairs for one in pair.spheres)
        if self._draw("spheres", DrawnSphere, self._spheres, spheres) and "spheres" in self._hidden:
            show(self.visualizer["spheres"], False)
        planes = ((plane_key(pair), pair) for pair in pairs if isinstance(pair.side_i, PlaneSide))
        self._draw("planes", DrawnPlane, self._planes, planes)
        return anew

    def _draw(
        self,
        name: str,
        kind: Callable[..., Drawn],
        drawn: dict[Hashable, Drawn],
        wanted: Iterable[tuple[object, ...]],
    ) -> bool:
        """Draw what is `wanted`, keys and arguments of `kind`, unless it is what is `drawn`.

        Of equal keys the first counts. Returns whether it differed.
        """
        first: dict[Hashable, list[object]] = {}
        for key, *given in wanted:
            first.setdefault(key, given)
        if set(first) == set(drawn):
            return False
        self.visualizer[name].delete()
        drawn.clear()
        for key, given in first.items():
            drawn[key] = kind(self.visualizer[name], *given, len(drawn))
        return True

    def _make_robot(self, visual_model: pin.GeometryModel | None) -> GeometryRobot | SkeletonRobot:
        if visual_model is not None and len(visual_model.geometryObjects):
            return GeometryRobot(self.visualizer, self._model, visual_model)
        tips = [
            (one.joint, one.in_joint.translation)
            for pair in self.scene.pairs
            for one in pair.spheres
        ]
        drawn = {one.joint for one in self._spheres.values()}
        drawn |= {one.joint for one in self._shells.values()}
        return SkeletonRobot(self.visualizer, self._model, 0.5 * self.view.distance, tips, drawn)
