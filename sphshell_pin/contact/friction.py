"""Tangential force of one contact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from sphshell_pin import _core
from sphshell_pin.base.checks import check_not_negative, check_positive, check_type
from sphshell_pin.base.parameters import Component, parameter, same_parameter
from sphshell_pin.contact import materials
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
        pair = materials.friction_between(
            materials.find_material(sphere), materials.find_material(shell)
        )
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


# Bristles stick below this part of Stribeck's speed: almost nothing moves.
STICKING_SHARE = 0.01
# As many as the compiled core knows.
MOST_RINGS = 8


@dataclass(frozen=True)
class BristleFriction(Coefficients, kind="bristle"):
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

    Parameters
    ----------
    stiffness : k of the spring: at the limit it has given way by mu_static N / k
    damping : c beside the spring: about `sqrt(k m)`, with the mass m along the surface
    v_stribeck : slip speed at which mu has come down from `mu_static` by 63 % of the way to
        `mu_dynamic`
    torsional : True: also against spin about the normal, as a soft finger
    """

    stiffness: float = parameter(above=0, unit="N/m", label="bristle stiffness")
    damping: float = parameter(0.0, at_least=0, unit="N s/m", label="bristle damping")
    v_stribeck: float = parameter(0.01, above=0, unit="m/s", label="Stribeck speed")
    torsional: bool = parameter(False)

    @property
    def text(self) -> str:
        """Parameters in one line."""
        spin = ", and against spin" if self.torsional else ""
        return (
            f"coefficient {self.mu_static:g} at rest, {self.mu_dynamic:g} beyond "
            f"{self.v_stribeck:g} m/s; sticks with {self.stiffness:.4g} N/m, damping "
            f"{self.damping:.4g} N s/m{spin}; the stretch is a state of the contact"
        )

    @property
    def sticking_speed(self) -> float:
        """Slip speed [m/s] below which almost nothing moves."""
        return STICKING_SHARE * self.v_stribeck

    def slip_time(self, mass: float, load: float, disc: float) -> float:
        """Return half a period of the spring, or 20 times its decay if that is shorter [s]."""
        return _spring_time(mass, self.stiffness, self.damping)


@dataclass(frozen=True)
class MindlinFriction(materials.TwoMaterials, Coefficients, kind="mindlin"):
    """Friction that sticks with the stiffness of two elastic bodies, after Mindlin.

    As BristleFriction, but the spring follows from the materials and the present disc of contact,
    of radius a = sqrt(radius depth): k = 8 G* a, 1/G* = (2 - nu_1)/G_1 + (2 - nu_2)/G_2, with the
    shear moduli G = E / (2 (1 + nu)). While the bodies approach, the force is kept (the new rim of
    the disc carries none of it); while they part, it falls with k. So no path in load and slip
    gains energy. With one of `rings` all of the disc sticks or slips at once; with several each of
    them for itself, so that micro-slip grows inwards from the rim.

    `torsional`: against spin about the normal the stiffness is 16/3 G a^3, 1/G = 1/G_1 + 1/G_2,
    with the limit that BristleFriction has. `rolling`: against rolling the moment is
    `rolling` radius N; below `rolling_speed` it is regularized, and creeps.

    Sources: Mindlin, J. Appl. Mech. 16 (1949) 259; Johnson, Contact Mechanics (1985), ch. 7;
    Thornton, Cummins, Cleary, Powder Technology 233 (2013) 30; Elata and Berryman, Mechanics of
    Materials 24 (1996) 229.

    Parameters
    ----------
    damping_time : of a damper beside the spring, `damping_time` times as large as the spring is
        stiff: 2 / omega damps a motion at omega [rad/s] critically
    rolling : moment against rolling, over the sphere's radius and the normal force
    rolling_speed : speed of rolling, radius times rad/s, from which on it is whole; below, it
        creeps
    rings : 1 to 8: of the disc, each with a state; for micro-slip
    """

    v_stribeck: float = same_parameter(BristleFriction, "v_stribeck")
    damping_time: float = parameter(0.0, at_least=0, unit="s", label="damping time")
    torsional: bool = same_parameter(BristleFriction, "torsional")
    rolling: float = parameter(0.0, at_least=0, label="rolling friction")
    rolling_speed: float = parameter(1e-3, above=0, unit="m/s", label="rolling friction speed")
    rings: int = parameter(1, at_least=1, at_most=MOST_RINGS)

    @classmethod
    def of(cls, sphere: str, shell: str, **more: Any) -> Self:
        """Build from two names of MATERIALS, with `more` parameters."""
        return super().of(sphere, shell, **materials.elastic_numbers(sphere, shell) | more)

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value outside its bounds."""
        super().__post_init__()
        must = f"must be a whole number in [1, {MOST_RINGS}]"
        check_type("rings", self.rings, int, must)
        if isinstance(self.rings, bool) or not 1 <= self.rings <= MOST_RINGS:
            raise InvalidParameter("rings", self.rings, must)

    def tangential_stiffness(self, disc: float) -> float:
        """Return 8 G* a [N/m] on a disc of contact of the radius a = `disc` [m]."""
        return self._moduli[1] * check_not_negative("disc", disc, "m")

    def torsional_stiffness(self, disc: float) -> float:
        """Return 16/3 G a^3 [N m/rad] on a disc of contact of the radius a = `disc` [m]."""
        return self._moduli[2] * check_not_negative("disc", disc, "m") ** 3

    @property
    def state_size(self) -> int:
        """Three numbers for each ring."""
        return 3 * self.rings

    @property
    def needs_radius(self) -> bool:
        """True: the disc of contact depends on it."""
        return True

    @property
    def text(self) -> str:
        """Parameters in one line."""
        spin = ", and against spin" if self.torsional else ""
        rolling = f"; {self.rings} rings of the disc slip apart" if self.rings > 1 else ""
        if self.rolling:
            rolling += (
                f"; rolling friction {self.rolling:g} from {self.rolling_speed:g} m/s, creeps below"
            )
        return (
            f"Mindlin, coefficient {self.mu_static:g} at rest, {self.mu_dynamic:g} beyond "
            f"{self.v_stribeck:g} m/s; sticks with {self._moduli[1]:.4g} N/m per m of the "
            f"disc's radius, damping time {self.damping_time:g} s{spin}{rolling}; the force is a "
            "state of the contact"
        )

    @property
    def sticking_speed(self) -> float:
        """Slip speed [m/s] below which almost nothing moves."""
        return STICKING_SHARE * self.v_stribeck

    def slip_time(self, mass: float, load: float, disc: float) -> float:
        """Return half a period of the spring, or 20 times its decay if that is shorter [s]."""
        stiffness = self._moduli[1] * disc
        times = [_spring_time(mass, stiffness, self.damping_time * stiffness)]
        if self.rolling and load > 0:
            decay = mass * self.rolling_speed / (1.5 * self.rolling * load)
            times.append(DECAYS_PER_PERIOD * decay)
        return min(times)


def _spring_time(mass: float, stiffness: float, damping: float) -> float:
    """Return half a period, or 20 times the decay if that is shorter [s]."""
    if not stiffness > 0:
        return math.inf
    times = [math.pi * math.sqrt(mass / stiffness)]
    if damping:
        times.append(DECAYS_PER_PERIOD * mass / damping)
    return min(times)
