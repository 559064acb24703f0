"""The path of a tip on the surface: the one asked for, or the longest that joints allow."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.scenario.drafting.asked import SHAPES, Asked
from sphshell_pin.scenario.drafting.clearance import Links
from sphshell_pin.scenario.drafting.placing import Place, nearer
from sphshell_pin.scenario.drafting.touch_points import TouchPoint, paths_on_surface, touches_once
from sphshell_pin.scenario.drafting.vectors import moved, tangents
from sphshell_pin.scenario.drafting.wording import mm
from sphshell_pin.shell.shell import Shell

# The path across a surface: radii long at most, and this part of the reach. It is a path from this
# number of radii on, and no longer one is looked for from this part of it on.
PATH_RADII, PATH_REACH = 10.0, 0.15
SHORTEST_PATH, ENOUGH = 1.0, 0.8
# Cosine of the normal with that of the beginning, at which a path ends that was not asked for.
_TILTED = 0.85
# Strokes of a raster, and points of a circle.
_STROKES, _AROUND = 5, 24


@dataclass(frozen=True)
class Way:
    """A path of the tip on the surface, or a single point.

    The `points` (k, 3) [m] are in the shell's frame; a `smooth` path has no corners. `why` says why
    it is not longer; along an `even` one the sphere touches one face.
    """

    points: Array
    smooth: bool = True
    why: str = ""
    even: bool = True

    @property
    def slides(self) -> bool:
        """Whether it is more than a single point."""
        return len(self.points) > 1

    @property
    def length(self) -> float:
        """Length of the path [m]."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())


def find_way(asked: Asked, place: Place, links: Links, gap: float, room: float) -> Way:
    """Return the longest path that surface and joints allow from a `place`, of those tried.

    The sphere, whose `gap` [m] to the surface is that of the start, touches one face along it, and
    the tip keeps its orientation unless that follows from its place. Links stay `room` [m] off the
    part.
    """
    shell, stance, touch = links.shell, place.stance, place.touch
    radius, stays = stance.tip.radius, touch.point[None]
    if not place.on_face:
        why = "the sphere touches edges or several sides at once, wherever it was tried"
        return Way(stays, why=why, even=False)
    if stance.slide is None:
        return Way(stays, why="its joints cannot move it across the surface")
    part = nearer(place.placement, room * stance.approach)
    length = asked.length or min(PATH_RADII * radius, PATH_REACH * stance.reach)
    whole = isinstance(asked.path, np.ndarray) or asked.path in SHAPES[1:]
    best, most_on_surface, reason = Way(stays), 0.0, ""
    direction = place.placement.rotation.T @ stance.slide
    for points, smooth in _tried(asked, shell, touch, direction, radius, length):
        fine = points if smooth else _fine(points, 0.5 * radius)
        count = max(1, touches_once(shell, touch, fine, radius, 2 * gap))
        normals = shell.closest_points(fine[:count]).normals
        facing = normals @ touch.normal
        if asked.path is None:  # not down the side of the part
            count = int(next(iter(np.flatnonzero(np.abs(facing) < _TILTED)), count))
        most_on_surface = max(most_on_surface, Way(fine[:count]).length)
        normals = normals * np.where(facing < 0, -1.0, 1.0)[:, None]
        world = moved(place.placement, fine[:count] + (radius + gap) * normals[:count])
        count, why = stance.follows(world, lambda q: links.within(q, part) is None)
        reason = why or reason
        if whole and count < len(fine):
            continue
        way = Way(points if count == len(fine) else fine[:count], smooth)
        if way.length > best.length:
            best = way
        if best.length >= ENOUGH * length:
            return best
    if asked.path is None and best.length >= SHORTEST_PATH * radius:
        return best
    needed = SHORTEST_PATH * radius if asked.path is None else ENOUGH * (asked.length or 0.0)
    if most_on_surface <= needed:
        within = mm(most_on_surface + 0.5 * radius)
        reason = f"the surface has no room: an edge or another side is within {within}"
    return Way(stays, why=reason)


def _tried(
    asked: Asked, shell: Shell, touch: TouchPoint, direction: Array, radius: float, size: float
) -> Iterator[tuple[Array, bool]]:
    """Yield paths (k, 3) on the surface, and whether they are smooth; shapes over `size` [m]."""
    if isinstance(asked.path, np.ndarray):
        yield shell.closest_points(asked.path).points, False
        return
    if asked.path in (None, "line"):
        paths = paths_on_surface(shell, touch, direction, size, 0.5 * radius)
        yield from ((path, True) for path in paths)
        return
    first, second = tangents(touch.normal, direction)
    if asked.path == "circle":
        turns = np.linspace(0.0, 2.0 * np.pi, _AROUND + 1)
        plane = size / (2 * np.pi) * np.array([np.cos(turns) - 1.0, np.sin(turns)]).T
    else:
        edge, rows = size / (_STROKES + 1), np.repeat(np.linspace(0.0, 1.0, _STROKES), 2)
        plane = edge * np.array([np.resize([0.0, 1.0, 1.0, 0.0], len(rows)), rows]).T
    for axes in ((first, second), (-first, -second), (second, -first), (-second, first)):
        flat = touch.point + plane @ np.array(axes)
        yield shell.closest_points(flat).points, asked.path == "circle"


def _fine(points: Array, spacing: float) -> Array:
    """Return `points` (k, 3) with more between them, at most `spacing` [m] apart."""
    parts = [points[:1]]
    for one, other in itertools.pairwise(points):
        steps = max(1, math.ceil(float(np.linalg.norm(other - one)) / spacing))
        parts.append(one + np.arange(1, steps + 1)[:, None] / steps * (other - one))
    return np.concatenate(parts)
