"""The normal laws: a class for each law, and for each other form in which it may be stated."""

from __future__ import annotations

import csv
import itertools
import math
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from sphshell_pin.checks import check_vector
from sphshell_pin.contact.normal_law import NormalLaw, bisect
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.parameters import Ingredient, parameter
from sphshell_pin.units import (
    adams_damping_to_si,
    adams_length_to_si,
    adams_stiffness_to_si,
    adams_units,
)

__all__ = ["HuntCrossleyLaw", "ImpactLaw", "TableLaw"]


@dataclass(frozen=True)
class _PowerLaw(NormalLaw):
    """A law whose elastic part is stiffness depth^exponent."""

    stiffness: float = parameter(
        above=0,
        unit="N/m^{0.exponent:g}",
        help="k, from a load F and the depth you accept under it: `k = F / depth^exponent`; a few "
        "percent of the radius is much",
    )
    exponent: float = parameter(
        1.5,
        above=0,
        help="e: 1.5 for a ball on an elastic surface (Hertz), 1 for a linear spring; ADAMS's "
        "default is 2.2 (`from_adams`)",
    )

    def depth_at(self, force: float) -> float:
        """Return the depth [m] at which the elastic part alone carries `force` [N]."""
        return float((max(force, 0.0) / self.stiffness) ** (1 / self.exponent))

    def depth_of(self, energy: float) -> float:
        """Return the depth [m] at which the elastic part has stored `energy` [J]."""
        power = self.exponent + 1
        return float((power * energy / self.stiffness) ** (1 / power))

    def contact_time(self, depth: float, speed: float) -> float:
        """Return the duration [s] of an undamped impact at `speed` [m/s] down to `depth` [m]."""
        power = self.exponent + 1
        # Integral of du / sqrt(1 - u^power) from 0 to 1.
        half = math.sqrt(math.pi) * math.gamma(1 + 1 / power) / math.gamma(0.5 + 1 / power)
        return 2 * depth / speed * half

    @property
    def _stiffness_text(self) -> str:
        return f"stiffness {self.stiffness:.4g} {self.unit_of('stiffness')}"


@dataclass(frozen=True)
class ImpactLaw(_PowerLaw, kind="impact"):
    """ADAMS's IMPACT: max(0, k depth^e - STEP(depth, 0, 0, d, c) gap_rate).

    `stiffness` k > 0 [N/m^e], `exponent` e > 0, `damping` c >= 0 [N s/m], which is reached at
    `full_damping_depth` d > 0 [m]. Source: ADAMS/Solver help, IMPACT.
    """

    damping: float = parameter(
        0.0,
        at_least=0,
        unit="N s/m",
        help="c: 0 gives back all energy. Restitution depends on speed and mass: find c by a drop "
        "test",
    )
    full_damping_depth: float = parameter(
        1e-4,
        above=0,
        unit="m",
        help="d: about the depth under load; damping comes on gradually up to it, so that the "
        "force starts from zero",
    )

    @classmethod
    def from_adams(
        cls,
        k: float = 1e5,
        e: float = 2.2,
        c: float = 10.0,
        d: float = 0.1,
        units: str = "mm-N-s",
    ) -> ImpactLaw:
        """Build from ADAMS's numbers, by default its defaults, in the system `units`.

        The stiffness is per length^e, so it converts by (meters per length)^-e: 1000^e from mm.
        """
        return AdamsImpact(k, e, c, d, units).made()

    @staticmethod
    def hertz(
        radius: float,
        young_1: float,
        poisson_1: float,
        young_2: float,
        poisson_2: float,
        restitution: float | None = None,
        speed: float | None = None,
        *,
        radius_2: float | None = None,
    ) -> ImpactLaw | HuntCrossleyLaw:
        """Build Hertz's law of a sphere of `radius` [m] on a plane: k = 4/3 E* sqrt(r), e = 3/2.

        Of two spheres `radius_2` [m] is that of the second, and 1/r = 1/radius + 1/radius_2.

        1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2 (Johnson, Contact Mechanics, 4.22); Young's
        moduli in Pa. Without `restitution` the law is undamped. With `restitution` at the impact
        `speed` [m/s] it is a HuntCrossleyLaw: there restitution does not depend on the mass, in
        IMPACT it does.
        """
        return Hertz(
            radius, young_1, poisson_1, young_2, poisson_2, restitution, speed, radius_2
        ).made()

    @property
    def text(self) -> str:
        """Name and parameters in one line."""
        if not self.damping:
            return f"IMPACT, {self._stiffness_text}, undamped"
        return (
            f"IMPACT, {self._stiffness_text}, damping {self.damping:.4g} N s/m from "
            f"{self.full_damping_depth * 1e3:.4g} mm"
        )

    def decay_time(self, mass: float, depth: float) -> float:
        """Return the time [s] in which damping at `depth` [m] slows `mass` [kg] down by e."""
        share = min(depth / self.full_damping_depth, 1.0)
        damping = self.damping * share * share * (3 - 2 * share)
        return mass / damping if damping else math.inf


@dataclass(frozen=True)
class HuntCrossleyLaw(_PowerLaw, kind="hunt-crossley"):
    """Hunt and Crossley's law: max(0, k depth^e (1 - b gap_rate)).

    `stiffness` k > 0 [N/m^e], `exponent` e > 0, `dissipation` b >= 0 [s/m]. The restitution at
    impact speed v depends on b v alone. Source: Hunt and Crossley, J. Appl. Mech. 42 (1975) 440.
    """

    dissipation: float = parameter(
        0.0,
        at_least=0,
        unit="s/m",
        help="b, from the restitution wanted at an impact speed: "
        "`ImpactLaw.hertz(..., restitution=, speed=)` computes it",
    )

    @classmethod
    def with_restitution(
        cls, stiffness: float, exponent: float, restitution: float, speed: float
    ) -> HuntCrossleyLaw:
        """Build the law that throws back at `restitution` times an impact speed of `speed` [m/s].

        The mass does not matter (Hunt and Crossley 1975).
        """
        return cls(stiffness, exponent, _dissipation_for(restitution, speed))

    @property
    def text(self) -> str:
        """Name and parameters in one line."""
        return f"Hunt-Crossley, {self._stiffness_text}, dissipation {self.dissipation:.4g} s/m"

    def decay_time(self, mass: float, depth: float) -> float:
        """Return the time [s] in which damping at `depth` [m] slows `mass` [kg] down by e."""
        damping = self.stiffness * depth**self.exponent * self.dissipation
        return mass / damping if damping else math.inf


@dataclass(frozen=True)
class TableLaw(NormalLaw, kind="table"):
    """Elastic force from a table, such as a measured one: no damping.

    `depth` (k,) [m] and `force` (k,) [N] start at zero and increase. Between them the force is the
    monotone cubic Hermite interpolant (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238),
    with a continuous slope; beyond the last row it is linear, with the last slope. The energy is
    its exact integral.
    """

    depth: tuple[float, ...] = parameter(unit="m", help="depths, from 0, increasing")
    force: tuple[float, ...] = parameter(unit="N", help="elastic force at each of them, from 0")

    def __post_init__(self) -> None:
        """Raise InvalidParameter unless the columns start at zero and increase."""
        for name in ("depth", "force"):
            given = getattr(self, name)
            rows = len(given) if hasattr(given, "__len__") else 0
            column = check_vector(name, given, rows).tolist()
            object.__setattr__(self, name, tuple(column))
            if rows < 2:
                raise InvalidParameter(name, given, "must have at least 2 rows")
            if column[0] != 0:
                raise InvalidParameter(f"{name}[0]", column[0], "must be 0: no depth, no force")
            for k, (before, here) in enumerate(itertools.pairwise(column), 1):
                if here <= before:
                    must = f"must be more than the row before, {before!r}"
                    raise InvalidParameter(f"{name}[{k}]", here, must)
        if len(self.depth) != len(self.force):
            raise InvalidParameter(
                "force",
                self.force,
                f"must have as many rows as depth, {len(self.depth)}",
                f"has {len(self.force)} rows,",
            )

    @classmethod
    def from_file(cls, path: str | PathLike[str]) -> TableLaw:
        """Read a csv file of two columns, depth [m] and force [N].

        A header and lines that start with # are left out. InvalidParameter for a file that cannot
        be read, and for its rows as for the arguments.
        """
        try:
            lines = csv.reader(Path(path).read_text(encoding="utf-8").splitlines())
            rows = [(k, row) for k, row in enumerate(lines, 1) if row and row[0].strip()[:1] != "#"]
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise InvalidParameter("file", str(path), f"cannot be read: {error}") from None
        table = []
        for i, (k, row) in enumerate(rows):
            try:
                depth, force = map(float, row)
            except ValueError:
                if i == 0:
                    continue  # the header
                must = f"must hold two numbers in line {k}: depth [m], force [N]"
                raise InvalidParameter("file", str(path), must) from None
            table.append((depth, force))
        try:
            return cls(*zip(*table, strict=True)) if table else cls((), ())
        except InvalidParameter as error:
            raise InvalidParameter("file", str(path), f"is no table of a law: {error}") from None

    def numbers(self) -> list[float]:
        """Return all depths, then all forces, as the compiled core takes them."""
        return [*self.depth, *self.force]

    @property
    def text(self) -> str:
        """Extent in one line."""
        return (
            f"table of {len(self.depth)} rows down to {self.depth[-1] * 1e3:.4g} mm and "
            f"{self.force[-1]:.4g} N, linear beyond, undamped"
        )


@dataclass(frozen=True)
class TableFile(Ingredient, kind="table", of=NormalLaw):
    """A table law as a scenario states it."""

    file: str = parameter(help="csv file of depth [m] and force [N], relative to the scenario")

    @property
    def files(self) -> tuple[str, ...]:
        """The csv file."""
        return (self.file,)

    def made(self, folder: Path = Path()) -> TableLaw:
        """Read the table."""
        return TableLaw.from_file(folder / self.file)


@dataclass(frozen=True)
class AdamsImpact(Ingredient, kind="adams", of=NormalLaw):
    """IMPACT as an ADAMS model states it; the defaults are ADAMS's own."""

    k: float = parameter(
        1e5, above=0, unit="{0.force}/{0.length}^{0.e:g}", label="stiffness", help="stiffness"
    )
    e: float = parameter(2.2, above=0, label="exponent", help="exponent")
    c: float = parameter(
        10.0, at_least=0, unit="{0.force} {0.time}/{0.length}", label="damping", help="damping"
    )
    d: float = parameter(
        0.1,
        above=0,
        unit="{0.length}",
        label="full damping depth",
        help="penetration for full damping",
    )
    units: str = parameter("mm-N-s", help="ADAMS's unit system: length, force, time")

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value outside its bounds or an unknown unit system."""
        super().__post_init__()
        adams_units(self.units)

    @property
    def length(self) -> str:
        """Unit of length."""
        return self.units.split("-")[0]

    @property
    def force(self) -> str:
        """Unit of force."""
        return self.units.split("-")[1]

    @property
    def time(self) -> str:
        """Unit of time."""
        return self.units.split("-")[2]

    def made(self, folder: Path = Path()) -> ImpactLaw:
        """Return the law in SI."""
        return ImpactLaw(
            adams_stiffness_to_si(self.k, self.e, self.units),
            self.e,
            adams_damping_to_si(self.c, self.units),
            adams_length_to_si(self.d, self.units),
        )


@dataclass(frozen=True)
class Hertz(Ingredient, kind="hertz", of=NormalLaw):
    """A ball on an elastic half-space or on another ball, see ImpactLaw.hertz."""

    radius: float = parameter(
        above=0, unit="m", label="Hertz radius", help="radius of the ball, or the effective one"
    )
    young_1: float = parameter(
        above=0, unit="Pa", label="Young's modulus 1", help="Young's modulus of the ball"
    )
    poisson_1: float = parameter(
        above=-1, at_most=0.5, label="Poisson's ratio 1", help="Poisson's ratio of the ball"
    )
    young_2: float = parameter(
        above=0, unit="Pa", label="Young's modulus 2", help="Young's modulus of the half-space"
    )
    poisson_2: float = parameter(
        above=-1, at_most=0.5, label="Poisson's ratio 2", help="Poisson's ratio of the half-space"
    )
    restitution: float | None = parameter(
        None, above=0, at_most=1, help="speed of rebound over `speed`; without it no damping"
    )
    speed: float | None = parameter(
        None,
        above=0,
        unit="m/s",
        label="speed of the restitution",
        help="impact speed at which the restitution holds",
    )
    radius_2: float | None = parameter(
        None,
        above=0,
        unit="m",
        label="Hertz radius 2",
        help="radius of the second body where it is a ball, too; without it a half-space",
    )

    def __post_init__(self) -> None:
        """Raise InvalidParameter for a value outside its bounds, and for one of a pair."""
        super().__post_init__()
        pair = self.restitution, self.speed
        if (pair[0] is None) != (pair[1] is None):
            raise InvalidParameter("restitution, speed", pair, "must be given together, or neither")

    def made(self, folder: Path = Path()) -> ImpactLaw | HuntCrossleyLaw:
        """Return the law of this stiffness, of Hunt and Crossley where a restitution is given."""
        softness = (1 - self.poisson_1**2) / self.young_1 + (1 - self.poisson_2**2) / self.young_2
        radius = self.radius
        if self.radius_2 is not None:
            radius *= self.radius_2 / (radius + self.radius_2)
        stiffness = 4 / 3 / softness * math.sqrt(radius)
        if self.restitution is None or self.speed is None:
            return ImpactLaw(stiffness, 1.5)
        return HuntCrossleyLaw.with_restitution(stiffness, 1.5, self.restitution, self.speed)


def _dissipation_for(restitution: float, speed: float) -> float:
    """Return the dissipation b [s/m] of Hunt-Crossley that rebounds at restitution * `speed`.

    Energy of approach and of rebound are equal where the depth is largest, which gives
    x - ln(1 + x) = -y - ln(1 - y) with x = b v, y = b v restitution; solved by bisection.
    """

    def excess(x: float) -> float:
        y = restitution * x
        return (-y - math.log1p(-y)) - (x - math.log1p(x))

    if restitution == 1:
        return 0.0
    # y < 1: the rebound never exceeds 1 / b. Below the root the series
    # x^2 (restitution^2 - 1) / 2 makes the difference negative.
    return bisect(excess, 0.0, 1 / restitution) / speed
