"""An elastic foundation over the true overlap of a sphere with a shell."""

import math
from dataclasses import dataclass

import numpy.typing as npt

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_positive, check_type, check_vector, read_only
from sphshell_pin.base.parameters import parameter
from sphshell_pin.contact.laws import HuntCrossleyLaw
from sphshell_pin.contact.normal_law import NormalLaw
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.shell.contact_set import Method
from sphshell_pin.shell.shell import Shell


@dataclass(frozen=True)
class FoundationLaw(NormalLaw, kind="foundation"):
    """Elastic foundation: a pressure wherever the sphere overlaps the body behind the shell.

    At a distance rho from the center of a sphere of radius R the pressure is

        p = modulus / thickness (R^2 - rho^2) / (2 rho),

    about modulus times the local overlap over the thickness. The force is the integral of p along
    the shell's normal, minus the gradient of the integral of p over the overlap. On a plane it is
    modulus / thickness pi depth^2 (R - depth / 3), the volume of the overlap times modulus over
    thickness. `dissipation` b [s/m]: the pressure is p (1 - b gap_rate), not below 0, with the gap
    rate of each point. The shell is rigid, the layer of this `modulus` [Pa] and `thickness` [m] is
    on the sphere: Johnson, Contact Mechanics (1985), 4.3.

    Beside a Plane the layer is on the plane, and the pressure is modulus / thickness times the
    depth below it: the force is modulus / thickness times the volume below the plane, at its
    centroid.

    Parameters
    ----------
    modulus : E of the layer where it may flow aside; where it may not, `E (1 - nu) / ((1 + nu) (1 -
        2 nu))`
    thickness : of the elastic layer, for a solid sphere about its radius
    dissipation : b: 0 gives back all energy, as of `HuntCrossleyLaw`
    """

    modulus: float = parameter(above=0, unit="Pa")
    thickness: float = parameter(above=0, unit="m")
    dissipation: float = parameter(0.0, at_least=0, unit="s/m")

    needs_shape = True

    def on_plane(self, radius: float) -> NormalLaw:
        """Return the law of a sphere of `radius` [m] on a plane, by its depth alone."""
        numbers = self.modulus, self.thickness, self.dissipation
        return _OnPlane(*numbers, check_positive("radius", radius, "m"))

    def on_face(self, area: float) -> NormalLaw:
        """Return the law of a flat face of `area` [m^2] that lies on a plane, by its depth."""
        stiffness = self.modulus / self.thickness * check_positive("area", area, "m^2")
        return HuntCrossleyLaw(stiffness, 1.0, self.dissipation)

    def _numbers(self) -> list[float]:
        """Return the parameters and no radius, as the compiled core takes them."""
        return [self.modulus, self.thickness, self.dissipation, 0.0]

    @property
    def _shapeless_binding(self) -> _core.NormalLaw:
        """Raise InvalidParameter: without a radius and a shell there is no overlap."""
        must = "needs a shell beside a sphere or a plane: take law.on_plane(radius)"
        raise InvalidParameter("law", self, must)

    @property
    def text(self) -> str:
        """Name and parameters in one line."""
        damping = f"dissipation {self.dissipation:.4g} s/m" if self.dissipation else "undamped"
        return (
            f"elastic foundation, modulus {self.modulus:.4g} Pa, "
            f"thickness {self.thickness * 1e3:.4g} mm, {damping}"
        )


@dataclass(frozen=True)
class _OnPlane(FoundationLaw):
    """The law of a sphere on a plane."""

    radius: float = 1.0

    needs_shape = False

    def on_plane(self, radius: float) -> NormalLaw:
        return self

    def _numbers(self) -> list[float]:
        return [self.modulus, self.thickness, self.dissipation, self.radius]

    @property
    def _shapeless_binding(self) -> _core.NormalLaw:
        return self._binding

    # Deeper than the radius the closed form ends; what cannot stop the sphere comes out deeper.
    def depth_at(self, force: float) -> float:
        most = self.normal_force(self.radius)
        return super().depth_at(force) if force <= most else self.radius * force / most

    def depth_of(self, energy: float) -> float:
        most = self.energy(self.radius)
        return super().depth_of(energy) if energy <= most else self.radius * energy / most

    def contact_time(self, depth: float, speed: float) -> float:
        return super().contact_time(min(depth, self.radius), speed)

    def decay_time(self, mass: float, depth: float) -> float:
        damping = self.normal_force(depth) * self.dissipation
        return mass / damping if damping else math.inf


def foundation_pressure(
    shell: Shell, center: npt.ArrayLike, radius: float, law: FoundationLaw, method: str = "smooth"
) -> tuple[Array, Array, Array, Array]:
    """Return where a FoundationLaw presses, by quadrature points on the shell.

    Parameters
    ----------
    shell : Shell
    center : (3,) of the sphere, in the shell's frame [m]
    radius : of the sphere [m]
    law : FoundationLaw; its dissipation does not count
    method : "smooth" (curved elements) or "facets"

    Returns
    -------
    points : (n, 3) in the shell's frame [m]
    forces : (n, 3) on the sphere [N]; they add up to the force of the contact
    pressures : (n,) [Pa]
    areas : (n,) [m^2]; 0 where a sheet ends: there the potential has a force along its border

    Raises
    ------
    InvalidParameter, NameNotFound
        If center or radius is out of range, the law is another one, or the method unknown.
    """
    place = check_vector("center", center, 3, " [m]")
    size = check_positive("radius", radius, "m")
    check_type("law", law, FoundationLaw, "must be a FoundationLaw")
    number = Method.from_name(method)
    found = _core.Foundation().find(shell.core_for(method), place, size, int(number), True)
    points, _, areas, pressures, forces, _ = found[1]
    stiffness = law.modulus / law.thickness
    columns = points, stiffness * forces, stiffness * pressures, areas
    for column in columns:
        read_only(column)
    return columns
