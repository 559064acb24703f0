"""Normal force of one contact, from depth and gap rate."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from sphshell_pin import _core
from sphshell_pin.checks import check_finite, check_not_negative, check_positive, check_type
from sphshell_pin.errors import InvalidParameter


class NormalLaw(ABC):
    """What every normal law offers: `core`, the C++ twin, decides the numbers."""

    stiffness: float
    exponent: float

    @property
    @abstractmethod
    def core(self) -> _core.NormalLaw:
        """The C++ twin of this law."""

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the C++ twin, which is made again: what pickle and copy take."""
        return {k: v for k, v in self.__dict__.items() if k != "core"}

    def normal_force(self, depth: float, gap_rate: float = 0.0) -> float:
        """Return the push [N] at `depth` [m] (0 where not positive) and `gap_rate` [m/s].

        gap_rate = normal . relative velocity: negative while the bodies close.
        """
        value: float = self.core.force(
            check_finite("depth", depth), check_finite("gap_rate", gap_rate)
        )
        return value

    def normal_stiffness(self, depth: float) -> float:
        """Return the slope of the elastic force at `depth` [m], in N/m (0 where not positive)."""
        depth = check_finite("depth", depth)
        if depth <= 0:
            return 0.0
        return float(self.exponent * self.stiffness * depth ** (self.exponent - 1))

    def energy(self, depth: float) -> float:
        """Return the elastic energy [J] stored at `depth` [m]."""
        value: float = self.core.energy(check_finite("depth", depth))
        return value

    def depth_at(self, force: float) -> float:
        """Return the depth [m] at which the elastic part alone carries `force` [N]."""
        return float((max(force, 0.0) / self.stiffness) ** (1 / self.exponent))


@dataclass(frozen=True)
class ImpactLaw(NormalLaw):
    """ADAMS's IMPACT: max(0, k depth^e - STEP(depth, 0, 0, d, c) gap_rate).

    `stiffness` k > 0 [N/m^e], `exponent` e > 0, `damping` c >= 0 [N s/m], which is reached at
    `full_damping_depth` d > 0 [m]. Source: ADAMS/Solver help, IMPACT.
    """

    stiffness: float
    exponent: float = 1.5
    damping: float = 0.0
    full_damping_depth: float = 1e-4

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value outside its range."""
        check_positive("stiffness", self.stiffness, "N/m^e")
        check_positive("exponent", self.exponent)
        check_not_negative("damping", self.damping, "N s/m")
        check_positive("full_damping_depth", self.full_damping_depth, "m")

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

        The stiffness is per length^e, so it converts by (metres per length)^-e: 1000^e from mm.
        """
        from sphshell_pin.units import (
            adams_damping_to_si,
            adams_length_to_si,
            adams_stiffness_to_si,
        )

        return cls(
            adams_stiffness_to_si(k, e, units),
            e,
            adams_damping_to_si(c, units),
            adams_length_to_si(d, units),
        )

    @staticmethod
    def hertz(
        radius: float,
        young_1: float,
        poisson_1: float,
        young_2: float,
        poisson_2: float,
        restitution: float | None = None,
        speed: float | None = None,
    ) -> ImpactLaw | HuntCrossleyLaw:
        """Build Hertz's law of a sphere of `radius` [m] on a plane: k = 4/3 E* sqrt(r), e = 3/2.

        1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2 (Johnson, Contact Mechanics, 4.22); Young's
        moduli in Pa. Without `restitution` the law is undamped. With `restitution` at the impact
        `speed` [m/s] it is a HuntCrossleyLaw: there restitution does not depend on the mass, in
        IMPACT it does.
        """
        radius = check_positive("radius", radius, "m")
        moduli = 0.0
        for i, (young, poisson) in enumerate(((young_1, poisson_1), (young_2, poisson_2)), 1):
            check_positive(f"young_{i}", young, "Pa")
            if not -1 < check_finite(f"poisson_{i}", poisson) <= 0.5:
                raise InvalidParameter(f"poisson_{i}", poisson, "must lie in (-1, 0.5]")
            moduli += (1 - poisson**2) / young
        stiffness = 4 / 3 / moduli * math.sqrt(radius)
        if (restitution is None) != (speed is None):
            raise InvalidParameter(
                "restitution, speed", (restitution, speed), "must be given together, or neither"
            )
        if restitution is None or speed is None:
            return ImpactLaw(stiffness, 1.5)
        return HuntCrossleyLaw(stiffness, 1.5, dissipation_for(restitution, speed))

    @cached_property
    def core(self) -> _core.NormalLaw:
        """The C++ twin of this law."""
        return _core.NormalLaw(
            0, self.stiffness, self.exponent, self.damping, self.full_damping_depth
        )


@dataclass(frozen=True)
class HuntCrossleyLaw(NormalLaw):
    """Hunt and Crossley's law: max(0, k depth^e (1 - b gap_rate)).

    `stiffness` k > 0 [N/m^e], `exponent` e > 0, `dissipation` b >= 0 [s/m]. The restitution at
    impact speed v depends on b v alone. Source: Hunt and Crossley, J. Appl. Mech. 42 (1975) 440.
    """

    stiffness: float
    exponent: float = 1.5
    dissipation: float = 0.0

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value outside its range."""
        check_positive("stiffness", self.stiffness, "N/m^e")
        check_positive("exponent", self.exponent)
        check_not_negative("dissipation", self.dissipation, "s/m")

    @cached_property
    def core(self) -> _core.NormalLaw:
        """The C++ twin of this law."""
        return _core.NormalLaw(1, self.stiffness, self.exponent, self.dissipation)


def check_law(law: Any) -> None:
    """Raise InvalidParameter unless `law` is a normal law."""
    check_type("law", law, NormalLaw, "must be a law, for instance ImpactLaw(stiffness)")


def dissipation_for(restitution: float, speed: float) -> float:
    """Return the dissipation b [s/m] of Hunt-Crossley that rebounds at restitution * `speed`.

    Energy of approach and of rebound are equal where the depth is largest, which gives
    x - ln(1 + x) = -y - ln(1 - y) with x = b v, y = b v restitution; solved by bisection.
    """
    check_positive("speed", speed, "m/s")
    if not 0 < check_finite("restitution", restitution) <= 1:
        raise InvalidParameter("restitution", restitution, "must lie in (0, 1]")

    def excess(x: float) -> float:
        y = restitution * x
        return (-y - math.log1p(-y)) - (x - math.log1p(x))

    if restitution == 1:
        return 0.0
    low, high = 0.0, 1 / restitution  # y < 1: the rebound never exceeds 1 / b
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        # Below the root the series x^2 (restitution^2 - 1) / 2 makes the difference negative.
        low, high = (middle, high) if excess(middle) < 0 else (low, middle)
    return 0.5 * (low + high) / speed
