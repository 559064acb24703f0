"""Normals given with a surface, carried through its cleaning."""

from typing import Any

import numpy as np

from sphshell_pin.base.arrays import Array, Mask
from sphshell_pin.shell.orientation import split_elements
from sphshell_pin.shell.polygons import Polygons
from sphshell_pin.shell.raw import RawSurface, area_vectors

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
    table: Array,
    polygons: Polygons,
    vertices: Array,
    found: Found,
    turn: bool = True,
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
