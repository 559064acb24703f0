"""What is fitted: numbers of a scenario, each on a scale that suits it and within its bounds."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sphshell_pin.errors import InvalidParameter, ScenarioError
from sphshell_pin.scenario.format.reading import change_scenario, look_up
from sphshell_pin.scenario.format.schema import Scenario
from sphshell_pin.scenario.format.sliders import meaning

Range = tuple[float, float]
Wanted = Iterable[str] | Mapping[str, Range | None]

TIE = "+"
# Tables of which no number is a property of what was measured.
_NOT_MEASURED = ("run", "knob", "figures", "expect")


@dataclass(frozen=True)
class Free:
    """A number of a scenario that is fitted; all `keys` have its value.

    The search moves x: the logarithm of the value of one that must be positive (`log`), else the
    value over `scale`. `low` and `high` bound the value.
    """

    keys: tuple[str, ...]
    unit: str
    start: float
    low: float
    high: float
    log: bool
    scale: float

    def to_x(self, value: float) -> float:
        """Return x at a value."""
        if self.log:
            return math.log(value) if value > 0.0 else -math.inf
        return value / self.scale

    def to_value(self, x: float) -> float:
        """Return the value at x."""
        if not self.log:
            return x * self.scale
        return math.exp(x) if x < 700.0 else math.inf

    def text(self, x: float) -> str:
        """Return the value at `x` as --set takes it, within the bounds whatever was rounded."""
        return repr(min(max(self.to_value(x), self.low), self.high))


def free_parameters(wanted: Wanted, scenario: Scenario, path: Path) -> tuple[Free, ...]:
    """Return what is fitted.

    `wanted` are keys, texts KEY=LO:HI, or keys with a range (None: that of the key); in KEY+KEY
    both have one value, within the bounds of both.

    Raises
    ------
    ScenarioError
        A key that the scenario, read from `path`, does not have, or that cannot be fitted.
    InvalidParameter
        No key, one given twice, or a range that does not hold the start value.
    """
    if isinstance(wanted, str):
        wanted = [wanted]
    stated = wanted.items() if isinstance(wanted, Mapping) else map(_stated, wanted)
    free = []
    for names, span in stated:
        several = [_free(key.strip(), span, scenario, path) for key in names.split(TIE)]
        if len({one.unit for one in several}) > 1:
            units = " and ".join(f"[{one.unit}]" for one in several)
            must = f"must have one unit to have one value: {units}"
            raise InvalidParameter("parameters", names, must)
        keys = tuple(key for one in several for key in one.keys)
        low, high = max(one.low for one in several), min(one.high for one in several)
        free.append(replace(several[0], keys=keys, low=low, high=high))
    keys = tuple(key for one in free for key in one.keys)
    if not keys:
        raise InvalidParameter("parameters", [], "must name at least one key of the scenario")
    for key in keys:
        if keys.count(key) > 1:
            raise InvalidParameter("parameters", key, "is given twice")
    return tuple(free)


def _stated(text: str) -> tuple[str, Range | None]:
    """Return the key and the range of a text such as "KEY" and "KEY=LO:HI"."""
    key, equals, span = text.partition("=")
    try:
        low, high = map(float, span.split(":")) if equals else (0.0, 0.0)
    except ValueError:
        raise InvalidParameter("parameters", text, "must be KEY or KEY=LO:HI") from None
    return key, (low, high) if equals else None


def _free(key: str, span: Range | None, scenario: Scenario, path: Path) -> Free:
    found = look_up(scenario, key, path)
    if found.parts[0] in _NOT_MEASURED:
        raise ScenarioError(path, key, "cannot be fitted: it is no property of what was measured")
    value = found.value
    if value is None:
        raise ScenarioError(path, key, f"has no value to start from: give one, --set {key}=VALUE")
    if isinstance(value, bool) or not isinstance(value, int | float):
        shown = None if isinstance(value, dict | list) else value
        raise ScenarioError(path, key, "is not a number, so it cannot be fitted", shown)
    if isinstance(value, int):
        # A whole number of a family, which may be a list, stays as the file has it.
        try:
            change_scenario(scenario, {found.key: repr(value + 0.5)}, path)
        except ScenarioError as fault:
            if "integer" in str(fault):
                reason = "is a whole number, so it cannot be fitted"
                raise ScenarioError(path, key, reason) from None
    value, about = float(value), meaning(scenario, found)
    if span is None:
        low = -math.inf if about.at_least is None else about.at_least
        if about.above is not None:
            # The smallest number that is accepted; a logarithm may come as near to 0 as it likes.
            low = float(np.nextafter(about.above, math.inf)) if about.above else 1e-300
        span = low, math.inf if about.at_most is None else about.at_most
    elif not span[0] < span[1] or not all(map(math.isfinite, span)):
        raise InvalidParameter(key, f"{span[0]:g}:{span[1]:g}", "must be a range low:high")
    low, high = span
    for end in filter(math.isfinite, span):
        about.check(key, end)
    how = f"give a start value by --set {key}=VALUE"
    if not low <= value <= high:
        must = f"must start within its range {low:g} to {high:g}: {how}"
        raise InvalidParameter(key, value, must)
    log = about.above == 0.0 or low > 0.0
    scale = 0.5 * (high - low) if math.isfinite(high - low) else abs(value)
    if not scale and not log:
        must = f"must not start at 0, which says nothing of its order of magnitude: {how}, or a "
        raise InvalidParameter(key, value, f"{must}range, {key}=LO:HI")
    return Free((found.key,), about.unit, value, low, high, log, scale)
