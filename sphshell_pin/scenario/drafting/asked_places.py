"""Where the sphere touches as a user asked: a point of the part, or a face by kind and size."""

import re

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.touch_points import TouchPoint, come_down, facet_areas
from sphshell_pin.scenario.drafting.wording import listed
from sphshell_pin.shell.faces import Face, described
from sphshell_pin.shell.raw import KINDS
from sphshell_pin.shell.shell import Shell

# How far the sphere may touch beside the place asked for, in radii, and a point be from the
# surface, as a part of its size; radii of faces that are alike, as a part of them.
_BESIDE, _OFF, _ALIKE = 0.25, 0.02, 0.01
# Places on a face that are tried, and faces.
_MOST_PLACES, _MOST_FACES = 12, 20


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
        # An open part is around its middle; a flat one is touched from above.
        outward = float((on - shell.box.mean(axis=0)) @ normal)
        if abs(outward) < 1e-6 * shell.size:
            outward = float(normal @ np.array([1e-6, 1e-3, 1.0]))
    normal = normal if outward >= 0 else -normal
    return come_down(shell, on + (1.5 * radius + gap) * normal, -normal, radius, gap)


def _on_face(shell: Shell, text: str, radius: float, gap: float) -> list[TouchPoint]:
    """Return touch points on the faces that `text` describes, the largest face first."""
    faces = _described_faces(shell, text)
    areas, middles = facet_areas(shell), shell.vertices[shell.triangles].mean(axis=1)
    carriers = np.asarray(shell.triangle_element)
    masks = [np.isin(carriers, face.elements) for face in faces]
    # The upper one of faces alike.
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
