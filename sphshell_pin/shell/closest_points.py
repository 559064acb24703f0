"""Where a surface is nearest to given points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphshell_pin.shell.raw import Floats, Ints


@dataclass(frozen=True)
class ClosestPoints:
    """Where the surface is nearest to each of n points, in the shell's frame.

    Attributes
    ----------
    points : (n, 3) on the surface [m]
    normals : (n, 3) unit, along the way from there to the point, or with flat elements that of the
        element, or the mean one of the edge or vertex; on the side the winding makes the outer one
    distances : (n,) [m], negative behind the surface
    elements : (n,) row of shell.elements
    """

    points: Floats
    normals: Floats
    distances: Floats
    elements: Ints

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.distances)
