"""Patches of contacts: ellipses colored by pressure, a fixed pool of nodes that only ever move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.result.result_parts import Patches
from sphshell_pin.view import nodes
from sphshell_pin.view.arrows import strongest
from sphshell_pin.view.surface import between_rings, ramp_colors

if TYPE_CHECKING:
    from meshcat import Visualizer

    from sphshell_pin.dynamics.scene.scene import SceneContacts

RAMP = ("#0d0887", "#6a00a8", "#b12a90", "#e16462", "#fca636", "#f0f921")
"""From no pressure to the largest: colors of matplotlib's plasma, evenly spaced."""
LEVELS = 8
"""Peak pressures that differ in color: the page cannot change the colors of a mesh in a film."""
SEEN = 0.014  # half axis of the largest patch in the picture, over its size, at least


@dataclass(frozen=True)
class PatchScale:
    """`pressure` [Pa] has the last color; patches are drawn `factor` times their size."""

    pressure: float
    factor: float = 1.0

    @classmethod
    def of(cls, patches: Patches, size: float) -> PatchScale:
        """Choose the scale for `patches` (k,) in a picture of this size [m].

        A peak far above the rest would leave no color for the rest: the pressure is 1.6 times the
        median at most.
        """
        pressure = patches["peak_pressure"]
        sound = np.isfinite(pressure) & (pressure > 0.0)
        if not sound.any():
            return cls(1.0)
        largest = min(float(pressure[sound].max()), 1.6 * float(np.median(pressure[sound])))
        half = float(np.median(patches["half_axes"][sound, 0]))
        return cls(largest, _factor(SEEN * size / half))

    def __str__(self) -> str:
        """As a legend shows it."""
        larger = "" if self.factor == 1.0 else f", drawn {self.factor:g} x larger"
        return f"pressure of patches: 0 to {self.pressure * 1e-6:.3g} MPa{larger}"


def _factor(least: float) -> float:
    """Return the smallest of 1, 2, 5, 10, 20, ... that is not below `least`."""
    if not least > 1.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(least))
    return float(next(k * power for k in (1, 2, 5, 10) if k * power >= least * (1 - 1e-9)))


class PatchPool:
    """`size` patches below `visualizer`, each of them in LEVELS colors, all hidden at first."""

    def __init__(self, visualizer: Visualizer, size: int) -> None:
        self.size = size
        self._moves: list[list[nodes.Move]] = []
        meshes = [_disc(level / LEVELS) for level in range(1, LEVELS + 1)]
        for index in range(size):
            moves = []
            for level, mesh in enumerate(meshes):
                node = visualizer[f"patch_{index}_{level}"]
                look = nodes.on_top(0xFFFFFF) | {"side": 2, "vertexColors": True}
                nodes.set_object(node, mesh, look, order=9)
                moves.append(nodes.mover(node))
            self._moves.append(moves)
        self._hidden = nodes.hidden_at(np.zeros(3))

    def update(self, contacts: SceneContacts | None, patches: Patches, scale: PatchScale) -> None:
        """Show `patches` (k,) of `contacts` at `scale`: the largest forces, if there are many."""
        force = np.zeros(0) if contacts is None else contacts.normal_force
        shown = strongest(force, self.size)
        for slot, moves in enumerate(self._moves):
            level, matrix = -1, self._hidden
            if contacts is not None and slot < len(shown):
                level, matrix = self._place(contacts, int(shown[slot]), patches, scale)
            # The others wait where it is: else they would sweep across the picture when shown.
            waiting = matrix.copy()
            waiting[:3, :3] = self._hidden[:3, :3]
            for number, move in enumerate(moves):
                move(matrix if number == level else waiting)

    def _place(
        self, contacts: SceneContacts, k: int, patches: Patches, scale: PatchScale
    ) -> tuple[int, Array]:
        patch = patches[k]
        normal, axis = contacts.normal_world[k], patch["axis_world"]
        a, b = patch["half_axes"] * scale.factor
        share = patch["peak_pressure"] / scale.pressure
        # At saddles the pressure is negative, unknown ones are nan.
        if not (share > 0.0 and b > 0.0 and np.isfinite(share)):
            return -1, self._hidden
        turn = np.stack([axis, np.cross(normal, axis), normal], axis=1)
        level = min(LEVELS, max(1, int(np.ceil(share * LEVELS)))) - 1
        return level, nodes.pose(turn, contacts.point_world[k], np.array([a, b, b]))


def _disc(level: float, rings: int = 10, sectors: int = 40) -> dict[str, Any]:
    """Return a unit disc in the plane z = 0 with the colors of Hertz's pressure, `level` its peak.

    Its rim is dark, so that it is seen on any surface.
    """
    radius = np.append(np.linspace(0.0, 1.0, rings + 1), 1.06)
    share = level * np.sqrt(np.maximum(0.0, 1.0 - radius**2))
    color = ramp_colors(share, RAMP)
    color[-1] = 0.15
    angle = 2.0 * np.pi * np.arange(sectors) / sectors
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros(sectors)], axis=1)
    vertices = (radius[:, None, None] * around).reshape(-1, 3)
    triangles = between_rings(len(radius), sectors)
    return nodes.triangle_mesh(vertices, triangles, np.repeat(color, sectors, axis=0))
