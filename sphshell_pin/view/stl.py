"""Robot meshes in binary STL files, made small: each point once, quantised, and the corners."""

from __future__ import annotations

import numpy as np

from sphshell_pin.view.collada import pack_numbers
from sphshell_pin.view.nodes import Json

HEADER = 84  # bytes: a title of 80, then the number of facets
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def pack_facets(data: bytes) -> Json | None:
    """Describe the facets of the binary STL file `data`, packed with `pack_numbers`.

    `points` (p, 3), row by row, and `corners` (f, 3) that number them. Titles, colours and normals
    are left out: the page shows none of the first two, and finds the last. None for what is no
    binary STL file.
    """
    if len(data) <= HEADER:
        return None
    count = int.from_bytes(data[80:HEADER], "little")
    if len(data) != HEADER + FACET.itemsize * count:
        return None
    soup = np.frombuffer(data, FACET, count, HEADER)["corners"].reshape(-1, 3)
    if not np.isfinite(soup).all():
        return None
    points, first, number = np.unique(soup, axis=0, return_index=True, return_inverse=True)
    # In the order of the file, where neighbours stand near each other.
    order = np.argsort(first)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return {
        "points": pack_numbers(points[order].astype(float).reshape(-1), exact=False),
        "corners": pack_numbers(place[number.reshape(-1)].astype(float), exact=True),
    }
