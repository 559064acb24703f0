"""From raw polygons to a surface for contact: all valid elements are kept, all repairs reported.

The order of the steps matters: welding makes edges shared, dropping what has no area or is double
opens the edges that T-junctions lie on, splitting those makes polygons, and only triangles and
planar quads can be wound alike. Dropping the slivers a triangulation may leave opens cracks again,
so these steps run until none changes anything.
"""

from collections import defaultdict
from dataclasses import replace

import numpy as np

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array, Ints, Mask
from sphshell_pin.errors import InvalidShell
from sphshell_pin.shell import orientation
from sphshell_pin.shell.cleaned import CleanedSurface
from sphshell_pin.shell.health import ShellHealth
from sphshell_pin.shell.polygons import Polygons, examine_quads, without_area
from sphshell_pin.shell.raw import RawSurface, in_use, raw_surface
from sphshell_pin.shell.tangent_joints import settle_joints

WELD_TOLERANCE = 1e-7
"""Vertices nearer than this share of the box diagonal are one."""

PLANAR_TOLERANCE = 1e-10
"""A quad whose corners leave their mean plane by at most this share of the diagonal is planar."""

MOST_PASSES = 20
"""Two passes settle what files hold; elements tangled within the tolerance might never end."""

MOST_INSERTED = 1_000_000
"""T-junctions that any surface may have; one of more corners may have four for each of them."""


def clean(vertices: object, polygons: object, normals: object = None) -> CleanedSurface:
    """Clean a surface given as arrays; see `raw_surface` for their shapes and the errors."""
    return clean_surface(raw_surface(vertices, polygons, normals))


def clean_surface(raw: RawSurface) -> CleanedSurface:
    """Weld, drop, split, triangulate and orient; keep a record of it all.

    Raises
    ------
    InvalidShell
        If no element with an area is left.
    """
    found = _given(raw)
    table = orientation.unit_normals(raw, found)
    polygons, vertices = _without_unused(Polygons.from_raw(raw), raw.vertices)
    size = box_diagonal(vertices)
    if size == 0.0:
        raise InvalidShell("all vertices of the surface lie in one place: there is no element")
    tolerance = WELD_TOLERANCE * size
    representative, distance = _core.mend_weld(vertices, tolerance)
    place = representative
    if raw.solids is not None:
        # Each solid is cleaned by itself, with its own copies of the vertices it has in common with
        # others.
        of_vertex = np.zeros(len(vertices), np.int64)
        of_vertex[polygons.corners] = raw.solids[polygons.source[polygons.polygon_of_slot]] + 1
        key = representative * (of_vertex.max() + 1) + of_vertex
        _, first, group = np.unique(key, return_index=True, return_inverse=True)
        representative = first[group].astype(np.int32)
    found["weld_tolerance"] = tolerance
    welded = int((representative != np.arange(len(vertices), dtype=np.int32)).sum())
    found["welded_vertices"] = welded
    found["weld_distance"] = float(distance)
    if welded:
        polygons = polygons.with_corners(representative[polygons.corners])
    polygons, table = _mend(polygons, vertices, table, tolerance, size, found)
    solid = None if raw.solids is None else raw.solids[polygons.source]
    oriented = orientation.orient(polygons, vertices, solid)
    polygons = oriented.polygons
    if solid is not None:
        polygons = _joined(polygons, place)
    polygons, vertices = _without_unused(polygons, vertices)
    # Those merged into another vertex are counted there.
    found["unused_vertices"] = len(raw.vertices) - welded - len(vertices)
    oriented = replace(oriented, polygons=polygons)
    return _with_origin(_assemble(oriented, vertices, table, found), raw)


def _joined(polygons: Polygons, place: Ints) -> Polygons:
    """Return the polygons with the vertices in one `place` (n,) made one where solids share edges.

    A sphere that rolls over the joint of two solids touches one surface, not two. Edges and their
    users stay those of each solid.
    """
    ends = np.sort(place[polygons.edges.ends], axis=1)
    _, edge, users = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    shared = polygons.edges.ends[users[edge.ravel()] > 1]
    merged = np.arange(len(place), dtype=np.int32)
    merged[shared] = place[shared]
    return polygons.renumbered(merged)


def take_surface(raw: RawSurface) -> CleanedSurface:
    """Take elements as they come (`clean=False`), without a check of anything but their area.

    Raises
    ------
    InvalidShell
        If an element has more than four corners or no area.
    """
    polygons = Polygons.from_raw(raw)
    if polygons.counts.max() > 4:
        element = int(np.argmax(polygons.counts))
        raise InvalidShell(
            f"element {element} has {int(polygons.counts[element])} corners: with clean=False an "
            "element has three or four; leave clean=True to have it triangulated"
        )
    flat = np.flatnonzero(without_area(polygons, raw.vertices))
    if flat.size:
        raise InvalidShell(
            f"element {int(flat[0])} has no area ({flat.size} such elements): leave clean=True to "
            "have it dropped"
        )
    as_given = orientation.orient(polygons, raw.vertices, keep_winding=True)
    found = _given(raw)
    found["cleaned"] = False
    table = orientation.unit_normals(raw, found)
    return _with_origin(_assemble(as_given, raw.vertices, table, found, turn_normals=False), raw)


def _given(raw: RawSurface) -> orientation.Found:
    """Begin the record of the cleaning: ShellHealth's fields by name, 0 unless they are set."""
    found: orientation.Found = defaultdict(int)
    found["input_vertices"], found["input_elements"] = len(raw.vertices), raw.num_polygons
    found["notes"], found["missing_faces"] = raw.notes, raw.missing_faces
    return found


def box_diagonal(points: Array) -> float:
    """Diagonal of the box around points (n, 3) [m]."""
    return float(np.linalg.norm([np.ptp(np.ascontiguousarray(points[:, k])) for k in range(3)]))


def _without_unused(polygons: Polygons, vertices: Array) -> tuple[Polygons, Array]:
    """Return the polygons over the vertices they use, in the same order, and those."""
    used = in_use(polygons.corners, len(vertices))
    if used.all():
        return polygons, np.ascontiguousarray(vertices)
    place = np.cumsum(used, dtype=np.int32) - np.int32(1)
    return polygons.renumbered(place), vertices[used]


def _mend(
    polygons: Polygons,
    vertices: Array,
    table: Array | None,
    tolerance: float,
    size: float,
    found: orientation.Found,
) -> tuple[Polygons, Array | None]:
    """Polygons of three or four corners, each with area and none twice, edge to edge."""
    counts = polygons.counts
    found["polygons"] = int((counts > 4).sum())
    found["largest_polygon"] = int(counts.max())
    most = max(MOST_INSERTED, 4 * len(polygons.corners))
    given = np.ones(len(polygons), np.bool_)  # input elements of which something is left
    for _ in range(MOST_PASSES):
        before = len(polygons)
        polygons = _drop_flat(polygons, vertices, given, found)
        polygons = _drop_duplicates(polygons, given, found)
        polygons, table, inserted = _split_t_junctions(
            polygons, vertices, table, tolerance, most - found["t_junctions"]
        )
        found["t_junctions"] += inserted
        polygons = _triangulate(polygons, vertices, tolerance, size, found)
        if len(polygons) == before and inserted == 0:
            return polygons, table
    return _drop_flat(polygons, vertices, given, found), table


def _drop_flat(
    polygons: Polygons, vertices: Array, given: Mask, found: orientation.Found
) -> Polygons:
    """Without repeated corners and without elements that have no area."""
    while (repeated := _core.mend_repeats(polygons.offsets, polygons.corners)).size:
        polygons = polygons.drop_slots(repeated.view(np.bool_))
        polygons = polygons.keep(polygons.counts >= 3)
        if len(polygons) == 0:
            break
    if len(polygons):
        polygons = polygons.keep(~without_area(polygons, vertices))
    if len(polygons) == 0:
        raise InvalidShell(
            f"no element is left: none of the {len(given)} given has an area (their corners lie on "
            "one line or in one place); check the vertex indices"
        )
    # An input element counts once, and only if nothing at all is left of it.
    left = np.zeros(len(given), np.bool_)
    left[polygons.source] = True
    found["degenerate_elements"] += int((given & ~left).sum())
    given[:] = left
    return polygons


def _drop_duplicates(polygons: Polygons, given: Mask, found: orientation.Found) -> Polygons:
    edges = polygons.edges
    first, opposite = _core.mend_duplicates(
        polygons.offsets, polygons.corners, edges.slot_edge, edges.users
    )
    single = first == np.arange(len(polygons), dtype=np.int32)
    found["duplicate_elements"] += int((~single).sum())
    found["opposite_duplicates"] += int(opposite.sum())
    polygons = polygons.keep(single)
    given[:] = False
    given[polygons.source] = True
    return polygons


def _split_t_junctions(
    polygons: Polygons, vertices: Array, table: Array | None, tolerance: float, most: int
) -> tuple[Polygons, Array | None, int]:
    """With the vertices that lie on open edges made corners there; and how many.

    Raises InvalidShell where they are more than `most`: elements that lie on one another in one
    line may have as many as the square of their number.
    """
    open_edge = polygons.edges.users == 1
    if not open_edge.any():
        return polygons, table, 0
    slots = np.flatnonzero(open_edge[polygons.edges.slot_edge])
    # Both sides of a crack are open: only ends of open edges can be T-junctions.
    candidates = np.unique(polygons.edges.ends[open_edge])
    at, vertex, parameter = _core.mend_t_junctions(
        polygons.offsets,
        polygons.corners,
        vertices,
        slots,
        np.ascontiguousarray(polygons.polygon_of_slot[slots]),
        candidates,
        tolerance,
        most,
    )
    if len(at) > most:
        raise InvalidShell(
            f"vertices lie on open edges of other elements (within {tolerance:.3g} m) at more than "
            f"{most} places: the elements lie on one another; check the vertices and their indices"
        )
    if len(at) == 0:
        return polygons, table, 0
    rows = None
    if table is not None and polygons.normal_row is not None:
        # What the normal along the straight edge would be.
        start = table[polygons.normal_row[at]]
        stop = table[polygons.normal_row[polygons.next_slot[at]]]
        between = start + parameter[:, None] * (stop - start)
        length = np.linalg.norm(between, axis=1, keepdims=True)
        rows = np.arange(len(table), len(table) + len(at))
        table = np.concatenate([table, between / np.where(length > 0.0, length, 1.0)])
    return polygons.insert(at, vertex, rows), table, len(at)


def _triangulate(
    polygons: Polygons, vertices: Array, tolerance: float, size: float, found: orientation.Found
) -> Polygons:
    """With everything but triangles and planar, convex quads cut into triangles."""
    cut = polygons.counts > 4
    quads = np.flatnonzero(polygons.counts == 4)
    if quads.size:
        slots = polygons.offsets[quads][:, None] + np.arange(4)
        judged = examine_quads(vertices[polygons.corners[slots]])
        warped = judged.warp > PLANAR_TOLERANCE * size
        found["warped_quads"] += int(warped.sum())
        found["concave_quads"] += int((~judged.convex & ~warped).sum())
        cut[quads] = warped | ~judged.convex
    if not cut.any():
        return polygons
    some = polygons.take(np.flatnonzero(cut))
    found["largest_warp"] = max(found["largest_warp"], _largest_warp(some, vertices, size))
    slots, polygon, tangled = _core.mend_clip_ears(some.offsets, some.corners, vertices, tolerance)
    found["tangled_polygons"] += int(tangled.sum())
    which = np.flatnonzero(cut)
    starts = polygons.offsets[which] - some.offsets[:-1]
    slots = slots + starts[polygon][:, None]
    return polygons.replace_by_triangles(cut, slots, which[polygon].astype(np.int32))


def _largest_warp(polygons: Polygons, vertices: Array, size: float) -> float:
    """Farthest distance of a corner from the mean plane of its polygon [m]; 0 if all planar."""
    starts = polygons.offsets[:-1]
    points = vertices[polygons.corners]
    middle = np.add.reduceat(points, starts) / polygons.counts[:, None]
    spokes = points - np.repeat(middle, polygons.counts, axis=0)
    normal = np.add.reduceat(np.cross(spokes, spokes[polygons.next_slot]), starts)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal /= np.where(length > 0.0, length, 1.0)
    height = np.einsum("cx,cx->c", spokes, np.repeat(normal, polygons.counts, axis=0))
    largest = float(np.abs(height).max())
    return largest if largest > PLANAR_TOLERANCE * size else 0.0


def _assemble(
    oriented: orientation.Oriented,
    vertices: Array,
    table: Array | None,
    found: orientation.Found,
    turn_normals: bool = True,
) -> CleanedSurface:
    polygons = oriented.polygons
    triangles, triangle_element = orientation.as_triangles(polygons, vertices)
    normals = None
    if table is not None and polygons.normal_row is not None:
        normals = orientation.settle_normals(table, polygons, vertices, found, turn_normals)
    elements = np.full((len(polygons), 4), -1, np.int32)
    if polygons.only_triangles:
        elements[:, :3] = triangles
    else:
        place = np.arange(len(polygons.corners)) - np.repeat(polygons.offsets[:-1], polygons.counts)
        elements[polygons.polygon_of_slot, place] = polygons.corners
    used = in_use(triangles, len(vertices))
    starts = np.arange(0, triangles.size + 1, 3)
    health = ShellHealth(
        **found,
        **oriented.found,
        **orientation.find_borders(oriented, vertices),
        vertices=len(vertices),
        elements=len(polygons),
        triangles=len(triangles),
        quads=len(triangles) - len(polygons),
        size=box_diagonal(vertices if used.all() else vertices[used]),
        worst_shape=float(_core.mend_shapes(starts, triangles.reshape(-1), vertices).min()),
    )
    return CleanedSurface(
        vertices, elements, triangles, triangle_element, normals, polygons.source, health
    )


def _with_origin(surface: CleanedSurface, raw: RawSurface) -> CleanedSurface:
    """With the rounding of the input, and its CAD faces, if it has any."""
    surface = replace(surface, rounding=raw.rounding)
    if raw.faces is None:
        return surface
    faces = raw.faces[surface.source_element]
    normals = surface.normals
    if normals is not None:
        face = faces[surface.triangle_element]
        plane = None if raw.face_shapes is None else raw.face_shapes[face, 0] == 0
        normals = settle_joints(normals, surface.triangles, face, plane)
    return replace(
        surface,
        normals=normals,
        element_face=faces,
        face_names=raw.face_names,
        face_shapes=raw.face_shapes,
    )
