"""Tangential force of one contact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from sphshell_pin import _core
from sphshell_pin.base.checks import check_not_negative, check_positive, check_type
from sphshell_pin.base.parameters import Component, parameter
from sphshell_pin.contact.materials import find_material, friction_between
from sphshell_pin.contact.normal_law import DECAYS_PER_PERIOD
from sphshell_pin.errors import InvalidParameter


class Friction(Component):
    """Base of the friction laws: `core`, the C++ binding, computes the forces."""

    @cached_property
    def _binding(self) -> _core.FrictionLaw:
        """The C++ binding of this law."""
        return _core.FrictionLaw(self.kind, self._numbers())

    @property
    def text(self) -> str:
        """Parameters in one line."""
        raise NotImplementedError

    @property
    def has_state(self) -> bool:
        """Whether a contact has a stretch, which depends on what happened before."""
        return self._binding.has_state

    @property
    def state_size(self) -> int:
        """How many numbers the state of a contact has."""
        return 3 * self.has_state

    @property
    def sticking_speed(self) -> float:
        """Slip speed [m/s] below which a contact sticks."""
        raise NotImplementedError

    @property
    def creep_speed(self) -> float:
        """Slip speed [m/s] at which it holds half of what it can hold; 0 where it sticks."""
        return 0.0

    @property
    def needs_radius(self) -> bool:
        """Whether the forces depend on the radius of the sphere."""
        return self._binding.torsional

    def slip_time(self, mass: float, load: float, disc: float) -> float:
        """Return the time scale [s] of slow slip of `mass` [kg] along the surface under `load` [N].

        20 times its decay where friction acts like a damper; half a period where like a spring.
        `disc` [m] is the radius of the disc of contact under this load.
        """
        raise NotImplementedError

    def coefficient(self, slip_speed: float, load: float = 1.0) -> float:
        """Return mu of steady sliding at `slip_speed` [m/s] >= 0.

        The `load` [N] counts for a FunctionFriction alone.
        """
        speed = check_not_negative("slip_speed", slip_speed, "m/s")
        return self._binding.coefficient(speed, check_positive("load", load, "N"))

    @property
    def largest_coefficient(self) -> float:
        """The largest mu, at rest or nearly so; of a FunctionFriction under 1 N."""
        raise NotImplementedError


@dataclass(frozen=True)
class Coefficients(Friction):
    """What the laws share that have two coefficients.

    Parameters
    ----------
    mu_static : coefficient at rest or nearly so
    mu_dynamic : coefficient of fast sliding; not above `mu_static`
    """

    mu_static: float = parameter(at_least=0, label="static friction")
    mu_dynamic: float = parameter(at_least=0, label="dynamic friction")

    @property
    def largest_coefficient(self) -> float:
        """The static coefficient."""
        return float(self.mu_static)

    @classmethod
    def of(cls, sphere: str, shell: str, **more: Any) -> Self:
        """Build from two names of MATERIALS: their coefficients, and `more` parameters."""
        pair = friction_between(find_material(sphere), find_material(shell))
        return cls(**dict(zip(("mu_static", "mu_dynamic"), pair, strict=True)) | more)

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value outside its bounds."""
        super().__post_init__()
        if self.mu_dynamic > self.mu_static:
            raise InvalidParameter(
                "mu_dynamic", self.mu_dynamic, f"must not exceed mu_static = {self.mu_static!r}"
            )


@dataclass(frozen=True)
class NoFriction(Component, kind="none", of=Friction):
    """A frictionless contact."""

    def _build(self, folder: Path = Path()) -> None:
        """Return None."""


@dataclass(frozen=True)
class CoulombFriction(Coefficients, kind="coulomb"):
    """Coulomb friction regularized over two slip speeds, as ADAMS has it; its defaults are ADAMS's.

    The force opposes the slip velocity with mu(s) N: mu rises from 0 at rest to `mu_static` at
    slip speed `v_static` [m/s], falls to `mu_dynamic` at `v_dynamic` [m/s] and stays there; both
    pieces are the cubic STEP. At rest there is no force, so a loaded contact always creeps.
    Source: ADAMS/View help, contact friction force.

    Parameters
    ----------
    mu_static : coefficient at the slip speed `v_static`
    mu_dynamic : coefficient from `v_dynamic` on; not above `mu_static`
    v_static : the slip you can bear where it should stick: small enough for the creep, large enough
        for dt (below)
    v_dynamic : more than `v_static`; ADAMS takes 10 times as much
    """

    mu_static: float = parameter(0.3, at_least=0, label="static friction")
    mu_dynamic: float = parameter(0.1, at_least=0, label="dynamic friction")
    v_static: float = parameter(0.1, above=0, unit="m/s", label="static friction speed")
    v_dynamic: float = parameter(1.0, above=0, unit="m/s", label="dynamic friction speed")

    def __post_init__(self) -> None:
        """Raise InvalidParameter unless mu_dynamic <= mu_static and v_static < v_dynamic."""
        super().__post_init__()
        if self.v_dynamic <= self.v_static:
            raise InvalidParameter(
                "v_dynamic", self.v_dynamic, f"must exceed v_static = {self.v_static!r} m/s"
            )

    @classmethod
    def from_adams(
        cls, mu_static: float, mu_dynamic: float, v_static: float, v_dynamic: float
    ) -> CoulombFriction:
        """Build from ADAMS's coefficients and its speeds in mm/s."""
        return cls(mu_static, mu_dynamic, v_static / 1000, v_dynamic / 1000)

    @property
    def text(self) -> str:
        """Parameters in one line."""
        return (
            f"coefficient {self.mu_static:g} at {self.v_static:g} m/s, "
            f"{self.mu_dynamic:g} from {self.v_dynamic:g} m/s; creeps under load"
        )

    @property
    def sticking_speed(self) -> float:
        """Slip speed [m/s] below which a contact creeps."""
        return self.v_static

    @property
    def creep_speed(self) -> float:
        """The root of (3 x - x^3) / 2 = 1/2, in `v_static`."""
        return 2.0 * math.sin(math.asin(0.5) / 3.0) * self.v_static

    def slip_time(self, mass: float, load: float, disc: float) -> float:
        """Return 20 times the decay of a slip below `v_static` [s]."""
        if not self.mu_static or not load > 0:
            return math.inf
        damper = 1.5 * float(self.mu_static) * load
        return DECAYS_PER_PERIOD * mass * self.v_static / damper


def check_friction(friction: object) -> Friction | None:
    """Return `friction`; raise InvalidParameter unless it is a friction law, or None."""
    if friction is None:
        return None
    kinds = "a CoulombFriction, a BristleFriction, a MindlinFriction, a FunctionFriction or None"
    return check_type("friction", friction, Friction, f"must be {kinds}")
