"""A surface that has been cleaned: what a shell is made of."""

from __future__ import annotations

from dataclasses import dataclass, replace

from sphshell_pin.shell.health import ShellHealth
from sphshell_pin.shell.raw import Floats, Ints, Mask, moved_shapes


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

    vertices: Floats
    elements: Ints
    triangles: Ints
    triangle_element: Ints
    normals: Floats | None
    source_element: Ints
    health: ShellHealth
    element_face: Ints | None = None
    face_names: tuple[str, ...] = ()
    face_shapes: Floats | None = None
    straight: Mask | None = None
    rounding: float = 0.0

    def moved(self, scale: float, rotation: Floats, translation: Floats) -> CleanedSurface:
        """Return the surface made larger, then turned by (3, 3), then moved by (3,) [m]."""
        return replace(
            self,
            vertices=(self.vertices * scale) @ rotation.T + translation,
            normals=None if self.normals is None else self.normals @ rotation.T,
            face_shapes=moved_shapes(self.face_shapes, scale, rotation, translation),
            health=self.health.moved(scale, rotation, translation),
            rounding=self.rounding * scale,
        )
