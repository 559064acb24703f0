"""A place to touch on any surface: its broad side, away from holes, and a path on it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from sphshell_pin.shell.shell import Shell

Array = npt.NDArray[np.float64]

# A path on a surface ends before a turn this sharp from one of its points to the next.
_SHARPEST = np.cos(np.deg2rad(35.0))
# Of a contact's normal with the surface's, where a face is touched and not an edge.
_ALIGNED = 0.98
# How far from the middle other places are looked for, as parts of half the box.
_PARTS = (0.15, 0.35, 0.6)
# Points at the end of a path that are left out, so that it ends before a rim and not on it.
_SPARE = 2
# Directions in which a path is tried when the asked one is too short.
_DIRECTIONS = 8


@dataclass(frozen=True)
class TouchPoint:
    """Where a sphere may stand on a shell; all in the shell's frame."""

    point: Array
    """On the surface (3,) [m]."""
    normal: Array
    """Unit (3,), from the surface to the sphere."""
    center: Array
    """Of the sphere (3,) [m], whose gap to the surface is the one asked for."""


def find_touch_point(
    shell: Shell,
    radius: float,
    gap: float,
    *,
    toward: Array | None = None,
    inside: bool = False,
    beside: Array | None = None,
) -> TouchPoint:
    """Return a place in the middle of `shell` where a sphere of `radius` [m] has the `gap` [m].

    `toward` (3,) is the side to touch from; by default the broad side, and for a closed surface its
    upper one where sides are alike. A sheet is touched from its hollow side. With `inside` the
    surface is touched from its middle. `beside` (3,) [m] moves the place away from the middle.
    """
    middle = shell.box.mean(axis=0) + (0.0 if beside is None else beside)
    if toward is None and _is_sheet(shell):
        point, normal = _hollow_side(shell, middle)
        start = point + max(float(np.linalg.norm(middle - point)), 2 * radius) * normal
        axis = normal
    else:
        axis = _broad_axis(shell.box) if toward is None else np.asarray(toward, dtype=float)
        start = middle if inside else _above(shell, axis, middle)
    return come_down(shell, start, -axis, radius, gap)


def touch_points(
    shell: Shell, radius: float, gap: float, *, toward: Array | None = None, inside: bool = False
) -> Iterator[TouchPoint]:
    """Yield touch points: that of `find_touch_point`, then others farther and farther from it.

    Without `toward` those on the six sides of the surface's box follow.
    """
    yield find_touch_point(shell, radius, gap, toward=toward, inside=inside)
    for part in _PARTS:
        yield from _around(shell, radius, gap, part, toward, inside=inside)
    if toward is None:
        for side in (*np.eye(3)[::-1], *-np.eye(3)[::-1]):
            yield find_touch_point(shell, radius, gap, toward=side)
            yield from _around(shell, radius, gap, _PARTS[1], side, inside=False)


def _around(
    shell: Shell, radius: float, gap: float, part: float, toward: Array | None, *, inside: bool
) -> Iterator[TouchPoint]:
    """Yield touch points beside the middle, by `part` of half the box along its axes."""
    half = 0.5 * (shell.box[1] - shell.box[0])
    for signs in itertools.product((0, 1, -1), repeat=3):
        if any(signs):
            aside = part * half * np.array(signs)
            yield find_touch_point(shell, radius, gap, toward=toward, inside=inside, beside=aside)


def touches_once(
    shell: Shell, place: TouchPoint, points: Array, radius: float, depth: float
) -> bool:
    """Whether a sphere pressed in by `depth` [m] at `points` (k, 3) touches a face, and once.

    In a groove it rests on several sides, each with a force of its own; on an edge the force turns
    with the smallest step aside. `points` lead away from `place`.
    """
    first, second = _tangents(place.normal, np.zeros(3))
    for aside in (0.1 * radius, 0.5 * radius):
        near = shell.closest_points(
            place.point + aside * np.array([first, -first, second, -second])
        )
        # Where it turns or ends, there is an edge or a hole.
        turns = np.abs(near.normals @ place.normal) < _SHARPEST
        if turns.any() or np.abs(near.distances).max() > 0.3 * aside:
            return False
    normal = place.normal
    at = shell.closest_points(points)
    for point, turned in zip(at.points, at.normals, strict=True):
        before, normal = normal, turned if turned @ normal >= 0 else -turned
        if before @ normal < _SHARPEST:
            return False
        contacts = shell.contacts(point + (radius - depth) * normal, radius)
        if len(contacts) != 1 or contacts.normal[0] @ normal < _ALIGNED:
            return False
    return True


def path_on_surface(
    shell: Shell, place: TouchPoint, direction: Array, length: float, spacing: float
) -> Array:
    """Return points (k, 3) on the surface from `place` on, `spacing` apart, over `length` [m].

    It goes along `direction` (3,) as the surface allows and ends before a rim or a sharp edge;
    where it would be less than half of `length`, the longest of several directions is taken.
    """
    first, second = _tangents(place.normal, direction)
    steps = max(1, round(length / spacing))
    best = np.zeros((0, 3))
    for k in range(_DIRECTIONS):
        # 0, +45, -45, +90, ... degrees: near the asked direction first.
        angle = np.pi / 4 * ((k + 1) // 2) * (1 if k % 2 else -1)
        ahead = np.cos(angle) * first + np.sin(angle) * second
        path = _walk(shell, place, ahead, steps, spacing)
        best = path if len(path) > len(best) else best
        if len(best) - 1 >= 0.5 * length / spacing:
            break
    return best


def _tangents(normal: Array, direction: Array) -> tuple[Array, Array]:
    """Return unit vectors (3,) across `normal` and each other, the first along `direction`."""
    first = direction - normal * (normal @ direction)
    if np.linalg.norm(first) < 1e-6:
        first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first = first / np.linalg.norm(first)
    return first, np.cross(normal, first)


def _walk(shell: Shell, place: TouchPoint, direction: Array, steps: int, spacing: float) -> Array:
    points, normal = [place.point], place.normal
    for _ in range(steps + _SPARE):
        at = shell.closest_points((points[-1] + spacing * direction)[None])
        point, turned = at.points[0], at.normals[0]
        turned = turned if turned @ normal >= 0 else -turned
        moved = point - points[-1]
        if turned @ normal < _SHARPEST or moved @ direction < 0.7 * spacing:
            break
        points.append(point)
        normal = turned
        ahead = moved - normal * (normal @ moved)
        direction = ahead / np.linalg.norm(ahead)
    return np.array(points[: max(1, len(points) - _SPARE)])


def _is_sheet(shell: Shell) -> bool:
    """Whether the surface is a sheet, and not a body, be it with holes: its normals agree."""
    if shell.is_closed:
        return False
    corners = shell.vertices[shell.triangles]
    areas = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = float(np.linalg.norm(areas, axis=1).sum())
    return float(np.linalg.norm(areas.sum(axis=0))) > 0.3 * total


def _broad_axis(box: Array) -> Array:
    """Return the axis along which the surface is thinnest; z before y before x where alike."""
    sizes = box[1] - box[0]
    k = max(i for i in range(3) if sizes[i] <= 1.01 * sizes.min() + 1e-12)
    axis: Array = np.eye(3)[k]
    return axis


def _above(shell: Shell, axis: Array, middle: Array) -> Array:
    """Return a place far out along `axis`, above the middle or, over a hole, beside it."""
    far: Array = middle + 2 * shell.size * axis
    if not _advance(shell, far, -axis, 0.0, 1e-6 * shell.size)[2]:
        beside = shell.closest_points(far[None]).points[0]
        far = beside + axis * (axis @ (far - beside))
    return far


def _hollow_side(shell: Shell, middle: Array) -> tuple[Array, Array]:
    """Return the point of an open surface nearest to its `middle`, and the normal towards that."""
    at = shell.closest_points(middle[None])
    point, normal = at.points[0], at.normals[0]
    inward = float((middle - point) @ normal)
    if abs(inward) < 1e-6 * shell.size:
        # A flat sheet has no hollow side: the upper one.
        inward = float(normal @ np.array([1e-6, 1e-3, 1.0]))
    return point, normal if inward >= 0 else -normal


def come_down(
    shell: Shell, start: Array, direction: Array, radius: float, gap: float
) -> TouchPoint:
    """Return where a sphere of `radius` [m] comes to that moves from `start` along `direction`.

    It stops at the `gap` [m] to the surface; `direction` is a unit vector (3,).
    """
    center, point, _ = _advance(shell, start, direction, radius + gap, 1e-3 * gap)
    away = center - point
    return TouchPoint(point, away / np.linalg.norm(away), center)


def _advance(
    shell: Shell, start: Array, direction: Array, distance: float, tolerance: float
) -> tuple[Array, Array, bool]:
    """Go from `start` along `direction` until the surface is at `distance` [m].

    Return the place, the surface's point next to it, and whether the surface was there. No step is
    longer than what is free, so nothing is passed through (sphere tracing, Hart 1996).
    """
    place = start
    farthest = 2 * float(np.linalg.norm(start - shell.box.mean(axis=0))) + 2 * shell.size
    for _ in range(500):
        point = shell.closest_points(place[None]).points[0]
        free = float(np.linalg.norm(place - point)) - distance
        if abs(free) <= tolerance:
            return place, point, True
        if float(direction @ (place - start)) > farthest:
            break
        place = place + free * direction
    return place, point, False
