"""Friction that sticks: springs between sphere and shell, whose stretch is a state."""

import math
from dataclasses import dataclass
from typing import Any, Self

from sphshell_pin.base.checks import check_not_negative, check_type
from sphshell_pin.base.parameters import parameter, same_parameter
from sphshell_pin.contact.friction import Coefficients
from sphshell_pin.contact.materials import TwoMaterials, elastic_numbers
from sphshell_pin.contact.normal_law import DECAYS_PER_PERIOD
from sphshell_pin.errors import InvalidParameter

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
class MindlinFriction(TwoMaterials, Coefficients, kind="mindlin"):
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
        return super().of(sphere, shell, **elastic_numbers(sphere, shell) | more)

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
