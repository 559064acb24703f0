"""The contacts of one sphere with one shell, as columns."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.errors import NameNotFound

Array = NDArray[np.float64]


class Feature(IntEnum):
    """What of the surface the sphere touches."""

    FACE = 0
    EDGE = 1
    VERTEX = 2


class Method(IntEnum):
    """How contacts are found; the names are lower case in public arguments."""

    FACETS = 0
    ELEMENTS = 1
    SMOOTH = 2

    @classmethod
    def from_name(cls, name: str) -> Method:
        """Look up "facets", "elements" or "smooth"; NameNotFound lists the valid ones."""
        for method in cls:
            if method.name.lower() == name:
                return method
        raise NameNotFound("method", str(name), "the contact query", [m.name.lower() for m in cls])


@dataclass(frozen=True)
class ContactSet:
    """Places of touch, deepest first, in the shell's frame.

    With k contacts: `point` (k, 3) on the shell [m]; `normal` (k, 3) unit, from the shell to the
    sphere's centre; `depth` (k,) > 0 [m]; `element` (k,) row of shell.elements (of an edge or a
    vertex, one of those that share it); `patch` (k,) smooth piece of the surface; `feature` (k,)
    values of Feature; `weight` (k,) by which a contact's force counts: 1, but -1 at a pass, a place
    where contacts flow together (method "smooth" only, where the sphere reaches a concave crease
    between them).
    """

    point: Array
    normal: Array
    depth: Array
    element: NDArray[np.int32]
    patch: NDArray[np.int32]
    feature: NDArray[np.uint8]
    weight: Array

    def __len__(self) -> int:
        """Return the number of contacts."""
        return len(self.depth)
