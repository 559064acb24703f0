"""Where the sphere touches as a user asked: a point of the part, or a face by kind and size."""

import re

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.touch_points import (
    TouchPoint,
    come_down,
    facet_areas,
    roomy_places,
    side_of_sheet,
)
from sphshell_pin.scenario.drafting.wording import listed
from sphshell_pin.shell.faces import Face, described
from sphshell_pin.shell.raw import KINDS
from sphshell_pin.shell.shell import Shell

# How far the sphere may touch beside the place asked for, in radii, and a point be from the
# surface, as a part of its size; radii of faces that are alike, as a part of them.
_BESIDE, _OFF, _ALIKE = 0.25, 0.02, 0.01
# Faces that are tried.
_MOST_FACES = 20


def asked_touches(asked: Asked, shell: Shell, radius: float, gap: float) -> list[TouchPoint]:
    """Return where the sphere can touch as asked; SphshellError if nowhere."""
    if isinstance(asked.at, str):
        return _on_face(shell, asked.at, radius, gap)
    point = asked.at if asked.at is not None else np.asarray(asked.path)[0]
    off = float(np.abs(shell.closest_points(point[None]).distances[0]))
    if off > _OFF * shell.size:
        raise SphshellError(
            f"the place {listed(point)} is {1e3 * off:.3g} mm off the surface, which is in "
            f"the box from {listed(shell.box[0])} to {listed(shell.box[1])} m: state it in "
            "the part's own coordinates, in meters"
        )
    spot = touch_from_outside(shell, point, radius, gap)
    beside = float(np.linalg.norm(spot.point - point)) - off
    if beside > _BESIDE * radius:
        raise SphshellError(
            f"a sphere of radius {1e3 * radius:.3g} mm does not come to {listed(point)}: it "
            f"touches the part {1e3 * beside:.3g} mm beside it; take a smaller --radius or "
            "another --at"
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
        f"a sphere of radius {1e3 * radius:.3g} mm touches none of the {len(faces)} faces "
        f"'{text}': it does not fit, or touches others first; take a smaller --radius or another "
        "--at"
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
