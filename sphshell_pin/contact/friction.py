"""Tangential force of one contact."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from sphshell_pin import _core
from sphshell_pin.checks import check_not_negative, check_positive, check_type
from sphshell_pin.errors import InvalidParameter


class Friction(ABC):
    """What every friction law offers: `core`, the C++ twin, decides the numbers."""

    @property
    @abstractmethod
    def core(self) -> _core.FrictionLaw:
        """The C++ twin of this law."""

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the C++ twin, which is made again: what pickle and copy take."""
        return {k: v for k, v in self.__dict__.items() if k != "core"}

    def coefficient(self, slip_speed: float) -> float:
        """Return mu of steady sliding at `slip_speed` [m/s] >= 0."""
        value: float = self.core.coefficient(check_not_negative("slip_speed", slip_speed, "m/s"))
        return value


@dataclass(frozen=True)
class CoulombFriction(Friction):
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
        _check_coefficients(self.mu_static, self.mu_dynamic)
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

    @cached_property
    def core(self) -> _core.FrictionLaw:
        """The C++ twin of this object."""
        return _core.FrictionLaw.two_velocity(
            self.mu_static, self.mu_dynamic, self.v_static, self.v_dynamic
        )


@dataclass(frozen=True)
class BristleFriction(Friction):
    """Friction that sticks: an elastic, perfectly plastic spring between sphere and shell.

    Below the limit mu N the tangential force is that of a spring of `stiffness` [N/m] with
    `damping` [N s/m], stretched since the touch, and nothing creeps; at the limit the sphere
    slides, with mu = mu_dynamic + (mu_static - mu_dynamic) exp(-(slip / v_stribeck)^2). The stretch
    belongs to the contact, in the shell's frame, and goes with it over elements and smooth edges.

    `torsional`: the contact also resists a spin about its normal, as a soft finger does, up to the
    moment 3 pi / 16 mu N a of Hertz's pressure, a = sqrt(radius depth); force and moment share the
    limit, (force / mu N)^2 + (moment / limit)^2 <= 1.

    Sources: Dupont, Hayward, Armstrong, Altpeter, IEEE Trans. Automatic Control 47 (2002) 787;
    Howe and Cutkosky, Int. J. Robotics Research 15 (1996) 557; Johnson, Contact Mechanics, 1985.
    """

    mu_static: float
    mu_dynamic: float
    stiffness: float
    damping: float = 0.0
    v_stribeck: float = 0.01
    torsional: bool = False

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value outside its range."""
        _check_coefficients(self.mu_static, self.mu_dynamic)
        check_positive("stiffness", self.stiffness, "N/m")
        check_not_negative("damping", self.damping, "N s/m")
        check_positive("v_stribeck", self.v_stribeck, "m/s")
        check_type("torsional", self.torsional, bool, "must be True or False")

    @cached_property
    def core(self) -> _core.FrictionLaw:
        """The C++ twin of this object."""
        return _core.FrictionLaw.bristle(
            self.mu_static,
            self.mu_dynamic,
            self.stiffness,
            self.damping,
            self.v_stribeck,
            self.torsional,
        )


def _check_coefficients(mu_static: float, mu_dynamic: float) -> None:
    check_not_negative("mu_static", mu_static)
    check_not_negative("mu_dynamic", mu_dynamic)
    if mu_dynamic > mu_static:
        raise InvalidParameter(
            "mu_dynamic", mu_dynamic, f"must not exceed mu_static = {mu_static!r}"
        )


def check_friction(friction: Any) -> None:
    """Raise InvalidParameter unless `friction` is a friction law, or None."""
    if friction is not None:
        check_type(
            "friction", friction, Friction, "must be a CoulombFriction, a BristleFriction or None"
        )
