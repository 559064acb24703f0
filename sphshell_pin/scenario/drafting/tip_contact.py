"""What a tip and a surface are made of, and the law and friction that follow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

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


class Materials(NamedTuple):
    """What a sphere and a surface are made of; lengths in [m], forces in [N]."""

    sphere: Material
    surface: Material

    @property
    def friction(self) -> float:
        """Coefficient of static friction."""
        return friction_between(*self)[0]

    def stiffness(self, radius: float) -> float:
        """Return Hertz's stiffness [N/m^1.5] of a sphere on a plane."""
        return 4 / 3 * math.sqrt(radius) / sum((1 - one.poisson**2) / one.young for one in self)

    def depth(self, force: float, radius: float) -> float:
        """Return the depth [m] at which a force [N] holds a sphere."""
        return float((force / self.stiffness(radius)) ** (2 / 3))

    def bearable(self, radius: float) -> float:
        """Return the load that presses a sphere in by a fifteenth of its radius."""
        return float(self.stiffness(radius) * (radius / 15) ** 1.5)

    def too_deep(self, force: float, radius: float) -> str:
        """Say that a force presses a sphere too far in; "" if it does not."""
        if self.depth(force, radius) <= 0.5 * radius:
            return ""
        ball = f"a {self.sphere.name} sphere of radius {mm(radius)}"
        return f"{force:.3g} N would press {ball} in by more than half of it"

    def sticking(self, radius: float, speed: float, load: float, mass: float) -> Contact:
        """Return a contact whose friction sticks under a load, that of a `mass` [kg]."""
        slope = 1.5 * self.stiffness(radius) ** (2 / 3) * load ** (1 / 3)
        bristle = (rounded(slope), rounded(0.2 * math.sqrt(slope * mass)))
        return Contact(self, speed, bristle=bristle)


class Contact:
    """Law and friction of a tip, as the scenario states them.

    The first touch is at `speed` [m/s], at which the restitution holds; friction is full at the
    slip speed `v_static` [m/s]. `bristle` is stiffness [N/m] and damping [N s/m] of bristles, for
    what has to stand.
    """

    def __init__(
        self,
        materials: Materials,
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


def chosen_materials(asked: Asked, tips: Sequence[Tip], load: float) -> Materials:
    """Return what sphere and surface are made of; `load` [kg] rests on each, 0: it falls."""
    rubber = Materials(find_material("rubber"), find_material(asked.against or "steel"))
    # A tip is of rubber, unless the mass behind it would press rubber in too far.
    bears = rubber.bearable(min(tip.radius for tip in tips)) >= load * GRAVITY
    name = asked.material or (("rubber" if bears else "plastic") if load else "steel")
    return rubber._replace(sphere=find_material(name))
