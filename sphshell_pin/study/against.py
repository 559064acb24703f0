"""Two files of one part, pressed by the same spheres: which faces differ, and by how much."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np

from sphshell_pin.base.arrays import Array, Ints, Longs
from sphshell_pin.base.checks import check_positive
from sphshell_pin.contact import ImpactLaw
from sphshell_pin.shell.raw import KINDS, area_vectors, random_places
from sphshell_pin.shell.shell import Shell

RADIUS, DEPTH = 0.02, 0.025
"""Radius of the spheres as a share of the size; depth as a share of the radius."""

SMALLER = 0.2
"""Spheres that would touch several places are made smaller by this factor, with the same depth."""

MOST_PLACES, FEWEST, MOST_PER_FACE = 6000, 12, 64
"""Places on all faces of a shell, if there are not more faces than that allows; on each face."""

TOLERANCE = 0.01
"""Share by which forces may differ, unless stated."""

NEAR = 0.02
"""Share of the size by which the boxes of one part may differ."""
LAW = ImpactLaw(1.0, exponent=1.5)


@dataclass(frozen=True)
class FaceDifference:
    """What the spheres at places on one face felt; the differences are other less own.

    Attributes
    ----------
    of : 0 of a face of the first shell, 1 of the second
    name, kind, area : of the face [m^2]
    places : at which a sphere touches the face alone
    worst, median : largest and middle of the depth differences by size [m]
    at : place of the worst (3,) [m]
    force : smallest and largest force, other over own
    lost : places pressed of which the other has no contact
    extra : places at which the other has a contact where this one has none
    """

    of: int
    name: str
    kind: str
    area: float
    places: int
    worst: float
    median: float
    at: tuple[float, float, float]
    force: tuple[float, float]
    lost: int
    extra: int

    def off(self, tolerance: float) -> bool:
        """Whether a contact is missing on one side, or a force off by more than `tolerance`."""
        low, high = self.force
        return bool(self.lost or self.extra or low < 1.0 - tolerance or high > 1.0 + tolerance)


@dataclass(frozen=True)
class Against:
    """How two shells differ.

    Attributes
    ----------
    radius, depth : of the largest spheres and of all [m]
    size : of the first shell [m]
    tolerance : share by which forces may differ
    moved : how the box of the second is not that of the first, in words, or ""
    faces : of both, those that differ most first; none if the second is elsewhere
    unreached : faces of both that no sphere touches alone
    """

    radius: float
    depth: float
    size: float
    tolerance: float
    moved: str
    faces: tuple[FaceDifference, ...]
    unreached: int

    @property
    def off(self) -> tuple[FaceDifference, ...]:
        """The faces that differ by more than the tolerance."""
        return tuple(face for face in self.faces if face.off(self.tolerance))

    @property
    def same(self) -> bool:
        """Whether no face differs."""
        return not self.moved and not self.off

    def verdict(self) -> str:
        """Return one sentence."""
        if self.moved:
            return f"not the same part in the same place: {self.moved}"
        places = sum(face.places for face in self.faces)
        if not self.off:
            return (
                f"the same within {self.tolerance:.3g} of the force at {places} places on "
                f"{len(self.faces)} faces"
            )
        worst = max(self.off, key=lambda face: abs(face.worst))
        lost, extra = (sum(getattr(one, key) for one in self.faces) for key in ("lost", "extra"))
        kinds = Counter(face.kind for face in self.off).most_common()
        return (
            f"different: {len(self.off)} of {len(self.faces)} faces by more than "
            f"{self.tolerance:.3g} of the force ({', '.join(f'{kind} {n}' for kind, n in kinds)}), "
            f"{lost} contacts lost, {extra} extra; the depth by up to {abs(worst.worst):.3g} m, on "
            f"{worst.kind} '{worst.name}'"
        )

    def to_dict(self) -> dict[str, object]:
        """All figures by name."""
        return {**asdict(self), "same": self.same, "verdict": self.verdict()}


def compare_shells(
    first: Shell, second: Shell, radius: float | None = None, tolerance: float = TOLERANCE
) -> Against:
    """Press spheres into places on every face of both shells, and compare depths and forces.

    Each sphere is pressed by the same depth into the one shell, and put as far above it; where it
    would touch more than that place, a smaller one is taken, or none. What the other shell does to
    the sphere is compared.

    Parameters
    ----------
    first, second : of the same part in one frame
    radius : of the spheres [m], 2 % of the size of the first unless given
    tolerance : share by which forces may differ

    Raises InvalidParameter if a number is not positive.
    """
    size = first.size
    radius = RADIUS * size if radius is None else check_positive("radius", radius, "m")
    tolerance = check_positive("tolerance", tolerance)
    rng = np.random.default_rng(0)
    moved = _moved(first, second)
    pairs = () if moved else ((first, second), (second, first))
    found = [
        face
        for of, (own, other) in enumerate(pairs)
        for face in _differences(of, own, other, radius, rng)
    ]
    faces = [face for face in found if face.places]
    faces.sort(key=lambda face: (not face.off(tolerance), -abs(face.worst)))
    unreached = len(found) - len(faces)
    return Against(radius, DEPTH * radius, size, tolerance, moved, tuple(faces), unreached)


def differences_on(found: Against, of: int, shell: Shell) -> Array:
    """Return the largest difference of depth (m,) [m] on the face of each element, 0 where none is.

    `of` : 0 of the first shell, 1 of the second
    """
    worst = {(face.kind, face.name): abs(face.worst) for face in found.off if face.of == of}
    out = np.zeros(shell.num_elements)
    for name, kind, elements in _faces_of(shell):
        out[elements] = worst.get((kind, name), 0.0)
    return out


def _faces_of(shell: Shell) -> Iterator[tuple[str, str, Ints | Longs]]:
    """Name, kind and elements of each face: of CAD, or recognized, or else smooth patches."""
    if shell.element_face is not None:
        shapes = shell.face_shapes
        for row, name in enumerate(shell.face_names):
            kind = -1 if shapes is None else int(shapes[row, 0])
            elements = np.flatnonzero(shell.element_face == row)
            yield name, KINDS[kind] if kind >= 0 else "face", elements
        return
    left = np.ones(shell.num_elements, np.bool_)
    for k, face in enumerate(shell.faces, 1):
        left[face.elements] = False
        yield str(k), face.kind, face.elements
    for patch in np.unique(shell.element_patch[left]).tolist():
        yield str(patch), "patch", np.flatnonzero(left & (shell.element_patch == patch))


def _differences(
    of: int, own: Shell, other: Shell, radius: float, rng: np.random.Generator
) -> Iterator[FaceDifference]:
    depth = DEPTH * radius
    faces = [face for face in _faces_of(own) if len(face[2])]
    count = int(np.clip(MOST_PLACES // len(faces), FEWEST, MOST_PER_FACE))
    corners = own.vertices[own.triangles]
    area = 0.5 * np.linalg.norm(area_vectors(corners), axis=1)
    for name, kind, elements in faces:
        rows = np.isin(own.triangle_element, elements)
        found = own.closest_points(random_places(corners[rows], count, rng)[1])
        radii = np.full(count, radius)
        for _ in range(2):
            centers = found.points + (radii - depth)[:, None] * found.normals
            deepest, contacts = own.contacts_batch(centers, radii)
            # The place alone, or nothing: a contact this shell itself does not find.
            alone = (contacts == 0) | ((contacts == 1) & (np.abs(deepest - depth) < 0.01 * depth))
            radii = np.where(alone, radii, SMALLER * radii)
        kept = np.flatnonzero(alone)
        size = float(area[rows].sum())
        if len(kept) == 0:
            nowhere = (np.nan, np.nan, np.nan)
            yield FaceDifference(of, name, kind, size, 0, 0.0, 0.0, nowhere, (1.0, 1.0), 0, 0)
            continue
        centers, radii = centers[kept], radii[kept]
        above = centers + 2.0 * depth * found.normals[kept]
        hits = [[s.contacts_batch(c, radii)[1] > 0 for c in (centers, above)] for s in (own, other)]
        lost = hits[0][0] & ~hits[1][0]
        extra = (hits[1][0] & ~hits[0][0]) | (hits[1][1] & ~hits[0][1])
        pressed = np.flatnonzero(hits[0][0]).tolist()
        force = [_force(other, own, centers[k], radii[k]) for k in pressed] or [1.0]
        signed = own.is_closed and other.is_closed
        away = [shell.closest_points(centers).distances for shell in (own, other)]
        gap = away[0] - away[1] if signed else np.abs(away[0]) - np.abs(away[1])
        worst = int(np.argmax(np.abs(gap)))
        at = found.points[kept[worst]]
        yield FaceDifference(
            of,
            name,
            kind,
            size,
            len(kept),
            float(gap[worst]),
            float(np.median(np.abs(gap))),
            (float(at[0]), float(at[1]), float(at[2])),
            (min(force), max(force)),
            int(lost.sum()),
            int(extra.sum()),
        )


def _force(other: Shell, own: Shell, center: Array, radius: float) -> float:
    one, two = (np.linalg.norm(s.contacts(center, radius).force(LAW)) for s in (other, own))
    return float(one / two)


def _moved(first: Shell, second: Shell) -> str:
    """Return in words how the box of the second is not that of the first, or ""."""
    one, other = (np.asarray(shell.box) for shell in (first, second))
    if np.abs(one - other).max() <= NEAR * first.size:
        return ""
    low, high = (f"({x:.4g}, {y:.4g}, {z:.4g})" for x, y, z in one)
    lower, higher = (f"({x:.4g}, {y:.4g}, {z:.4g})" for x, y, z in other)
    return (
        f"the first reaches from {low} to {high} m, the second, {second.size / first.size:.4g} "
        f"times as large, from {lower} to {higher} m"
    )
