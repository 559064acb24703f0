"""Boxes and other parts whose fillets meet at corners [mm]."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sphshell_pin.base.arrays import Array
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


@dataclass(frozen=True)
class Side:
    """An upright side of a plate, `wall` from its middle, with a fillet of one radius at the top.

    It is turned by `turn` about z; if it is `round` [1/mm], bent inward.
    """

    fillet: float
    turn: float
    wall: float = 30.0
    round: float = 0.0

    @property
    def middle(self) -> Array:
        """Of its bend."""
        out = np.array([np.cos(self.turn), np.sin(self.turn)])
        return (self.wall - (1 / self.round if self.round else 0.0)) * out

    def tool(self) -> Solid:
        if self.round:
            return occ.cylinder(1 / self.round, SIDES[2], (*self.middle, 0.0))
        far = [self.middle + k * 200 * np.array([-self.middle[1], self.middle[0]]) / self.wall
               for k in (-1, 1)]  # fmt: skip
        back = [end - 10 * self.middle for end in far[::-1]]
        return occ.extruded([*far, *back], SIDES[2])

    def ends_in(self, points: Array) -> bool:
        """Whether points (n, 3) are where it meets the top."""
        flat = points[:, :2]
        if self.round:
            off = np.linalg.norm(flat - self.middle, axis=1) - 1 / self.round
        else:
            off = flat @ self.middle / self.wall - self.wall
        return bool(np.abs(off).max() + np.abs(points[:, 2] - SIDES[2]).max() < 1e-6)


def plate(*sides: Side) -> Solid:
    """A corner of two fillets, whose crossing begins where both touch the top."""
    solid = occ.common(occ.box([-60, -60, 0], [60, 60, SIDES[2]]), *(one.tool() for one in sides))
    edges = [(e, one.fillet) for one in sides for e in occ.edges_where(solid, one.ends_in)]
    return occ.checked(occ.filleted_each(solid, edges))


PLATES = {
    "cylinders": (Side(0.35, 0.0), Side(3.6, np.pi / 2)),
    "cylinders at an angle": (Side(2.4, 0.0), Side(0.7, 1.1)),
    "cylinder and torus": (Side(0.8, 0.0), Side(2.5, np.pi / 2, round=1 / 60)),
    "torus and cylinder": (Side(2.5, 0.0), Side(0.6, 1.3, round=1 / 50)),
    "tori": (Side(0.9, 0.0, round=1 / 45), Side(2.1, np.pi / 2, round=1 / 70)),
    "equal tori": (Side(1.5, 0.0, round=1 / 45), Side(1.5, np.pi / 2, round=1 / 45)),
    "equal torus and cylinder": (Side(1.5, 0.0, round=1 / 45), Side(1.5, np.pi / 2)),
}
