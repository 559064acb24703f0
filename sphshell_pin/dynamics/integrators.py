"""Which stepper moves the state, and how far at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sphshell_pin.checks import check_positive


@dataclass(frozen=True)
class SemiImplicitEuler:
    """Velocity first, then position with the new velocity, in steps of `dt` [s]; order 1.

    Cheap, and forgiving with stiff contact: where the mass matrix is constant it is symplectic, and
    energy oscillates without drift. Gyroscopic terms are stepped explicitly: a body that is not
    round gains energy in proportion to spin^2 dt, so take RungeKutta4 for fast tumbling.
    """

    dt: float = 1e-4
    stages: ClassVar[int] = 1

    def __post_init__(self) -> None:
        """Raise InvalidParameter unless dt is positive."""
        object.__setattr__(self, "dt", check_positive("dt", self.dt, "s"))


@dataclass(frozen=True)
class RungeKutta4:
    """The classical method of order 4 in steps of `dt` [s], on the Lie group (Munthe-Kaas 1998)."""

    dt: float = 1e-4
    stages: ClassVar[int] = 4

    def __post_init__(self) -> None:
        """Raise InvalidParameter unless dt is positive."""
        object.__setattr__(self, "dt", check_positive("dt", self.dt, "s"))


Integrator = SemiImplicitEuler | RungeKutta4
