"""Potential and force of a sphere from the pieces of surface inside it, from the definition.

Inside a smaller sphere of radius s the surface has some number n(s) of connected pieces. The
elastic potential is the integral of n(s) U'(r - s) over s < r: a piece counts from the distance at
which it begins to that at which it joins another, deeper one. Triangles are convex, so what a
sphere holds of one is connected, and two are joined where the sphere reaches what they share.
"""

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.base.arrays import Array
from tests.oracle.geometry import closest_on_segment, closest_on_triangles


def potential_and_force(
    vertices: Array,
    triangles: NDArray[np.int32],
    center: Array,
    radius: float,
    exponent: float = 1.5,
) -> tuple[float, Array]:
    """Potential, and force (3,) on the sphere, of the law depth^exponent."""
    near = closest_on_triangles(center, vertices[triangles]).astype(float)
    shared: dict[tuple[int, ...], list[int]] = defaultdict(list)
    for t, corners in enumerate(triangles):
        for i in range(3):
            shared[(int(corners[i]),)].append(t)
            shared[tuple(sorted((int(corners[i]), int(corners[i - 1]))))].append(t)
    joints = []
    for ends, owners in shared.items():
        if len(owners) > 1:
            point = vertices[ends[0]]
            if len(ends) == 2:
                point = closest_on_segment(center, point, vertices[ends[1]])
            joints.append((float(np.linalg.norm(center - point)), point, owners))
    joints.sort(key=lambda joint: joint[0])
    begin = [float(np.linalg.norm(center - point)) for point in near]
    total, force = 0.0, np.zeros(3)

    def count(point: Array, distance: float, sign: float) -> None:
        nonlocal total, force
        depth = radius - distance
        if depth > 0 and distance > 0:
            total += sign * depth ** (exponent + 1) / (exponent + 1)
            force = force + sign * depth**exponent * (center - point) / distance

    piece = list(range(len(triangles)))

    def find(i: int) -> int:
        while piece[i] != i:
            i = piece[i]
        return i

    for point, distance in zip(near, begin, strict=True):
        count(point, distance, 1.0)
    for distance, point, owners in joints:
        if distance >= radius:
            break
        for other in owners[1:]:
            a, b = find(owners[0]), find(other)
            if a != b:
                older, younger = (a, b) if begin[a] <= begin[b] else (b, a)
                piece[younger] = older
                count(point, distance, -1.0)
    return total, force
