"""Which method moves the state, and what decides how far it moves at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sphshell_pin.checks import check_positive
from sphshell_pin.errors import InvalidParameter


@dataclass(frozen=True)
class _FixedStep:
    dt: float = 1e-4

    def __post_init__(self) -> None:
        """Raise InvalidParameter unless dt is positive."""
        object.__setattr__(self, "dt", check_positive("dt", self.dt, "s"))


@dataclass(frozen=True)
class SemiImplicitEuler(_FixedStep):
    """Velocity first, then position with the new velocity, in steps of `dt` [s]; order 1.

    Cheap, and forgiving with stiff contact: where the mass matrix is constant it is symplectic, and
    energy oscillates without drift. Gyroscopic terms are stepped explicitly: a body that is not
    round gains energy in proportion to spin^2 dt, so take another for fast tumbling.
    """

    kind: ClassVar[str] = "semi-implicit-euler"


@dataclass(frozen=True)
class RungeKutta4(_FixedStep):
    """The classical method of order 4 in steps of `dt` [s], on the Lie group (Munthe-Kaas 1998)."""

    kind: ClassVar[str] = "runge-kutta-4"


@dataclass(frozen=True)
class LinearlyImplicitEuler(_FixedStep):
    """One linear solve a step of `dt` [s]; order 1, stable at any stiffness and damping.

    For interactive use: it loses energy where a step does not resolve a contact, and gains none
    (with laws whose exponent is 1 or more).
    """

    dt: float = 1e-3
    kind: ClassVar[str] = "linearly-implicit-euler"


@dataclass(frozen=True)
class _ErrorControlled:
    rtol: float = 1e-6
    atol: float | None = None

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a tolerance that is not positive or out of reach."""
        rtol = check_positive("rtol", self.rtol)
        if not 1e-13 <= rtol <= 0.1:
            raise InvalidParameter("rtol", rtol, "must lie between 1e-13 and 0.1")
        atol = 0.01 * rtol if self.atol is None else self.atol
        object.__setattr__(self, "rtol", rtol)
        object.__setattr__(self, "atol", check_positive("atol", atol))


@dataclass(frozen=True)
class Adaptive(_ErrorControlled):
    """Steps as long as the error allows: Dormand and Prince's explicit pair of order 5(4).

    The error of a step stays below atol + rtol times the size of each part of the state (m, rad,
    m/s, rad/s; positions from the origin, angles of joints from zero, turns of free bodies by
    1 rad); `atol` is rtol / 100 unless given. Touch and lift-off are found to round-off and the
    step ends there, so that the order holds through them. The first choice for impacts and smooth
    motion; where contact is stiff and lasts, take Implicit.
    """

    kind: ClassVar[str] = "adaptive"


@dataclass(frozen=True)
class Implicit(_ErrorControlled):
    """Steps as long as the error allows, however stiff: Rodas, an L-stable method of order 4(3).

    Tolerances and events are those of Adaptive. Each step solves linear systems with the analytic
    Jacobian of dynamics and contact: for stiff contact that lasts, and for friction that sticks.
    """

    rtol: float = 1e-5
    kind: ClassVar[str] = "implicit"


Integrator = SemiImplicitEuler | RungeKutta4 | LinearlyImplicitEuler | Adaptive | Implicit
