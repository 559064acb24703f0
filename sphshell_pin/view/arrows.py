"""Force arrows and contact points: a fixed pool of nodes that only ever change their transforms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from sphshell_pin.view.nodes import (
    HIDDEN_SCALE,
    FloatArray,
    IntArray,
    Move,
    mover,
    on_top,
    pose,
    rod,
    rotation_to,
    set_object,
    show,
    sphere,
)

if TYPE_CHECKING:
    from meshcat import Visualizer

NORMAL_COLOR = 0xD4202A
FRICTION_COLOR = 0xF08A00
TOTAL_COLOR = 0xB0127B
POINT_COLOR = 0x101418

HEAD_LENGTH = 6.5  # in half widths of the shaft
SAME_CONTACT = 30.0  # likewise: farther away it is another contact

ArrowKind = Literal["components", "total"]


class ContactColumns(Protocol):
    """The columns a picture needs, one row per contact, world frame [m], [N]."""

    @property
    def point_world(self) -> FloatArray:
        """Contact points (k, 3) [m]."""

    @property
    def normal_world(self) -> FloatArray:
        """Unit normals (k, 3), shell to sphere."""

    @property
    def normal_force(self) -> FloatArray:
        """Normal forces (k,) on the sphere along the normal [N]."""

    @property
    def friction_force_world(self) -> FloatArray:
        """Friction forces (k, 3) on the sphere [N]."""


def nice(value: float) -> float:
    """Round a positive `value` to the nearest 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    steps = np.array([1.0, 2.0, 5.0, 10.0])
    return float(steps[np.argmin(np.abs(np.log(steps * power / value)))] * power)


@dataclass(frozen=True)
class ArrowScale:
    """How forces become lengths: `reference_length` [m] stands for `reference_force` [N].

    No arrow is drawn longer than `longest` [m].
    """

    reference_length: float = 0.1
    reference_force: float = 10.0
    longest: float = np.inf

    @property
    def metres_per_newton(self) -> float:
        """Length per force [m/N]."""
        return self.reference_length / self.reference_force

    @classmethod
    def from_forces(cls, forces: FloatArray, length: float) -> ArrowScale:
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

    def cuts(self, forces: FloatArray) -> bool:
        """Tell whether any of `forces` (k,) [N] has an arrow longer than the longest."""
        return bool(np.any(forces * self.metres_per_newton > self.longest))

    def __str__(self) -> str:
        return f"{self.reference_length * 1e3:g} mm = {self.reference_force:g} N"


def largest_force(contacts: ContactColumns) -> FloatArray:
    """Magnitude (k,) of the total force of each contact [N]."""
    total = contacts.normal_world * contacts.normal_force[:, None] + contacts.friction_force_world
    return np.asarray(np.linalg.norm(total, axis=1))


@dataclass(frozen=True)
class ForceColumns:
    """ContactColumns of their own."""

    point_world: FloatArray
    normal_world: FloatArray
    normal_force: FloatArray
    friction_force_world: FloatArray


def pushing(contacts: ContactColumns, pair: IntArray) -> ContactColumns:
    """Return `contacts` of the pairs `pair` (k,) without saddles, with the same sum of forces.

    A saddle takes off what two contacts of its pair push too much, and would be an arrow that
    pulls. Each of the two nearest contacts bears half of it: what is left of them still pushes.
    """
    saddle = contacts.normal_force < 0.0
    if not saddle.any():
        return contacts
    normal = contacts.normal_world * contacts.normal_force[:, None]
    friction = np.array(contacts.friction_force_world)
    for k in np.flatnonzero(saddle):
        others = np.flatnonzero(~saddle & (pair == pair[k]))
        far = np.linalg.norm(contacts.point_world[others] - contacts.point_world[k], axis=1)
        bearing = others[np.argsort(far, kind="stable")[:2]]
        normal[bearing] += normal[k] / max(len(bearing), 1)
        friction[bearing] += friction[k] / max(len(bearing), 1)
    normal, kept = normal[~saddle], contacts.normal_world[~saddle]
    force = np.linalg.norm(normal, axis=1)
    direction = np.where(force[:, None] > 0.0, normal / np.where(force, force, 1.0)[:, None], kept)
    return ForceColumns(contacts.point_world[~saddle], direction, force, friction[~saddle])


class ArrowPool:
    """`size` contacts' worth of arrows and points below `visualizer`, all hidden at first.

    An arrow starts at the contact point and shows the force on the sphere. Where more than `size`
    contacts exist, the largest forces are shown.
    """

    def __init__(
        self, visualizer: Visualizer, size: int, width: float, kind: ArrowKind = "components"
    ) -> None:
        self.size = size
        self._width = width
        self._kind = kind
        colors = (
            {"normal": NORMAL_COLOR, "friction": FRICTION_COLOR}
            if kind == "components"
            else {"total": TOTAL_COLOR}
        )
        self._arrows: list[tuple[Move, Move]] = []
        self._points: list[Move] = []
        self._arrow_nodes, self._point_nodes = [], []
        for index in range(size):
            for name, color in colors.items():
                node = visualizer[f"{name}_{index}"]
                set_object(node["shaft"], rod(1.0, 1.0), on_top(color), order=10)
                set_object(node["head"], rod(2.6, 0.0), on_top(color), order=10)
                self._arrows.append((mover(node["shaft"]), mover(node["head"])))
                self._arrow_nodes.append(node)
            point = visualizer[f"point_{index}"]
            set_object(point, sphere(1.0, 20), on_top(POINT_COLOR), order=11)
            self._points.append(mover(point))
            self._point_nodes.append(point)
        self._where = np.zeros((size, 3))
        # Where a hidden arrow waits: most of a pool does, in most frames.
        self._waiting: list[FloatArray | None] = [None] * len(self._arrows)
        self._shown: set[int] = set()
        self._directions = np.tile(np.array([0.0, 0.0, 1.0]), (len(self._arrows), 1))
        self.update(None, ArrowScale())

    def update(self, contacts: ContactColumns | None, scale: ArrowScale) -> None:
        """Show `contacts` at `scale`, and hide what the pool has left over."""
        rows = self._strongest(contacts)
        row_of_slot: dict[int, int] = {}
        if contacts is not None and rows:
            row_of_slot = self._slots(contacts, rows)
        per_slot = len(self._arrows) // self.size if self.size else 0
        for slot, place_point in enumerate(self._points):
            forces = np.zeros((per_slot, 3))
            size = HIDDEN_SCALE
            row = row_of_slot.get(slot)
            if contacts is not None and row is not None:
                self._where[slot] = contacts.point_world[row]
                forces = self._forces(contacts, row)
                size = 1.3 * self._width
            place_point(pose(np.eye(3), self._where[slot], size))
            for part in range(per_slot):
                self._place_arrow(per_slot * slot + part, slot, forces[part], scale)
        self._shown = set(row_of_slot)

    def show_arrows(self, on: bool) -> None:
        """Show or hide the arrows, whatever forces there are."""
        for node in self._arrow_nodes:
            show(node, on)

    def show_points(self, on: bool) -> None:
        """Show or hide the contact points."""
        for node in self._point_nodes:
            show(node, on)

    def _slots(self, contacts: ContactColumns, rows: list[int]) -> dict[int, int]:
        """Return the row that each slot shows: a contact keeps its slot while it moves little.

        Else an arrow would sweep across the picture whenever another contact comes or goes.
        """
        points = contacts.point_world[rows]
        far = np.linalg.norm(points[:, None] - self._where[None, :], axis=2)
        taken: dict[int, int] = {}
        left = set(range(len(rows)))
        for flat in np.argsort(far, axis=None, kind="stable"):
            index, slot = divmod(int(flat), self.size)
            if far[index, slot] > SAME_CONTACT * self._width:
                break
            if index in left and slot in self._shown and slot not in taken:
                taken[slot] = rows[index]
                left.remove(index)
        free = sorted(set(range(self.size)) - set(taken), key=lambda slot: slot in self._shown)
        taken.update(zip(free, (rows[index] for index in sorted(left)), strict=False))
        return taken

    def _strongest(self, contacts: ContactColumns | None) -> list[int]:
        if contacts is None or not len(contacts.normal_force):
            return []
        if len(contacts.normal_force) <= self.size:
            return list(range(len(contacts.normal_force)))
        order = np.argsort(-largest_force(contacts), kind="stable")[: self.size]
        return sorted(int(row) for row in order)

    def _forces(self, contacts: ContactColumns, row: int) -> FloatArray:
        normal = contacts.normal_world[row] * contacts.normal_force[row]
        friction = contacts.friction_force_world[row]
        if self._kind == "total":
            return np.asarray((normal + friction)[None, :])
        return np.stack((normal, friction))

    def _place_arrow(self, arrow: int, contact: int, force: FloatArray, scale: ArrowScale) -> None:
        size = math.hypot(*force.tolist())
        if not math.isfinite(size):
            size = 0.0  # of a run that diverges: it has no direction to show
        length = min(size * scale.metres_per_newton, scale.longest)
        start = self._where[contact]
        place_shaft, place_head = self._arrows[arrow]
        if length <= 0.05 * self._width:
            # A hidden arrow keeps its last direction, so that it does not swing as it grows back.
            hidden = self._waiting[arrow]
            if hidden is None or not np.array_equal(hidden[:3, 3], start):
                hidden = pose(rotation_to(self._directions[arrow]), start, HIDDEN_SCALE)
                self._waiting[arrow] = hidden
            place_shaft(hidden)
            place_head(hidden)
            return
        self._waiting[arrow] = None
        direction = self._directions[arrow] = force / size
        turn = rotation_to(direction)
        # The head keeps its shape; an arrow too short for it shrinks as a whole.
        head = min(HEAD_LENGTH * self._width, 0.6 * length)
        width = head / HEAD_LENGTH
        shaft = length - head
        place_shaft(pose(turn, start + 0.5 * shaft * direction, np.array([width, shaft, width])))
        place_head(
            pose(turn, start + (shaft + 0.5 * head) * direction, np.array([width, head, width]))
        )
