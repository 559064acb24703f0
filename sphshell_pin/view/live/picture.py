"""The scene of the live page: a Display, and what only makes sense while things move."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.result.result_parts import Patches
from sphshell_pin.view import nodes
from sphshell_pin.view.arrows import ArrowPool, ArrowScale, Forces, arrow_length
from sphshell_pin.view.camera import View, choose_view
from sphshell_pin.view.display import HIDDEN_AT_FIRST, PARTS, Display
from sphshell_pin.view.patches import PatchScale
from sphshell_pin.view.surface import is_curved

if TYPE_CHECKING:
    from meshcat import Visualizer

    from sphshell_pin.dynamics.scene.scene import Scene, SceneContacts
    from sphshell_pin.scenario.live.acting import Dragged
    from sphshell_pin.view.live.player import Player

POOL = 16
# More of the robot than in a recording: here one looks round before one looks closely.
FAR = 18.0
# Frames with contact from which the scale of the arrows is taken.
FRAMES_TO_SCALE = 45
# A trail is drawn in pieces of so many points; the oldest piece makes room for the newest.
POINTS_OF_PIECE, PIECES = 48, 60

LIVE_PARTS: tuple[str, ...] = (*PARTS, "pressure")
DRAG_COLOR = 0x16A34A


class Picture:
    """Draws the state of `player` below `visualizer` again and again."""

    def __init__(self, player: Player, visualizer: Visualizer) -> None:
        scene = player.scene
        seen = player.contacts
        places = seen.point_world, seen.normal_world
        view = lowered(choose_view(scene, player.q[None], *places, player.visual_model, FAR))
        self.display = Display(scene, player.visual_model, visualizer, view=view, pool=_pool(scene))
        self.view: View = view
        self.shown = {part: part in PARTS and part not in HIDDEN_AT_FIRST for part in LIVE_PARTS}
        self.shown["pressure"] = player.patches is not None
        self._pairs = scene.pairs
        self._empty = _empty_parts(scene)
        self._scale = _Scale(scene, view)
        self._trails = _Trails(self.display)
        width = 0.0026 * view.distance
        self._push = ArrowPool(visualizer["push"], 1, width, total=True)
        self._drag: DragLine | None = None  # until something is dragged
        self.cut = False
        """Whether a force is larger than its arrow: no arrow is longer than the longest."""

    @property
    def arrow_scale(self) -> ArrowScale:
        """What the length of an arrow means now."""
        return self.display.arrow_scale

    @property
    def pressure(self) -> str | None:
        """What the colors and sizes of patches mean; None without any in the picture."""
        on = self.shown["points"] and self.shown["pressure"]
        shown = on and self.display.draws_patches
        return str(self.display.patch_scale) if shown else None

    def switches(self, player: Player, with_patches: bool) -> dict[str, bool]:
        """Return of the parts that have something to show whether they are shown.

        `with_patches` tells whether the patches of contacts can be computed.
        """
        empty = self._empty
        if not with_patches and player.patches is None:
            empty = empty | {"pressure"}
        return {part: on for part, on in self.shown.items() if part not in empty}

    def update(self, player: Player, push: Forces | None, drag: Dragged | None = None) -> None:
        """Show the state of `player`, a `push` on a body, and a `drag`."""
        if player.scene.pairs is not self._pairs:
            self._pairs = player.scene.pairs
            self._empty = _empty_parts(player.scene)
            if self.display.replace_scene(player.scene, player.visual_model):
                self._trails.draw_again()
        if not np.isfinite(player.q).all():
            return  # of a run that diverged the last sound state stays
        contacts = player.contacts
        scale = self._scale.update(contacts)
        self.display.arrow_scale = scale
        patches = player.patches if self.shown["pressure"] else None
        if patches is not None:
            self.display.patch_scale = self._scale.of_patches(patches)
        self.display.update(player.q, contacts, patches)
        if self.shown["trails"]:
            self._trails.add(contacts)
        self._push.update(push, scale)
        if drag is not None and self._drag is None:
            self._drag = DragLine(self.display.visualizer["drag"], self.view.distance)
        if self._drag is not None:
            self._drag.update(drag)
        pushed = () if push is None else np.linalg.norm(push.normal, axis=1)
        self.cut = scale.cuts(np.append(contacts.normal_force, pushed))

    def show(self, part: str, on: bool) -> None:
        """Show or hide one of LIVE_PARTS."""
        self.shown[part] = on
        if part == "pressure":
            self.display.show_patches(on)
        else:
            self.display.show(part, on)  # type: ignore[arg-type]

    def magnify_arrows(self, factor: float) -> None:
        """Draw arrows `factor` times as long as by themselves."""
        self._scale.factor = factor

    @property
    def magnification(self) -> float:
        """How many times longer than by themselves arrows are drawn."""
        return self._scale.factor

    def clear(self) -> None:
        """Remove the trails, and choose the scale again."""
        self._trails.clear()
        self._scale.forget()


class DragLine:
    """The spring of a drag below `visualizer`: from a point of the body to the cursor."""

    def __init__(self, visualizer: Visualizer, size: float) -> None:
        self._width = 0.0018 * size
        look = nodes.on_top(DRAG_COLOR)
        nodes.set_object(visualizer["line"], nodes.rod(1.0, 1.0), look, order=11)
        self._line = nodes.mover(visualizer["line"])
        self._ends: list[nodes.Move] = []
        for name, radius in (("held", 2.6), ("cursor", 1.6)):
            nodes.set_object(
                visualizer[name], nodes.sphere(radius * self._width, 16), look, order=11
            )
            self._ends.append(nodes.mover(visualizer[name]))

    def update(self, drag: Dragged | None) -> None:
        """Show `drag`, or nothing."""
        points = (np.zeros(3),) * 2 if drag is None else (drag.point_world, drag.target_world)
        span = points[1] - points[0]
        for move, point in zip(self._ends, points, strict=True):
            move(nodes.hidden_at(point) if drag is None else nodes.pose(np.eye(3), point))
        short = np.linalg.norm(span) <= self._width
        self._line(
            nodes.hidden_at(points[0]) if short else nodes.rod_along(points[0], span, self._width)
        )


class _Scale:
    """Chooses the length of arrows from the first forces that appear, and then keeps it."""

    def __init__(self, scene: Scene, view: View) -> None:
        self._size = view.distance
        self._length = arrow_length(scene, view.distance)
        self.factor = 1.0
        self.forget()

    def forget(self) -> None:
        """Choose the scale again."""
        self._seen: list[float] = []
        self._found = ArrowScale.from_forces(np.zeros(0), self._length)
        self._patches: list[Patches] = []
        self._patch_scale = PatchScale(1.0)

    def of_patches(self, patches: Patches) -> PatchScale:
        if len(self._patches) < FRAMES_TO_SCALE and len(patches):
            self._patches.append(patches)
            self._patch_scale = PatchScale.of(np.concatenate(self._patches), self._size)
        return self._patch_scale

    def update(self, contacts: SceneContacts) -> ArrowScale:
        if len(self._seen) < FRAMES_TO_SCALE and len(contacts):
            self._seen.append(float(np.max(contacts.normal_force)))
            self._found = ArrowScale.from_forces(np.array(self._seen), self._length)
        found = self._found
        return ArrowScale(
            found.reference_length * self.factor,
            found.reference_force,
            found.longest * max(1.0, self.factor),
        )


class _Trails:
    """Where the contacts have been, on their shells; of each pair the strongest contact."""

    def __init__(self, display: Display) -> None:
        self._display = display
        self._step = 0.6 * display.trail_width
        self._jump = 0.04 * display.view.distance
        self.clear()

    def clear(self) -> None:
        for pair in {pair for pair, _ in getattr(self, "_drawn", ())}:
            self._display.trail_node(pair).delete()
        self._drawn: dict[tuple[int, int], Array] = {}
        self._points: dict[int, list[Array]] = {}
        self._piece: dict[int, int] = {}
        self._undrawn: dict[int, int] = {}

    def draw_again(self) -> None:
        """Draw on shells that were drawn anew, without their trails."""
        for (index, slot), path in self._drawn.items():
            self._display.draw_trail(f"{index}_{slot}", path, index)

    def add(self, contacts: SceneContacts) -> None:
        """Go on to where `contacts` are now."""
        pairs = self._display.scene.pairs
        strongest: dict[int, int] = {}
        for k in np.argsort(contacts.normal_force, kind="stable"):
            strongest[int(contacts.pair[k])] = int(k)
        for index in [index for index in self._points if index not in strongest]:
            self._finish(index)
        for index, k in strongest.items():
            for one in pairs[index].shells:
                where = self._display.data.oMi[one.joint] * one.in_joint
                self._extend(index, where.actInv(contacts.point_world[k]))

    def _extend(self, index: int, point: Array) -> None:
        points = self._points.setdefault(index, [])
        if points:
            step = math.dist(points[-1], point)
            if step < self._step:
                return
            if step > self._jump:
                self._finish(index)
                points = self._points.setdefault(index, [])
        points.append(point)
        self._undrawn[index] = self._undrawn.get(index, 0) + 1
        full = len(points) >= POINTS_OF_PIECE
        # A piece is drawn again as it grows: every few points will do.
        if full or self._undrawn[index] >= 4:
            self._draw(index)
        if full:
            self._finish(index)
            self._points[index] = [point]

    def _draw(self, index: int) -> None:
        slot = self._piece.setdefault(index, 0) % PIECES
        self._undrawn[index] = 0
        path = np.array(self._points[index])
        if self._display.draw_trail(f"{index}_{slot}", path, index) is not None:
            self._drawn[index, slot] = path

    def _finish(self, index: int) -> None:
        if self._undrawn.get(index, 0) and len(self._points[index]) > 1:
            self._draw(index)
        if len(self._points.pop(index)) > 1:
            self._piece[index] = self._piece.get(index, 0) + 1


def _empty_parts(scene: Scene) -> frozenset[str]:
    """Return the parts that show nothing of `scene`."""
    shells = [(one.shell, one.is_smooth) for pair in scene.pairs for one in pair.shells]
    has = {
        "curved": any(is_curved(shell, smooth) for shell, smooth in shells),
        "faces": any(shell.element_face is None for shell, _ in shells),
        "pressure": bool(scene.pairs),
    }
    return frozenset(part for part, some in has.items() if not some)


def lowered(view: View) -> View:
    """Return a view of the same a little lower in the picture, below the figures over its top.

    It is farther off, so that nothing leaves the picture at the bottom.
    """
    lift = np.array([0.0, 0.0, 0.05 * view.distance])
    return View(view.eye + lift + 0.08 * (view.eye - view.target), view.target + lift)


def _pool(scene: Scene) -> int:
    return max(4, min(POOL, 2 * len(scene.pairs)))


def frame_point(model: pin.Model, data: pin.Data, name: str) -> Array | None:
    """Return the origin (3,) [m] of a frame or joint in the world; None if there is none."""
    if model.existFrame(name):
        frame = model.frames[model.getFrameId(name)]
        return np.array((data.oMi[frame.parentJoint] * frame.placement).translation)
    if model.existJointName(name):
        return np.array(data.oMi[model.getJointId(name)].translation)
    return None
