"""Surfaces as they come in: vertices and polygons of any size, checked but not yet cleaned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sphshell_pin.base.arrays import Array, Ints, Longs, Mask
from sphshell_pin.base.checks import as_floats
from sphshell_pin.errors import InvalidShell

SAMPLE = 1000
"""Vertices that are looked at."""

FEWEST = 12
"""Distinct numbers that it takes as evidence of digits or of a grid."""

LARGEST_STEP = 1e-4
"""Share of the box diagonal: what lies on a coarser grid was made so, as voxels are."""

MOST_DIGITS = 9
SINGLE_PRECISION = 6e-8

SCALES = (1.0, 1e-3, 1e-2, 0.0254)
"""Meters per unit in which arrays may have been rounded, before they were scaled."""


def rounding(numbers: Array, scales: tuple[float, ...] = (1.0,)) -> float:
    """Return half the step to which coordinates (n, 3) are known, 0 where they show none.

    They are also tried divided by each of `scales`; the result is in the unit of `numbers`.
    """
    largest = float(max(-numbers.min(initial=0.0), numbers.max(initial=0.0)))
    if not 0.0 < largest < np.inf:
        return 0.0
    some = numbers[:: max(1, len(numbers) // SAMPLE)]
    size = float(np.linalg.norm(np.ptp(some, axis=0)))
    values = np.unique(np.abs(some))
    values = values[values > 1e-12 * largest]
    found = [0.0]
    for scale in scales:
        own = values / scale
        # Scaling there and back is off by a few units in the last place.
        if np.allclose(own.astype(np.float32), own, rtol=1e-15, atol=0.0):
            found.append(SINGLE_PRECISION * largest)
        if len(own) >= FEWEST:
            steps = scale * _last_digit(own), scale * _grid_step(own)
            found += [step / 2 for step in steps if step <= LARGEST_STEP * size]
    return max(found)


def _last_digit(values: Array) -> float:
    """Return a unit in the last digit of the largest of `values` (n,), 0 if all need many digits.

    The third largest stands for it: one or two may have a digit more in front, as 100 has.
    """
    step = 0.0
    decade = np.floor(np.log10(values))
    for digits in range(MOST_DIGITS, 0, -1):
        last = 10.0 ** (digits - 1 - decade)
        if np.abs(values * last - np.round(values * last)).max() > 1e-5:
            break
        step = 1.0 / float(last[-3])
    return step


def _grid_step(values: Array) -> float:
    """Return the step of which all `values` (n,), sorted, are multiples, 0 if there is none."""
    gaps = np.diff(values)
    gaps = gaps[gaps > 2e-7 * values[-1]]
    if len(gaps) == 0:
        return 0.0
    spans = np.concatenate([gaps, values])
    for parts in range(1, 9):  # the smallest gap may be several steps
        step = gaps.min() / parts
        for reach in 10.0 ** np.arange(1, 8):  # the farther, the more exact
            near = spans[spans < reach * step]
            count = np.round(near / step)
            step = near @ count / max(count @ count, 1.0) or step
        multiple = values / step
        if np.abs(multiple - np.round(multiple)).max() < 0.1:
            return float(step)
    return 0.0


LARGEST_COUNT = np.iinfo(np.int32).max


KINDS = ("plane", "cylinder", "cone", "sphere", "torus")
"""Kinds of faces, in the order of FaceKind in C++."""

NO_SHAPE = (-1.0,) + (0.0,) * 8
"""The row of `face_shapes` of a face of another kind."""


def moved_shapes(
    shapes: Array | None, scale: float, rotation: Array, translation: Array
) -> Array | None:
    """Shapes (f, 9) of faces made larger, then turned by (3, 3), then moved by (3,) [m]."""
    if shapes is None:
        return None
    out = shapes.copy()
    out[:, 1:4] = (shapes[:, 1:4] * scale) @ rotation.T + translation
    out[:, 4:7] = shapes[:, 4:7] @ rotation.T
    out[:, 7] *= scale
    out[shapes[:, 0] == KINDS.index("torus"), 8] *= scale  # of a cone it is an angle
    return out


@dataclass(frozen=True)
class RawSurface:
    """Polygons before cleaning.

    Attributes
    ----------
    vertices : (n, 3) [m]
    offsets : (m + 1,) where the corners of each polygon start in `corners`
    corners : (c,) vertex index of every corner
    normals : (c, 3) one per corner, or None
    notes : sentences a reader has to say about the file
    faces : (m,) row in `face_names` of the CAD face each polygon lies on, or None
    face_names : of the CAD faces
    face_shapes : (f, 9) of the CAD faces, as of CleanedSurface, or None
    rounding : half the step to which the coordinates are known [m], 0 if they show none
    solids : (m,) solid of the CAD file whose surface each polygon is part of, -1 of none; or None.
        No vertex is used by polygons of two
    missing_faces : how many faces of the CAD file could not be read, or be given triangles
    """

    vertices: Array
    offsets: Longs
    corners: Ints
    normals: Array | None = None
    notes: tuple[str, ...] = ()
    faces: Ints | None = None
    face_names: tuple[str, ...] = ()
    face_shapes: Array | None = None
    rounding: float = 0.0
    solids: Ints | None = None
    missing_faces: int = 0

    @property
    def num_polygons(self) -> int:
        """Number of polygons."""
        return len(self.offsets) - 1

    def scaled(self, factor: float) -> RawSurface:
        """Return the same surface, `factor` times larger."""
        return replace(
            self,
            vertices=self.vertices * factor,
            face_shapes=moved_shapes(self.face_shapes, factor, np.eye(3), np.zeros(3)),
            rounding=self.rounding * factor,
        )

    def noting(self, *sentences: str) -> RawSurface:
        """Return the same surface with more `notes`."""
        return replace(self, notes=(*self.notes, *sentences))


def in_use(corners: Ints, count: int) -> Mask:
    """(count,) which vertices are corners."""
    used = np.zeros(count, np.bool_)
    used[corners] = True
    return used


def area_vectors(corners: Array) -> Array:
    """Twice the area times the unit normal (t, 3) of triangles (t, 3, 3)."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def random_places(corners: Array, count: int, rng: np.random.Generator) -> tuple[Longs, Array]:
    """Random points (count, 3) of triangles (t, 3, 3), spread by area, and the triangle of each."""
    area = np.linalg.norm(area_vectors(corners), axis=1)
    chosen = rng.choice(len(area), count, p=area / area.sum())
    weights = rng.dirichlet((1.0, 1.0, 1.0), count)
    return chosen, np.einsum("nk,nkx->nx", weights, corners[chosen])


def raw_surface(vertices: object, elements: object, normals: object = None) -> RawSurface:
    """Check arrays and copy them into a `RawSurface`.

    Parameters
    ----------
    vertices : (n, 3) [m], finite
    elements : (m, k) integers, rows of fewer corners end in -1; or a sequence of m sequences
    normals : per vertex (n, 3) or per corner (m, k, 3), or None

    Raises
    ------
    InvalidShell
        On a wrong shape, a value that is not finite, an index out of range, an element with fewer
        than three corners; the message says which.
    """
    points = _vertices(vertices)
    offsets, corners = _polygons(elements)
    check_indices(offsets, corners, len(points))
    given = _corner_normals(normals, points, offsets, corners)
    return RawSurface(points, offsets, corners, given, rounding=rounding(points, SCALES))


def check_vertices(points: Array, first: int = 0) -> None:
    """Raise InvalidShell unless three vertices or more are there, all finite.

    first : the number of the first one in messages
    """
    if not 3 <= len(points) <= LARGEST_COUNT:
        raise InvalidShell(f"a surface needs at least 3 vertices; {len(points)} given")
    finite = np.isfinite(points)
    if not finite.all():
        wrong = np.flatnonzero(~finite.all(axis=1))
        raise InvalidShell(
            f"vertex {int(wrong[0]) + first} is not finite: {points[wrong[0]].tolist()}"
            + (f" ({wrong.size} such vertices)" if wrong.size > 1 else "")
        )


def check_indices(offsets: Longs, corners: Ints, num_vertices: int, first: int = 0) -> None:
    """Raise InvalidShell if a polygon names a vertex that does not exist.

    first : the number of the first element and vertex in messages
    """
    if corners.min() < 0 or corners.max() >= num_vertices:
        wrong = np.flatnonzero((corners < 0) | (corners >= num_vertices))
        slot = int(wrong[0])
        element = int(np.searchsorted(offsets, slot, side="right")) - 1
        raise InvalidShell(
            f"element {element + first} uses vertex {int(corners[slot]) + first}, but the "
            f"{num_vertices} vertices are numbered {first} to {num_vertices - 1 + first}: correct "
            "the index"
        )


def _vertices(vertices: object) -> Array:
    try:
        points = as_floats(vertices)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidShell(f"vertices must be an (n, 3) array of numbers [m]: {error}") from error
    if points.ndim != 2 or points.shape[1] != 3:
        raise InvalidShell(
            f"vertices must be an (n, 3) array [m]; the one given has shape {points.shape}"
        )
    check_vertices(points)
    return points


def _polygons(elements: object) -> tuple[Longs, Ints]:
    if not isinstance(elements, (np.ndarray, Sequence)):
        raise InvalidShell(f"elements must be an array or a list of lists, not {type(elements)}")
    if len(elements) == 0:
        raise InvalidShell("a surface needs at least one element; none given")
    if np.ma.is_masked(elements):
        raise InvalidShell("elements must not be masked: leave out those that are not wanted")
    rows = elements
    if not isinstance(rows, np.ndarray):
        if len({len(row) for row in rows if hasattr(row, "__len__")}) != 1:
            return _ragged(rows)
        rows = np.array(rows)
    if rows.ndim != 2 or rows.shape[1] < 3:
        raise InvalidShell(
            f"elements must be an (m, 3) or (m, 4) array of vertex indices, or a list of lists; "
            f"the one given has shape {rows.shape}"
        )
    if not np.issubdtype(rows.dtype, np.integer):
        raise InvalidShell(f"elements must hold integer vertex indices; they are {rows.dtype}")
    if rows.min() < -1 or rows.max() > LARGEST_COUNT:
        element, place = np.argwhere((rows < -1) | (rows > LARGEST_COUNT))[0]
        raise InvalidShell(f"element {element} uses vertex {rows[element, place]}: no such vertex")
    if rows.min() >= 0:
        starts = np.arange(len(rows) + 1, dtype=np.int64) * rows.shape[1]
        return starts, np.array(rows, np.int32, order="C").reshape(-1)
    used = rows >= 0
    counts = used.sum(axis=1)
    ragged = np.flatnonzero((counts < 3) | (used[:, 1:] & ~used[:, :-1]).any(axis=1))
    if ragged.size:
        raise InvalidShell(
            f"element {int(ragged[0])} is {rows[ragged[0]].tolist()}: it needs at least three "
            "corners, and -1 may stand only at the end of its row"
        )
    return offsets_of(counts), rows[used].astype(np.int32)


def _ragged(rows: Sequence[Sequence[int]]) -> tuple[Longs, Ints]:
    kept: list[list[int]] = []
    for k, row in enumerate(rows):
        corners = [c for c in row if c != -1] if hasattr(row, "__iter__") else []
        if len(corners) < 3 or not all(isinstance(c, (int, np.integer)) for c in corners):
            raise InvalidShell(f"element {k} is {row!r}: it needs at least three vertex indices")
        kept.append(corners)
    flat = np.concatenate([np.asarray(row, np.int64) for row in kept])
    flat = np.clip(flat, -LARGEST_COUNT, LARGEST_COUNT)
    return offsets_of(np.array(list(map(len, kept)))), flat.astype(np.int32)


def offsets_of(counts: Longs) -> Longs:
    """Where each of some rows starts that have `counts` (m,) entries, and the end (m + 1,)."""
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])


def _corner_normals(normals: object, points: Array, offsets: Longs, corners: Ints) -> Array | None:
    if normals is None:
        return None
    try:
        given = as_floats(normals)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidShell(f"normals must be an array of numbers: {error}") from error
    if given.shape == points.shape:
        return np.asarray(given[corners], np.float64)
    counts = np.diff(offsets)
    fits = given.ndim == 3 and given.shape[2] == 3 and len(given) == len(counts)
    if fits and given.shape[1] >= counts.max():
        used = np.arange(given.shape[1]) < counts[:, None]
        return np.asarray(given[used], np.float64)
    raise InvalidShell(
        f"normals must be one per vertex {points.shape} or one per corner of each element "
        f"({len(counts)}, {int(counts.max())}, 3); the array given has shape {given.shape}"
    )


def shape_distances(kind: str, shape: Array, points: Array) -> Array:
    """Distances (n,) of points (n, 3) from a shape (8,): point, axis, and two radii."""
    axis, (radius, second) = shape[3:6], shape[6:]
    from_point = points - shape[:3]
    along = from_point @ axis
    if kind == "plane":
        return np.asarray(np.abs(along))
    if kind == "sphere":
        return np.asarray(np.abs(np.linalg.norm(from_point, axis=1) - radius))
    outward = np.linalg.norm(from_point - along[:, None] * axis, axis=1) - radius
    if kind == "cone":
        outward = outward * np.cos(second) - along * np.sin(second)
    elif kind == "torus":
        outward = np.hypot(outward, along) - second
    return np.asarray(np.abs(outward))
