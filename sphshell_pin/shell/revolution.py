"""Surfaces of revolution about z, tessellated with their exact normals."""

import math
from dataclasses import replace

import numpy as np

from sphshell_pin.base.arrays import Array, Longs
from sphshell_pin.shell.raw import KINDS, NO_SHAPE, RawSurface, raw_surface

Profile = tuple[float, float]
"""A unit normal in the half-plane of the profile: (radial, axial)."""


class Revolution:
    """Collects rings around the z axis, strips between them and discs inside them, face by face.

    Strips are added with their bottom first, so that the winding is outward. Rings of radius 0 are
    single points, which makes triangles of the elements beside them: none is without area.
    """

    def __init__(self, segments: int) -> None:
        self.segments = segments
        turns = math.pi * np.arange(2 * segments) / segments
        # At whole and half steps around the circle.
        self._circle = np.column_stack([np.cos(turns), np.sin(turns)])
        # Quarter turns are exact: a point meant to lie on an axis does.
        self._circle[np.abs(self._circle) < 1e-15] = 0.0
        self._vertices: list[Array] = []
        self._elements: list[Longs] = []
        self._normals: list[Array] = []
        self._names: list[str] = []
        self._shapes: list[tuple[float, ...]] = []
        self._faces: list[Longs] = []

    def face(
        self, name: str, kind: str | None, height: float, radius: float = 0.0, second: float = 0.0
    ) -> None:
        """Begin a face to which what follows belongs; `kind` of raw.KINDS, None of another.

        Its point is at `height` on the axis [m]; its numbers are as of `Face` [m, rad].
        """
        self._names.append(name)
        place = (0.0, 0.0, height, 0.0, 0.0, 1.0, radius, second)
        self._shapes.append(NO_SHAPE if kind is None else (float(KINDS.index(kind)), *place))

    def ring(self, radius: float, height: float) -> Longs:
        """Add a ring of vertices (radius, height) [m], or a single one on the axis.

        Returns their indices (segments,).
        """
        first = sum(map(len, self._vertices))
        count = self.segments if radius else 1
        points = np.column_stack([radius * self._circle[::2][:count], np.full(count, height)])
        self._vertices.append(points if radius else points * [0.0, 0.0, 1.0])
        return np.resize(np.arange(first, first + count), self.segments)

    def strip(
        self, lower: Longs, upper: Longs, lower_normal: Profile, upper_normal: Profile
    ) -> None:
        """Add the elements between two rings, with the normals at each of them."""
        corners = np.stack([lower, np.roll(lower, -1), np.roll(upper, -1), upper], axis=1)
        steps, profile = [0, 2, 2, 0], [lower_normal, lower_normal, upper_normal, upper_normal]
        # The tip of a cone has no normal: it gets that of the middle of the element.
        if lower[0] == lower[-1]:
            corners = np.column_stack([corners[:, 1:], np.full(self.segments, -1)])
            steps, profile = [1, 2, 0, 0], [lower_normal, upper_normal, upper_normal, (0.0, 0.0)]
        elif upper[0] == upper[-1]:
            corners[:, 3] = -1
            steps, profile = [0, 2, 1, 0], [lower_normal, lower_normal, upper_normal, (0.0, 0.0)]
        places = (2 * np.arange(self.segments)[:, None] + steps) % (2 * self.segments)
        radial, axial = np.array(profile).T
        normals = np.empty((self.segments, 4, 3))
        normals[:, :, :2] = radial[:, None] * self._circle[places]
        normals[:, :, 2] = axial
        self._add(corners, normals)

    def disc(self, ring: Longs, up: bool) -> None:
        """Close a ring with a flat disc of quads from rim to rim (no needles in its middle)."""
        rows = []
        for k in range(self.segments // 2):
            cycle = [k, k + 1, self.segments - k - 1, (self.segments - k) % self.segments]
            corners = list(dict.fromkeys(cycle))
            corners = corners if up else corners[::-1]
            rows.append([*(ring[i] for i in corners), -1][:4])
        self._add(np.array(rows), np.tile([0.0, 0.0, 1.0 if up else -1.0], (len(rows), 4, 1)))

    def _add(self, elements: Longs, normals: Array) -> None:
        self._elements.append(elements)
        self._normals.append(normals)
        self._faces.append(np.full(len(elements), len(self._names) - 1))

    def surface(self, stretch: Array | None = None) -> RawSurface:
        """All that was added, larger by the factors `stretch` (3,) along the axes."""
        vertices, normals = np.concatenate(self._vertices), np.concatenate(self._normals)
        if stretch is not None:
            # Normals go with the inverse transpose; unused fourth corners stay zero.
            vertices, normals = stretch * vertices, normals / stretch
            length = np.linalg.norm(normals, axis=2, keepdims=True)
            normals /= np.where(length > 0.0, length, 1.0)
        raw = raw_surface(vertices, np.concatenate(self._elements), normals)
        return replace(
            raw,
            faces=np.concatenate(self._faces).astype(np.int32),
            face_names=tuple(self._names),
            face_shapes=np.array(self._shapes),
        )


def arc(start: float, stop: float, steps: int) -> list[tuple[float, float]]:
    """Cosine and sine at `steps` + 1 latitudes [rad], exact at the poles and the equator."""
    angles = start + (stop - start) * np.arange(steps + 1) / steps
    table = np.column_stack([np.cos(angles), np.sin(angles)])
    table[np.abs(table) < 1e-15] = 0.0
    return [(c, s) for c, s in table.tolist()]
