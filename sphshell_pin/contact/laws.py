"""Laws with a stiffness: a class for each, and for each other form in which it may be stated."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import cast

from sphshell_pin import _core
from sphshell_pin.contact.normal_law import NormalLaw, bisect
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.parameters import Ingredient, parameter
from sphshell_pin.units import (
    adams_damping_to_si,
    adams_length_to_si,
    adams_stiffness_to_si,
    adams_units,
)

__all__ = ["HertzLaw", "HuntCrossleyLaw", "ImpactLaw"]


@dataclass(frozen=True)
class _PowerLaw(NormalLaw):
    """A law whose elastic part is stiffness depth^exponent."""

    stiffness: float = parameter(
        above=0,
        unit="N/m^{0.exponent:g}",
        help="k, from a load F and the depth you accept under it: `k = F / depth^exponent`; a few "
        "percent of the radius is much",
    )
    exponent: float = parameter(
        1.5,
        above=0,
        help="e: 1.5 for a ball on an elastic surface (Hertz), 1 for a linear spring; ADAMS's "
        "default is 2.2 (`from_adams`)",
    )

    def depth_at(self, force: float) -> float:
        """Return the depth [m] at which the elastic part alone carries `force` [N]."""
        return float((max(force, 0.0) / self.stiffness) ** (1 / self.exponent))

    def depth_of(self, energy: float) -> float:
        """Return the depth [m] at which the elastic part has stored `energy` [J]."""
        power = self.exponent + 1
        return float((power * energy / self.stiffness) ** (1 / power))

    def contact_time(self, depth: float, speed: float) -> float:
        """Return the duration [s] of an undamped impact at `speed` [m/s] down to `depth` [m]."""
        power = self.exponent + 1
        # Integral of du / sqrt(1 - u^power) from 0 to 1.
        half = math.sqrt(math.pi) * math.gamma(1 + 1 / power) / math.gamma(0.5 + 1 / power)
        return 2 * depth / speed * half

    @property
    def _stiffness_text(self) -> str:
        return f"stiffness {self.stiffness:.4g} {self.unit_of('stiffness')}"


@dataclass(frozen=True)
class ImpactLaw(_PowerLaw, kind="impact"):
    """ADAMS's IMPACT: max(0, k depth^e - STEP(depth, 0, 0, d, c) gap_rate).

    `stiffness` k > 0 [N/m^e], `exponent` e > 0, `damping` c >= 0 [N s/m], which is reached at
    `full_damping_depth` d > 0 [m]. Source: ADAMS/Solver help, IMPACT.
    """

    damping: float = parameter(
        0.0,
        at_least=0,
        unit="N s/m",
        help="c: 0 gives back all energy. Restitution depends on speed and mass: find c by a drop "
        "test",
    )
    full_damping_depth: float = parameter(
        1e-4,
        above=0,
        unit="m",
        help="d: about the depth under load; damping comes on gradually up to it, so that the "
        "force starts from zero",
    )

    @classmethod
    def from_adams(
        cls,
        k: float = 1e5,
        e: float = 2.2,
        c: float = 10.0,
        d: float = 0.1,
        units: str = "mm-N-s",
    ) -> ImpactLaw:
        """Build from ADAMS's numbers, by default its defaults, in the system `units`.

        The stiffness is per length^e, so it converts by (meters per length)^-e: 1000^e from mm.
        """
        return AdamsImpact(k, e, c, d, units).made()

    @staticmethod
    def hertz(
        radius: float,
        young_1: float,
        poisson_1: float,
        young_2: float,
        poisson_2: float,
        restitution: float | None = None,
        speed: float | None = None,
        *,
        radius_2: float | None = None,
    ) -> ImpactLaw | HuntCrossleyLaw:
        """Build Hertz's law of a sphere of `radius` [m] on a plane: k = 4/3 E* sqrt(r), e = 3/2.

        Of two spheres `radius_2` [m] is that of the second, and 1/r = 1/radius + 1/radius_2.

        1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2 (Johnson, Contact Mechanics, 4.22); Young's
        moduli in Pa. Without `restitution` the law is undamped. With `restitution` at the impact
        `speed` [m/s] it is a HuntCrossleyLaw: there restitution does not depend on the mass, in
        IMPACT it does.
        """
        stated = Hertz(
            young_1, poisson_1, young_2, poisson_2, restitution, speed, radius_2, radius=radius
        )
        return cast(ImpactLaw | HuntCrossleyLaw, stated.made())

    @property
    def text(self) -> str:
        """Name and parameters in one line."""
        if not self.damping:
            return f"IMPACT, {self._stiffness_text}, undamped"
        return (
            f"IMPACT, {self._stiffness_text}, damping {self.damping:.4g} N s/m from "
            f"{self.full_damping_depth * 1e3:.4g} mm"
        )

    def decay_time(self, mass: float, depth: float) -> float:
        """Return the time [s] in which damping at `depth` [m] slows `mass` [kg] down by e."""
        share = min(depth / self.full_damping_depth, 1.0)
        damping = self.damping * share * share * (3 - 2 * share)
        return mass / damping if damping else math.inf


@dataclass(frozen=True)
class HuntCrossleyLaw(_PowerLaw, kind="hunt-crossley"):
    """Hunt and Crossley's law: max(0, k depth^e (1 - b gap_rate)).

    `stiffness` k > 0 [N/m^e], `exponent` e > 0, `dissipation` b >= 0 [s/m]. The restitution at
    impact speed v depends on b v alone. Source: Hunt and Crossley, J. Appl. Mech. 42 (1975) 440.
    """

    dissipation: float = parameter(
        0.0,
        at_least=0,
        unit="s/m",
        help="b, from the restitution wanted at an impact speed: "
        "`ImpactLaw.hertz(..., restitution=, speed=)` computes it",
    )

    @classmethod
    def with_restitution(
        cls, stiffness: float, exponent: float, restitution: float, speed: float
    ) -> HuntCrossleyLaw:
        """Build the law that throws back at `restitution` times an impact speed of `speed` [m/s].

        The mass does not matter (Hunt and Crossley 1975).
        """
        return cls(stiffness, exponent, _dissipation_for(restitution, speed))

    @property
    def text(self) -> str:
        """Name and parameters in one line."""
        return f"Hunt-Crossley, {self._stiffness_text}, dissipation {self.dissipation:.4g} s/m"

    def decay_time(self, mass: float, depth: float) -> float:
        """Return the time [s] in which damping at `depth` [m] slows `mass` [kg] down by e."""
        damping = self.stiffness * depth**self.exponent * self.dissipation
        return mass / damping if damping else math.inf


@dataclass(frozen=True)
class HertzLaw(NormalLaw, kind="hertz"):
    """Hertz's law from materials: the force follows from the curvatures of sphere and shell.

    force = E* scale depth^1.5 with 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2; `young` [Pa] and
    `poisson` of the sphere, `young_2` and `poisson_2` of the shell (by default of the same
    material). `scale` [m^0.5] depends on the radius of the sphere and the two principal curvatures
    of the shell at the contact, by the elliptic integrals of Johnson, Contact Mechanics (1985),
    4.26; on a plane it is 4/3 sqrt(radius). Where it changes along the shell there is a force along
    the shell as well, as the elastic energy 2/5 force depth changes.

    Damping: by `restitution` at an impact `speed` [m/s], after Hunt and Crossley (J. Appl. Mech. 42
    (1975) 440), or by the `loss_tangent` of a viscoelastic material at a `frequency` [Hz], after
    Kuwabara and Kono (Jpn. J. Appl. Phys. 26 (1987) 1230): 1.5 tau E* scale depth^0.5 times the
    closing speed, tau = loss_tangent / (2 pi frequency). By default none.

    `radius` [m]: of a sphere on a plane, whatever it touches; see on_plane.
    """

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
        help="of the shell; without it both are of one material",
    )
    poisson_2: float | None = parameter(
        None, above=-1, at_most=0.5, label="Poisson's ratio 2", help="of the shell"
    )
    restitution: float | None = parameter(
        None, above=0, at_most=1, help="speed of rebound over `speed`; without it no damping"
    )
    speed: float | None = parameter(
        None,
        above=0,
        unit="m/s",
        label="speed of the restitution",
        help="impact speed at which the restitution holds",
    )
    loss_tangent: float | None = parameter(
        None, above=0, help="tangent of the loss angle at `frequency`, in place of a restitution"
    )
    frequency: float | None = parameter(
        None, above=0, unit="Hz", help="frequency at which the loss tangent holds"
    )
    radius: float | None = parameter(
        None,
        above=0,
        unit="m",
        help="of a sphere on a plane, whatever it touches; without it the stiffness follows the "
        "curvature of what it touches",
    )

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value outside its bounds, and for one of a pair."""
        super().__post_init__()
        for one, other in (
            ("young_2", "poisson_2"),
            ("restitution", "speed"),
            ("loss_tangent", "frequency"),
        ):
            pair = getattr(self, one), getattr(self, other)
            if (pair[0] is None) != (pair[1] is None):
                must = "must be given together, or neither"
                raise InvalidParameter(f"{one}, {other}", pair, must)
        if self.restitution is not None and self.loss_tangent is not None:
            must = "must not be given with a restitution: either states the damping"
            raise InvalidParameter("loss_tangent", self.loss_tangent, must)

    @cached_property
    def modulus(self) -> float:
        """The effective modulus E* [Pa] of both materials."""
        young_2 = self.young if self.young_2 is None else self.young_2
        poisson_2 = self.poisson if self.poisson_2 is None else self.poisson_2
        return 1 / ((1 - self.poisson**2) / self.young + (1 - poisson_2**2) / young_2)

    @cached_property
    def dissipation(self) -> float:
        """Hunt and Crossley's b [s/m]."""
        if self.restitution is None or self.speed is None:
            return 0.0
        return _dissipation_for(self.restitution, self.speed)

    @property
    def relaxation_time(self) -> float:
        """The time tau [s] of the viscoelastic material."""
        if self.loss_tangent is None or self.frequency is None:
            return 0.0
        return self.loss_tangent / (2 * math.pi * self.frequency)

    @property
    def needs_shape(self) -> bool:
        """Whether the force depends on the shell's curvature: unless there is a `radius`."""
        return self.radius is None

    def on_plane(self, radius: float) -> NormalLaw:
        """Return the law of a sphere of `radius` [m] on a plane, whatever it touches.

        It is an ImpactLaw, a HuntCrossleyLaw with a restitution, and a HertzLaw with a loss
        tangent.
        """
        stiffness = 4 / 3 * self.modulus * math.sqrt(radius)
        if self.relaxation_time:
            return replace(self, radius=radius)
        if self.restitution is None or self.speed is None:
            return ImpactLaw(stiffness, 1.5)
        return HuntCrossleyLaw.with_restitution(stiffness, 1.5, self.restitution, self.speed)

    def numbers(self) -> list[float]:
        """Return E*, b, tau and the fixed scale, or 0, as the compiled core takes them."""
        scale = 0.0 if self.radius is None else 4 / 3 * math.sqrt(self.radius)
        return [self.modulus, self.dissipation, self.relaxation_time, scale]

    @property
    def alone(self) -> _core.NormalLaw:
        """The C++ binding; InvalidParameter without `radius`: the gap is not known."""
        if self.needs_shape:
            must = "must be given where nothing is touched: take law.on_plane(radius)"
            raise InvalidParameter("radius", None, must)
        return self.core

    @property
    def text(self) -> str:
        """Name and parameters in one line."""
        damping = "undamped"
        if self.restitution is not None:
            damping = f"restitution {self.restitution:g} at {self.speed:g} m/s"
        elif self.loss_tangent is not None:
            damping = f"loss tangent {self.loss_tangent:g} at {self.frequency:g} Hz"
        where = (
            "of the curvatures of sphere and shell"
            if self.radius is None
            else f"of a sphere of {self.radius * 1e3:.4g} mm on a plane"
        )
        return f"Hertz, E* {self.modulus:.4g} Pa, {where}, {damping}"

    def decay_time(self, mass: float, depth: float) -> float:
        """Return the time [s] in which damping at `depth` [m] slows `mass` [kg] down by e."""
        relaxation = 1.5 * self.relaxation_time / depth + self.dissipation if depth else 0.0
        damping = self.normal_force(depth) * relaxation
        return mass / damping if damping else math.inf


@dataclass(frozen=True)
class AdamsImpact(Ingredient, kind="adams", of=NormalLaw):
    """IMPACT as an ADAMS model states it; the defaults are ADAMS's own."""

    k: float = parameter(
        1e5, above=0, unit="{0.force}/{0.length}^{0.e:g}", label="stiffness", help="stiffness"
    )
    e: float = parameter(2.2, above=0, label="exponent", help="exponent")
    c: float = parameter(
        10.0, at_least=0, unit="{0.force} {0.time}/{0.length}", label="damping", help="damping"
    )
    d: float = parameter(
        0.1,
        above=0,
        unit="{0.length}",
        label="full damping depth",
        help="penetration for full damping",
    )
    units: str = parameter("mm-N-s", help="ADAMS's unit system: length, force, time")

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value outside its bounds or an unknown unit system."""
        super().__post_init__()
        adams_units(self.units)

    @property
    def length(self) -> str:
        """Unit of length."""
        return self.units.split("-")[0]

    @property
    def force(self) -> str:
        """Unit of force."""
        return self.units.split("-")[1]

    @property
    def time(self) -> str:
        """Unit of time."""
        return self.units.split("-")[2]

    def made(self, folder: Path = Path()) -> ImpactLaw:
        """Return the law in SI."""
        return ImpactLaw(
            adams_stiffness_to_si(self.k, self.e, self.units),
            self.e,
            adams_damping_to_si(self.c, self.units),
            adams_length_to_si(self.d, self.units),
        )


@dataclass(frozen=True)
class Hertz(Ingredient, kind="hertz", of=NormalLaw):
    """Hertz's law as a scenario states it, see HertzLaw; with a radius see ImpactLaw.hertz."""

    young_1: float = parameter(
        above=0, unit="Pa", label="Young's modulus 1", help="Young's modulus of the sphere"
    )
    poisson_1: float = parameter(
        above=-1, at_most=0.5, label="Poisson's ratio 1", help="Poisson's ratio of the sphere"
    )
    young_2: float | None = parameter(
        None,
        above=0,
        unit="Pa",
        label="Young's modulus 2",
        help="Young's modulus of the shell; without it both are of one material",
    )
    poisson_2: float | None = parameter(
        None,
        above=-1,
        at_most=0.5,
        label="Poisson's ratio 2",
        help="Poisson's ratio of the shell",
    )
    restitution: float | None = parameter(
        None, above=0, at_most=1, help="speed of rebound over `speed`; without it no damping"
    )
    speed: float | None = parameter(
        None,
        above=0,
        unit="m/s",
        label="speed of the restitution",
        help="impact speed at which the restitution holds",
    )
    radius_2: float | None = parameter(
        None,
        above=0,
        unit="m",
        label="Hertz radius 2",
        help="radius of the second body where it is a ball, too; without it a half-space",
    )
    loss_tangent: float | None = parameter(
        None, above=0, help="tangent of the loss angle at `frequency`, in place of a restitution"
    )
    frequency: float | None = parameter(
        None, above=0, unit="Hz", help="frequency at which the loss tangent holds"
    )
    radius: float | None = parameter(
        None,
        above=0,
        unit="m",
        label="Hertz radius",
        help="of a constant stiffness: radius of the ball, or the effective one; without it the "
        "stiffness follows from the sphere and the curvature of what it touches",
    )

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value outside its bounds, and for one of a pair."""
        super().__post_init__()
        self._law()
        if self.radius is None and self.radius_2 is not None:
            raise InvalidParameter("radius_2", self.radius_2, "must be given with radius, or left")

    def made(self, folder: Path = Path()) -> NormalLaw:
        """Return the law; with a radius a constant one, of Hunt and Crossley with a restitution."""
        law = self._law()
        if self.radius is None:
            return law
        radius = self.radius
        if self.radius_2 is not None:
            radius *= self.radius_2 / (radius + self.radius_2)
        return law.on_plane(radius)

    def _law(self) -> HertzLaw:
        return HertzLaw(
            self.young_1,
            self.poisson_1,
            self.young_2,
            self.poisson_2,
            self.restitution,
            self.speed,
            self.loss_tangent,
            self.frequency,
        )


def _dissipation_for(restitution: float, speed: float) -> float:
    """Return the dissipation b [s/m] of Hunt-Crossley that rebounds at restitution * `speed`.

    Energy of approach and of rebound are equal where the depth is largest, which gives
    x - ln(1 + x) = -y - ln(1 - y) with x = b v, y = b v restitution; solved by bisection.
    """

    def excess(x: float) -> float:
        y = restitution * x
        return (-y - math.log1p(-y)) - (x - math.log1p(x))

    if restitution == 1:
        return 0.0
    # y < 1: the rebound never exceeds 1 / b. Below the root the series
    # x^2 (restitution^2 - 1) / 2 makes the difference negative.
    return bisect(excess, 0.0, 1 / restitution) / speed
