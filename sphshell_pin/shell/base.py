"""The arrays of a shell and its compiled core."""

from dataclasses import fields
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array, Bytes, Ints, Mask
from sphshell_pin.base.checks import read_only
from sphshell_pin.base.summary import Summarized
from sphshell_pin.shell.cleaned import CleanedSurface
from sphshell_pin.shell.faces import Face, faces_of
from sphshell_pin.shell.health import ShellHealth
from sphshell_pin.shell.options import SIDES, check_size
from sphshell_pin.shell.raw import in_use

_ARRAYS: dict[str, npt.DTypeLike] = {
    **dict.fromkeys(("elements", "source_element", "element_face"), np.int32),
    **dict.fromkeys(("normals", "face_shapes"), np.float64),
}
"""Arrays of a surface, taken over as they are."""


class ShellBase(Summarized):
    """A cleaned surface and the compiled one that queries run on; `Shell` has the attributes."""

    name: str
    side: str
    crease_angle: float
    source: str | None
    unit: str | None
    vertices: Array
    elements: Ints
    triangles: Ints
    triangle_element: Ints
    normals: Array | None
    source_element: Ints
    element_face: Ints | None
    face_names: tuple[str, ...]
    face_shapes: Array | None
    straight: Mask | None
    rounding: float
    finds_faces: bool
    box: Array
    size: float
    health: ShellHealth
    _binding: _core.Shell

    @classmethod
    def from_surface(
        cls,
        surface: CleanedSurface,
        crease_angle: float,
        side: str = "both",
        name: str = "shell",
        source: str | None = None,
        unit: str | None = None,
        finds_faces: bool = True,
    ) -> Self:
        """Build a shell of a surface that is clean; the options are not checked."""
        shell = cls.__new__(cls)
        shell._set(surface, crease_angle, side, name, source, unit, finds_faces)
        return shell

    def _set(
        self,
        surface: CleanedSurface,
        crease_angle: float,
        side: str,
        name: str,
        source: str | None = None,
        unit: str | None = None,
        finds_faces: bool = True,
    ) -> None:
        self.name, self.side, self.source, self.unit = str(name), side, source, unit
        self.crease_angle, self.finds_faces = float(crease_angle), finds_faces
        self.rounding = surface.rounding
        vertices = np.ascontiguousarray(surface.vertices, np.float64)
        triangles = np.ascontiguousarray(surface.triangles, np.int32)
        triangle_element = np.ascontiguousarray(surface.triangle_element, np.int32)
        self.face_names = tuple(surface.face_names)
        for one, kind in _ARRAYS.items():
            array = getattr(surface, one)
            owned = None if array is None else read_only(np.ascontiguousarray(array, kind))
            setattr(self, one, owned)
        self.straight = None if surface.straight is None else read_only(surface.straight.copy())
        # Without cleaning there may be vertices no element uses.
        used = in_use(triangles, len(vertices))
        corners = vertices if used.all() else vertices[used]
        self.box = read_only(np.stack([corners.min(axis=0), corners.max(axis=0)]))
        self.size = float(np.linalg.norm(self.box[1] - self.box[0]))
        check_size(self.size)
        self.health = surface.health.labelled(name=self.name, size=self.size)
        # The CAD face of each triangle and the corner normals say what is smooth.
        cad_face, normals = None, None
        if self.element_face is not None and self.normals is not None and self.crease_angle > 0.0:
            cad_face, normals = self.element_face[triangle_element], self.normals.reshape(-1, 3)
        self._smooth: _core.Shell | None = None
        self._binding = _core.Shell(
            vertices,
            triangles,
            triangle_element,
            self.crease_angle,
            SIDES.index(side),
            cad_face,
            normals,
        )
        # The compiled surface has its own copies: these are views of them.
        self.vertices = self._binding.vertices
        self.triangles = self._binding.triangles
        self.triangle_element = self._binding.triangle_element
        pinched = self._binding.pinched_vertices
        self.health = self.health.labelled(
            pinched_vertices=len(pinched),
            pinched_at=tuple(self.vertices[pinched[0]].tolist()) if len(pinched) else None,
        )

    def surface(self) -> CleanedSurface:
        """Return the arrays that the shell is made of."""
        held = {one.name: getattr(self, one.name) for one in fields(CleanedSurface)}
        return CleanedSurface(**held)

    @property
    def options(self) -> dict[str, Any]:
        """What `from_surface` takes besides the surface."""
        names = ("crease_angle", "side", "name", "source", "unit", "finds_faces")
        return {one: getattr(self, one) for one in names}

    def core_for(self, method: str) -> _core.Shell:
        """Return the compiled surface, with curved elements if `method` is "smooth".

        These may have vertices of their own: see "Exact faces" in docs/contact.md.
        """
        if method != "smooth":
            return self._binding
        if self._smooth is None:
            # With no smooth edges every element is flat, whatever normals came with it.
            given = self.normals if self.crease_angle > 0 else None
            exact = self.element_face is not None and given is not None  # CAD's own
            straight = None if self.straight is None else self.straight.ravel().view(np.uint8)
            given = None if given is None else given.reshape(-1, 3)
            known, shapes = None, self.face_shapes
            if self.finds_faces and given is not None and shapes is not None:
                assert self.element_face is not None  # both come from CAD
                known = self.element_face[self.triangle_element]
            self._smooth = self._binding.curve(
                given, exact, straight, self.rounding, self.finds_faces, known, shapes
            )
        return self._smooth

    @cached_property
    def faces(self) -> tuple[Face, ...]:
        """Planes, cylinders, cones, spheres and tori on which elements lie.

        Those of CAD, or recognized in meshes whose vertices lie on them to the rounding of their
        numbers; none if `finds_faces` is False or the crease angle 0. It makes the curved elements,
        if no query has.
        """
        return faces_of(self.core_for("smooth"), self.face_names)

    @property
    def num_elements(self) -> int:
        """Number of elements."""
        return int(self._binding.num_elements)

    @property
    def num_patches(self) -> int:
        """Number of patches: elements connected through smooth edges."""
        return int(self._binding.num_patches)

    @property
    def num_edges(self) -> int:
        """Number of edges; the diagonal inside a quad is none."""
        return len(self.edge_class)

    @cached_property
    def element_patch(self) -> Ints:
        """(m,) patch of each element."""
        return read_only(self._binding.element_patch)

    @cached_property
    def edge_vertices(self) -> Ints:
        """(E, 2) ends of each edge."""
        return read_only(self._binding.edge_vertices)

    @cached_property
    def edge_class(self) -> Bytes:
        """(E,) 0 smooth, 1 crease, 2 boundary, 3 non-manifold."""
        return read_only(self._binding.edge_class)

    @cached_property
    def edge_angle(self) -> Array:
        """(E,) turn of each edge [rad], positive where convex."""
        return read_only(self._binding.edge_angle)

    @cached_property
    def triangle_normals(self) -> Array:
        """(t, 3) unit normals by winding."""
        return read_only(self._binding.triangle_normals)

    def __getstate__(self) -> dict[str, object]:
        """Everything but the compiled surface, which is made again."""
        return {"surface": self.surface(), **self.options}

    def __setstate__(self, state: dict[str, object]) -> None:
        """Rebuild from arrays that are clean already."""
        self._set(**state)  # type: ignore[arg-type]
