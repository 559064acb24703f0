"""Random solids, one for each number: a family in turn, with random sizes and place."""

from collections.abc import Callable

import numpy as np

from tests.parts import milled, turned
from tests.parts.occ import Rng, Solid, checked, placed

FAMILIES: dict[str, Callable[[Rng], Solid]] = {
    family.__name__: family
    for family in (
        milled.rounded_box,
        milled.variable_fillets,
        milled.plate,
        milled.boss,
        milled.rib,
        milled.thin_box,
        milled.mitred_prism,
        milled.mitred_frame,
        milled.bores,
        milled.chamfered_block,
        milled.pocket,
        milled.star,
        milled.nut,
        milled.random_boolean,
        turned.peg,
        turned.bottle,
        turned.cones,
        turned.round_ends,
        turned.grooved_shaft,
        turned.crossing_cylinders,
        turned.elbow,
        turned.spline_pipe,
        turned.loft,
        turned.spline_vase,
        turned.spline_prism,
        turned.stepped_shaft,
    )
}
"""By name. A family that is added goes to the end of its number: the parts change their numbers."""

PLACES = 200.0
"""Parts are moved by up to this [mm]: a file of few digits rounds them the more."""


def family_of(number: int) -> str:
    return tuple(FAMILIES)[number % len(FAMILIES)]


def random_solid(number: int, seed: int = 1) -> Solid:
    """Return the solid of a number, turned and moved at random [mm].

    Raises
    ------
    OccFailed, or an error of OpenCASCADE's
        If it cannot make that solid, or makes an invalid one.
    """
    rng = np.random.default_rng([seed, number])
    return placed(checked(FAMILIES[family_of(number)](rng)), rng, PLACES)
