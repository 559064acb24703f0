"""Contacts of a sphere with a polyhedral surface, by the definition of each method.

`facets`: the distinct local minima, over the surface as a point set, of the distance to the center.
A triangle is convex, so p is a local minimum iff for every triangle that contains p and every
corner x of it (c - p) . (x - p) <= 0.

A definition has sharp borders and floating point has not, so the answer is a pair of sets: what
must be found, and what may be found: what a center moved by rounding (NUDGE) would have. Away from
the borders they are equal.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.oracle import geometry
from tests.oracle.geometry import Array, closest_on_triangles, cross, dot, gaps, norm

# All relative to the size of the problem (largest coordinate met): on the same point, must, may.
SAME_POINT = 1e-9
SURE, DOUBTFUL = 1e-14, 1e-11
EDGE_OF_REACH = 1e-12
NUDGE, ON_SURFACE = 5e-14, 1e-17


@dataclass(frozen=True)
class Touch:
    """One contact: point (3,), normal (3,), depth, and all elements that contain the point.

    Touches of one `group` are too near to each other to be told apart: one of them counts.
    """

    point: NDArray[np.float64]
    normal: NDArray[np.float64]
    depth: float
    elements: frozenset[int]
    sure: bool
    group: int


def size_of(center: NDArray[np.float64], radius: float, corners: Array) -> float:
    """Largest length met [m]."""
    return float(max(np.abs(corners - np.asarray(center)).max(), radius))


def _descends(slack: Array, tolerance: float) -> bool:
    return bool((slack > tolerance).any())


def _nudges(center: Array, points: Array, corners: Array, size: float) -> list[list[Array]]:
    """Steps for each triangle, of rounding's size, that its closest point follows.

    Tried are steps into the triangle and, from a corner, along its sides. Away from the borders of
    the triangle's regions there are none.
    """
    tries = [corners.mean(axis=1) - points]
    for k in range(3):
        side = corners[:, k - 2] - corners[:, k]
        inward = cross(cross(side, corners[:, k - 1] - corners[:, k]), side)
        at_corner = norm(corners - points[:, None]).min(axis=1) <= SAME_POINT * size
        along = np.where(at_corner[:, None], side, 0)
        tries += [along, -along, inward]
    directions = np.array(tries)
    length = norm(directions)
    steps = NUDGE * size * directions / np.where(length > 0, length, 1)[..., None]
    all_corners = np.tile(corners, (len(tries), 1, 1))
    there = closest_on_triangles((center + steps).reshape(-1, 3), all_corners)
    off = norm(there.reshape(steps.shape) - points - steps)
    follows = (length > 0) & (off <= 0.1 * NUDGE * size)
    return [list(steps[follows[:, k], k]) for k in range(len(points))]


def _some_nudge_holds(
    center: Array, point: Array, nudges: list[Array], near: Array, size: float
) -> bool:
    """True where a center within rounding of `center` has a local minimum beside `point`."""
    if not nudges:
        return False
    there = point + np.array(nudges)
    held = gaps(there, near) <= ON_SURFACE * size
    slack = ((near - there[:, None, None]) * (center - point)).sum(axis=3).max(axis=2)
    return bool((~held | (slack <= 1e-17 * size**2)).all(axis=1).any())


def _touch(center, point, elements, *, sure, depth, group=0, normal=None) -> Touch:  # type: ignore[no-untyped-def]
    away = center - point
    if normal is None:  # undefined, here zero, where the center lies on the surface
        normal = away / norm(away) if norm(away) > 0 else away
    point, normal = (np.asarray(one, dtype=float) for one in (point, normal))
    return Touch(point, normal, float(depth), frozenset(map(int, elements)), sure, group)


def facets(
    center: NDArray[np.float64], radius: float, corners: Array, owner: Array, side: str = "both"
) -> list[Touch]:
    """Local minima of the distance; `sure` ones must be found, the others may be."""
    center = np.asarray(center, dtype=np.longdouble)
    size = size_of(center, radius, corners)
    points = closest_on_triangles(center, corners)
    distances = norm(center - points)
    if side != "both":
        sign = 1.0 if side == "outside" else -1.0
        nearest = points[distances.argmin()]
        outward = sign * geometry.feature_normal(nearest, corners, SAME_POINT * size)
        if dot(center - nearest, outward) < 0:
            distance = distances.min()
            if distance >= radius:
                return []
            holders = owner[norm(nearest - points) <= SAME_POINT * size]
            normal = (nearest - center) / distance
            return [
                _touch(center, nearest, holders, sure=True, depth=radius + distance, normal=normal)
            ]
    # A triangle that contains a contact is itself within reach: the others need not be asked.
    reached = distances < radius + EDGE_OF_REACH * size
    corners, owner = corners[reached], owner[reached]
    found: list[Touch] = []
    points = points[reached]
    every = zip(points, gaps(points, corners), _nudges(center, points, corners, size), strict=True)
    for point, gap, nudges in every:
        away = center - point
        slack = ((corners - point) * away).sum(axis=2).max(axis=1) / size**2
        possible = not _descends(slack[gap <= 1e-13 * size], DOUBTFUL)
        certain = not _descends(slack[gap <= SAME_POINT * size], SURE)
        near = corners[gap <= SAME_POINT * size]
        possible = possible or _some_nudge_holds(center, point, nudges, near, size)
        sure = certain and bool(norm(away) < radius - EDGE_OF_REACH * size)
        if side != "both" and possible:
            lift = dot(away, sign * geometry.feature_normal(point, corners, SAME_POINT * size))
            sure &= bool(lift > DOUBTFUL * size)
            possible &= bool(lift > -DOUBTFUL * size)
        if possible:
            holders = owner[gap <= SAME_POINT * size]
            near = [t.group for t in found if norm(point - t.point) <= SAME_POINT * size]
            depth, group = radius - norm(away), near[0] if near else len(found)
            found.append(_touch(center, point, holders, sure=sure, depth=depth, group=group))
    return found


def elements(
    center: NDArray[np.float64], radius: float, corners: Array, owner: Array
) -> list[Touch]:
    """The paper's sum: each element nearer than the radius gives its closest point."""
    center = np.asarray(center, dtype=np.longdouble)
    size = size_of(center, radius, corners)
    points = closest_on_triangles(center, corners)
    distances = norm(center - points)
    found = []
    for element in range(int(owner.max()) + 1):
        mine = np.flatnonzero(owner == element)
        nearest = distances[mine].min()
        sure = bool(nearest < radius - EDGE_OF_REACH * size)
        # The halves of a quad may be nearest at places too near to each other to tell which is.
        for k in mine[distances[mine] <= nearest + SURE * size]:
            if distances[k] < radius + EDGE_OF_REACH * size:
                depth = radius - distances[k]
                found.append(
                    _touch(center, points[k], [element], sure=sure, depth=depth, group=element)
                )
    return found


def mismatch(found, expected: list[Touch], tolerance: float) -> str:  # type: ignore[no-untyped-def]
    """Why a ContactSet is not the expected set within `tolerance` [m] ("" if it is).

    Every sure contact is there, once; nothing else is there but what may be.
    """
    used: set[int] = set()
    for k in range(len(found.depth)):
        match = None
        for touch in expected:
            reach = max(norm(touch.point - found.point[k]), abs(touch.depth - found.depth[k]))
            if reach <= tolerance and int(found.element[k]) in touch.elements:
                match = touch.group
                break
        if match is None or match in used:
            listed = [(t.point, t.depth, sorted(t.elements), t.sure, t.group) for t in expected]
            return (
                f"contact {k} (element {found.element[k]}) at {found.point[k]}, depth "
                f"{found.depth[k]!r} is twice there or not among {listed}"
            )
        used.add(match)
        distance = abs(np.linalg.norm(found.normal[k]) - 1.0)
        if distance > 1e-14 * 4:
            return f"normal of contact {k} has length 1 + {distance}"
    missing = [t for t in expected if t.sure and t.group not in used]
    if missing:
        return f"missing: {[(t.point, t.depth, sorted(t.elements)) for t in missing]}"
    return ""


def normal_error(found, expected: list[Touch]) -> float:  # type: ignore[no-untyped-def]
    """Largest difference of normals between a ContactSet and the nearest expected contacts."""
    worst = 0.0
    for k in range(len(found.depth)):
        nearest = min(expected, key=lambda touch: norm(touch.point - found.point[k]))
        worst = max(worst, float(np.abs(nearest.normal - found.normal[k]).max()))
    return worst
