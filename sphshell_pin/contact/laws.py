"""Laws with a stiffness: a class for each, and for each other form in which it may be stated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, cast

from sphshell_pin.base.parameters import Component, parameter
from sphshell_pin.contact.normal_law import NormalLaw, bisect
from sphshell_pin.units import (
    adams_damping_to_si,
    adams_length_to_si,
    adams_stiffness_to_si,
    adams_units,
)

if TYPE_CHECKING:
    from sphshell_pin.contact.hertz_law import Hertz

__all__ = ["HuntCrossleyLaw", "ImpactLaw"]


@dataclass(frozen=True)
class _PowerLaw(NormalLaw):
    """A law whose elastic part is stiffness depth^exponent.

    Parameters
    ----------
    stiffness : k, from a load F and the depth you accept under it: `k = F / depth^exponent`; a few
        percent of the radius is much
    exponent : e: 1.5 for a ball on an elastic surface (Hertz), 1 for a linear spring; ADAMS's
        default is 2.2 (`from_adams`)
    """

    stiffness: float = parameter(above=0, unit="N/m^{0.exponent:g}")
    exponent: float = parameter(1.5, above=0)

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
        return 2 * depth / speed * half if speed > 0.0 else math.inf

    @property
    def _stiffness_text(self) -> str:
        return f"stiffness {self.stiffness:.4g} {self.unit_of('stiffness')}"


@dataclass(frozen=True)
class ImpactLaw(_PowerLaw, kind="impact"):
    """ADAMS's IMPACT: max(0, k depth^e - STEP(depth, 0, 0, d, c) gap_rate).

    `stiffness` k > 0 [N/m^e], `exponent` e > 0, `damping` c >= 0 [N s/m], which is reached at
    `full_damping_depth` d > 0 [m]. Source: ADAMS/Solver help, IMPACT.

    Parameters
    ----------
    damping : c: 0 gives back all energy. Restitution depends on speed and mass: find c by a drop
        test
    full_damping_depth : d: about the depth under load; damping comes on gradually up to it, so that
        the force starts from zero
    """

    damping: float = parameter(0.0, at_least=0, unit="N s/m")
    full_damping_depth: float = parameter(1e-4, above=0, unit="m")

    @classmethod
    def from_adams(
        cls, k: float = 1e5, e: float = 2.2, c: float = 10.0, d: float = 0.1, units: str = "mm-N-s"
    ) -> ImpactLaw:
        """Build from ADAMS's numbers, by default its defaults, in the system `units`.

        The stiffness is per length^e, so it converts by (meters per length)^-e: 1000^e from mm.
        """
        return AdamsImpact(k, e, c, d, units)._build()

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
        # By its name in files: the module of Hertz imports this one.
        hertz = cast("type[Hertz]", NormalLaw.kinds["hertz"])
        stated = hertz(
            young_1,
            poisson_1,
            young_2,
            poisson_2,
            restitution,
            speed,
            radius=radius,
            radius_2=radius_2,
        )
        return cast(ImpactLaw | HuntCrossleyLaw, stated._build())

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

    Parameters
    ----------
    dissipation : b, from the restitution wanted at an impact speed: `ImpactLaw.hertz(...,
        restitution=, speed=)` computes it
    """

    dissipation: float = parameter(0.0, at_least=0, unit="s/m")

    @classmethod
    def with_restitution(
        cls, stiffness: float, exponent: float, restitution: float, speed: float
    ) -> HuntCrossleyLaw:
        """Build the law that throws back at `restitution` times an impact speed of `speed` [m/s].

        The mass does not matter (Hunt and Crossley 1975).
        """
        return cls(stiffness, exponent, dissipation_for(restitution, speed))

    @property
    def text(self) -> str:
        """Name and parameters in one line."""
        return f"Hunt-Crossley, {self._stiffness_text}, dissipation {self.dissipation:.4g} s/m"

    def decay_time(self, mass: float, depth: float) -> float:
        """Return the time [s] in which damping at `depth` [m] slows `mass` [kg] down by e."""
        damping = self.stiffness * depth**self.exponent * self.dissipation
        return mass / damping if damping else math.inf


@dataclass(frozen=True)
class AdamsImpact(Component, kind="adams", of=NormalLaw):
    """IMPACT as an ADAMS model states it; the defaults are ADAMS's own.

    Parameters
    ----------
    k : stiffness
    e : exponent
    c : damping
    d : penetration for full damping
    units : ADAMS's unit system: length, force, time
    """

    k: float = parameter(
        1e5, above=0, unit="{0.symbols[force]}/{0.symbols[length]}^{0.e:g}", label="stiffness"
    )
    e: float = parameter(2.2, above=0, label="exponent")
    c: float = parameter(
        10.0,
        at_least=0,
        unit="{0.symbols[force]} {0.symbols[time]}/{0.symbols[length]}",
        label="damping",
    )
    d: float = parameter(0.1, above=0, unit="{0.symbols[length]}", label="full damping depth")
    units: str = parameter("mm-N-s")

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value outside its bounds or an unknown unit system."""
        super().__post_init__()
        adams_units(self.units)

    @property
    def symbols(self) -> dict[str, str]:
        """Units of length, force and time."""
        return dict(zip(("length", "force", "time"), self.units.split("-"), strict=True))

    def _build(self, folder: Path = Path()) -> ImpactLaw:
        """Return the law in SI."""
        return ImpactLaw(
            adams_stiffness_to_si(self.k, self.e, self.units),
            self.e,
            adams_damping_to_si(self.c, self.units),
            adams_length_to_si(self.d, self.units),
        )


def dissipation_for(restitution: float, speed: float) -> float:
    """Return the dissipation b [s/m] of Hunt-Crossley that rebounds at restitution * `speed`.

    Energy of approach and of rebound are equal where the depth is largest, which gives
    x - ln(1 + x) = -y - ln(1 - y) with x = b v, y = b v restitution; solved by bisection. Both
    sides are nearly equal where x is small: there their series are subtracted, divided by x^2.
    """

    def excess(x: float) -> float:
        if x < 0.1:
            powers = ((restitution**n - (-1.0) ** n) / n * x ** (n - 2) for n in range(3, 20))
            return math.fsum(((restitution - 1) * (restitution + 1) / 2, *powers))
        y = restitution * x
        return (-y - math.log1p(-y)) - (x - math.log1p(x))

    if restitution == 1:
        return 0.0
    # y < 1: the rebound never exceeds 1 / b.
    return bisect(excess, 0.0, 1 / restitution) / speed
