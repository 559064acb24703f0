"""A place to touch on any surface, as asked or on its broad side, and a path on it."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.vectors import nearest_axis, tangents, unit
from sphshell_pin.scenario.drafting.wording import listed, mm
from sphshell_pin.shell.faces import Face, described
from sphshell_pin.shell.raw import KINDS, area_vectors, random_places
from sphshell_pin.shell.shell import Shell

# A path on a surface ends before a turn this sharp from one of its points to the next.
_SHARP_ANGLE = np.deg2rad(35.0)
_SHARPEST = np.cos(_SHARP_ANGLE)
# Cosine of a contact's normal with the surface's, where a face is touched and not an edge.
_ALIGNED = 0.98
# A sheet's mean normal, as a part of that of a plane.
_SHEET = 0.3
# Places beside the middle: samples, how many are taken, how far apart as a part of the size, and
# the cosine between their normals and the side that is touched.
_SAMPLES, _MOST_PLACES, _APART, _FACING = 200, 16, 0.05, 0.5
# Points at the end of a path that are left out, so that it ends before a rim and not on it.
_SPARE = 2
# Directions in which a path is tried when the asked one is too short [rad].
_ANGLES = tuple(np.deg2rad((0, 180, 45, -135, -45, 135, 90, -90)))
# How far the sphere may touch beside the place asked for, in radii, and a point be from the
# surface, as a part of its size; radii of faces that are alike, as a part of them.
_BESIDE, _OFF, _ALIKE = 0.25, 0.02, 0.01
# Faces that are tried.
_MOST_FACES = 20


@dataclass(frozen=True)
class TouchPoint:
    """Where a sphere may stand on a shell; all in the shell's frame.

    `point` (3,) [m] is on the surface, `normal` (3,) points to the sphere, `center` (3,) [m] is the
    sphere's, whose gap to the surface is the one asked for.
    """

    point: Array
    normal: Array
    center: Array


def find_touch_point(
    shell: Shell, radius: float, gap: float, *, toward: Array, beside: Array | float = 0.0
) -> TouchPoint:
    """Return a place in the middle of `shell` where a sphere of `radius` [m] has the `gap` [m].

    It is touched from the side `toward` (3,), a hollow from its middle. `beside` (3,) [m] moves the
    place away from the middle.
    """
    start = shell.box.mean(axis=0) + beside
    if shell.side != "inside":
        # Far out above the middle or, over a hole, beside it.
        start = start + 2 * shell.size * toward
        if not _advance(shell, start, -toward, 0.0, 1e-6 * shell.size)[2]:
            near = shell.closest_points(start[None]).points[0]
            start = near + toward * (toward @ (start - near))
    return come_down(shell, start, -toward, radius, gap)


def sides(shell: Shell) -> list[Array]:
    """Return the sides (3,) to touch a part from, unit vectors of its frame, the best one first.

    Of a body the top, as it stands in its file, unless another side is more than twice as broad;
    of an open sheet the outside only, where it bulges: the axis nearest to it.
    """
    outward = _bulge(shell)
    if outward is not None:
        return [nearest_axis(outward)]
    broad = [float(np.prod(np.delete(np.ptp(shell.box, axis=0), k))) for k in range(3)]
    axes = [sign * np.eye(3)[k] for sign in (1.0, -1.0) for k in (2, 1, 0)]

    def rank(axis: Array) -> tuple[bool, float]:
        area = broad[int(np.argmax(np.abs(axis)))]
        return axis[2] < 1.0 or area < 0.5 * max(broad), -round(area / max(broad), 3)

    return sorted(axes, key=rank)


def touch_points(shell: Shell, radius: float, gap: float, toward: Array) -> Iterator[TouchPoint]:
    """Yield touch points: that of `find_touch_point`, then those farthest from edges."""
    middle = shell.box.mean(axis=0)
    facing = _facing(shell, -toward if shell.side == "inside" else toward)
    for point in (middle, *roomy_places(shell, facing)[0]):
        beside = point - middle - toward * (toward @ (point - middle))
        yield find_touch_point(shell, radius, gap, toward=toward, beside=beside)


def widest_room(shell: Shell) -> float:
    """Return the largest distance [m] of a place from where the surface ends, or turns sharply."""
    return max(roomy_places(shell, _facing(shell, side))[1] for side in sides(shell))


def _facing(shell: Shell, toward: Array) -> NDArray[np.bool_]:
    """Return which facets (n,) face `toward` (3,)."""
    return np.asarray(shell.triangle_normals @ toward > _FACING)


def roomy_places(shell: Shell, facets: NDArray[np.bool_]) -> tuple[list[Array], float]:
    """Return points (3,) apart from each other on some `facets` (n,), the best one first.

    The best is the farthest from where the surface ends, or turns sharply: so far [m].
    """
    normals, facing = shell.triangle_normals, np.flatnonzero(facets)
    if not len(facing):
        return [], 0.0
    ends = np.sort(shell.triangles[facing][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    ends, owner, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    # An edge of two facets is sharp where their normals differ, any other always.
    total = np.zeros((len(ends), 3))
    np.add.at(total, owner.ravel(), np.repeat(normals[facing], 3, axis=0))
    sharp = (count != 2) | (np.linalg.norm(total, axis=1) < 2 * np.cos(0.5 * _SHARP_ANGLE))
    start, end = np.moveaxis(shell.vertices[ends[sharp]], 1, 0)
    along = end - start
    corners = shell.vertices[shell.triangles[facing]]
    points = random_places(corners, _SAMPLES, np.random.default_rng(0))[1]
    room = np.full(_SAMPLES, np.inf)
    for k, point in enumerate(points):
        away = point - start
        part = (away * along).sum(axis=1) / np.maximum((along * along).sum(axis=1), 1e-300)
        off = away - np.clip(part, 0.0, 1.0)[:, None] * along
        room[k] = (off * off).sum(axis=1).min(initial=np.inf)
    found = list[Array]()
    for point in points[np.argsort(-room, kind="stable")]:
        if all(np.linalg.norm(point - one) > _APART * shell.size for one in found):
            found.append(point)
    return found[:_MOST_PLACES], float(np.sqrt(room.max()))


def touches_once(
    shell: Shell, place: TouchPoint, points: Array, radius: float, depth: float
) -> int:
    """Return at how many `points` (k, 3) a sphere pressed in by `depth` [m] touches a face, once.

    One after the other, as they lead away from `place`. In a groove it rests on several sides, each
    with a force of its own; on an edge the force turns with the smallest step aside.
    """
    first, second = tangents(place.normal, np.zeros(3))
    for aside in (0.1 * radius, 0.5 * radius):
        around = place.point + aside * np.array([first, -first, second, -second])
        near = shell.closest_points(around)
        # Where it turns or ends, there is an edge or a hole.
        turns = np.abs(near.normals @ place.normal) < _SHARPEST
        if turns.any() or np.abs(near.distances).max() > 0.3 * aside:
            return 0
    normal, at = place.normal, shell.closest_points(points)
    for k, (point, turned) in enumerate(zip(at.points, at.normals, strict=True)):
        before, normal = normal, turned if turned @ normal >= 0 else -turned
        contacts = shell.contacts(point + (radius - depth) * normal, radius)
        alone = len(contacts) == 1 and contacts.normal[0] @ normal >= _ALIGNED
        if before @ normal < _SHARPEST or not alone:
            return k
    return len(points)


def paths_on_surface(
    shell: Shell, place: TouchPoint, direction: Array, length: float, spacing: float
) -> Iterator[Array]:
    """Yield paths (k, 3) on the surface from `place` on, `spacing` apart, over `length` [m].

    The first goes along `direction` (3,) as the surface allows, the others beside it; each ends
    before a rim or a sharp edge.
    """
    first, second = tangents(place.normal, direction)
    steps = max(1, round(length / spacing))
    for angle in _ANGLES:
        ahead = np.cos(angle) * first + np.sin(angle) * second
        yield _walk(shell, place, ahead, steps, spacing)


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
        normal, direction = turned, unit(moved - turned * (turned @ moved))
    return np.array(points[: max(1, len(points) - _SPARE)])


def facet_areas(shell: Shell) -> Array:
    """Return the areas (n,) [m2] of the triangles."""
    return np.asarray(0.5 * np.linalg.norm(area_vectors(shell.vertices[shell.triangles]), axis=1))


def _bulge(shell: Shell) -> Array | None:
    """Return the mean normal (3,) of an open sheet on the side where it bulges, of a flat one up.

    None of a body, be it with holes: its normals do not agree.
    """
    mean = np.average(shell.triangle_normals, axis=0, weights=facet_areas(shell))
    if shell.is_closed or np.linalg.norm(mean) <= _SHEET:
        return None
    normal = unit(mean)
    heights = shell.vertices @ normal
    middle = shell.closest_points(shell.box.mean(axis=0)[None]).points[0] @ normal
    # The box of a dome is around its hollow.
    bulge = side_of_sheet(shell, normal, middle - 0.5 * (heights.max() + heights.min()))
    return normal if bulge >= 0 else -normal


def side_of_sheet(shell: Shell, normal: Array, height: float) -> float:
    """Return the `height` [m] that says whether `normal` (3,) points out; up of what is flat."""
    flat = abs(height) < 1e-6 * shell.size
    return float(normal @ np.array([1e-6, 1e-3, 1.0]) if flat else height)


def come_down(
    shell: Shell, start: Array, direction: Array, radius: float, gap: float
) -> TouchPoint:
    """Return where a sphere of `radius` [m] comes to that moves from `start` along `direction`.

    It stops at the `gap` [m] to the surface; `direction` is a unit vector (3,).
    """
    center, point, _ = _advance(shell, start, direction, radius + gap, 1e-3 * gap)
    return TouchPoint(point, unit(center - point), center)


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


def asked_touches(asked: Asked, shell: Shell, radius: float, gap: float) -> list[TouchPoint]:
    """Return where the sphere can touch as asked; SphshellError if nowhere."""
    if isinstance(asked.at, str):
        return _on_face(shell, asked.at, radius, gap)
    point = asked.at if asked.at is not None else np.asarray(asked.path)[0]
    off = float(np.abs(shell.closest_points(point[None]).distances[0]))
    if off > _OFF * shell.size:
        raise SphshellError(
            f"the place {listed(point)} is {mm(off)} off the surface, which is in the box from "
            f"{listed(shell.box[0])} to {listed(shell.box[1])} m: state it in the part's own "
            "coordinates, in meters"
        )
    spot = touch_from_outside(shell, point, radius, gap)
    beside = float(np.linalg.norm(spot.point - point)) - off
    if beside > _BESIDE * radius:
        raise SphshellError(
            f"a sphere of radius {mm(radius)} does not come to {listed(point)}: it touches the "
            f"part {mm(beside)} beside it; take a smaller --radius or another --at"
        )
    return [spot]


def touch_from_outside(shell: Shell, point: Array, radius: float, gap: float) -> TouchPoint:
    """Return where a sphere comes down on the surface at `point` (3,), from outside."""
    near = shell.closest_points(point[None])
    on, normal = near.points[0], near.normals[0]
    aside = on + 1e-3 * radius * normal
    if shell.is_closed:
        outward = float(shell.closest_points(aside[None], method="facets").distances[0])
        outward = -outward if shell.side == "inside" else outward
    else:
        # An open part is around its middle.
        outward = side_of_sheet(shell, normal, (on - shell.box.mean(axis=0)) @ normal)
    normal = normal if outward >= 0 else -normal
    return come_down(shell, on + (1.5 * radius + gap) * normal, -normal, radius, gap)


def _on_face(shell: Shell, text: str, radius: float, gap: float) -> list[TouchPoint]:
    """Return touch points on the faces that `text` describes, the largest face first."""
    faces, areas = _described_faces(shell, text), facet_areas(shell)
    masks = [np.isin(shell.triangle_element, face.elements) for face in faces]
    heights = shell.vertices[shell.triangles, 2].max(axis=1)
    # The upper one of faces alike.
    masks.sort(key=lambda on: (float(f"{-areas[on].sum():.3g}"), -float(heights[on].max())))
    for on in masks[:_MOST_FACES]:
        places = shell.closest_points(np.array(roomy_places(shell, on)[0])).points
        spots = [touch_from_outside(shell, place, radius, gap) for place in places]
        away = np.linalg.norm([spot.point for spot in spots] - places, axis=1)
        if (away <= _BESIDE * radius).any():
            return [spots[k] for k in np.flatnonzero(away <= _BESIDE * radius)]
    raise SphshellError(
        f"a sphere of radius {mm(radius)} touches none of the {len(faces)} faces '{text}': it does "
        "not fit, or touches others first; take a smaller --radius or another --at"
    )


def _described_faces(shell: Shell, text: str) -> list[Face]:
    """Return the faces that `text` describes as `check` lists them: a kind, and its radius."""
    words = re.fullmatch(r"([a-z]+)((?:of|radius|and|mm|[\s\d.eE+-])*)", text.strip())
    name = words[1].replace("tori", "torus") if words else ""
    kind = next((one for one in KINDS if name in (one, f"{one}s")), "")
    lengths = f"the faces of this part: {described(shell.faces, shell.num_elements)}"
    if words is None or not kind:
        raise SphshellError(
            f"no face '{text}': give x,y,z [m], or one of {', '.join(KINDS)} with its radius, as "
            f"'cylinder 5.5 mm'; {lengths}"
        )
    asked = [float(one) for one in re.findall(r"[\d.]+(?:[eE][+-]?\d+)?", words[2])]
    found = list[Face]()
    for face in shell.faces:
        radii = [1e3 * r for r in (face.radius, face.minor_radius) if r is not None]
        alike = [abs(r / one - 1) < _ALIKE for r, one in zip(radii, asked, strict=False)]
        if face.kind == kind and all(alike):
            found.append(face)
    if not found:
        raise SphshellError(f"the part has no face '{text}'; {lengths}")
    return found
