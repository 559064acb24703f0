"""What is fitted: numbers of a scenario, each on a scale that suits it and within its bounds."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sphshell_pin.base.parameters import Parameter
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
    """A number of a scenario that is fitted; `others` are keys that always have its value, too.

    The search moves x: the logarithm of the value of one that must be positive (`log`), else the
    value over `scale`. `low` and `high` bound the value.
    """

    key: str
    unit: str
    start: float
    low: float
    high: float
    log: bool
    scale: float = 1.0
    others: tuple[str, ...] = ()

    @property
    def keys(self) -> tuple[str, ...]:
        """All keys that have the value."""
        return (self.key, *self.others)

    @property
    def name(self) -> str:
        """The keys as the caller gives them."""
        return TIE.join(self.keys)

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
    """Return what is fitted: `wanted` are keys, or keys with a range (None: that of the key).

    Raises
    ------
    ScenarioError
        A key that the scenario, read from `path`, does not have, or that cannot be fitted.
    InvalidParameter
        No key, one given twice, or a range that does not hold the start value.
    """
    if isinstance(wanted, str):
        wanted = [wanted]
    ranges = dict(wanted) if isinstance(wanted, Mapping) else dict.fromkeys(wanted)
    if not ranges:
        raise InvalidParameter("parameters", [], "must name at least one key of the scenario")
    free = [_tied(key, span, scenario, path) for key, span in ranges.items()]
    keys = [key for one in free for key in one.keys]
    for key in keys:
        if keys.count(key) > 1:
            raise InvalidParameter("parameters", key, "is given twice")
    return tuple(free)


def parse_wanted(texts: Iterable[str]) -> dict[str, Range | None]:
    """Return the keys and ranges that texts such as "KEY" and "KEY=LO:HI" state."""
    out: dict[str, Range | None] = {}
    for text in texts:
        key, equals, span = text.partition("=")
        key = key.strip()
        if key in out:
            raise InvalidParameter("--param", text, "is given twice")
        out[key] = None
        if equals:
            try:
                low, high = map(float, span.split(":"))
            except ValueError:
                raise InvalidParameter("--param", text, "must be KEY or KEY=LO:HI") from None
            out[key] = low, high
    return out


def _tied(key: str, span: Range | None, scenario: Scenario, path: Path) -> Free:
    """Return the parameter of "KEY" or "KEY+KEY": one value for all, within the bounds of all."""
    first, *others = (_free(one.strip(), span, scenario, path) for one in key.split(TIE))
    for one in others:
        if one.unit != first.unit:
            must = f"must have one unit to have one value: [{first.unit}] and [{one.unit}]"
            raise InvalidParameter("parameters", key, must)
    low, high = max(one.low for one in (first, *others)), min(one.high for one in (first, *others))
    return replace(first, low=low, high=high, others=tuple(one.key for one in others))


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
    value = float(value)
    about = meaning(scenario, found)
    low, high = _bounds(about)
    if span is not None:
        if not span[0] < span[1] or not all(map(math.isfinite, span)):
            raise InvalidParameter(key, f"{span[0]:g}:{span[1]:g}", "must be a range low:high")
        for end in span:
            about.check(key, end)
        low, high = span
    if not low <= value <= high:
        raise InvalidParameter(
            key,
            value,
            f"must start within its range {low:g} to {high:g}: give a start value by --set "
            f"{key}=VALUE",
        )
    log = about.above == 0.0 or low > 0.0
    scale = abs(value)
    if span is not None and not log:
        scale = 0.5 * (high - low)
    if not scale and not log:
        raise InvalidParameter(
            key,
            value,
            f"must not start at 0, which says nothing of its order of magnitude: give a start by "
            f"--set {key}=VALUE, or a range, {key}=LO:HI",
        )
    return Free(found.key, about.unit, value, low, high, log, scale)


def _bounds(about: Parameter) -> Range:
    """Return the closed bounds of a description."""
    low = -math.inf
    if about.at_least is not None:
        low = about.at_least
    if about.above is not None:
        # The smallest number that is accepted; a logarithm may come as near to 0 as it likes.
        low = float(np.nextafter(about.above, math.inf)) if about.above else 1e-300
    return low, math.inf if about.at_most is None else about.at_most
