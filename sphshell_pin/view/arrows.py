"""Force arrows and contact points: a fixed pool of nodes that only ever change their transforms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.view import nodes
from sphshell_pin.view.nodes import show

if TYPE_CHECKING:
    from meshcat import Visualizer

    from sphshell_pin.dynamics.scene.scene import Scene, SceneContacts

NORMAL_COLOR = 0xD4202A
FRICTION_COLOR = 0xF08A00
TOTAL_COLOR = 0xB0127B
POINT_COLOR = 0x101418

HEAD_LENGTH = 6.5  # in half widths of the shaft
SAME_CONTACT = 30.0  # likewise: farther away it is another contact


def nice(value: float) -> float:
    """Round a positive `value` to the nearest 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    steps = np.array([1.0, 2.0, 5.0, 10.0])
    return float(steps[np.argmin(np.abs(np.log(steps * power / value)))] * power)


def arrow_length(scene: Scene, distance: float) -> float:
    """Return how long the usual arrow is in a picture seen from a `distance` [m]."""
    radii = [one.radius for pair in scene.pairs for one in pair.spheres]
    return min([0.16 * distance, *(12.0 * radius for radius in radii)])


@dataclass(frozen=True)
class ArrowScale:
    """How forces become lengths: `reference_length` [m] stands for `reference_force` [N].

    No arrow is drawn longer than `longest` [m].
    """

    reference_length: float = 0.1
    reference_force: float = 10.0
    longest: float = np.inf

    @property
    def meters_per_newton(self) -> float:
        """Length per force [m/N]."""
        return self.reference_length / self.reference_force

    @classmethod
    def from_forces(cls, forces: Array, length: float) -> ArrowScale:
        """Choose the scale at which the peak of `forces` (k,) [N] is about `length` [m] long.

        A peak far above the rest (an impact before a rest) would leave nothing to see of the rest:
        beyond 1.6 times the median, the median sets the scale, and very long arrows are cut.
        """
        reference = nice(length)
        present = forces[np.isfinite(forces) & (forces > 0.0)]
        if not present.size:
            return cls(reference, 10.0, 2.5 * reference)
        peak = min(float(present.max()), 1.6 * float(np.median(present)))
        return cls(reference, nice(peak * reference / length), 2.5 * reference)

    def cuts(self, forces: Array) -> bool:
        """Tell whether any of `forces` (k,) [N] has an arrow longer than the longest."""
        return bool(np.any(forces * self.meters_per_newton > self.longest))

    def __str__(self) -> str:
        return f"{self.reference_length * 1e3:g} mm = {self.reference_force:g} N"


def largest_force(contacts: SceneContacts) -> Array:
    """Magnitude (k,) of the total force of each contact [N]."""
    total = contacts.normal_world * contacts.normal_force[:, None] + contacts.friction_force_world
    return np.asarray(np.linalg.norm(total, axis=1))


@dataclass(frozen=True)
class Forces:
    """Forces (k, 3) [N] to be drawn as arrows from `point` (k, 3) [m], in the world."""

    point: Array
    normal: Array
    friction: Array


def pushing(contacts: SceneContacts) -> Forces:
    """Return the forces of `contacts` (k,) without saddles, with the same sum.

    A saddle takes off what two contacts of its pair push too much, and would be an arrow that
    pulls. Each of the two nearest contacts bears half of it: what is left of them still pushes.
    """
    saddle = contacts.normal_force < 0.0
    normal = contacts.normal_world * contacts.normal_force[:, None]
    friction = np.array(contacts.friction_force_world)
    for k in np.flatnonzero(saddle):
        others = np.flatnonzero(~saddle & (contacts.pair == contacts.pair[k]))
        far = np.linalg.norm(contacts.point_world[others] - contacts.point_world[k], axis=1)
        bearing = others[np.argsort(far, kind="stable")[:2]]
        normal[bearing] += normal[k] / max(len(bearing), 1)
        friction[bearing] += friction[k] / max(len(bearing), 1)
    return Forces(contacts.point_world[~saddle], normal[~saddle], friction[~saddle])


def strongest(force: Array, size: int) -> nodes.IntArray:
    """Return the indices of the `size` largest of `force` (k,) at most, in their order."""
    return np.sort(np.argsort(-force, kind="stable")[:size])


class ArrowPool:
    """`size` contacts' worth of arrows and points below `visualizer`, all hidden at first.

    An arrow starts at the contact point and shows the force on the sphere. Where more than `size`
    contacts exist, the largest forces are shown.
    """

    def __init__(
        self, visualizer: Visualizer, size: int, width: float, *, total: bool = False
    ) -> None:
        self.size = size
        self._width = width
        colors = {"normal": NORMAL_COLOR, "friction": FRICTION_COLOR}
        if total:
            colors = {"total": TOTAL_COLOR}
        self._parts = len(colors)
        self._arrows: list[tuple[nodes.Move, nodes.Move]] = []
        self._points: list[nodes.Move] = []
        self._nodes: dict[str, list[Visualizer]] = {"arrows": [], "points": []}
        for index in range(size):
            for name, color in colors.items():
                node = visualizer[f"{name}_{index}"]
                nodes.set_object(node["shaft"], nodes.rod(1.0, 1.0), nodes.on_top(color), order=10)
                nodes.set_object(node["head"], nodes.rod(2.6, 0.0), nodes.on_top(color), order=10)
                self._arrows.append((nodes.mover(node["shaft"]), nodes.mover(node["head"])))
                self._nodes["arrows"].append(node)
            point = visualizer[f"point_{index}"]
            nodes.set_object(point, nodes.sphere(1.0, 20), nodes.on_top(POINT_COLOR), order=11)
            self._points.append(nodes.mover(point))
            self._nodes["points"].append(point)
        self._where = np.zeros((size, 3))
        # Where a hidden arrow waits: most of a pool does, in most frames.
        self._waiting: list[Array | None] = [None] * len(self._arrows)
        self._shown: set[int] = set()
        self._directions = np.tile(np.array([0.0, 0.0, 1.0]), (len(self._arrows), 1))
        self.update(None, ArrowScale())

    def update(self, forces: Forces | None, scale: ArrowScale) -> None:
        """Show `forces` at `scale`, and hide what the pool has left over."""
        rows: dict[int, int] = {}
        drawn = np.zeros((0, self._parts, 3))
        if forces is not None:
            drawn = np.stack((forces.normal, forces.friction), axis=1)
            total = drawn.sum(axis=1, keepdims=True)
            drawn = total if self._parts == 1 else drawn
            with np.errstate(over="ignore"):  # of a run that diverges
                most = strongest(np.linalg.norm(total[:, 0], axis=1), self.size)
            rows = self._slots(forces.point, most)
        for slot, place_point in enumerate(self._points):
            arrows, size = np.zeros((self._parts, 3)), nodes.HIDDEN_SCALE
            if forces is not None and slot in rows:
                self._where[slot] = forces.point[rows[slot]]
                arrows, size = drawn[rows[slot]], 1.3 * self._width
            place_point(nodes.pose(np.eye(3), self._where[slot], size))
            for part, force in enumerate(arrows):
                self._place_arrow(self._parts * slot + part, slot, force, scale)
        self._shown = set(rows)

    def show(self, part: Literal["arrows", "points"], on: bool) -> None:
        """Show or hide the arrows, or the contact points, whatever forces there are."""
        for node in self._nodes[part]:
            show(node, on)

    def _slots(self, points: Array, rows: nodes.IntArray) -> dict[int, int]:
        """Return which of `rows` each slot shows: a contact keeps its slot while it moves little.

        Else an arrow would sweep across the picture whenever another contact comes or goes.
        """
        far = np.linalg.norm(points[rows, None] - self._where[None, :], axis=2)
        taken: dict[int, int] = {}
        left = set(range(len(rows)))
        for flat in np.argsort(far, axis=None, kind="stable"):
            index, slot = divmod(int(flat), self.size)
            if far[index, slot] > SAME_CONTACT * self._width:
                break
            if index in left and slot in self._shown and slot not in taken:
                taken[slot] = int(rows[index])
                left.remove(index)
        free = sorted(set(range(self.size)) - set(taken), key=lambda slot: slot in self._shown)
        taken.update(zip(free, (int(rows[index]) for index in sorted(left)), strict=False))
        return taken

    def _place_arrow(self, arrow: int, contact: int, force: Array, scale: ArrowScale) -> None:
        size = math.hypot(*force.tolist())
        if not math.isfinite(size):
            size = 0.0  # of a run that diverges: it has no direction to show
        length = min(size * scale.meters_per_newton, scale.longest)
        start = self._where[contact]
        place_shaft, place_head = self._arrows[arrow]
        if length <= 0.05 * self._width:
            # A hidden arrow keeps its last direction, so that it does not swing as it grows back.
            hidden = self._waiting[arrow]
            if hidden is None or not np.array_equal(hidden[:3, 3], start):
                hidden = nodes.pose(
                    nodes.rotation_to(self._directions[arrow]), start, nodes.HIDDEN_SCALE
                )
                self._waiting[arrow] = hidden
            place_shaft(hidden)
            place_head(hidden)
            return
        self._waiting[arrow] = None
        direction = self._directions[arrow] = force / size
        # The head keeps its shape; an arrow too short for it shrinks as a whole.
        head = min(HEAD_LENGTH * self._width, 0.6 * length)
        width = head / HEAD_LENGTH
        shaft = (length - head) * direction
        place_shaft(nodes.rod_along(start, shaft, width))
        place_head(nodes.rod_along(start + shaft, head * direction, width))
