"""Which method moves the state, and what decides how far it moves at a time."""

from dataclasses import dataclass

from sphshell_pin.base.parameters import Component, parameter, same_parameter

__all__ = ["Adaptive", "Implicit", "LinearlyImplicitEuler", "RungeKutta4", "SemiImplicitEuler"]


class Integrator(Component):
    """Base of the integrators: `kind` is their name in files and in the compiled core."""

    @property
    def limited_dt(self) -> float | None:
        """Step [s] that has to resolve the shortest time scale; None where it need not."""
        return None


@dataclass(frozen=True)
class _FixedStep(Integrator):
    """What all of them have.

    Parameters
    ----------
    dt : step
    """

    dt: float = parameter(1e-4, above=0, unit="s", label="time step")


@dataclass(frozen=True)
class SemiImplicitEuler(_FixedStep, kind="semi-implicit-euler"):
    """Velocity first, then position with the new velocity, in steps of `dt` [s]; order 1.

    Cheap, and forgiving with stiff contact: where the mass matrix is constant it is symplectic, and
    energy oscillates without drift. Gyroscopic terms are stepped explicitly: a body that is not
    round gains energy in proportion to spin^2 dt, so take another for fast tumbling.
    """

    @property
    def limited_dt(self) -> float:
        """The step: the recommended one is that of a method of order 1."""
        return self.dt


@dataclass(frozen=True)
class RungeKutta4(_FixedStep, kind="runge-kutta-4"):
    """The classical method of order 4 in steps of `dt` [s], on the Lie group (Munthe-Kaas 1998)."""


@dataclass(frozen=True)
class LinearlyImplicitEuler(_FixedStep, kind="linearly-implicit-euler"):
    """One linear solve a step of `dt` [s]; order 1, stable at any stiffness and damping.

    For interactive use: it loses energy where a step does not resolve a contact, and gains none
    (with laws whose exponent is 1 or more).
    """

    dt: float = same_parameter(_FixedStep, "dt", 1e-3)


@dataclass(frozen=True)
class _ErrorControlled(Integrator):
    """What all of them have.

    Parameters
    ----------
    rtol : error of a step over the size of the state
    atol : error of a step (m, rad, m/s, rad/s); by default `rtol` / 100
    """

    rtol: float = parameter(1e-6, at_least=1e-13, at_most=0.1, label="relative tolerance")
    atol: float | None = parameter(None, above=0, label="absolute tolerance")

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a tolerance that is not positive or out of reach."""
        super().__post_init__()
        if self.atol is None:
            object.__setattr__(self, "atol", 0.01 * self.rtol)


@dataclass(frozen=True)
class Adaptive(_ErrorControlled, kind="adaptive"):
    """Steps as long as the error allows: Dormand and Prince's explicit pair of order 5(4).

    The error of a step stays below atol + rtol times the size of each part of the state (m, rad,
    m/s, rad/s; positions from the origin, angles of joints from zero, rotations of free bodies by
    1 rad); `atol` is rtol / 100 unless given. Touch and lift-off are found to round-off and the
    step ends there, so that the order holds through them. The first choice for impacts and smooth
    motion; where contact is stiff and lasts, take Implicit.
    """


@dataclass(frozen=True)
class Implicit(_ErrorControlled, kind="implicit"):
    """Steps as long as the error allows, however stiff: Rodas, an L-stable method of order 4(3).

    Tolerances and events are those of Adaptive. Each step solves linear systems with the analytic
    Jacobian of dynamics and contact: for stiff contact that lasts, and for friction that sticks.
    """

    rtol: float = same_parameter(_ErrorControlled, "rtol", 1e-5)
