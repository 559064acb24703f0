"""Numbers of contacts that change while all else stays: in a scene of the same model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from pydantic import BaseModel

import sphshell_pin as sp
from sphshell_pin.base.named_numbers import with_value
from sphshell_pin.base.parameters import Component, parameters_of
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.scenario.format.reading import parse_value
from sphshell_pin.scenario.format.schema import ContactSection, SourceSection

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
    simulation = sp.Simulation(scene, built.simulation.integrator, built.simulation.sensors)
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
    pair: sp.results.ContactPair,
    entry: Entry,
    built: Built,
    parts: Mapping[str, Mapping[str, float]],
) -> sp.results.ContactPair:
    if "sphere" in parts:
        pair = with_value(pair, ("side_i", "sphere", "radius"), parts["sphere"]["radius"])
    new = {
        part: getattr(entry, part)._build(built.path.parent)
        for part in ("law", "friction")
        if part in parts
    }
    return replace(pair, **new)
