"""What a tip and a surface are made of, and the law and friction that follow."""

import math
from collections.abc import Sequence

from sphshell_pin.contact.materials import (
    Material,
    find_material,
    friction_between,
    restitution_between,
)
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.wording import mm, rounded

GRAVITY = 9.81


class Contact:
    """Law and friction of a tip of `materials[0]` on `materials[1]`, as the scenario states them.

    The first touch is at `speed` [m/s], at which the restitution holds; friction is full at the
    slip speed `v_static` [m/s]. `bristle` is stiffness [N/m] and damping [N s/m] of bristles, for
    what has to stand.
    """

    def __init__(
        self,
        materials: tuple[Material, Material],
        speed: float,
        v_static: float = 0.005,
        bristle: tuple[float, float] | None = None,
    ) -> None:
        self.material, self.against = materials
        self.restitution = restitution_between(*materials)
        self.mu_static, self.mu_dynamic = (round(mu, 3) for mu in friction_between(*materials))
        self.speed, self.v_static, self.bristle = rounded(speed), rounded(v_static), bristle
        self.v_dynamic = rounded(10 * self.v_static)

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


def too_deep(force: float, radius: float, materials: tuple[Material, Material]) -> str:
    """Say that a `force` [N] presses a sphere of `radius` [m] too far in; "" if it does not."""
    if force <= hertz_stiffness(radius, *materials) * (0.5 * radius) ** 1.5:
        return ""
    ball = f"a {materials[0].name} sphere of radius {mm(radius)}"
    return f"{force:.3g} N would press {ball} in by more than half of it"


def sticking(
    materials: tuple[Material, Material], radius: float, speed: float, load: float, mass: float
) -> Contact:
    """Return a contact whose friction sticks under a `load` [N], that of a `mass` [kg]."""
    slope = 1.5 * hertz_stiffness(radius, *materials) ** (2 / 3) * load ** (1 / 3)
    bristle = (rounded(slope), rounded(0.2 * math.sqrt(slope * mass)))
    return Contact(materials, speed, bristle=bristle)
