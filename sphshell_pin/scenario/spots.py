"""A place to touch on any surface: its broad side, away from holes, and a way across it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

# A way across a surface ends before a turn this sharp from one of its points to the next.
_SHARPEST = np.cos(np.deg2rad(35.0))
# Directions in which a way across is tried when the asked one is too short.
_DIRECTIONS = 8


@dataclass(frozen=True)
class Spot:
    """Where a sphere may stand on a shell; all in the shell's frame."""

    point: Array
    """On the surface (3,) [m]."""
    normal: Array
    """Unit (3,), from the surface to the sphere."""
    centre: Array
    """Of the sphere (3,) [m], whose gap to the surface is the one asked for."""


def find_spot(shell: Any, radius: float, gap: float, *, toward: Array | None = None) -> Spot:
    """Return a spot in the middle of `shell` where a sphere of `radius` [m] has the `gap` [m].

    `toward` (3,) is the side to touch from; by default the broad side, and for a closed surface its
    upper one where sides are alike. An open surface is touched from its hollow side.
    """
    if toward is None and _is_sheet(shell):
        point, normal = _hollow_side(shell)
    else:
        axis = _broad_axis(shell.box) if toward is None else np.asarray(toward, dtype=float)
        point, normal = _first_hit(shell, axis)
    return _with_room(shell, point, normal, radius, gap)


def way_across(shell: Any, spot: Spot, direction: Array, length: float, spacing: float) -> Array:
    """Return points (k, 3) on the surface from `spot` on, `spacing` apart, over `length` [m].

    The way goes along `direction` (3,) as the surface allows and ends before a rim or a sharp edge;
    where it would be less than half of `length`, the longest of several directions is taken.
    """
    normal = spot.normal
    first = direction - normal * (normal @ direction)
    if np.linalg.norm(first) < 1e-6:
        first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    ways: list[Array] = []
    for k in range(_DIRECTIONS):
        # 0, +45, -45, +90, ... degrees: near the asked direction first.
        angle = np.pi / 4 * ((k + 1) // 2) * (1 if k % 2 else -1)
        ways.append(
            _walk(
                shell,
                spot,
                np.cos(angle) * first + np.sin(angle) * second,
                max(1, round(length / spacing)),
                spacing,
            )
        )
        if len(ways[-1]) - 1 >= 0.5 * length / spacing:
            return ways[-1]
    return max(ways, key=len)


def _walk(shell: Any, spot: Spot, direction: Array, steps: int, spacing: float) -> Array:
    points, normal = [spot.point], spot.normal
    for _ in range(steps):
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
    return np.array(points)


def _is_sheet(shell: Any) -> bool:
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


def _first_hit(shell: Any, axis: Array) -> tuple[Array, Array]:
    """Return point and normal where a ray towards the middle, against `axis`, meets the shell."""
    middle = shell.box.mean(axis=0)
    triangles = shell.vertices[shell.triangles]
    a = triangles[:, 0]
    edge_1, edge_2 = triangles[:, 1] - a, triangles[:, 2] - a
    ray = -axis
    # Moeller and Trumbore, Fast Minimum Storage Ray/Triangle Intersection, 1997.
    p = np.cross(ray, edge_2)
    volume = np.einsum("ij,ij->i", edge_1, p)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = middle - a
        u = np.einsum("ij,ij->i", s, p) / volume
        q = np.cross(s, edge_1)
        v = (q @ ray) / volume
        t = np.einsum("ij,ij->i", edge_2, q) / volume
        hit = np.isfinite(t) & (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
    if hit.any():
        at = shell.closest_points((middle + float(t[hit].min()) * ray)[None])
    else:
        at = shell.closest_points((middle + shell.size * axis)[None])
    point, normal = at.points[0], at.normals[0]
    return point, normal if normal @ axis >= 0 else -normal


def _hollow_side(shell: Any) -> tuple[Array, Array]:
    """Return the point of an open surface nearest to its middle, and the normal towards that."""
    middle = shell.box.mean(axis=0)
    at = shell.closest_points(middle[None])
    point, normal = at.points[0], at.normals[0]
    inward = float((middle - point) @ normal)
    if abs(inward) < 1e-6 * shell.size:
        # A flat sheet has no hollow side: the upper one.
        inward = float(normal @ np.array([1e-6, 1e-3, 1.0]))
    return point, normal if inward >= 0 else -normal


def _with_room(shell: Any, point: Array, normal: Array, radius: float, gap: float) -> Spot:
    """Return the spot with the sphere lifted until nothing but the nearest point is close."""
    wanted = radius + gap
    centre = point + wanted * normal
    for _ in range(200):
        at = shell.closest_points(centre[None])
        missing = wanted - float(np.linalg.norm(centre - at.points[0]))
        if missing <= 1e-3 * gap:
            break
        centre = centre + max(missing, 1e-3 * gap) * normal
    away = centre - at.points[0]
    return Spot(at.points[0], away / np.linalg.norm(away), centre)
