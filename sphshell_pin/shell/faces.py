"""The planes, cylinders, cones, spheres and tori of a surface, of CAD or recognized in its mesh."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array, Ints
from sphshell_pin.base.checks import read_only
from sphshell_pin.shell.raw import KINDS, shape_distances

MOST_GROUPS = 5  # in words

CLEARLY_WIDER = 1.1
"""Bands that differ by less stand off about as much: if one is a flat, that hardly matters."""


@dataclass(frozen=True, eq=False)
class Face:
    """A plane, cylinder, cone, sphere or torus that elements of a shell lie on, in its frame.

    Attributes
    ----------
    kind : "plane", "cylinder", "cone", "sphere" or "torus"
    point : (3,) on the plane or the axis; the center of a sphere or torus [m]
    axis : (3,) unit vector along the axis, or the normal of a plane; None of a sphere
    radius : of a cylinder or sphere; of a cone at `point`; of a torus from its center to those of
        its tube [m]; None of a plane
    minor_radius : of the tube of a torus [m], else None
    half_angle : of a cone, between its axis and its surface: negative where its radius decreases
        along the axis [rad], else None
    elements : (k,) indices of the elements on it
    curved : (j,) those of its elements that are not exact: a vertex, or a border with what is no
        such face, is farther from the face than 4e-9 of the size, and contacts there are those of
        curved elements with its normals
    name : of the CAD face; None of one that was recognized
    reason : why it is not exact, with the distance in the file's own geometry; "" if it is
    inscribed : whether it is a plane with all corners on a round face beside it: it is wider than
        the equal steps of that face
    """

    kind: str
    point: Array
    axis: Array | None
    radius: float | None
    minor_radius: float | None
    half_angle: float | None
    elements: Ints = field(repr=False)
    curved: Ints = field(repr=False)
    name: str | None = None
    reason: str = ""
    inscribed: bool = False

    @property
    def exact(self) -> bool:
        """Whether contacts on all of it are closed forms: no element of it is curved."""
        return len(self.curved) == 0


def faces_of(core: _core.Shell, names: Sequence[str] = ()) -> tuple[Face, ...]:
    """Return the faces of a compiled surface with curved elements; `names`: of those of CAD."""
    of_element = np.full(core.num_elements, -1, np.int32)
    of_element[core.triangle_element] = core.triangle_face
    kinds, numbers = core.faces
    order = np.argsort(of_element, kind="stable").astype(np.int32)
    rows, starts = np.unique(of_element[order], return_index=True)
    # An element of four corners is exact if both of its triangles are.
    exact = np.ones(core.num_elements, bool)
    np.logical_and.at(exact, core.triangle_element, core.exact_triangles.astype(bool))
    reasons = _reasons(core.inexact_faces, names)
    parts = zip(rows.tolist(), np.split(order, starts[1:]), strict=True)
    return tuple(
        _face(
            KINDS[kinds[k]],
            numbers[k],
            some,
            some[~exact[some]],
            names[k] if names else None,
            "" if exact[some].all() else reasons.get(k, ""),
        )
        for k, some in parts
        if k >= 0
    )


def _reasons(inexact: Array, names: Sequence[str]) -> dict[int, str]:
    """Return by face what is off it: rows (n, 3) of the face, the one beside it, and how far."""
    reasons = {}
    for face, other, off in inexact.tolist():
        beside = f" to {names[int(other)] if names else 'another face'}" if other >= 0 else ""
        what = "a vertex" if other == face else f"its border{beside}"
        reasons[int(face)] = f"{what} is off it by {off * 1e9:.2g} nm"
    return reasons


def _face(
    kind: str, numbers: Array, elements: Ints, curved: Ints, name: str | None, reason: str
) -> Face:
    point, axis = read_only(numbers[:3].copy()), read_only(numbers[3:6].copy())
    radius, second = numbers[6:].tolist()
    return Face(
        kind,
        point,
        None if kind == "sphere" else axis,
        None if kind == "plane" else radius,
        second if kind == "torus" else None,
        second if kind == "cone" else None,
        read_only(elements.copy()),
        read_only(curved.copy()),
        name,
        reason,
        kind == "plane" and second > 0.0,
    )


def described(faces: Sequence[Face], elements: int) -> str:
    """Return how many faces there are by kind and radius, and the share of elements on none."""
    groups = Counter(map(_named, faces)).most_common()
    parts = [f"{n} {name[n > 1]}" for name, n in groups[:MOST_GROUPS]]
    if more := sum(n for _, n in groups[MOST_GROUPS:]):
        parts.append(f"and {more} more")
    left = 100.0 * (1.0 - sum(len(face.elements) for face in faces) / elements)
    share = f"; {left:.3g} % of the elements on none" if left > 0.0 else ""
    if curved := sum(not face.exact for face in faces):
        share += f"; {curved} of {len(faces)} as curved elements"
    if flats := [face for face in faces if face.inscribed]:
        at = "({:.4g}, {:.4g}, {:.4g}) m".format(*flats[0].point)
        share += (
            f"; plane although inscribed in the round face beside it, as wider than its steps: "
            f"{len(flats)}, one at {at}"
        )
    return (", ".join(parts) or "none recognized") + share


def ambiguous_band(face: Face, corners: Array) -> Array | None:
    """Return the middle (3,) [m] of the widest band of a cylinder or cone that may be a flat.

    That is a band between two rulings that is clearly wider than all others of the face, though not
    so wide that it must be a plane. None if there is none.

    corners : (t, 3, 3) of the triangles on the face [m]
    """
    if face.kind not in ("cylinder", "cone") or face.axis is None or face.name is not None:
        return None
    east = np.cross(face.axis, np.eye(3)[np.abs(face.axis).argmin()])
    east /= np.linalg.norm(east)
    away = corners - face.point
    turn = np.arctan2(away @ np.cross(face.axis, east), away @ east)
    first = turn[:, :1]
    turn = first + np.angle(np.exp(1j * (turn - first)))
    # The tip of a cone is on every ruling.
    off = np.linalg.norm(np.cross(away, face.axis), axis=2)
    turn[off < 1e-3 * off.max()] = np.nan
    low, high = np.nanmin(turn, axis=1), np.nanmax(turn, axis=1)
    width, middle = high - low, 0.5 * (low + high)
    widest = width.argmax()
    same = np.abs(np.angle(np.exp(1j * (middle - middle[widest])))) < 0.1 * width[widest]
    if same.all() or width[widest] < CLEARLY_WIDER * width[~same].max():
        return None
    return np.asarray(corners[same].mean(axis=(0, 1)))


def not_exact(faces: Sequence[Face], shares: Array, off: Array) -> tuple[str, ...]:
    """Return a sentence for each reason why faces are not exact, which names them and the cost.

    shares : of their curved elements, of the area of the shell (n,)
    off : of these elements from the faces (n,) [m]
    """
    groups: dict[str, list[int]] = {}
    for k, face in enumerate(faces):
        if not face.exact:
            what = "border to another face" if " to " in face.reason.split(" is off")[0] else ""
            what = what or ("vertex" if face.reason.startswith("a vertex") else "border")
            groups.setdefault(what if face.reason else "reason unknown", []).append(k)
    told = []
    for what, rows in sorted(groups.items(), key=lambda group: -shares[group[1]].sum()):
        by = [float(faces[k].reason.split()[-2]) for k in rows if faces[k].reason]
        far = f" off by {min(by):.2g} to {max(by):.2g} nm" if by else ""
        names = ", ".join(
            f"{faces[k].name or f'{faces[k].kind} {k}'} ({off[k]:.1e} m)"
            for k in sorted(rows, key=lambda k: -off[k])
        )
        told.append(
            f"{what}{far}: {100 * shares[rows].sum():.2g} % of the area; elements stand off by up "
            f"to {off[rows].max():.2g} m: {names}"
        )
    return tuple(told)


def distances_from(face: Face, points: Array) -> Array:
    """Distances (n,) [m] of points (n, 3) from a face."""
    axis = np.zeros(3) if face.axis is None else face.axis
    second = face.minor_radius or face.half_angle or 0.0
    shape = np.array([*face.point, *axis, face.radius or 0.0, second])
    return shape_distances(face.kind, shape, points)


def _named(face: Face) -> tuple[str, str]:
    """Return the kind of a face and its radius in words, and the plural of it."""
    radii = [f"{r * 1e3:.4g}" for r in (face.radius, face.minor_radius) if r is not None]
    of = "" if face.kind in ("plane", "cone") else f" of radius {' and '.join(radii)} mm"
    return face.kind + of, ("tori" if face.kind == "torus" else f"{face.kind}s") + of
