"""Random solids, one for each number: a family in turn, with random sizes and place."""

from collections.abc import Callable

import numpy as np

from tests.parts import milled, turned
from tests.parts.occ import Rng, Solid, checked, placed

FAMILIES: dict[str, Callable[[Rng], Solid]] = {
    name: family
    for module in (milled, turned)
    for name, family in vars(module).items()
    if getattr(family, "__module__", "") == module.__name__ and not name.startswith("_")
}
"""By name, in the order of the files. One that is added changes the numbers of the parts."""

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
