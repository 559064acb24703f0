"""How an uncertain number is distributed, as texts such as "normal(1e5,1e4)" and as classes."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from types import ModuleType

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import stated_pairs
from sphshell_pin.base.parameters import Component, parameter
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.study.sweep.job import need

Dist = Mapping[str, "str | Distribution"]

_CALL = re.compile(r"\s*(\w+)\s*\(([^()]*)\)\s*")


@dataclass(frozen=True)
class Distribution(Component):
    """A distribution of one number; its kinds are `Normal`, `Uniform` and `LogNormal`."""

    def quantile(self, share: Array) -> Array:
        """Return the values that `share` (n,) of the distribution lies below.

        Raises MissingExtra without scipy.
        """
        return self._ppf(need("scipy.stats"), share)

    def _ppf(self, stats: ModuleType, share: Array) -> Array:
        raise NotImplementedError

    def __str__(self) -> str:
        return f"{self.kind}({','.join(f'{one:.12g}' for one in self._numbers())})"


@dataclass(frozen=True)
class Normal(Distribution, kind="normal"):
    """The normal distribution; 68 % of the values lie within mean ± deviation.

    Parameters
    ----------
    mean : mean
    deviation : standard deviation
    """

    mean: float = parameter()
    deviation: float = parameter(above=0)

    def _ppf(self, stats: ModuleType, share: Array) -> Array:
        return np.asarray(stats.norm.ppf(share, self.mean, self.deviation))


@dataclass(frozen=True)
class Uniform(Distribution, kind="uniform"):
    """Every value from low to high is as likely as any other.

    Parameters
    ----------
    low : smallest value
    high : largest value
    """

    low: float = parameter()
    high: float = parameter()

    def __post_init__(self) -> None:
        """Check the values; InvalidParameter where they enclose nothing."""
        super().__post_init__()
        if not self.low < self.high:
            raise InvalidParameter("high", self.high, f"must be more than low = {self.low:g}")

    def _ppf(self, stats: ModuleType, share: Array) -> Array:
        return np.asarray(stats.uniform.ppf(share, self.low, self.high - self.low))


@dataclass(frozen=True)
class LogNormal(Distribution, kind="lognormal"):
    """The logarithm is normal, with mean log(median) and standard deviation log(factor).

    Parameters
    ----------
    median : half of the values lie below it
    factor : 68 % of the values lie from median / factor to median * factor
    """

    median: float = parameter(above=0)
    factor: float = parameter(above=1)

    def _ppf(self, stats: ModuleType, share: Array) -> Array:
        return np.asarray(stats.lognorm.ppf(share, math.log(self.factor), scale=self.median))


def forms() -> str:
    """Return how the distributions are written, as a list."""
    return ", ".join(
        f"{kind}({','.join(one.name for one in fields(family))})"
        for kind, family in Distribution.kinds.items()
    )


def distributions_of(dist: Dist | Iterable[str]) -> dict[str, Distribution]:
    """Return the distributions by key, of a mapping or of texts "KEY=normal(1e5,1e4)".

    Raises
    ------
    InvalidParameter
        A text that is no distribution, values that it cannot have, or a key given twice.
    """
    if not isinstance(dist, Iterable):
        raise InvalidParameter("dist", dist, "must map keys to distributions")
    found: dict[str, Distribution] = {}
    must = f"must be KEY=DISTRIBUTION, one of {forms()}"
    for key, given in stated_pairs("dist", dist, must):
        if key in found:
            raise InvalidParameter("dist", key, "is given twice: leave one of the two out")
        found[key] = given if isinstance(given, Distribution) else _parse(key, given)
    return found


def _parse(key: str, text: object) -> Distribution:
    call = _CALL.fullmatch(text) if isinstance(text, str) else None
    family = Distribution.kinds.get(call[1].lower()) if call else None
    try:
        values = [float(one) for one in call[2].split(",")] if call else []
    except ValueError:
        values = []
    if family is None or len(values) != len(fields(family)):
        raise InvalidParameter(f"dist {key}", text, f"must be one of {forms()}")
    try:
        made = family(*values)
    except InvalidParameter as fault:
        raise InvalidParameter(f"dist {key}", text, f"is no distribution: {fault}") from None
    return made  # type: ignore[return-value]  # the kinds of Distribution
