"""Boxes and other parts whose fillets meet at corners [mm]."""

from collections.abc import Callable

import numpy as np

from tests.parts import milled, occ, turned
from tests.parts.occ import Rng, Solid, rough_size

SIDES = np.array([60.0, 40.0, 20.0])


def rounded_box(rng: Rng) -> Solid:
    """All twelve edges with one radius: cylinders, and spheres at the corners."""
    solid = occ.box([0, 0, 0], SIDES)
    return occ.filleted(solid, occ.edges_where(solid, lambda p: True), rough_size(rng, 0.1, 8))


def mitre(rng: Rng) -> Solid:
    """The edges of the top, sharp ones between: fillets of equal radii meet in mitres."""
    solid = occ.box([0, 0, 0], SIDES)
    return occ.filleted(solid, occ.edges_at(solid, 20.0), rough_size(rng, 0.1, 8))


def unequal_mitre(rng: Rng) -> Solid:
    """Fillets of two radii along the edges of the top."""
    return mitred(rough_size(rng, 0.3, 3), rough_size(rng, 3, 8))


def mitred(short: float, long: float) -> Solid:
    """Fillets of one radius along the short edges of the top, of another along the long ones."""
    solid = occ.box([0, 0, 0], SIDES)
    edges = occ.edges_at(solid, 20.0)
    radii = [long if np.argmax(occ.span(edge)) == 0 else short for edge in edges]
    return occ.filleted_each(solid, zip(edges, radii, strict=True))


def sharp_tray(rng: Rng) -> Solid:
    """A pocket with sharp corners and a fillet around its floor: hollow mitres."""
    pocket = occ.box([8, 8, 6], [52, 32, 30])
    pocket = occ.filleted(pocket, occ.edges_at(pocket, 6.0), rough_size(rng, 0.2, 6))
    return occ.cut(occ.box([0, 0, 0], SIDES), pocket)


FAMILIES = milled.plate, milled.boss, milled.bores, milled.pocket, milled.chamfered_block
BOXES: dict[str, Callable[[Rng], Solid]] = {
    **{one.__name__: one for one in (rounded_box, mitre, unequal_mitre, sharp_tray)},
    **{f"random {one.__name__}": one for one in (*FAMILIES, turned.crossing_cylinders)},
}
