"""What a sweep varies: keys of the scenario, the values each takes, and the runs they make."""

import itertools
import json
import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sphshell_pin.base.checks import stated_pairs
from sphshell_pin.errors import InvalidParameter

Value = bool | int | float | str
"""A value of a varied key, as a table holds it; a list of the scenario file is its text."""

Vary = Mapping[str, str | Sequence[object]]

MOST_RUNS = 1_000_000
# Steps between the ends are rounded: 0.3 rather than 0.30000000000000004, on every machine.
_DIGITS = 12
_NUMBER = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?\s*", re.IGNORECASE)
HOW = "key=lo:hi:n, key=lo:hi:log:n or key=a,b,c"


@dataclass(frozen=True)
class Axis:
    """A key of the scenario, as --set takes it, and the values that it takes in turn."""

    key: str
    values: tuple[Value, ...]


def axes_of(vary: Vary | Iterable[str]) -> tuple[Axis, ...]:
    """Return the axes of a mapping from keys to values, or of texts such as "run.dt=1e-5,1e-4".

    Values are a sequence, or a text: "lo:hi:n" (n equal steps, ends included), "lo:hi:log:n" (n
    values, each the same multiple of the one before), "a,b,c" (numbers, words, TOML lists).

    Raises
    ------
    InvalidParameter
        A text that says no values, a key or a value given twice, or nothing to vary.
    """
    axes: dict[str, Axis] = {}
    for key, given in stated_pairs("--vary", vary, f"must be {HOW}"):
        if not isinstance(given, Iterable):
            raise InvalidParameter(f"vary {key}", given, "must be a list of values, or a text")
        values = _parse(key, given) if isinstance(given, str) else tuple(map(_plain, given))
        if not values:
            raise InvalidParameter("vary", key, "must have at least one value", key)
        # 1 and 1.0 are one value, true is another; as text: a nan is not even equal to itself.
        texts = [text_of(_as_number(value)) for value in values]
        for value, text in zip(values, texts, strict=True):
            if texts.count(text) > 1:
                raise InvalidParameter(f"vary {key}", text_of(value), "is given twice")
        if key in axes:
            raise InvalidParameter("vary", key, "is given twice: put all its values together")
        axes[key] = Axis(key, values)
    if not axes:
        raise InvalidParameter("vary", {}, f"must say what varies: {HOW}")
    return tuple(axes.values())


def points_of(axes: Sequence[Axis], together: bool) -> list[tuple[Value, ...]]:
    """Return the values of each run in turn: the grid of `axes` (the last varies fastest).

    With `together` the first run takes the first value of every axis, and so on.

    Raises
    ------
    InvalidParameter
        More runs than anyone wants, or axes of different lengths with `together`.
    """
    lengths = [len(axis.values) for axis in axes]
    if together:
        if len(set(lengths)) > 1:
            given = ", ".join(f"{axis.key} has {n}" for axis, n in zip(axes, lengths, strict=True))
            raise InvalidParameter("together", True, f"needs as many values of every key: {given}")
        return list(zip(*(axis.values for axis in axes), strict=True))
    if math.prod(lengths) > MOST_RUNS:
        raise InvalidParameter(
            "vary", math.prod(lengths), f"runs are too many: {MOST_RUNS} at most"
        )
    return list(itertools.product(*(axis.values for axis in axes)))


def text_of(value: Value) -> str:
    """Return `value` as --set takes it; numbers are exact."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return value if isinstance(value, str) else repr(value)


def _as_number(value: Value) -> Value:
    """Return an int as the float of the same value, where there is one."""
    whole = isinstance(value, int) and not isinstance(value, bool) and abs(value) <= 2**53
    return float(value) if whole else value


def _parse(key: str, text: str) -> tuple[Value, ...]:
    parts = text.split(":")
    if len(parts) > 1 and _NUMBER.fullmatch(parts[0]):
        return _range(key, text, parts)
    try:
        found = tomllib.loads(f"values = [{text}]")["values"]
    except tomllib.TOMLDecodeError:
        found = [_word(one.strip()) for one in text.split(",")]
    return tuple(map(_plain, found))


def _range(key: str, text: str, parts: list[str]) -> tuple[Value, ...]:
    log = len(parts) == 4 and parts[2].strip() == "log"
    ends, count = parts[:2], parts[-1].strip()
    if not (len(parts) == 3 or log) or not all(_NUMBER.fullmatch(one) for one in ends):
        raise InvalidParameter(f"vary {key}", text, "must be lo:hi:n or lo:hi:log:n")
    low, high = map(float, ends)
    if not (math.isfinite(low) and math.isfinite(high)):
        raise InvalidParameter(f"vary {key}", text, "must have finite ends")
    if not count.isdecimal() or not 2 <= int(count) <= MOST_RUNS:
        raise InvalidParameter(f"vary {key}", text, "must end in a number of values, 2 or more")
    if low == high:
        raise InvalidParameter(f"vary {key}", text, "must have two ends that differ")
    if log and not (low > 0 and high > 0):
        raise InvalidParameter(f"vary {key}", text, "must have positive ends with log")
    steps = (np.geomspace if log else np.linspace)(low, high, int(count))
    inner = [float(f"{one:.{_DIGITS}g}") for one in steps[1:-1]]
    return low, *inner, high


def _word(text: str) -> object:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return float(text) if _NUMBER.fullmatch(text) else text


def _plain(value: object) -> Value:
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return f"[{', '.join(_inner(one) for one in value)}]"
    if isinstance(value, Value):
        return value
    raise InvalidParameter("vary", value, "must be numbers, words, or lists of numbers")


def _inner(value: object) -> str:
    """Return a value inside a list as TOML writes it."""
    plain = _plain(value)
    return json.dumps(plain) if isinstance(value, str) else text_of(plain)
