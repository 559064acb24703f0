"""Which runs a sweep with uncertain inputs makes: points of a sample, and those around them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.study.sweep.distributions import Dist, Distribution, distributions_of, forms
from sphshell_pin.study.sweep.grid import MOST_RUNS, Axis, Value
from sphshell_pin.study.sweep.job import need

DRAWN = SAMPLE, A, B = "sample", "A", "B"
"""Parts of a design whose runs are drawn from the distributions, each independent of the others."""
MEDIAN = "median"
LOW, HIGH = 5, 95
"""Between these quantiles [%] an input moves in the tornado."""
# Sobol points are whole multiples of 2^-30. Half a step more keeps them off 0 and 1, where a
# quantile may be infinite, and in the intervals that make them even.
_HALF_STEP = 2.0**-31


def swapped(key: str) -> str:
    """Return the part of the design whose points are those of A with the `key` of B."""
    return f"AB {key}"


def at_quantile(key: str, percent: int) -> str:
    """Return the part of the design in which `key` is at a quantile, all others at the median."""
    return f"{percent} % {key}"


@dataclass(frozen=True)
class Design:
    """The runs of a sweep with uncertain inputs, in their order."""

    dists: Mapping[str, Distribution]
    values: Array
    """(n, d): the values of each run, in the order of `dists`."""
    parts: tuple[str, ...]
    """What each run is for: "sample"; "A", "B", "AB KEY"; "median", "5 % KEY", "95 % KEY"."""

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The keys with their values in each run."""
        columns = self.values.T.tolist()
        return tuple(Axis(key, tuple(c)) for key, c in zip(self.dists, columns, strict=True))

    @property
    def points(self) -> list[tuple[Value, ...]]:
        """The values of each run."""
        return [tuple(one) for one in self.values.tolist()]


def design_of(
    dist: Dist | Iterable[str],
    sample: str | None = None,
    n: int | None = None,
    *,
    seed: int = 0,
    indices: bool = False,
    tornado: bool = False,
) -> Design:
    """Return the runs for inputs distributed as `dist`; see `sphshell_pin.study.sweep.sweep`.

    The points of "sobol" are those of a scrambled Sobol sequence, those of "lhs" a Latin hypercube
    [scipy.stats.qmc]. With `indices` the design is Saltelli's: A and B are the halves of one
    sequence in 2 d dimensions, and each AB is A with one column of B [Saltelli et al., Computer
    Physics Communications 181 (2010), 259-270]. The d + 2 runs of a point follow each other.

    Raises
    ------
    InvalidParameter
        A distribution, `n` or another argument is wrong.
    MissingExtra
        scipy is not installed.
    """
    dists = distributions_of(dist)
    if not dists:
        raise InvalidParameter(
            "dist", {}, f"what is uncertain: a key with one of {forms()}", "must say"
        )
    _check(sample, n, seed, indices=indices, tornado=tornado)
    d = len(dists)
    shares, parts = np.empty((0, d)), list[str]()
    if sample is not None and n is not None:
        runs = n * (d + 2 if indices else 1)
        if runs > MOST_RUNS:
            raise InvalidParameter("n", n, f"makes {runs} runs, too many: {MOST_RUNS} at most")
        shares, parts = _unit_points(sample, n, 2 * d if indices else d, seed), [SAMPLE] * n
        if indices:
            a, b = shares[:, :d], shares[:, d:]
            swaps = [np.where(np.arange(d) == i, b, a) for i in range(d)]
            shares = np.stack([a, b, *swaps], axis=1).reshape(-1, d)
            parts = [A, B, *map(swapped, dists)] * n
    if tornado:
        alone = np.full((d, 2, d), 0.5)
        alone[range(d), :, range(d)] = LOW / 100, HIGH / 100
        shares = np.vstack([shares, np.full((1, d), 0.5), alone.reshape(-1, d)])
        parts += [MEDIAN, *(at_quantile(key, one) for key in dists for one in (LOW, HIGH))]
    with np.errstate(over="ignore", invalid="ignore"):
        quantiles = [one.quantile(s) for one, s in zip(dists.values(), shares.T, strict=True)]
    for (key, one), values in zip(dists.items(), quantiles, strict=True):
        if not np.all(np.isfinite(values)):
            raise InvalidParameter(f"dist {key}", str(one), "has values that are not finite")
    return Design(dists, np.column_stack(quantiles), tuple(parts))


def _check(sample: str | None, n: int | None, seed: int, *, indices: bool, tornado: bool) -> None:
    if sample is None and (n is not None or not tornado):
        must = "with dist: sobol or lhs, and n points (or tornado alone)"
        raise InvalidParameter("sample", None, must, "must be given")
    if sample not in (None, "sobol", "lhs"):
        raise InvalidParameter("sample", sample, "must be sobol or lhs")
    for name, value, least in (("n", 2 if sample is None else n, 2), ("seed", seed, 0)):
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise InvalidParameter(name, value, f"must be a whole number, {least} or more")
    if indices and sample != "sobol":
        raise InvalidParameter("indices", True, "the points of a sequence: sample = sobol", "need")
    if sample == "sobol" and n is not None and n & (n - 1):
        below = 1 << (n.bit_length() - 1)
        raise InvalidParameter(
            "n",
            n,
            f"must be a power of 2 with sample = sobol, such as {below} or {2 * below}: other "
            "numbers of Sobol points are not evenly spread",
        )


def _unit_points(sample: str, n: int, d: int, seed: int) -> Array:
    """Return `n` points in the unit cube (n, d)."""
    qmc = need("scipy.stats").qmc
    if sample == "sobol":
        return np.asarray(qmc.Sobol(d, rng=seed).random(n)) + _HALF_STEP
    return np.asarray(qmc.LatinHypercube(d, rng=seed).random(n))
