"""The winding of elements: consistent in a component, outward where it is closed."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array, Ints, Longs, Mask
from sphshell_pin.shell.polygons import Polygons, examine_quads
from sphshell_pin.shell.raw import RawSurface, area_vectors, in_use

Found = dict[str, Any]
"""Findings about a surface, under the names of ShellHealth's fields."""

UNIT_TOLERANCE = 1e-3
"""Normals off unit length by less than this were rounded when written; more is reported."""


def unit_normals(raw: RawSurface, found: Found) -> Array | None:
    """Return unit normals (c, 3) of all corners, zero where there is none to be had.

    What was found about them goes into `found`, under the names of ShellHealth.
    """
    if raw.normals is None:
        return None
    largest = np.abs(raw.normals).max(axis=1)
    usable = np.isfinite(largest) & (largest > 0.0)
    # Divided by the largest component first: squares of tiny normals would vanish.
    scaled = np.where(usable[:, None], raw.normals, 0.0)
    scaled /= np.where(usable, largest, 1.0)[:, None]
    length = np.linalg.norm(scaled, axis=1)
    rescaled = usable & (np.abs(length * np.where(usable, largest, 0.0) - 1.0) > UNIT_TOLERANCE)
    found["has_normals"] = True
    found["missing_normals"] = int((~usable).sum())
    found["rescaled_normals"] = int(rescaled.sum())
    return np.asarray(scaled / np.where(usable, length, 1.0)[:, None])


def settle_normals(
    table: Array, polygons: Polygons, vertices: Array, found: Found, turn: bool = True
) -> Array:
    """Return normals (t, 3, 3) of the triangle corners, on the side of their elements.

    All corners of an element are turned together, if their sum points against the element's own
    normal. Missing normals become the element's. What was found goes into `found`, under the names
    of ShellHealth.
    """
    slots, element = split_elements(polygons, vertices)
    spans = area_vectors(vertices[polygons.corners[slots]])
    sums = [np.bincount(element, spans[:, k], len(polygons)) for k in range(3)]
    vectors = np.stack(sums, axis=1).astype(np.float64)
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    corner = table[polygons.normal_row]
    own = vectors[polygons.polygon_of_slot]
    along = np.einsum("cx,cx->c", corner, own)
    if turn:
        total = np.bincount(polygons.polygon_of_slot, along, len(polygons))
        turned: Mask = np.asarray(total[polygons.polygon_of_slot] < 0.0, np.bool_)
        corner = np.where(turned[:, None], -corner, corner)
        along = np.where(turned, -along, along)
        found["turned_normals"] = int(turned.sum())
    missing: Mask = np.asarray(~np.any(corner, axis=1), np.bool_)
    corner = np.where(missing[:, None], own, corner)
    along = np.where(missing, 1.0, along)
    found["opposing_normals"] = int((along < 0.0).sum())
    found["largest_normal_angle"] = float(np.arccos(np.clip(along.min(), -1.0, 1.0)))
    return np.ascontiguousarray(corner[slots])


SMALL_HOLE_EDGES = 4
SMALL_HOLE_AREA = 0.3
"""A boundary loop of so few edges that spans less than this share of its component is a hole."""

TINY_HOLE_AREA = 0.02
"""A boundary loop of any number of edges is a hole if it spans less than this share."""

LINES = 16
"""Through each closed component, along which it is measured how much of it is in others."""

INSIDE, OUTSIDE = 0.95, 0.05
"""A component with at least, at most this share inside another is in it, is beside it."""

SAME_VOLUME = 1e-6
"""A component larger by less than this share does not hold another."""


def split_elements(polygons: Polygons, vertices: Array) -> tuple[Longs, Ints]:
    """Split polygons with three or four corners into triangles, those of one side by side.

    Returns the corner slots of the triangles (t, 3), and the polygon (t,) of each.
    """
    counts = polygons.counts
    starts = np.cumsum(counts - 2) - (counts - 2)
    slots = np.empty((int((counts - 2).sum()), 3), np.int64)
    three = counts == 3
    slots[starts[three]] = polygons.offsets[:-1][three, None] + np.arange(3)
    quads = np.flatnonzero(~three)
    if quads.size:
        first = polygons.offsets[quads]
        corners = vertices[polygons.corners[first[:, None] + np.arange(4)]]
        other = examine_quads(corners).other_diagonal[:, None]
        slots[starts[quads]] = first[:, None] + np.where(other, [0, 1, 3], [0, 1, 2])
        slots[starts[quads] + 1] = first[:, None] + np.where(other, [1, 2, 3], [0, 2, 3])
    return slots, np.repeat(np.arange(len(polygons), dtype=np.int32), counts - 2)


def as_triangles(polygons: Polygons, vertices: Array) -> tuple[Ints, Ints]:
    """Vertices (t, 3) of the triangles of `split_elements`, and the polygon (t,) of each."""
    if polygons.only_triangles:
        return polygons.corners.reshape(-1, 3), np.arange(len(polygons), dtype=np.int32)
    slots, element = split_elements(polygons, vertices)
    return polygons.corners[slots], element


@dataclass(frozen=True)
class Oriented:
    """The outcome of `orient`.

    Attributes
    ----------
    polygons : wound consistently
    component : (m,) of each polygon, connected across edges of exactly two polygons
    area : (components,) [m^2]
    found : among it how many elements are wound the other way than in the input, and of the
        components how many were turned as a whole, are closed (their directed edges cancel), are
        inside another one and wound inward (away from the material), or partly inside one, and
        have no consistent winding (a Moebius strip)
    """

    polygons: Polygons
    component: Ints
    area: Array
    found: Found


def orient(
    polygons: Polygons, vertices: Array, solid: Ints | None = None, keep_winding: bool = False
) -> Oriented:
    """Wind polygons of three and four corners alike within each component.

    A closed component is wound outward; inside another closed one it is a cavity, wound toward
    its inside, and so on by turns. With the `solid` (m,) of each polygon, -1 of none, that is asked
    only of components of one solid, which must not be connected to others. An open one keeps the
    winding most of its area has. With `keep_winding` nothing is turned, and a component counts as
    closed only if it need not be.
    """
    edges = polygons.edges
    component, flipped, one_sided = _core.mend_flood_fill(
        polygons.offsets, polygons.corners, edges.slot_edge, edges.users
    )
    flip: Mask = flipped.view(np.bool_)
    number = len(one_sided)
    closed = _closed_components(polygons, component, flip, number)
    closed &= one_sided == 0
    if keep_winding:
        odd_ones = np.bincount(component, flip, number)
        closed &= (odd_ones == 0) | (odd_ones == np.bincount(component, minlength=number))
    triangles, element = as_triangles(polygons, vertices)
    # The volume about a point near the surface loses the least to rounding.
    volume, total_area, turned_area = _core.mend_sums(
        vertices, triangles, element, component, flipped, number, vertices.mean(axis=0)
    )
    # How many other closed components enclose each closed one.
    depth, overlapping = np.zeros(number, np.int64), 0
    group = np.where(closed, 0, -1).astype(np.int32)
    if solid is not None:
        group[component] = np.where(closed[component], solid + 1, -1)
    if closed.sum() > len(np.unique(group[closed])):
        owner = component[element]
        places, of_place = _places(vertices, triangles, owner, group >= 0)
        pairs, share = _core.mend_overlaps(vertices, triangles, owner, places, of_place, group)
        # Only the larger of two that share room can hold the other.
        size = np.abs(volume)[pairs]
        larger = size[:, 1] * (1.0 - SAME_VOLUME) > size[:, 0]
        depth = np.bincount(pairs[larger & (share > INSIDE), 0], minlength=number)
        partly = (share > OUTSIDE) & ~(larger & (share > INSIDE)) & (size[:, 0] <= size[:, 1])
        overlapping = len(np.unique(pairs[partly, 0]))
    inward = depth % 2 == 1
    reverse = np.where(
        closed, (volume < 0.0) != inward, turned_area > 1e-9 * np.maximum(total_area, 1e-300)
    )
    flip ^= reverse[component]
    if keep_winding:
        flip[:] = False
    reversed_components = 0
    if flip.any():
        turned = np.bincount(component, flip, number)
        reversed_components = int((turned == np.bincount(component, minlength=number)).sum())
    sign = np.where(inward, -1.0, 1.0)
    used = int(in_use(polygons.corners, len(vertices)).sum())
    found = {
        "area": float(total_area.sum()),
        "volume": float((np.abs(volume) * sign)[closed].sum()),
        "flipped_elements": int(flip.sum()),
        "reversed_components": reversed_components,
        "components": number,
        "closed_components": int(closed.sum()),
        "cavities": 0 if keep_winding else int((closed & inward).sum()),
        "overlapping_components": overlapping,
        "one_sided_components": int((one_sided != 0).sum()),
        "euler_number": used - len(edges.users) + len(polygons),
    }
    return Oriented(polygons.reverse(flip), component, total_area, found)


def _places(vertices: Array, triangles: Ints, owner: Ints, wanted: Mask) -> tuple[Array, Ints]:
    """Return points (n, 3) on triangles of the `wanted` components, and the component of each.

    They are spread by area, LINES on each component.
    """
    own = np.flatnonzero(wanted[owner])
    own = own[np.argsort(owner[own], kind="stable")]
    corners = vertices[triangles[own]]
    total = np.cumsum(np.linalg.norm(area_vectors(corners), axis=1))
    components, first = np.unique(owner[own], return_index=True)
    start, stop = np.append(0.0, total)[first], total[np.append(first[1:], len(own)) - 1]
    share = (np.arange(LINES) + 0.5) / LINES
    at = np.searchsorted(total, start[:, None] + share * (stop - start)[:, None])
    # No two in one place of a triangle that has several of them.
    weights = 0.2 + 0.3 * np.stack([share, np.roll(share, LINES // 2)], axis=1)
    weights = np.tile(np.c_[weights, 1.0 - weights.sum(axis=1)], (len(components), 1))
    places = np.einsum("nk,nkx->nx", weights, corners[at.ravel()])
    return places, np.repeat(components, LINES).astype(np.int32)


def _closed_components(polygons: Polygons, component: Ints, flip: Mask, number: int) -> Mask:
    """(components,) True where the directed edges of a component cancel."""
    slot_edge = polygons.edges.slot_edge
    closed = np.ones(number, np.bool_)
    # Edges of two polygons cancel by construction; only the others need to be added up.
    odd = np.flatnonzero((polygons.edges.users != 2)[slot_edge])
    owner = component[polygons.polygon_of_slot[odd]]
    following = polygons.corners[polygons.next_slot[odd]]
    sign = np.where(polygons.corners[odd] < following, 1, -1)
    sign = np.where(flip[polygons.polygon_of_slot[odd]], -sign, sign)
    key = slot_edge[odd].astype(np.int64) * number + owner
    place, group = np.unique(key, return_inverse=True)
    left = np.bincount(group, sign, len(place)) != 0
    closed[(place[left] % number).astype(np.int64)] = False
    return closed


def find_borders(oriented: Oriented, vertices: Array) -> dict[str, Any]:
    """Count the edges of oriented polygons and follow the open ones.

    Returns ShellHealth's fields about edges, boundary loops and holes, by name.
    """
    polygons = oriented.polygons
    slot_edge, users = polygons.edges.slot_edge, polygons.edges.users
    single: Mask = users == 1
    slots = np.flatnonzero(single[slot_edge])
    start = polygons.corners[slots]
    stop = polygons.corners[polygons.next_slot[slots]]
    used, compact = np.unique(np.concatenate([start, stop]), return_inverse=True)
    pairs = compact.reshape(2, -1).T.astype(np.int32)
    loop = _core.mend_components(len(used), np.ascontiguousarray(pairs))
    loops = int(loop.max()) + 1 if loop.size else 0
    sums = np.stack([np.bincount(loop, vertices[used, k], loops) for k in range(3)], axis=1)
    center = sums / np.maximum(np.bincount(loop, minlength=loops), 1)[:, None]
    edge_loop = loop[pairs[:, 0]]
    middle = center[edge_loop]
    spanned = 0.5 * np.cross(vertices[start] - middle, vertices[stop] - middle)
    area = np.stack([np.bincount(edge_loop, spanned[:, k], loops) for k in range(3)], axis=1)
    surface = np.zeros(loops)
    component = oriented.component[polygons.polygon_of_slot[slots]]
    np.maximum.at(surface, edge_loop, oriented.area[component])
    many = np.flatnonzero(users > 2)
    place = None if not many.size else vertices[polygons.edges.ends[many[0]]].mean(axis=0)
    found: dict[str, Any] = {
        "edges": len(users),
        "boundary_edges": len(slots),
        "boundary_loops": loops,
        "non_manifold_edges": len(many),
        "non_manifold_at": None if place is None else tuple(place.tolist()),
    }
    # Boundary loops that look like a lost element rather than the rim of a sheet. A loop without
    # any surface, below what numbers hold, is none: it has no share.
    loop_area, length = np.sqrt((area**2).sum(axis=1)), np.bincount(edge_loop, minlength=loops)
    share = np.divide(loop_area, surface, where=surface > 0, out=np.full(loops, np.nan))
    small = ((length <= SMALL_HOLE_EDGES) & (share < SMALL_HOLE_AREA)) | (share < TINY_HOLE_AREA)
    # One or two open edges enclose nothing: they bound a fin between non-manifold edges.
    holes = np.flatnonzero(small & (length >= 3))
    if holes.size:
        largest = holes[np.argmax(loop_area[holes])]
        found |= {
            "holes": int(holes.size),
            "hole_edges": int(length[largest]),
            "largest_hole_area": float(loop_area[largest]),
            "hole_at": tuple(center[largest].tolist()),
        }
    return found
