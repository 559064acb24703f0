"""The error of curved elements from the exact faces; sides whose error is too large stay straight.

The tessellation is measured flat. Contact uses the elements curved to meet the normals at their
corners, and where these do not represent the whole side, as beside a joint that is nearly tangent,
a curved side may leave a face that the straight one is on.
"""

from dataclasses import dataclass, replace

import numpy as np
from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line

from sphshell_pin.base.arrays import Array, Ints, Longs, Mask
from sphshell_pin.shell.base import ShellBase
from sphshell_pin.shell.cad.face_mesh import ALONG, FaceMesh
from sphshell_pin.shell.cad.face_surface import stationary_parameters
from sphshell_pin.shell.cad.options import Occ
from sphshell_pin.shell.cad.surface import CadSurface
from sphshell_pin.shell.cleaned import CleanedSurface
from sphshell_pin.shell.curvature import points_at

_ON_SIDES = [np.roll([1 - share, share, 0.0], side) for side in range(3) for share in ALONG]
WEIGHTS = np.array([*_ON_SIDES, [1 / 3, 1 / 3, 1 / 3]])
"""Where triangles are measured (k, 3): along the sides 0, 1 and 2, and in the middle."""

CURVED = 0.25
"""Curved sides must be nearer than this share of the chord error."""

MOST_ROUNDS = 6
"""Times sides are straightened and measured again: a straight side changes middles beside it."""

SAME_PLACE = 1e-6
"""A corner this near to a node, as a share of the size, is it: cleaning welds within less."""

CURVE_SEEDS, SETTLED = 9, 0.01
"""Places along an edge from the nearest of which Newton's method goes on; the share of the chord
error below which its step no longer changes the distance notably."""


@dataclass(frozen=True)
class Errors:
    """Largest distances of elements from the exact faces [units of the model].

    sides (t, 3), middles (t,) : from the surface below; borders (t, 3) : of sides on the border of
    a face from its exact curve, 0 for the others
    """

    sides: Array
    middles: Array
    borders: Array

    @property
    def surface(self) -> float:
        """The largest distance from a surface."""
        return float(max(self.sides.max(initial=0.0), self.middles.max(initial=0.0)))

    @property
    def border(self) -> float:
        """The largest distance from a border."""
        return float(self.borders.max(initial=0.0))


def hold_curvature(
    surface: CleanedSurface, cad: CadSurface, factor: float, crease_angle: float
) -> CleanedSurface:
    """Return a CAD surface whose curved elements are as near as its flat ones, with a note of it.

    A curved side, or the sides of a curved middle, farther off than the share CURVED of the stated
    chord error are kept straight, unless straight ones are no nearer.

    factor : meters per unit of the model; crease_angle : of the shell [rad]
    """
    places = _Places(surface, cad, factor)
    limit = CURVED * cad.stated
    straight = np.zeros((len(surface.triangles), 3), np.bool_)
    bent = 0.0
    for turn in range(MOST_ROUNDS + 1):
        found = places.errors(
            ShellBase.from_surface(replace(surface, straight=straight), crease_angle)
        )
        if turn == MOST_ROUNDS:
            break
        bad, farthest = _too_far(found, places, limit)
        bent = max(bent, farthest)
        if not (bad & ~straight).any():
            break
        straight |= bad
    count = _count_sides(surface, straight)
    note = _note(found, cad.stated, cad.model.meters, count, bent)
    health = surface.health.labelled(notes=(*surface.health.notes, note))
    return replace(surface, straight=straight if count else None, health=health)


class _Places:
    """Where the triangles of a surface lie on the faces of its model."""

    def __init__(self, surface: CleanedSurface, cad: CadSurface, factor: float) -> None:
        self._factor, self._tolerance = factor, cad.stated
        polygon = surface.source_element[surface.triangle_element]
        self.corners = surface.vertices[surface.triangles] / factor
        self._sides = _own_sides(surface.triangles, cad.found.face_of(polygon))
        self._of_face: list[tuple[FaceMesh, Longs, Array | None]] = []
        self._curves = _Curves()
        for face, mesh, own in cad.found.by_face(polygon):
            of_mesh = polygon[own] - cad.found.starts[face]
            uv: Array | None = None
            if not mesh.surface.has_closed_form:
                corners = self.corners[own].reshape(-1, 3)
                at = mesh.parameters_at(np.repeat(of_mesh, 3), corners).reshape(-1, 3, 2)
                uv = np.einsum("kc,tcx->tkx", WEIGHTS, at)
            self._of_face.append((mesh, own, uv))
            self._find_curves(mesh, own, mesh.triangles[of_mesh], SAME_PLACE * cad.size)
        self._curves.seal()
        self._flat_points = np.einsum("kc,tcx->tkx", WEIGHTS, self.corners)
        # Measured last: where, nan where nowhere yet; and how far off.
        off = np.zeros((len(self.corners), 3))
        self._curved = np.full_like(self._flat_points, np.nan), Errors(off, off[:, 0], off)
        self._flat = self._curved

    def errors(self, shell: ShellBase) -> Errors:
        """Measure the curved elements of `shell`, whose triangles are those of the surface."""
        points = points_at(shell, np.arange(len(self.corners)), WEIGHTS) / self._factor
        self._curved = points, self._measure(points, *self._curved)
        return self._curved[1]

    def flat_errors(self, rows: Longs) -> Errors:
        """Measure the flat triangles `rows`: others have the errors of an earlier call, or 0."""
        points = self._flat[0].copy()
        of_sides = np.isin(self._sides.number, self._sides.number[rows]).any(axis=1)
        points[of_sides] = self._flat_points[of_sides]
        self._flat = points, self._measure(points, *self._flat)
        return self._flat[1]

    def _measure(self, points: Array, before: Array, known: Errors) -> Errors:
        """Errors of points (t, k, 3) at WEIGHTS of all triangles; `known` are those of `before`.

        Only what has moved is measured; a side that triangles of a face share, in one of them.
        """
        count = len(self.corners)
        changed = ((points != before) & np.isfinite(points)).any(axis=(1, 2))
        on_sides = self._sides.first & changed[:, None]
        sides, middles, borders = known.sides.copy(), known.middles.copy(), known.borders.copy()
        for mesh, own, uv in self._of_face:
            wanted = np.repeat(on_sides[own], len(ALONG), axis=1)
            wanted = np.column_stack([wanted, changed[own]])
            if not wanted.any():
                continue
            found, near = np.zeros(wanted.shape), None if uv is None else uv[wanted]
            found[wanted] = mesh.surface.distances(points[own][wanted], near, self._tolerance)
            largest = found[:, :-1].reshape(-1, 3, len(ALONG)).max(axis=2)
            sides[own] = np.where(on_sides[own], largest, sides[own])
            middles[own] = np.where(changed[own], found[:, -1], middles[own])
        of_sides = points[:, : 3 * len(ALONG)].reshape(count, 3, len(ALONG), 3)
        for shape, places in self._curves.shapes:
            wanted = on_sides[tuple(places.T)]
            triangle, side = places[wanted].T
            borders[triangle, side] = _from_shape(shape[wanted], of_sides[triangle, side])
        for curves, places, ends in self._curves.others:
            rows = np.flatnonzero(on_sides[tuple(places.T)])
            triangle, side = places[rows].T
            along, near = of_sides[triangle, side], SETTLED * self._tolerance
            chosen = [curves[k] for k in rows]
            borders[triangle, side] = _from_curves(chosen, along, ends[rows], near)
        return Errors(self._sides.spread(sides), middles, borders)

    def _find_curves(self, mesh: FaceMesh, own: Longs, nodes: Longs, near: float) -> None:
        """Find the exact curve of each side on the border of a face, and its parameters there."""
        if not mesh.borders:
            return
        away = np.linalg.norm(self.corners[own][:, :, None] - mesh.points[nodes][:, None], axis=3)
        node = np.take_along_axis(nodes, away.argmin(axis=2), axis=1)
        node[away.min(axis=2) > near] = -1  # a corner that cleaning has put into a side
        # The sides of all borders, either way, and the parameters of their ends.
        ways = [way for one in mesh.borders for way in (one, one.turned())]
        counts = [len(way.at) - 1 for way in ways]
        number = np.repeat(np.arange(len(ways)) // 2, counts)
        ends = np.concatenate([np.stack((way.at[:-1], way.at[1:]), axis=1) for way in ways])
        pairs = np.concatenate([np.stack((way.nodes[:-1], way.nodes[1:]), axis=1) for way in ways])
        row, side = np.nonzero(self._sides.on_border[own])
        wanted = np.stack((node[row, side], node[row, (side + 1) % 3]), axis=1)
        count = len(mesh.points)
        keys, asked = (one[:, 0] * count + one[:, 1] for one in (pairs, wanted))
        order = np.argsort(keys, kind="stable")
        at = order[np.searchsorted(keys, asked, "right", sorter=order) - 1]
        found = (keys[at] == asked) & (wanted >= 0).all(axis=1)
        at, places = at[found], np.stack((own[row], side), axis=1)[found]
        for k in np.unique(number[at]).tolist():
            mine = number[at] == k
            self._curves.add(mesh.borders[k].curve, places[mine], ends[at[mine]])


@dataclass(frozen=True)
class _Sides:
    """Sides within faces, all (t, 3).

    The `number` of each, whether it is the `first` of its number, and whether it is `on_border` of
    its face.
    """

    number: Longs
    first: Mask
    on_border: Mask

    def spread(self, values: Array) -> Array:
        """Give all triangles (t, 3) what the first one of each side has."""
        of_number = np.zeros(int(self.number.max(initial=-1)) + 1)
        of_number[self.number[self.first]] = values[self.first]
        return np.asarray(of_number[self.number])


def _own_sides(triangles: Ints, face: Longs) -> _Sides:
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).astype(np.int64)
    low, high = np.sort(ends.reshape(-1, 2), axis=1).T
    keys = (np.repeat(face, 3) * (int(high.max(initial=0)) + 1) + low) * (high.max(initial=0) + 1)
    _, index, number, count = np.unique(
        keys + high, return_index=True, return_inverse=True, return_counts=True
    )
    number = number.reshape(-1, 3)
    first = np.zeros(number.size, np.bool_)
    first[index] = True
    return _Sides(number, first.reshape(-1, 3), np.asarray(count[number] == 1, np.bool_))


def _too_far(found: Errors, places: _Places, limit: float) -> tuple[Mask, float]:
    """Sides (t, 3) to straighten, and the largest distance that goes with them."""
    far = (found.sides > limit) | (found.borders > limit)
    far_middle = found.middles > limit
    rows = np.flatnonzero(far.any(axis=1) | far_middle)
    bad = np.zeros(far.shape, np.bool_)
    if not len(rows):
        return bad, 0.0
    flat = places.flat_errors(rows)
    off, off_flat = (np.maximum(one.sides, one.borders) for one in (found, flat))
    bad = far & (off > off_flat)
    bad |= (far_middle & (found.middles > flat.middles))[:, None]
    largest = np.maximum(off.max(axis=1), found.middles)
    return bad, float(largest[bad.any(axis=1)].max(initial=0.0))


def _count_sides(surface: CleanedSurface, straight: Mask) -> int:
    rows, side = np.nonzero(straight)
    ends = surface.triangles[rows, side], surface.triangles[rows, (side + 1) % 3]
    return len(np.unique(np.sort(np.stack(ends, axis=1), axis=1), axis=0))


def _note(found: Errors, stated: float, factor: float, count: int, bent: float) -> str:
    error = max(found.surface, found.border)
    note = (
        f"curved elements {error * factor:.3g} m off ({found.surface * factor:.3g} m from the "
        f"surfaces, {found.border * factor:.3g} m from their borders): "
        + ("held" if error <= stated else f"not held, by a factor {error / stated:.3g}")
    )
    if count:
        sides = "side is" if count == 1 else "sides are"
        note += f"; {count} {sides} kept straight, bent to the normals up to {bent * factor:.3g} m"
        note += " off"
    return note


class _Curves:
    """Exact curves of sides, all together: lines and circles as numbers, and others.

    shapes : rows (n, 7) of point, unit direction or axis, radius (0 of lines), and sides (n, 2)
    others : the curve of each side, sides (n, 2), their parameters (n, 2)
    """

    def __init__(self) -> None:
        self.shapes: list[tuple[Array, Longs]] = []
        self.others: list[tuple[list[Occ], Longs, Array]] = []

    def add(self, curve: Occ, places: Longs, ends: Array) -> None:
        kind = curve.GetType()
        if kind == GeomAbs_Line:
            line = curve.Line()
            row = (*line.Location().Coord(), *line.Direction().Coord(), 0.0)
        elif kind == GeomAbs_Circle:
            circle = curve.Circle()
            axis = circle.Axis().Direction().Coord()
            row = (*circle.Location().Coord(), *axis, circle.Radius())
        else:
            self.others.append(([curve] * len(places), places, ends))
            return
        self.shapes.append((np.tile(row, (len(places), 1)), places))

    def seal(self) -> None:
        """Put all lines and circles together, and all others."""
        if self.shapes:
            rows, places = (np.concatenate(parts) for parts in zip(*self.shapes, strict=True))
            self.shapes = [(rows, places)]
        if self.others:
            curves, *rest = zip(*self.others, strict=True)
            places, ends = (np.concatenate(parts) for parts in rest)
            self.others = [([one for some in curves for one in some], places, ends)]


def _from_shape(shape: Array, points: Array) -> Array:
    """Largest distances (n,) of points (n, k, 3) along sides from lines and circles (n, 7)."""
    axis, radius = shape[:, None, 3:6], shape[:, 6:]
    offset = points - shape[:, None, :3]
    along = (offset * axis).sum(axis=2)
    aside = np.linalg.norm(offset - along[..., None] * axis, axis=2)
    away = np.where(radius > 0.0, np.hypot(aside - radius, along), aside)
    return np.asarray(away.max(axis=1, initial=0.0))


def _from_curves(curves: list[Occ], points: Array, ends: Array, settled: float) -> Array:
    """Largest distances (n,) of points (n, k, 3) along sides from n curves, `ends` (n, 2) on them.

    Newton's steps shorter than `settled` are the last.
    """
    # Its speed may be anything: the middle of the side need not be near that of the parameters.
    seeds = np.linspace(ends[:, 0], ends[:, 1], CURVE_SEEDS, axis=1)
    rows = zip(curves, seeds.tolist(), strict=True)
    values = [curve.Value(at).Coord() for curve, row in rows for at in row]
    along = np.array(values).reshape(*seeds.shape, 3)
    away = np.linalg.norm(along[:, None] - points[:, :, None], axis=3)
    nearest, seed = away.min(axis=2), np.take_along_axis(seeds, away.argmin(axis=2), axis=1)
    each = [curve for curve in curves for _ in range(points.shape[1])]
    limits = {curve: (curve.FirstParameter(), curve.LastParameter()) for curve in curves}
    flat, between = points.reshape(-1, 3), np.array([limits[curve] for curve in each])
    at = stationary_parameters(each, flat, seed.ravel(), between.reshape(-1, 2), settled)
    found = np.flatnonzero(np.isfinite(at))
    rows = zip(found.tolist(), at[found].tolist(), strict=True)
    exact = np.array([each[k].Value(one).Coord() for k, one in rows]).reshape(-1, 3)
    closest = nearest.ravel()
    closest[found] = np.minimum(closest[found], np.linalg.norm(exact - flat[found], axis=1))
    return np.asarray(closest.reshape(nearest.shape).max(axis=1))
