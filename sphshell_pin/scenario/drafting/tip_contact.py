"""What a tip and a surface are made of, and the law and friction that follow."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from sphshell_pin.contact.materials import (
    Material,
    find_material,
    friction_between,
    restitution_between,
)
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.wording import rounded

GRAVITY = 9.81


@dataclass(frozen=True)
class Contact:
    """Law and friction of a tip, as the scenario states them."""

    material: Material
    against: Material
    restitution: float
    speed: float
    """At which the restitution holds: of the first touch [m/s]."""
    mu_static: float
    mu_dynamic: float
    v_static: float
    """Slip speed [m/s] at which friction is full."""
    bristle: tuple[float, float] | None = None
    """Stiffness [N/m] and damping [N s/m] of bristles, for what has to stand."""

    @property
    def note(self) -> str:
        """Where the values are from."""
        pair = f"{self.material.name} on {self.against.name}"
        return f"law and friction of {pair}, typical values: --law and --against name others"


def chosen_materials(asked: Asked, tips: Sequence[Tip], load: float) -> tuple[Material, Material]:
    """Return what sphere and surface are made of; `load` [kg] rests on each, 0: it falls."""
    other = find_material(asked.against or "steel")
    if asked.material is not None:
        return find_material(asked.material), other
    if not load:
        return find_material("steel"), other
    # A tip is of rubber, unless the mass behind it would press rubber in too far.
    rubber, radius = find_material("rubber"), min(tip.radius for tip in tips)
    bears = bearable(radius, rubber, other) >= load * GRAVITY
    return rubber if bears else find_material("plastic"), other


def hertz_stiffness(radius: float, one: Material, other: Material) -> float:
    """Return Hertz's stiffness [N/m^1.5] of a sphere of `radius` [m] on a plane."""
    softness = (1 - one.poisson**2) / one.young + (1 - other.poisson**2) / other.young
    return 4 / 3 * math.sqrt(radius) / softness


def bearable(radius: float, one: Material, other: Material) -> float:
    """Return the load [N] that presses a sphere of `radius` [m] in by a fifteenth of it."""
    return float(hertz_stiffness(radius, one, other) * (radius / 15) ** 1.5)


def contact_of(materials: tuple[Material, Material], speed: float, slip: float) -> Contact:
    """Return a contact, first touched at `speed` [m/s]; its friction is full at `slip` [m/s]."""
    static, dynamic = friction_between(*materials)
    return Contact(
        materials[0],
        materials[1],
        restitution_between(*materials),
        rounded(speed),
        round(static, 3),
        round(dynamic, 3),
        rounded(slip),
    )


def sticking(
    materials: tuple[Material, Material], radius: float, speed: float, load: float, mass: float
) -> Contact:
    """Return a contact whose friction sticks under a `load` [N], that of a `mass` [kg]."""
    slope = 1.5 * hertz_stiffness(radius, *materials) ** (2 / 3) * load ** (1 / 3)
    bristle = (rounded(slope), rounded(0.2 * math.sqrt(slope * mass)))
    return replace(contact_of(materials, speed, 0.005), bristle=bristle)
