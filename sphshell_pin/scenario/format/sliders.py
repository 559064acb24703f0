"""Knobs: what of a scenario is turned while it is looked at: numbers, and words of a choice."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args, get_origin

from pydantic import BaseModel

from sphshell_pin.base.named_numbers import with_value
from sphshell_pin.base.parameters import Component, Parameter, parameters_of
from sphshell_pin.dynamics.run.simulation import Simulation
from sphshell_pin.dynamics.scene.pairs import ContactPair
from sphshell_pin.errors import InvalidParameter, ScenarioError
from sphshell_pin.scenario.format.reading import Found, child_of, look_up, owner_of, parse_value
from sphshell_pin.scenario.format.schema import ContactSection, KnobSection, Scenario, SourceSection

if TYPE_CHECKING:
    from sphshell_pin.scenario.format.build import Built

Entry = ContactSection | SourceSection


def with_numbers(built: Built, changes: Mapping[str, str]) -> Built | None:
    """Return `built` with other numbers of laws, friction and radii of its contacts, by dotted key.

    None where a key is of something else, or a value is refused: who validates the whole scenario
    finds out why.
    """
    found: dict[tuple[str, int], dict[str, dict[str, float]]] = {}
    for key, text in changes.items():
        places, value = list(_places(built, key)), number_in(text)
        if len(places) != 1 or value is None:
            return None
        ((table, index, part, name),) = places
        found.setdefault((table, index), {}).setdefault(part, {})[name] = value
    scenario, pairs = built.scenario, list(built.scene.pairs)
    try:
        for (table, index), parts in found.items():
            entries = list(getattr(scenario, table))
            entries[index] = entry = _changed_entry(entries[index], parts)
            scenario = scenario.model_copy(update={table: entries})
            for k, pair in enumerate(pairs):
                if entry.name in (pair.name, pair.group):
                    pairs[k] = _changed_pair(pair, entry, built, parts)
    except InvalidParameter:
        return None
    scene = built.scene.with_pairs(tuple(pairs))
    simulation = Simulation(scene, built.simulation.integrator, built.simulation.sensors)
    return replace(built, scenario=scenario, scene=scene, simulation=simulation)


def _places(built: Built, key: str) -> Iterator[tuple[str, int, str, str]]:
    """Yield the table, the entry, its part and its number that a dotted key may mean."""
    for table in ("contact", "source"):
        entries: list[Entry] = getattr(built.scenario, table)
        for index, entry in enumerate(entries):
            # The name of a table alone may be left out of the key.
            heads = [f"{table}.{entry.name}.", f"{table}.{index}."]
            heads += [f"{table}."] * (len(entries) == 1)
            for part in ("law", "friction", "sphere"):
                if (stated := getattr(entry, part, None)) is None:
                    continue
                for head in (f"{head}{part}." for head in heads):
                    name = key.removeprefix(head)
                    if key.startswith(head) and has_number(stated, name):
                        yield table, index, part, name


def number_in(text: str) -> float | None:
    """Return the number that --set states; None where it is none."""
    value = parse_value(text)
    return float(value) if type(value) in (int, float) else None


def has_number(stated: object, name: str) -> bool:
    """Whether what is stated, with no file beside it, has a number of that name."""
    if not isinstance(stated, Component):
        return name == "radius"
    return (
        not stated.files
        and name in parameters_of(stated)
        and isinstance(getattr(stated, name), float)
    )


def _changed_entry(entry: Entry, parts: Mapping[str, Mapping[str, float]]) -> Entry:
    new: dict[str, object] = {}
    for part, values in parts.items():
        stated: Component | BaseModel = getattr(entry, part)
        if isinstance(stated, Component):
            new[part] = stated.changed(**values)
        else:
            new[part] = stated.model_copy(update=values)
    return entry.model_copy(update=new)


def _changed_pair(
    pair: ContactPair, entry: Entry, built: Built, parts: Mapping[str, Mapping[str, float]]
) -> ContactPair:
    if "sphere" in parts:
        pair = with_value(pair, ("side_i", "sphere", "radius"), parts["sphere"]["radius"])
    new = {
        part: getattr(entry, part)._build(built.path.parent)
        for part in ("law", "friction")
        if part in parts
    }
    return replace(pair, **new)


# A knob without a range goes from a tenth of its value to ten times as much.
DECADE = 10.0

# Keys whose new value holds from the start only: a run in progress keeps its state and its time.
_FROM_THE_START = ("robot", "shell", "run")


@dataclass(frozen=True)
class LiveParameter:
    """A number of a scenario with the range to turn it in, or a word with its choices."""

    key: str
    """Dotted key, as --set takes it."""
    label: str
    unit: str
    """Unit of `value`, `low`, `high`; "" for a pure number."""
    low: float
    high: float
    log: bool
    """Whether equal turns multiply (else they add)."""
    value: float | str
    restart: bool
    """Whether a new value holds only from the next start: start states, placements, times."""
    choices: tuple[str, ...] = ()
    """The words that the value may be; none where it is a number."""


def live_parameters(built: Built) -> tuple[LiveParameter, ...]:
    """Return the knobs of a built scenario, in the file's order, with the values they stand at.

    A range is widened where the value, changed by --set, lies outside.
    """
    return tuple(_knob(one, built.scenario, built.path) for one in built.scenario.knob)


def check_knobs(scenario: Scenario, path: Path, *, ranges: bool) -> None:
    """Check the knobs of the `scenario` read from `path`; with `ranges` their values lie inside.

    Raises
    ------
    ScenarioError
        A key that the scenario has not or that is not a number, one given twice, or a range that
        cannot be.
    """
    seen: set[str] = set()
    for i, section in enumerate(scenario.knob):
        where = f"knob[{i}]"
        found = look_up(scenario, section.key, path)
        if found.key in seen:
            raise ScenarioError(path, f"{where}.key", "is a knob already", section.key)
        seen.add(found.key)
        if _choices(scenario, found):
            _check_choice(section, found, path, where)
            continue
        value = _number(found, section.key, path)
        if not ranges and None in (section.min, section.max):
            continue  # its author saw a range, which this value may have left
        low, high, log = _range(section, value, meaning(scenario, found))
        if low is None or high is None:
            raise ScenarioError(
                path, where, f"needs min and max, as '{section.key}' is not positive", value
            )
        if not low < high:
            raise ScenarioError(path, where, f"min {low:g} must be less than max {high:g}")
        if log and low <= 0:
            raise ScenarioError(path, where, "min must be positive with log = true", low)
        if ranges and not low <= value <= high:
            raise ScenarioError(
                path,
                where,
                f"'{section.key}' = {value:g} lies outside its range {low:g} to {high:g}: change "
                "the knob's min and max",
            )


def _number(found: Found, key: str, path: Path) -> float:
    if isinstance(found.value, bool) or not isinstance(found.value, int | float):
        shown = None if isinstance(found.value, dict | list) else found.value
        raise ScenarioError(path, key, "is not a number, so it cannot be a knob", shown)
    return float(found.value)


def _range(
    section: KnobSection, value: float, about: Parameter
) -> tuple[float | None, float | None, bool]:
    low, high = section.min, section.max
    if value > 0:
        low = value / DECADE if low is None else low
        if high is None:
            high = value * DECADE if about.at_most is None else min(value * DECADE, about.at_most)
    log = section.log
    if log is None:
        # A range that was given spans what one wants to see, in plain steps unless it is wide.
        log = low is not None and high is not None and low > 0 and high >= DECADE * low
    return low, high, log


def _choices(scenario: Scenario, found: Found) -> tuple[str, ...]:
    """Return the words that the value at a key may be, where its table lists them; else none."""
    owner = owner_of(scenario, found.parts[:-1])
    info = type(owner).model_fields.get(found.parts[-1]) if isinstance(owner, BaseModel) else None
    if info is None:
        return ()
    parts = (info.annotation, *get_args(info.annotation))
    words = [word for part in parts if get_origin(part) is Literal for word in get_args(part)]
    return tuple(word for word in words if isinstance(word, str))


def _check_choice(section: KnobSection, found: Found, path: Path, where: str) -> None:
    if found.value is None:
        raise ScenarioError(path, section.key, "is not set: give it a value to make it a knob")
    for name in ("min", "max", "log", "unit"):
        if getattr(section, name) is not None:
            given = getattr(section, name)
            raise ScenarioError(path, f"{where}.{name}", "is for numbers, not for words", given)


def _knob(section: KnobSection, scenario: Scenario, path: Path) -> LiveParameter:
    key, found = section.key, look_up(scenario, section.key, path)
    about, restart = meaning(scenario, found), found.parts[0] in _FROM_THE_START
    label = about.label if section.label is None else section.label
    choices = _choices(scenario, found)
    if choices:
        return LiveParameter(key, label, "", 0.0, 0.0, False, str(found.value), restart, choices)
    value = _number(found, key, path)
    unit = about.unit if section.unit is None else section.unit
    low, high, log = _range(section, value, about)
    # A missing end, and a value that is not positive any more.
    if low is None:
        low = DECADE * value
    if high is None:
        high = value / DECADE if value < 0.0 else 1.0
    low, high = min(low, value), max(high, value)
    return LiveParameter(key, label, unit, low, high, log and low > 0, value, restart)


def meaning(scenario: Scenario, found: Found) -> Parameter:
    """Return what the description of its table says of a number of `scenario`.

    The label says whose it is, the unit is that of the table's other values.
    """
    owner: object = scenario
    prefix: list[str] = []
    for i, part in enumerate(found.parts):
        about = _description(owner, part)
        if about is not None:
            inner = found.parts[i + 1 :]
            label = about.label or part.replace("_", " ")
            unit = owner.unit_of(part) if isinstance(owner, Component) else about.unit
            return replace(about, label=_named(prefix, _inside(label, inner), scenario), unit=unit)
        prefix.append(part)
        owner = child_of(owner, part)
    *tables, last = found.parts
    return Parameter(label=f"{'.'.join(tables[1:])} {last.replace('_', ' ')}".strip())


def _description(owner: object, name: str) -> Parameter | None:
    if isinstance(owner, BaseModel):
        info = type(owner).model_fields.get(name)
        return next((m for m in info.metadata if isinstance(m, Parameter)), None) if info else None
    return parameters_of(owner).get(name)


def _inside(label: str, inner: list[str]) -> str:
    """Return the label of a part of a vector or table."""
    if not inner:
        return label
    (part,) = inner
    if label == "rpy deg":
        return ("roll", "pitch", "yaw")[int(part)]
    axis = "xyz"[int(part)] if part in ("0", "1", "2") else f"of {part}"
    return axis if label == "xyz" else f"{label} {axis}"


def _named(tables: list[str], label: str, scenario: Scenario) -> str:
    """Return `label` with the name of the item that it belongs to."""
    if tables and tables[0] in ("contact", "source"):
        several = len(scenario.contact) + len(scenario.source) > 1
        return f"{tables[1]}: {label}" if several else label
    return f"{tables[1]} {label}" if len(tables) > 1 else label
