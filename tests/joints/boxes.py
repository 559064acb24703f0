"""Boxes, trays, slots and tees whose fillets meet at corners [mm]."""

from collections.abc import Callable

import numpy as np

from tests.parts import occ
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


def tray(rng: Rng) -> Solid:
    """A pocket with rounded corners, a fillet around its floor, perhaps around its rim."""
    corner, floor = rough_size(rng, 4, 8), rough_size(rng, 0.2, 3)
    pocket = occ.box([8, 8, 6], [52, 32, 30])
    pocket = occ.filleted(pocket, occ.upright_edges(pocket), corner)
    pocket = occ.filleted(pocket, occ.edges_at(pocket, 6.0), floor)
    solid = occ.cut(occ.box([0, 0, 0], SIDES), pocket)
    if rng.random() < 0.5:
        rim = occ.edges_where(
            solid, lambda p: bool((np.abs(p[:, 2] - 20) < 1e-6).all() and p[:, 0].min() > 1)
        )
        rim = [edge for edge in rim if occ.points_of(edge)[:, 0].max() < 59]
        inner = [e for e in rim if 1 < occ.points_of(e)[:, 1].min() < 39]
        solid = occ.filleted(solid, inner, rough_size(rng, 0.2, 2))
    return solid


def sharp_tray(rng: Rng) -> Solid:
    """A pocket with sharp corners and a fillet around its floor: hollow mitres."""
    pocket = occ.box([8, 8, 6], [52, 32, 30])
    pocket = occ.filleted(pocket, occ.edges_at(pocket, 6.0), rough_size(rng, 0.2, 6))
    return occ.cut(occ.box([0, 0, 0], SIDES), pocket)


def slots(rng: Rng) -> Solid:
    """Slots with round ends, one with a fillet at its floor, one through."""
    solid = occ.box([0, 0, 0], SIDES)
    for y, r, low in ((11.0, rough_size(rng, 1, 5), 12.0), (29.0, rough_size(rng, 1, 5), -1.0)):
        tool = occ.box([15, y - r, low], [45, y + r, 30])
        ends = [occ.cylinder(r, 30 - low, (x, y, low)) for x in (15, 45)]
        tool = occ.fuse(tool, *ends)
        if low > 0:
            tool = occ.filleted(tool, occ.edges_at(tool, low), rough_size(rng, 0.1, 0.9 * r))
        solid = occ.cut(solid, tool)
    return solid


def tee(rng: Rng) -> Solid:
    """Two crossing tubes."""
    wide, narrow = rough_size(rng, 9, 14), rough_size(rng, 4, 8)
    tilt = rng.uniform(-0.3, 0.3)
    way = (np.cos(tilt), 0.0, np.sin(tilt))
    body = occ.fuse(occ.cylinder(wide, 80, (0, 0, -40)), occ.cylinder(narrow, 40, axis=way))
    return occ.cut(
        body,
        occ.cylinder(0.8 * wide, 90, (0, 0, -45)),
        occ.cylinder(0.75 * narrow, 50, axis=way),
    )


def chamfered_block(rng: Rng) -> Solid:
    """A block with chamfers, a bore with a countersink, and a boss with a fillet."""
    solid = occ.box([0, 0, 0], SIDES)
    solid = occ.chamfered(solid, occ.edges_at(solid, 20.0), rough_size(rng, 0.3, 3))
    r = rough_size(rng, 2, 5)
    sink = occ.cone(r, r + 4, 4, (15, 20, 16.5))
    solid = occ.cut(solid, occ.cylinder(r, 30, (15, 20, -1)), sink)
    boss = rough_size(rng, 3, 8)
    solid = occ.fuse(solid, occ.cylinder(boss, 15, (42, 20, 15)))

    def is_foot(points: np.ndarray) -> bool:
        away = np.hypot(points[:, 0] - 42, points[:, 1] - 20)
        return bool(np.abs(away - boss).max() + np.abs(points[:, 2] - 20).max() < 1e-3)

    return occ.filleted(solid, occ.edges_where(solid, is_foot), 0.3 * boss)


BOXES: dict[str, Callable[[Rng], Solid]] = {
    one.__name__: one
    for one in (rounded_box, mitre, unequal_mitre, tray, sharp_tray, slots, tee, chamfered_block)
}
