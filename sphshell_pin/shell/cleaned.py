"""A surface that has been cleaned: what a shell is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from numpy.typing import NDArray

from sphshell_pin.base.arrays import Array, Ints, Kind, Mask, misfit
from sphshell_pin.errors import InvalidShell
from sphshell_pin.shell.health import ShellHealth
from sphshell_pin.shell.raw import moved_shapes

AnyArray: TypeAlias = NDArray[Any]
Arrays = Mapping[str, AnyArray]
Known = dict[str, Kind]
ARRAYS: Known = {
    "vertices": ("f8", ("n", 3)),
    "elements": ("i4", ("m", 4)),
    "triangles": ("i4", ("t", 3)),
    "triangle_element": ("i4", ("t",)),
    "source_element": ("i4", ("m",)),
    "normals": ("f8", ("t", 3, 3)),
    "element_face": ("i4", ("m",)),
    "face_shapes": ("f8", ("f", 9)),
    "straight": ("b1", ("t", 3)),
}
"""Those of a CleanedSurface, with n vertices, m elements, t triangles and f faces."""


@dataclass(frozen=True)
class CleanedSurface:
    """A surface of planar elements with three or four corners.

    Attributes
    ----------
    vertices : (n, 3) [m]
    elements : (m, 4) vertex indices; triangles end in -1
    triangles : (t, 3) vertex indices; those of one element side by side
    triangle_element : (t,) element of each triangle, not decreasing
    normals : (t, 3, 3) unit normal per triangle corner, or None
    source_element : (m,) index of the input element each came from
    health : what was found and done
    element_face : (m,) row in `face_names` of the CAD face each element lies on, or None
    face_names : of the CAD faces
    face_shapes : (f, 9) of the CAD faces: the row of the kind in raw.KINDS, -1 of none of these;
        a point, the axis, the radius and the second number, as of `Face` [m, rad]; or None
    straight : (t, 3) sides that stay straight whatever the normals say, or None
    rounding : half the step to which the coordinates are known [m], 0 if they show none
    """

    vertices: Array
    elements: Ints
    triangles: Ints
    triangle_element: Ints
    normals: Array | None
    source_element: Ints
    health: ShellHealth
    element_face: Ints | None = None
    face_names: tuple[str, ...] = ()
    face_shapes: Array | None = None
    straight: Mask | None = None
    rounding: float = 0.0

    def moved(self, scale: float, rotation: Array, translation: Array) -> CleanedSurface:
        """Return the surface made larger, then turned by (3, 3), then moved by (3,) [m]."""
        return replace(
            self,
            vertices=(self.vertices * scale) @ rotation.T + translation,
            normals=None if self.normals is None else self.normals @ rotation.T,
            face_shapes=moved_shapes(self.face_shapes, scale, rotation, translation),
            health=self.health.moved(scale, rotation, translation),
            rounding=self.rounding * scale,
        )


def check_arrays(given: Arrays, known: Known, always: tuple[str, ...]) -> None:
    """Raise InvalidShell unless arrays have numbers and shapes as `known`, those `always` there."""
    for name in always:
        if name not in given:
            raise InvalidShell(f"it has no {name}")
    wanted = {name: one for name, one in known.items() if name in given}
    if fault := misfit({name: (given[name].dtype, given[name].shape) for name in wanted}, wanted):
        raise InvalidShell(f"of its arrays {fault}")
