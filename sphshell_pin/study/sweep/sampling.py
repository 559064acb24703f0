"""Which runs a sweep with uncertain inputs makes: points of a sample, and those around them."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.study.sweep.distributions import Dist, Distribution, distributions_of, forms
from sphshell_pin.study.sweep.grid import MOST_RUNS, Axis, Value
from sphshell_pin.study.sweep.job import need

SAMPLES = ("sobol", "lhs")
SAMPLE, A, B, MEDIAN = "sample", "A", "B", "median"
DRAWN = (SAMPLE, A, B)
"""Parts of a design whose runs are drawn from the distributions, each independent of the others."""
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
    description: Mapping[str, object]
    """What distinguishes it from another."""

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
    _check(sample, n, seed, indices, tornado)
    need("scipy")
    d = len(dists)
    shares, parts = np.empty((0, d)), list[str]()
    if sample is not None and n is not None:
        runs = n * (d + 2 if indices else 1)
        if runs > MOST_RUNS:
            raise InvalidParameter("n", n, f"makes {runs} runs, too many: {MOST_RUNS} at most")
        shares = _unit_points(sample, n, 2 * d if indices else d, seed)
        parts = [SAMPLE] * n
        if indices:
            shares = _saltelli(shares).reshape(-1, d)
            parts = [A, B, *map(swapped, dists)] * n
    if tornado:
        shares = np.vstack([shares, _one_at_a_time(d)])
        parts += [MEDIAN, *(at_quantile(key, one) for key in dists for one in (LOW, HIGH))]
    columns = []
    for (key, one), share in zip(dists.items(), shares.T, strict=True):
        with np.errstate(over="ignore", invalid="ignore"):
            columns.append(one.quantile(share))
        if not np.all(np.isfinite(columns[-1])):
            raise InvalidParameter(f"dist {key}", str(one), "has values that are not finite")
    values = np.column_stack(columns)
    description = {
        "dist": {key: str(one) for key, one in dists.items()},
        "sample": sample,
        "n": n,
        "seed": seed,
        "indices": indices,
        "tornado": tornado,
        # Another version of scipy may draw other points.
        "points": hashlib.sha256(values.astype("<f8").tobytes()).hexdigest(),
    }
    return Design(dists, values, tuple(parts), description)


def _check(sample: str | None, n: int | None, seed: int, indices: bool, tornado: bool) -> None:
    if sample is None and not tornado:
        raise InvalidParameter(
            "sample",
            None,
            "with dist: sobol or lhs, and n points (or tornado alone)",
            "must be given",
        )
    if sample is not None and sample not in SAMPLES:
        raise InvalidParameter("sample", sample, f"must be one of {', '.join(SAMPLES)}")
    if sample is None and n is not None:
        raise InvalidParameter("n", n, "is the size of a sample: give sample, sobol or lhs, too")
    if sample is not None and n is None:
        raise InvalidParameter(
            "n", None, f"with sample = {sample}: the number of points", "must be given"
        )
    for name, value, least in (("n", 2 if n is None else n, 2), ("seed", seed, 0)):
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


def _saltelli(points: Array) -> Array:
    """Return A, B, AB_1 ... AB_d of each point (n, d + 2, d); `points` (n, 2 d) are A beside B."""
    n, d = points.shape[0], points.shape[1] // 2
    a, b = points[:, :d], points[:, d:]
    found = np.repeat(a[:, None, :], d + 2, axis=1).reshape(n, d + 2, d)
    found[:, 1] = b
    for i in range(d):
        found[:, 2 + i, i] = b[:, i]
    return found


def _one_at_a_time(d: int) -> Array:
    """Return the medians, then each input at its low and high quantile (2 d + 1, d)."""
    found = np.full((2 * d + 1, d), 0.5)
    for i in range(d):
        found[1 + 2 * i, i], found[2 + 2 * i, i] = LOW / 100, HIGH / 100
    return found
