"""Which runs a sweep makes: the points of a grid, or a sample of uncertain inputs."""

import itertools
import json
import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from sphshell_pin.base.checks import stated_pairs
from sphshell_pin.errors import InvalidParameter

Value = bool | int | float | str
"""A value of a varied key, as a table holds it; a list of the scenario file is its text."""
Vary = Mapping[str, str | Sequence[object]]
Frozen: TypeAlias = Any
"""A distribution of scipy.stats with its parameters, which has no types."""
Dist = Mapping[str, "str | Frozen"]

MOST_RUNS = 1_000_000
HOW = "key=lo:hi:n, key=lo:hi:log:n or key=a,b,c"
FORMS = "normal(mean,deviation), uniform(low,high), lognormal(median,factor)"
_CALL = re.compile(r"\s*(\w+)\s*\(([^(),]*),([^(),]*)\)\s*")
# Steps between the ends are rounded: 0.3 rather than 0.30000000000000004, on every machine.
_DIGITS = 12
_PLAIN = r"\s*[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\s*"
_NUMBER = re.compile(_PLAIN)
_RANGE = re.compile(rf"({_PLAIN}):({_PLAIN}):(\s*log\s*:)?\s*(\d+)\s*")

DRAWN = SAMPLE, A, B = "sample", "A", "B"
"""Parts of a design whose runs are drawn from the distributions, each independent of the others."""
# Sobol points are whole multiples of 2^-30. Half a step more keeps them off 0 and 1, where a
# quantile may be infinite, and in the intervals that make them even.
_HALF_STEP = 2.0**-31


@dataclass(frozen=True)
class Points:
    """The values that each varied key takes, run by run: (n,) by key."""

    values: Mapping[str, Sequence[Value]]
    parts: tuple[str, ...] = ()
    """What each run of a sample is for: "sample"; "A", "B", "AB KEY"."""

    @property
    def changes(self) -> list[dict[str, str]]:
        """The values of each run by key, as --set takes them."""
        texts = [[text_of(one) for one in column] for column in self.values.values()]
        return [dict(zip(self.values, row, strict=True)) for row in zip(*texts, strict=True)]


def swapped(key: str) -> str:
    """Return the part of the design whose points are those of A with the `key` of B."""
    return f"AB {key}"


def grid_of(vary: Vary | Iterable[str]) -> Points:
    """Return the grid of a mapping from keys to values, or of texts such as "run.dt=1e-5,1e-4".

    Values are a sequence, or a text: "lo:hi:n" (n equal steps, ends included), "lo:hi:log:n" (n
    values, each the same multiple of the one before), "a,b,c" (numbers, words, TOML lists). The
    last key varies fastest.

    Raises
    ------
    InvalidParameter
        A text that says no values, a key or a value given twice, nothing to vary, too many runs.
    """
    axes: dict[str, tuple[Value, ...]] = {}
    for key, given in _stated("vary", vary, f"must be {HOW}", f"what varies: {HOW}").items():
        if not isinstance(given, Iterable):
            raise InvalidParameter(f"vary {key}", given, "must be a list of values, or a text")
        values = _parse(key, given) if isinstance(given, str) else tuple(map(_plain, given))
        if not values:
            raise InvalidParameter("vary", key, "must have at least one value", key)
        # 1 and 1.0 are one value, true is another; as text: a nan is not even equal to itself.
        texts = [
            text_of(float(one) if type(one) is int and abs(one) < 2**53 else one) for one in values
        ]
        for value, text in zip(values, texts, strict=True):
            if texts.count(text) > 1:
                raise InvalidParameter(f"vary {key}", text_of(value), "is given twice")
        axes[key] = values
    if (runs := math.prod(map(len, axes.values()))) > MOST_RUNS:
        raise InvalidParameter("vary", runs, f"runs are too many: {MOST_RUNS} at most")
    columns = zip(*itertools.product(*axes.values()), strict=True)
    return Points(dict(zip(axes, columns, strict=True)))


def sample_of(
    dist: Dist | Iterable[str], n: int | None, *, seed: int = 0, indices: bool = False
) -> Points:
    """Return the runs for inputs distributed as `dist`; see `sphshell_pin.study.sweep.sweep`.

    The points are those of a scrambled Sobol sequence [scipy.stats.qmc]. With `indices` the design
    is Saltelli's: A and B are the halves of one sequence in 2 d dimensions, and each AB is A with
    one column of B [Saltelli et al., Computer Physics Communications 181 (2010), 259-270]. The
    d + 2 runs of a point follow each other.

    Raises
    ------
    InvalidParameter
        A distribution, `n` or another argument is wrong.
    """
    if not isinstance(dist, Iterable):
        raise InvalidParameter("dist", dist, "must map keys to distributions")
    what = f"what is uncertain: a key with one of {FORMS}"
    stated = _stated("dist", dist, f"must be KEY=DISTRIBUTION, one of {FORMS}", what)
    dists = {key: one if hasattr(one, "ppf") else _frozen(key, one) for key, one in stated.items()}
    for name, value, least in (("n", n, 2), ("seed", seed, 0)):
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise InvalidParameter(name, value, f"must be a whole number, {least} or more")
    assert n is not None
    d = len(dists)
    if n & (n - 1):
        below = 1 << (n.bit_length() - 1)
        must = f"must be a power of 2, such as {below} or {2 * below}"
        raise InvalidParameter("n", n, must)
    if (runs := n * (d + 2 if indices else 1)) > MOST_RUNS:
        raise InvalidParameter("n", n, f"makes {runs} runs, too many: {MOST_RUNS} at most")
    from scipy.stats import qmc

    shares = np.asarray(qmc.Sobol(2 * d if indices else d, rng=seed).random(n)) + _HALF_STEP
    parts = [SAMPLE] * n
    if indices:
        a, b = shares[:, :d], shares[:, d:]
        swaps = [np.where(np.arange(d) == i, b, a) for i in range(d)]
        shares = np.stack([a, b, *swaps], axis=1).reshape(-1, d)
        parts = [A, B, *map(swapped, dists)] * n
    values = {}
    for (key, one), share in zip(dists.items(), shares.T, strict=True):
        with np.errstate(over="ignore", invalid="ignore"):
            values[key] = np.asarray(one.ppf(share), dtype=float).tolist()
        if not np.all(np.isfinite(values[key])):
            raise InvalidParameter("dist", key, "has values that are not finite")
    return Points(values, tuple(parts))


def text_of(value: Value) -> str:
    """Return `value` as --set takes it; numbers are exact."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return value if isinstance(value, str) else repr(value)


def _stated(
    name: str, given: Mapping[str, object] | Iterable[str], must: str, what: str
) -> dict[str, object]:
    """Return what is stated by key; InvalidParameter for a key given twice, and for none."""
    found: dict[str, object] = {}
    for key, one in stated_pairs(name, given, must):
        if key in found:
            raise InvalidParameter(name, key, "is given twice: put all that it may be together")
        found[key] = one
    if not found:
        raise InvalidParameter(name, {}, what, "must say")
    return found


def _frozen(key: str, text: object) -> Frozen:
    """Return the distribution that a text states."""
    from scipy import stats

    call = _CALL.fullmatch(text) if isinstance(text, str) else None
    try:
        kind, a, b = (call[1].lower(), float(call[2]), float(call[3])) if call else ("", 0.0, 0.0)
    except ValueError:
        kind = ""
    if kind == "normal":
        must, valid = "deviation > 0", b > 0
    elif kind == "uniform":
        must, valid = "low < high", a < b
    elif kind == "lognormal":
        must, valid = "median > 0, factor > 1", a > 0 and b > 1
    else:
        raise InvalidParameter(f"dist {key}", text, f"must be one of {FORMS}")
    if not valid:
        raise InvalidParameter(f"dist {key}", text, f"must have {must}")
    if kind == "lognormal":
        return stats.lognorm(math.log(b), scale=a)
    return stats.norm(a, b) if kind == "normal" else stats.uniform(a, b - a)


def _parse(key: str, text: str) -> tuple[Value, ...]:
    if ":" in text and _NUMBER.fullmatch(text.partition(":")[0]):
        return _range(key, text)
    try:
        found = tomllib.loads(f"values = [{text}]")["values"]
    except tomllib.TOMLDecodeError:
        found = [_word(one.strip()) for one in text.split(",")]
    return tuple(map(_plain, found))


def _range(key: str, text: str) -> tuple[Value, ...]:
    parts = _RANGE.fullmatch(text)
    low, high, n = (float(parts[1]), float(parts[2]), int(parts[4])) if parts else (0.0, 0.0, 0)
    log = parts is not None and parts[3] is not None
    positive = min(low, high) > 0.0 or not log
    if not (2 <= n <= MOST_RUNS and low != high and positive and math.isfinite(high - low)):
        must = "finite ends that differ (positive ones with log), n 2 or more"
        raise InvalidParameter(f"vary {key}", text, f"must be lo:hi:n or lo:hi:log:n, {must}")
    steps = (np.geomspace if log else np.linspace)(low, high, n)
    return low, *(float(f"{one:.{_DIGITS}g}") for one in steps[1:-1]), high


def _word(text: str) -> object:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return float(text) if _NUMBER.fullmatch(text) else text


def _plain(value: object) -> Value:
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        inner = (_plain(one) for one in value)
        texts = (json.dumps(one) if isinstance(one, str) else text_of(one) for one in inner)
        return f"[{', '.join(texts)}]"
    if isinstance(value, Value):
        return value
    raise InvalidParameter("vary", value, "must be numbers, words, or lists of numbers")
