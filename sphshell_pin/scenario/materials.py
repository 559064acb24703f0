"""Materials to start from: elasticity, rebound and friction of what touches."""

from __future__ import annotations

from dataclasses import dataclass

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
