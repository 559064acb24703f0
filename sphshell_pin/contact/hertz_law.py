"""Hertz's law from materials, and how a file states it."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path

from sphshell_pin import _core
from sphshell_pin.base.parameters import parameter
from sphshell_pin.contact import materials
from sphshell_pin.contact.laws import HuntCrossleyLaw, ImpactLaw, dissipation_for
from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.errors import InvalidParameter


@dataclass(frozen=True)
class HertzLaw(materials.TwoMaterials, NormalLaw, kind="hertz"):
    """Hertz's law from materials: the force follows from the curvatures of sphere and shell.

    force = E* scale depth^1.5 with 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2; `young` [Pa] and
    `poisson` of the sphere, `young_2` and `poisson_2` of the shell (by default of the same
    material); of two names of MATERIALS see `of`. `scale` [m^0.5] depends on the radius of the
    sphere and the two principal curvatures of the shell at the contact, by the elliptic integrals
    of Johnson, Contact Mechanics (1985), 4.26; on a plane it is 4/3 sqrt(radius). Where it changes
    along the shell there is a force along the shell as well, as the elastic energy
    2/5 force depth changes.

    Damping: by `restitution` at an impact `speed` [m/s], after Hunt and Crossley (J. Appl. Mech. 42
    (1975) 440), or by the `loss_tangent` of a viscoelastic material at a `frequency` [Hz], after
    Kuwabara and Kono (Jpn. J. Appl. Phys. 26 (1987) 1230): 1.5 tau E* scale depth^0.5 times the
    closing speed, tau = loss_tangent / (2 pi frequency). By default none.

    `radius` [m]: gives the constant stiffness of a sphere on a plane; see on_plane.

    Parameters
    ----------
    restitution : speed of rebound over `speed`; without it no damping
    speed : impact speed at which the restitution holds
    loss_tangent : tangent of the loss angle at `frequency`, in place of a restitution
    frequency : frequency at which the loss tangent holds
    radius : radius of the sphere, for the constant stiffness of a sphere on a plane; without it the
        stiffness follows the curvature of the surface at the contact
    """

    restitution: float | None = parameter(None, above=0, at_most=1)
    speed: float | None = parameter(None, above=0, unit="m/s", label="speed of the restitution")
    loss_tangent: float | None = parameter(None, above=0)
    frequency: float | None = parameter(None, above=0, unit="Hz")
    radius: float | None = parameter(None, above=0, unit="m")

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value outside its bounds, and for one of a pair."""
        super().__post_init__()
        for one, other in (("restitution", "speed"), ("loss_tangent", "frequency")):
            pair = getattr(self, one), getattr(self, other)
            if (pair[0] is None) != (pair[1] is None):
                must = "must be given together, or neither"
                raise InvalidParameter(f"{one}, {other}", pair, must)
        if self.restitution is not None and self.loss_tangent is not None:
            must = "must not be given with a restitution: either states the damping"
            raise InvalidParameter("loss_tangent", self.loss_tangent, must)

    @classmethod
    def of(cls, sphere: str, shell: str, **more: float) -> HertzLaw:
        """Build from two names of MATERIALS, with `more` parameters.

        Where these state no damping, the restitution is that of the materials at 1 m/s.
        """
        stated = materials.elastic_numbers(sphere, shell)
        if not more.keys() & {"restitution", "speed", "loss_tangent", "frequency"}:
            pair = materials.find_material(sphere), materials.find_material(shell)
            stated |= {"restitution": materials.restitution_between(*pair), "speed": 1.0}
        return cls(**stated | more)

    @cached_property
    def dissipation(self) -> float:
        """Hunt and Crossley's b [s/m]."""
        if self.restitution is None or self.speed is None:
            return 0.0
        return dissipation_for(self.restitution, self.speed)

    @property
    def relaxation_time(self) -> float:
        """The time tau [s] of the viscoelastic material."""
        if self.loss_tangent is None or self.frequency is None:
            return 0.0
        return self.loss_tangent / (2 * math.pi * self.frequency)

    @property
    def needs_shape(self) -> bool:
        """Whether the force depends on the shell's curvature: unless there is a `radius`."""
        return self.radius is None

    def on_plane(self, radius: float) -> NormalLaw:
        """Return the law with the constant stiffness of a sphere of `radius` [m] on a plane.

        It is an ImpactLaw, a HuntCrossleyLaw with a restitution, and a HertzLaw with a loss
        tangent.
        """
        stiffness = 4 / 3 * self.modulus * math.sqrt(radius)
        if self.relaxation_time:
            return replace(self, radius=radius)
        if self.restitution is None or self.speed is None:
            return ImpactLaw(stiffness, 1.5)
        return HuntCrossleyLaw.with_restitution(stiffness, 1.5, self.restitution, self.speed)

    def _numbers(self) -> list[float]:
        """Return the materials, b, tau and the radius, or 0, as the compiled core takes them."""
        damping = self.dissipation, self.relaxation_time
        return [*super()._numbers()[:4], *damping, self.radius or 0.0]

    @property
    def _shapeless_binding(self) -> _core.NormalLaw:
        """The C++ binding; InvalidParameter without `radius`: the gap is not known."""
        if self.needs_shape:
            must = "must be given where nothing is touched: take law.on_plane(radius)"
            raise InvalidParameter("radius", None, must)
        return self._binding

    @property
    def text(self) -> str:
        """Name and parameters in one line."""
        damping = "undamped"
        if self.restitution is not None:
            damping = f"restitution {self.restitution:g} at {self.speed:g} m/s"
        elif self.loss_tangent is not None:
            damping = f"loss tangent {self.loss_tangent:g} at {self.frequency:g} Hz"
        where = (
            "of the curvatures of sphere and shell"
            if self.radius is None
            else f"of a sphere of {self.radius * 1e3:.4g} mm on a plane"
        )
        return f"Hertz, E* {self.modulus:.4g} Pa, {where}, {damping}"

    def decay_time(self, mass: float, depth: float) -> float:
        """Return the time [s] in which damping at `depth` [m] slows `mass` [kg] down by e."""
        relaxation = 1.5 * self.relaxation_time / depth + self.dissipation if depth else 0.0
        damping = self.normal_force(depth) * relaxation
        return mass / damping if damping else math.inf


@dataclass(frozen=True)
class Hertz(HertzLaw, kind="hertz", of=NormalLaw):
    """Hertz's law as a scenario states it, see HertzLaw; with a radius see ImpactLaw.hertz.

    Parameters
    ----------
    radius : of a constant stiffness: radius of the ball, or the effective one; without it the
        stiffness follows from the sphere and the curvature of what it touches
    radius_2 : radius of the second body where it is a ball, too; without it a half-space
    """

    radius: float | None = parameter(None, above=0, unit="m", label="Hertz radius")
    radius_2: float | None = parameter(None, above=0, unit="m", label="Hertz radius 2")

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value outside its bounds, and for one of a pair."""
        super().__post_init__()
        if self.radius is None and self.radius_2 is not None:
            raise InvalidParameter("radius_2", self.radius_2, "must be given with radius, or left")

    def _build(self, folder: Path = Path()) -> NormalLaw:
        """Return the law; with a radius a constant one, of Hunt and Crossley with a restitution."""
        values = {one.name: getattr(self, one.name) for one in fields(HertzLaw)}
        law = HertzLaw(**values | {"radius": None})
        if self.radius is None:
            return law
        radius = self.radius
        if self.radius_2 is not None:
            radius *= self.radius_2 / (radius + self.radius_2)
        return law.on_plane(radius)
