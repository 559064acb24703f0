"""What the compiled surface knows of its edges and patches, as read-only arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sphshell_pin.checks import read_only

if TYPE_CHECKING:
    from sphshell_pin.shell.raw import Bytes, Floats, Ints


class Topology:
    """Edges and patches of a shell, read from its compiled `core` when they are asked for."""

    core: Any

    @property
    def num_elements(self) -> int:
        """Number of elements."""
        return int(self.core.num_elements)

    @property
    def num_patches(self) -> int:
        """Number of patches: elements connected through smooth edges."""
        return int(self.core.num_patches)

    @property
    def num_edges(self) -> int:
        """Number of edges; the diagonal inside a quad is none."""
        return int(self.core.num_edges)

    @property
    def element_patch(self) -> Ints:
        """(m,) patch of each element."""
        array: Ints = self._core_array("element_patch")
        return array

    @property
    def edge_vertices(self) -> Ints:
        """(E, 2) ends of each edge."""
        array: Ints = self._core_array("edge_vertices")
        return array

    @property
    def edge_class(self) -> Bytes:
        """(E,) 0 smooth, 1 crease, 2 boundary, 3 non-manifold."""
        array: Bytes = self._core_array("edge_class")
        return array

    @property
    def edge_angle(self) -> Floats:
        """(E,) turn of each edge [rad], positive where convex."""
        array: Floats = self._core_array("edge_angle")
        return array

    @property
    def triangle_normals(self) -> Floats:
        """(t, 3) unit normals by winding."""
        array: Floats = self._core_array("triangle_normals")
        return array

    def _core_array(self, name: str) -> Any:
        # The core makes a new array at every call: keep the first.
        cache: dict[str, Any] = self.__dict__.setdefault("_arrays", {})
        if name not in cache:
            cache[name] = read_only(np.asarray(getattr(self.core, name)))
        return cache[name]
