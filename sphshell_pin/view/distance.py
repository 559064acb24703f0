"""A shell colored by how far its curved elements differ from the flat ones."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from sphshell_pin.errors import InvalidParameter
from sphshell_pin.view.surface import divisions, draw_colored, is_curved, ramp_colors

if TYPE_CHECKING:
    from meshcat import Visualizer

    from sphshell_pin.shell.shell import Shell

RAMP = ("#440154", "#3b528b", "#21918c", "#5ec962", "#fde725")
"""From no distance to the largest: five colors of matplotlib's viridis, evenly spaced."""

Painting = Literal["patches", "distance", "faces"]
Coloring = Literal["surface", Painting]
"""What the colors of shells can show."""

FEW = 2
"""Pieces of a side at which a shell of very many elements is measured; its elements have one color
each."""


def draw_distance(node: Visualizer, shell: Shell, largest: float) -> None:
    """Draw the curved elements of `shell` below `node`, as "distance".

    Its colors go from the first of RAMP, where a curved element is on the flat one, to the last,
    at the distance `largest` [m].
    """
    from sphshell_pin.shell.curvature import distances_at
    from sphshell_pin.shell.curved import curved_mesh

    if is_curved(shell, curved=True):
        points, triangles, _ = curved_mesh(shell, divisions(shell))
        distance = distances_at(shell, divisions(shell)).ravel()
    else:
        points = np.asarray(shell.vertices)[shell.triangles].reshape(-1, 3)
        triangles = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
        distance = distances_at(shell, FEW).max(axis=1).repeat(3)
    share = distance / largest if largest > 0.0 else np.zeros(len(distance))
    draw_colored(node["distance"], points, triangles, ramp_colors(share, RAMP))


def check_coloring(color: str) -> None:
    """Raise InvalidParameter unless `color` is a Coloring."""
    if color not in get_args(Coloring):
        raise InvalidParameter("color", color, f"must be one of {', '.join(get_args(Coloring))}")


def range_text(largest: float) -> str:
    """Return the range of the colors as text."""
    return f"distance of curved from flat: 0 to {largest * 1e3:.3g} mm"
