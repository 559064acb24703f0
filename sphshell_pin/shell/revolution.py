"""Surfaces of revolution about z, tessellated with their exact normals."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from sphshell_pin.shell.raw import Floats


@dataclass
class Revolution:
    """Collects rings round the z axis, strips between them and discs inside them.

    Strips are added with their bottom first, so that the winding is outward. Rings of radius 0 are
    single points, which makes triangles of the elements beside them: none is without area.
    """

    segments: int
    vertices: list[tuple[float, float, float]] = field(default_factory=list)
    elements: list[list[int]] = field(default_factory=list)
    normals: list[list[tuple[float, float, float]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        turns = 2.0 * math.pi * np.arange(2 * self.segments) / (2 * self.segments)
        circle = np.column_stack([np.cos(turns), np.sin(turns)])
        # Quarter turns are exact: a point meant to lie on an axis does.
        circle[np.abs(circle) < 1e-15] = 0.0
        self._direction = circle.tolist()

    def ring(self, radius: float, height: float) -> list[int]:
        """Add a ring of vertices (radius, height) [m], or a single one on the axis."""
        first = len(self.vertices)
        if radius == 0.0:
            self.vertices.append((0.0, 0.0, height))
            return [first] * self.segments
        for k in range(self.segments):
            x, y = self._direction[2 * k]
            self.vertices.append((radius * x, radius * y, height))
        return list(range(first, first + self.segments))

    def strip(
        self,
        lower: list[int],
        upper: list[int],
        lower_normal: tuple[float, float],
        upper_normal: tuple[float, float],
    ) -> None:
        """Add the elements between two rings; unit normals as (radial, axial) at each of them."""
        n = self.segments
        for k in range(n):
            after = (k + 1) % n
            corners = [lower[k], lower[after], upper[after], upper[k]]
            halves = [2 * k, 2 * k + 2, 2 * k + 2, 2 * k]
            slopes = [lower_normal, lower_normal, upper_normal, upper_normal]
            if lower[k] == lower[after]:
                # The tip of a cone has no normal: that of the middle of the element.
                corners, slopes = corners[1:], slopes[1:]
                halves = [2 * k + 1, 2 * k + 2, 2 * k]
            elif upper[k] == upper[after]:
                corners, slopes = corners[:3], slopes[:3]
                halves = [2 * k, 2 * k + 2, 2 * k + 1]
            self.elements.append(corners)
            self.normals.append(
                [self._turned(half, slope) for half, slope in zip(halves, slopes, strict=True)]
            )

    def disc(self, ring: list[int], up: bool) -> None:
        """Close a ring with a flat disc of quads from rim to rim (no needles in its middle)."""
        n = self.segments
        normal = (0.0, 0.0, 1.0 if up else -1.0)
        for k in range(n // 2 + 1):
            cycle = [k, k + 1, n - k - 1, (n - k) % n]
            if k + 1 > n - k - 1:
                break
            corners = [ring[i] for i in dict.fromkeys(cycle)]
            if len(corners) < 3:
                break
            self.elements.append(corners if up else corners[::-1])
            self.normals.append([normal] * len(corners))

    def arrays(self) -> tuple[Floats, list[list[int]], Floats]:
        """Vertices (n, 3), elements, and normals (m, 4, 3) of their corners."""
        normals = np.zeros((len(self.elements), 4, 3))
        for k, corners in enumerate(self.normals):
            normals[k, : len(corners)] = corners
        return np.array(self.vertices), self.elements, normals

    def _turned(self, half: int, slope: tuple[float, float]) -> tuple[float, float, float]:
        x, y = self._direction[half % (2 * self.segments)]
        return (slope[0] * x, slope[0] * y, slope[1])


def arc(start: float, stop: float, steps: int) -> list[tuple[float, float]]:
    """Cosine and sine at `steps` + 1 latitudes [rad], exact at the poles and the equator."""
    out = []
    for k in range(steps + 1):
        angle = start + (stop - start) * k / steps
        c, s = math.cos(angle), math.sin(angle)
        out.append((0.0 if abs(c) < 1e-15 else c, 0.0 if abs(s) < 1e-15 else s))
    return out
