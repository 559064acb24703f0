"""Tangential force of one contact."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from sphshell_pin import _core
from sphshell_pin.checks import check_not_negative, check_positive, check_type
from sphshell_pin.errors import InvalidParameter


@dataclass(frozen=True)
class CoulombFriction:
    """Coulomb friction regularised over two slip speeds, as ADAMS has it.

    The force opposes the slip velocity with mu(s) N: mu rises from 0 at rest to `mu_static` at
    slip speed `v_static` [m/s], falls to `mu_dynamic` at `v_dynamic` [m/s] and stays there; both
    pieces are the cubic STEP. At rest there is no force, so a loaded contact always creeps.
    Source: ADAMS/View help, contact friction force.
    """

    mu_static: float
    mu_dynamic: float
    v_static: float
    v_dynamic: float

    def __post_init__(self) -> None:
        """Raise InvalidParameter unless mu_dynamic <= mu_static and v_static < v_dynamic."""
        check_not_negative("mu_static", self.mu_static)
        check_not_negative("mu_dynamic", self.mu_dynamic)
        if self.mu_dynamic > self.mu_static:
            raise InvalidParameter(
                "mu_dynamic", self.mu_dynamic, f"must not exceed mu_static = {self.mu_static!r}"
            )
        check_positive("v_static", self.v_static, "m/s")
        check_positive("v_dynamic", self.v_dynamic, "m/s")
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

    def coefficient(self, slip_speed: float) -> float:
        """Return mu at `slip_speed` [m/s] >= 0."""
        value: float = self.core.coefficient(check_not_negative("slip_speed", slip_speed, "m/s"))
        return value

    @cached_property
    def core(self) -> _core.CoulombLaw:
        """The C++ twin of this object."""
        return _core.CoulombLaw(self.mu_static, self.mu_dynamic, self.v_static, self.v_dynamic)


def check_friction(friction: Any) -> None:
    """Raise InvalidParameter unless `friction` is a CoulombFriction, or None."""
    if friction is not None:
        check_type("friction", friction, CoulombFriction, "must be a CoulombFriction or None")
