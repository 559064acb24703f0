"""A scenario's file with other values in place; comments and order stay."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from sphshell_pin.errors import ScenarioError
from sphshell_pin.scenario.format.reading import change_scenario, look_up, parse_scenario
from sphshell_pin.scenario.format.schema import Scenario
from sphshell_pin.study.sweep.job import files_of

# What a value may look like: numbers and words, texts, lists without lists in them.
_VALUES = (
    r"(?<![\w.+-])[+-]?(?:\d[\d_]*(?:\.[\d_]*)?(?:[eE][+-]?\d+)?|inf|nan)(?![\w.])|\btrue\b|\bfalse\b",
    r'"(?:[^"\n\\]|\\.)*"|\'[^\'\n]*\'',
    r"\[[^\[\]\n]*\]",
)
_STRING = re.compile(_VALUES[1])
# Where a key may be added: at the start of an inline table, below the head of a table.
_BRACE = re.compile(r"\{(?=[^\n]*\})")
_HEAD = re.compile(r"^[ \t]*\[{1,2}[^\[\]\n]+\]{1,2}[ \t]*(?:#[^\n]*)?$", re.MULTILINE)


def scenario_text(source: Path, changes: Mapping[str, str], folder: Path) -> str:
    """Return the text of the scenario at `source` with values changed by dotted key.

    `folder` is where the text will be a file: names of files are relative to it.

    Raises
    ------
    ScenarioError
        The file does not state a value, and there is no place for it in the tables that it has.
    """
    text = _with_values(source.read_text(encoding="utf-8"), source, changes)
    return _from_folder(text, source, folder)


def _with_values(text: str, source: Path, changes: Mapping[str, str]) -> str:
    waiting = dict(changes)
    while waiting:
        fault: ScenarioError | None = None
        for key, value in list(waiting.items()):
            try:
                text = _with_value(text, source, key, value)
            except ScenarioError as now:
                fault = fault or now
                continue
            del waiting[key]
            # Another one may have waited for this: mu_dynamic must not exceed mu_static.
            break
        else:
            assert fault is not None
            raise fault
    return text


def check_places(source: Path, keys: Iterable[str], changes: Mapping[str, str]) -> None:
    """Raise ScenarioError for a key of which `scenario_text` could not write a number."""
    text = _with_values(source.read_text(encoding="utf-8"), source, changes)
    for key in keys:
        scenario = parse_scenario(text, source)
        number = float(look_up(scenario, key, source).value)
        # Another number: the next one down, or up where the scenario cannot have that.
        down, up = (math.nextafter(number, end) for end in (-math.inf, math.inf))
        try:
            change_scenario(scenario, {key: repr(down)}, source)
        except ScenarioError:
            down = up
        _with_value(text, source, key, repr(down))


def _with_value(text: str, source: Path, key: str, value: str) -> str:
    """Return `text` with one value changed.

    Each place of a value is tried, until the text says what the changed scenario is: so it is right
    whatever form the file's tables have.
    """
    before = parse_scenario(text, source)
    wanted = change_scenario(before, {key: value}, source)
    if wanted == before:
        return text
    written = _as_toml(value)
    for candidate in _candidates(text, key, written):
        if _parsed(candidate, source) == wanted:
            return candidate
    whole, _, index = key.rpartition(".")
    if index.isdecimal() and isinstance(found := look_up(wanted, whole, source).value, list):
        # One number of a list that the file leaves at its default: state the list.
        return _with_value(text, source, whole, json.dumps(found))
    raise ScenarioError(
        source, key, "the file has no place for this value: state the key in it first", value
    )


def _candidates(text: str, key: str, value: str) -> Iterator[str]:
    for pattern in _VALUES:
        for found in re.finditer(pattern, text):
            yield text[: found.start()] + value + text[found.end() :]
    last = key.rpartition(".")[2]
    yield f"{last} = {value}\n{text}"
    for found in _BRACE.finditer(text):
        yield f"{text[: found.end()]} {last} = {value},{text[found.end() :]}"
    for found in _HEAD.finditer(text):
        yield f"{text[: found.end()]}\n{last} = {value}{text[found.end() :]}"


def _parsed(text: str, source: Path) -> Scenario | None:
    try:
        return parse_scenario(text, source)
    except ScenarioError:
        return None


def _as_toml(value: str) -> str:
    """Return a value as --set takes it as TOML writes it: other words are texts."""
    import tomllib

    try:
        tomllib.loads(f"value = {value}")
    except ValueError:
        return json.dumps(value)
    return value


def _from_folder(text: str, source: Path, folder: Path) -> str:
    """Return `text` with the names of the scenario's files as seen from `folder`."""
    here, there = source.parent.absolute(), folder.absolute()
    if here == there:
        return text
    scenario = parse_scenario(text, source)
    named = files_of(scenario) | {one for robot in scenario.robot for one in robot.package_dirs}

    def moved(found: re.Match[str]) -> str:
        name = found[0][1:-1]
        file, colon, function = name.partition(":") if ".py:" in name else (name, "", "")
        if file not in named or os.path.isabs(file):
            return found[0]
        return json.dumps(Path(os.path.relpath(here / file, there)).as_posix() + colon + function)

    return _STRING.sub(moved, text)
