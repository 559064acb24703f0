"""Base of the normal laws: the force of one contact, from depth and gap rate."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np

from sphshell_pin import _core
from sphshell_pin.base.checks import check_finite, check_type
from sphshell_pin.base.parameters import Component
from sphshell_pin.errors import InvalidParameter, SphshellError

# Decay times that need as many steps as one period of an oscillation.
DECAYS_PER_PERIOD = 20


class NormalLaw(Component):
    """Base of the normal laws: `core`, the C++ binding, computes the forces.

    A law gives `kind`, its parameters, `text`, and `decay_time` if it has damping. What else is
    asked of it follows from force and energy; a law overrides what has a closed form.
    """

    @cached_property
    def _binding(self) -> _core.NormalLaw:
        """The C++ binding of this law."""
        return _core.NormalLaw(self.kind, self._numbers())

    @property
    def _shapeless_binding(self) -> _core.NormalLaw:
        """The C++ binding, where depth and gap rate are all that is known."""
        return self._binding

    @property
    def text(self) -> str:
        """Name and parameters in one line."""
        raise NotImplementedError

    @property
    def needs_shape(self) -> bool:
        """Whether the force depends on the shell's curvature, besides depth and gap rate."""
        return False

    def on_plane(self, radius: float) -> NormalLaw:
        """Return the law of a sphere of `radius` [m] on a plane: itself, if it is the same."""
        return self

    @property
    def has_damping(self) -> bool:
        """Whether the force depends on the gap rate."""
        return self._binding.needs_rate

    def normal_force(self, depth: float, gap_rate: float = 0.0) -> float:
        """Return the push [N] at `depth` [m] (0 where not positive) and `gap_rate` [m/s].

        gap_rate = normal . relative velocity: negative while the bodies close.
        """
        return self._shapeless_binding.force(
            check_finite("depth", depth), check_finite("gap_rate", gap_rate)
        )

    def normal_stiffness(self, depth: float) -> float:
        """Return the slope of the elastic force at `depth` [m], in N/m (0 where not positive)."""
        return self._shapeless_binding.stiffness(check_finite("depth", depth))

    def energy(self, depth: float) -> float:
        """Return the elastic energy [J] stored at `depth` [m]."""
        return self._shapeless_binding.energy(check_finite("depth", depth))

    def depth_at(self, force: float) -> float:
        """Return the depth [m] at which the elastic part alone carries `force` [N]."""
        return inverse(self.normal_force, force)

    def depth_of(self, energy: float) -> float:
        """Return the depth [m] at which the elastic part has stored `energy` [J]."""
        return inverse(self.energy, energy)

    def contact_time(self, depth: float, speed: float) -> float:
        """Return the duration [s] of an undamped impact at `speed` [m/s] down to `depth` [m].

        It is 2 / speed times the integral of dx / sqrt(1 - energy(x) / energy(depth)) from 0 to
        `depth`, here by Gauss's rule after x = depth (1 - s^2), which removes the singularity.
        """
        nodes, weights = np.polynomial.legendre.leggauss(40)
        s = 0.5 * (1.0 + nodes)
        stored = np.array([self.energy(depth * (1.0 - one * one)) for one in s])
        integrand = s / np.sqrt(1.0 - stored / self.energy(depth))
        return float(2.0 * depth / speed * (weights @ integrand))

    def decay_time(self, mass: float, depth: float) -> float:
        """Return the time [s] in which damping at `depth` [m] slows `mass` [kg] down by e."""
        return math.inf

    def shortest_time(self, mass: float, speed: float, load: float) -> float:
        """Return the shortest time scale [s] of `mass` [kg].

        It is the shortest of an impact at `speed` [m/s], half an oscillation under `load` [N], and
        the decay by damping: a decay needs fewer steps than an oscillation.
        """
        depth = self.depth_of(0.5 * mass * speed**2)
        times = [self.contact_time(depth, speed), DECAYS_PER_PERIOD * self.decay_time(mass, depth)]
        stiffness = self.normal_stiffness(self.depth_at(load)) if load > 0 else 0.0
        if stiffness > 0:  # not of a law that cannot carry the load
            times.append(math.pi * math.sqrt(mass / stiffness))
        return min(times)


def check_law(law: object, shapeless: str = "") -> NormalLaw:
    """Return `law`; raise InvalidParameter unless it is a normal law.

    `shapeless` names where nothing is known about the shape of the gap; there a law that needs it
    is refused.
    """
    must = (
        "must be a law of this package, for instance ImpactLaw(stiffness); a law of your own is "
        "FunctionLaw(function), a force-depth curve TableLaw(depth, force): see docs/laws.md"
    )
    good = check_type("law", law, NormalLaw, must)
    if shapeless and good.needs_shape:
        must = f"must not need the curvature of a shell {shapeless}: take law.on_plane(radius)"
        raise InvalidParameter("law", good, must)
    return good


def inverse(function: Callable[[float], float], value: float) -> float:
    """Return where the increasing `function` with function(0) = 0 has `value`, 0 if that is < 0."""
    if value <= 0:
        return 0.0
    high = 1e-6
    while function(high) < value:
        high *= 2
        if high > 1e12:
            what = function.__name__.replace("_", " ")
            said = f"the {what} of a law stays below {value:.4g} at any depth"
            raise SphshellError(f"{said}: it must grow with the depth")
    return bisect(lambda x: function(x) - value, 0.0, high)


def bisect(function: Callable[[float], float], low: float, high: float) -> float:
    """Return to the last bit where the increasing `function` changes its sign."""
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if function(middle) < 0 else (low, middle)
    return 0.5 * (low + high)
