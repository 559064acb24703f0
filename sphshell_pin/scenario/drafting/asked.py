"""What a user asks of the place to touch and of the path of the tip: `--at` and `--path`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sphshell_pin.checks import check_points, check_positive, check_vector
from sphshell_pin.errors import InvalidParameter, SphshellError
from sphshell_pin.scenario.drafting.touch_points import (
    TouchPoint,
    come_down,
    paths_on_surface,
    tangents,
)
from sphshell_pin.shell.faces import Face, described
from sphshell_pin.shell.raw import KINDS
from sphshell_pin.shell.shell import Shell

Array = npt.NDArray[np.float64]

SHAPES = ("line", "circle", "raster")
# Strokes of a raster, and points of a circle.
_STROKES, _AROUND = 5, 24
# How far the sphere may touch beside the place asked for, in radii, and a point be from the
# surface, as a part of its size; radii of faces that are alike, as a part of them.
_BESIDE, _OFF, _ALIKE = 0.25, 0.02, 0.01
# Places on a face that are tried, and faces.
_MOST_PLACES, _MOST_FACES = 12, 20


@dataclass(frozen=True)
class Asked:
    """Where to touch and along which path; None: that is chosen."""

    at: Array | str | None = None
    """A point of the part (3,) [m], or a kind of its faces, with a radius where there are more."""
    path: Array | str | None = None
    """Points on the part (k, 3) [m], or one of SHAPES."""
    length: float | None = None
    """Of a path of SHAPES [m]."""

    @classmethod
    def checked(cls, at: object, path: object, length: float | None) -> Asked:
        """Return what is asked, from text or numbers; InvalidParameter if it is neither."""
        if length is not None:
            check_positive("length", length, "m")
            if not isinstance(path, str) or path not in SHAPES:
                raise InvalidParameter(
                    "length", length, f"belongs to a path of {', '.join(SHAPES)}: name one"
                )
        if isinstance(at, str):
            point = _numbers(at)
            at = at.strip() if point is None else point
        elif at is not None:
            at = check_vector("at", at, 3, " [m]")
        if isinstance(path, str) and path not in SHAPES:
            rows = [_numbers(one) for one in path.split(";") if one.strip()]
            if not rows or any(one is None for one in rows):
                raise InvalidParameter(
                    "path",
                    path,
                    f"must be {', '.join(SHAPES)}, or points [m] of the part: 'x,y,z; x,y,z'",
                )
            path = np.array(rows)
        elif path is not None and not isinstance(path, str):
            path = check_points("path", path)
        if isinstance(path, np.ndarray) and at is not None:
            raise InvalidParameter("at", at, "the first point of the path says it: leave it out")
        return cls(at, path, length)

    @property
    def is_default(self) -> bool:
        """Whether nothing is asked for."""
        return self.at is None and self.path is None

    @property
    def slides(self) -> bool:
        """Whether a path is asked for."""
        return self.path is not None and len(self.path) > 1

    @property
    def whole(self) -> bool:
        """Whether part of the path will not do."""
        return isinstance(self.path, np.ndarray) or self.path in SHAPES[1:]

    @property
    def fixed(self) -> bool:
        """Whether the place is asked for."""
        return self.at is not None or isinstance(self.path, np.ndarray)

    def touches(self, shell: Shell, radius: float, gap: float) -> list[TouchPoint]:
        """Return where the sphere can touch as asked; SphshellError if nowhere."""
        if isinstance(self.at, str):
            return _on_face(shell, self.at, radius, gap)
        point = self.at if self.at is not None else np.asarray(self.path)[0]
        off = float(np.abs(shell.closest_points(point[None]).distances[0]))
        if off > _OFF * shell.size:
            raise SphshellError(
                f"the place {_listed(point)} is {1e3 * off:.3g} mm off the surface, which is in "
                f"the box from {_listed(shell.box[0])} to {_listed(shell.box[1])} m: state it in "
                "the part's own coordinates, in meters"
            )
        spot = touch_from_outside(shell, point, radius, gap)
        beside = float(np.linalg.norm(spot.point - point)) - off
        if beside > _BESIDE * radius:
            raise SphshellError(
                f"a sphere of radius {1e3 * radius:.3g} mm does not come to {_listed(point)}: it "
                f"touches the part {1e3 * beside:.3g} mm beside it; take a smaller --radius or "
                "another --at"
            )
        return [spot]

    def paths(
        self, shell: Shell, touch: TouchPoint, direction: Array, radius: float, length: float
    ) -> Iterator[tuple[Array, bool]]:
        """Yield paths (k, 3) on the surface, and whether they are smooth; `length` by default."""
        size = length if self.length is None else self.length
        if isinstance(self.path, np.ndarray):
            yield shell.closest_points(self.path).points, False
            return
        if self.path is None or self.path == "line":
            for path in paths_on_surface(shell, touch, direction, size, 0.5 * radius):
                yield path, True
            return
        first, second = tangents(touch.normal, direction)
        if self.path == "circle":
            turns = np.linspace(0.0, 2.0 * np.pi, _AROUND + 1)
            plane = size / (2 * np.pi) * np.array([np.cos(turns) - 1.0, np.sin(turns)]).T
        else:
            edge = size / (_STROKES + 1)
            along = np.tile([0.0, edge, edge, 0.0], _STROKES)[: 2 * _STROKES]
            plane = np.array([along, np.repeat(np.linspace(0.0, edge, _STROKES), 2)]).T
        for turn in range(4):
            u, v = [(first, second), (-first, -second), (second, -first), (-second, first)][turn]
            flat = touch.point + plane @ np.array([u, v])
            yield shell.closest_points(flat).points, self.path == "circle"


def touch_from_outside(shell: Shell, point: Array, radius: float, gap: float) -> TouchPoint:
    """Return where a sphere comes down on the surface at `point` (3,), from outside."""
    near = shell.closest_points(point[None])
    on, normal = near.points[0], near.normals[0]
    aside = on + 1e-3 * radius * normal
    if shell.is_closed:
        outward = float(shell.closest_points(aside[None], method="facets").distances[0])
        outward = -outward if shell.side == "inside" else outward
    else:
        # An open part is around its middle; a flat one is touched from above.
        outward = float((on - shell.box.mean(axis=0)) @ normal)
        if abs(outward) < 1e-6 * shell.size:
            outward = float(normal @ np.array([1e-6, 1e-3, 1.0]))
    normal = normal if outward >= 0 else -normal
    return come_down(shell, on + (1.5 * radius + gap) * normal, -normal, radius, gap)


def _on_face(shell: Shell, text: str, radius: float, gap: float) -> list[TouchPoint]:
    """Return touch points on the faces that `text` describes, the largest face first."""
    faces = _described_faces(shell, text)
    corners = shell.vertices[shell.triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas, middles = 0.5 * np.linalg.norm(cross, axis=1), corners.mean(axis=1)
    carriers = np.asarray(shell.triangle_element)
    masks = [np.isin(carriers, face.elements) for face in faces]
    # Of faces alike the upper one.
    ranks = [(float(f"{-areas[on].sum():.3g}"), -float(middles[on, 2].max())) for on in masks]
    for k in sorted(range(len(faces)), key=ranks.__getitem__)[:_MOST_FACES]:
        on = masks[k]
        center = np.average(middles[on], axis=0, weights=areas[on])
        some = middles[on][np.argsort(np.linalg.norm(middles[on] - center, axis=1))]
        some = some[:: max(1, len(some) // _MOST_PLACES)][:_MOST_PLACES]
        places = shell.closest_points([center, *some] if faces[k].kind == "plane" else some).points
        spots = [touch_from_outside(shell, place, radius, gap) for place in places]
        found = [
            spot
            for spot, place in zip(spots, places, strict=True)
            if np.linalg.norm(spot.point - place) <= _BESIDE * radius
        ]
        if found:
            return found
    raise SphshellError(
        f"a sphere of radius {1e3 * radius:.3g} mm touches none of the {len(faces)} faces "
        f"'{text}': it does not fit, or touches others first; take a smaller --radius or another "
        "--at"
    )


def _described_faces(shell: Shell, text: str) -> list[Face]:
    """Return the faces that `text` describes as `check` lists them: a kind, and its radius."""
    words = re.fullmatch(
        r"\s*(\w+?)s?(?:\s+(?:of\s+)?(?:radius\s+)?([\d.eE+-]+)(?:\s+and\s+([\d.eE+-]+))?\s*mm)?\s*",
        text.replace("tori", "torus"),
    )
    kind = words[1] if words else ""
    kind = "torus" if kind == "toru" else kind
    lengths = f"the faces of this part: {described(shell.faces, shell.num_elements)}"
    if words is None or kind not in KINDS:
        raise SphshellError(
            f"no face '{text}': give x,y,z [m], or one of {', '.join(KINDS)} with its radius, as "
            f"'cylinder 5.5 mm'; {lengths}"
        )
    asked = [float(one) for one in words.groups()[1:] if one is not None]

    def fits(face: Face) -> bool:
        radii = [1e3 * r for r in (face.radius, face.minor_radius) if r is not None]
        return face.kind == kind and all(
            abs(one / stated - 1) < _ALIKE for one, stated in zip(radii, asked, strict=False)
        )

    found = [face for face in shell.faces if fits(face)]
    if not found:
        raise SphshellError(f"the part has no face '{text}'; {lengths}")
    return found


def _numbers(text: str) -> Array | None:
    """Return the point (3,) that `text` states; None if it does not."""
    try:
        point = np.array([float(one) for one in text.split(",")])
    except ValueError:
        return None
    return point if point.shape == (3,) and np.isfinite(point).all() else None


def _listed(point: Sequence[float] | Array) -> str:
    return f"[{', '.join(f'{one:.4g}' for one in point)}]"
