"""Materials to start from, and those of sphere and shell in the laws that follow from them."""

import math
from dataclasses import dataclass
from functools import cached_property

from sphshell_pin import _core
from sphshell_pin.base.parameters import parameter
from sphshell_pin.errors import NameNotFound


@dataclass(frozen=True)
class Material:
    """A material, with typical values to start from: real parts scatter widely about them.

    Moduli are rounded handbook values (Ashby, Materials Selection in Mechanical Design); those of
    the elastomers follow from their hardness, about 80 and 20 Shore A (Gent, Engineering with
    Rubber). Friction on dry steel and restitution of a ball on a thick steel plate at about 1 m/s
    are of the usual order and measured for no particular part.
    """

    name: str
    young: float
    """Young's modulus [Pa]."""
    poisson: float
    restitution: float
    """Speed of rebound over speed of approach, against steel."""
    friction: float
    """Static coefficient against dry steel."""
    slip: float
    """Dynamic coefficient as a part of the static one."""
    density: float
    """[kg/m^3]"""


MATERIALS: dict[str, Material] = {
    one.name: one
    for one in (
        Material("steel", 2.1e11, 0.30, 0.90, 0.40, 0.75, 7850.0),
        Material("aluminium", 7.0e10, 0.33, 0.80, 0.45, 0.75, 2700.0),
        Material("plastic", 2.5e9, 0.38, 0.80, 0.30, 0.80, 1050.0),
        Material("wood", 1.0e10, 0.35, 0.60, 0.40, 0.75, 700.0),
        Material("rubber", 1.0e7, 0.49, 0.70, 0.80, 0.85, 1100.0),
        Material("silicone", 6.0e5, 0.49, 0.60, 0.70, 0.85, 1100.0),
    )
}


def find_material(name: str) -> Material:
    """Return the material called `name`.

    Raises
    ------
    NameNotFound
        The table has none of that name; the text lists what it has.
    """
    if name not in MATERIALS:
        raise NameNotFound("material", name, "the table", MATERIALS)
    return MATERIALS[name]


def restitution_between(one: Material, other: Material) -> float:
    """Return the restitution of two materials: the more dissipative one decides."""
    return min(one.restitution, other.restitution)


def friction_between(one: Material, other: Material) -> tuple[float, float]:
    """Return the static and the dynamic coefficient of two materials.

    Against steel they are the table's; the softer of two others decides, as it conforms to the
    harder one.
    """
    softer, harder = sorted((one, other), key=lambda m: m.young)
    known = softer if harder.name == "steel" or softer.young < 0.1 * harder.young else None
    static = known.friction if known else 0.5 * (softer.friction + harder.friction)
    return static, static * (known or softer).slip


@dataclass(frozen=True)
class TwoMaterials:
    """Young's modulus and Poisson's ratio of sphere and shell, and the moduli of the contact."""

    young: float = parameter(
        above=0, unit="Pa", label="Young's modulus", help="Young's modulus of the sphere"
    )
    poisson: float = parameter(
        above=-1, at_most=0.5, label="Poisson's ratio", help="Poisson's ratio of the sphere"
    )
    young_2: float | None = parameter(
        None,
        above=0,
        unit="Pa",
        label="Young's modulus 2",
        help="Young's modulus of the shell; without it that of the sphere",
    )
    poisson_2: float | None = parameter(
        None,
        above=-1,
        at_most=0.5,
        label="Poisson's ratio 2",
        help="Poisson's ratio of the shell; without it that of the sphere",
    )

    @cached_property
    def _moduli(self) -> tuple[float, float, float]:
        """E*, 8 G* and 16/3 G [Pa] of sphere and shell, by the compiled core."""
        numbers = self.young, self.poisson, self.young_2, self.poisson_2
        return _core.contact_moduli([math.nan if x is None else x for x in numbers])

    @property
    def modulus(self) -> float:
        """The effective modulus E* [Pa]: 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2."""
        return self._moduli[0]


def elastic_numbers(sphere: str, shell: str) -> dict[str, float]:
    """Return the parameters of TwoMaterials that follow from two names of MATERIALS."""
    one, other = find_material(sphere), find_material(shell)
    return {
        "young": one.young,
        "poisson": one.poisson,
        "young_2": other.young,
        "poisson_2": other.poisson,
    }
