"""The materials of sphere and shell, as the laws take them that compute a stiffness from them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from sphshell_pin.parameters import parameter


@dataclass(frozen=True)
class TwoMaterials:
    """Young's modulus and Poisson's ratio of sphere and shell, and the moduli of the contact."""

    young: float = parameter(
        above=0, unit="Pa", label="Young's modulus", help="Young's modulus of the sphere"
    )
    poisson: float = parameter(
        above=-1, at_most=0.5, label="Poisson's ratio", help="Poisson's ratio of the sphere"
    )
    young_2: float | None = parameter(
        None,
        above=0,
        unit="Pa",
        label="Young's modulus 2",
        help="Young's modulus of the shell; without it that of the sphere",
    )
    poisson_2: float | None = parameter(
        None,
        above=-1,
        at_most=0.5,
        label="Poisson's ratio 2",
        help="Poisson's ratio of the shell; without it that of the sphere",
    )

    @property
    def _both(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Young's modulus [Pa] and Poisson's ratio of the sphere, and those of the shell."""
        return (self.young, self.poisson), (
            self.young if self.young_2 is None else self.young_2,
            self.poisson if self.poisson_2 is None else self.poisson_2,
        )

    @cached_property
    def modulus(self) -> float:
        """The effective modulus E* [Pa]: 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2."""
        return 1 / sum((1 - nu**2) / young for young, nu in self._both)

    @cached_property
    def _shear_moduli(self) -> tuple[float, float]:
        """8 G* and 16/3 G [Pa]: 1/G* = sum of (2 - nu)/G_k, 1/G = sum of 1/G_k, over both."""
        softness = [2 * (1 + nu) / young for young, nu in self._both]
        tangential = sum((2 - nu) * s for s, (_, nu) in zip(softness, self._both, strict=True))
        return 8 / tangential, 16 / 3 / sum(softness)
