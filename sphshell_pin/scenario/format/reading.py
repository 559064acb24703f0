"""From a scenario file to a Scenario: find it, read it, change values, report what is wrong."""

import functools
import importlib
import os
import re
import shlex
import tomllib
import typing
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from pydantic import ValidationError

from sphshell_pin.base.parameters import parameters_of
from sphshell_pin.base.regular_file import MOST_TEXT, StrPath, read_text, why_no_file
from sphshell_pin.base.texts import counted
from sphshell_pin.dynamics.run.integrators import Integrator
from sphshell_pin.dynamics.sensing.sensors import Sensor
from sphshell_pin.errors import NameNotFound, ScenarioError, did_you_mean
from sphshell_pin.scenario.format.schema import LISTS, STEPPING, RunSection, Scenario
from sphshell_pin.shell.readers import SUFFIXES

TOO_DEEP = "is not valid TOML: its tables or lists are nested too deeply"
# A key of a hundred parts: the time and memory of tomllib grow with their square.
_LONG_KEY = re.compile(r"""(?<![\w.-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){100}""")
# What tomllib gives: tables, lists and values in each other.
Toml: TypeAlias = Any

_ROBOT_SUFFIXES = (".urdf", ".xacro", ".xml", ".mjcf")


def shipped_scenarios() -> dict[str, Path]:
    """Return the files of the shipped scenarios by name."""
    # The folder stands at the top of the repository and is installed inside the package.
    folder = Path(str(importlib.import_module("sphshell_pin.scenarios").__file__)).parent
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def find_scenario(name: StrPath) -> Path:
    """Return the file of a shipped scenario's name or of a path.

    Raises
    ------
    NameNotFound
        Neither a file nor a shipped scenario.
    """
    path = Path(name)
    if os.path.isfile(path):
        suffix, quoted = path.suffix.lower(), shlex.quote(str(path))
        if suffix in SUFFIXES:
            must = f"is a surface: sphshell-pin new --robot ROBOT --surface {quoted}"
            raise ScenarioError(path, "", f"{must} writes a scenario")
        if suffix in _ROBOT_SUFFIXES:
            must = f"is a robot: sphshell-pin new --robot {quoted} --surface SURFACE"
            raise ScenarioError(path, "", f"{must} writes a scenario")
        return path
    shipped = shipped_scenarios()
    if str(name) in shipped:
        return shipped[str(name)]
    beside = path.with_name(f"{path.name}.toml") if path.name else path
    if os.path.isfile(beside):
        raise ScenarioError(path, "", f"no such file; did you mean {beside}?")
    if os.path.isdir(path):
        raise ScenarioError(path, "", "is a folder: give the .toml file of a scenario")
    if path.suffix == ".toml" or len(path.parts) > 1:
        raise ScenarioError(path, "", why_no_file(path))
    raise NameNotFound("scenario", str(name), "beside .toml files, sphshell-pin", shipped)


def read_scenario(path: StrPath, changes: Mapping[str, str] | None = None) -> Scenario:
    """Read and check the scenario at `path`, with values changed by dotted key.

    `changes` maps keys such as "run.dt" or "contact.tip-blade.law.stiffness" (list items by their
    name, their label, or their index) to values as TOML writes them; anything else is text.

    Raises
    ------
    ScenarioError
        Unreadable file, wrong TOML, or a key or value that no scenario may have.
    """
    scenario = parse_scenario(_read_text(path), path)
    return change_scenario(scenario, changes, path) if changes else scenario


def parse_scenario(text: str, path: StrPath) -> Scenario:
    """Read and check the scenario that `text` says; `path` is the file it belongs to.

    Raises
    ------
    ScenarioError
        Wrong TOML, or a key or value that no scenario may have.
    """
    if long := _LONG_KEY.search(text):
        line = text.count("\n", 0, long.start()) + 1
        raise ScenarioError(path, "", f"is not valid TOML: line {line} has a key of 100 parts")
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(path, "", f"is not valid TOML: {error}") from None
    except ValueError:  # of int(), whose texts are limited
        raise ScenarioError(path, "", "is not valid TOML: a number has too many digits") from None
    except RecursionError:
        raise ScenarioError(path, "", TOO_DEEP) from None
    return _validated(data, path)


def change_scenario(scenario: Scenario, changes: Mapping[str, str], path: StrPath) -> Scenario:
    """Return `scenario`, read from `path`, with more values changed as `read_scenario` does.

    Raises
    ------
    ScenarioError
        A key or a value that no scenario may have.
    """
    data = scenario.model_dump(exclude_unset=True)
    change_data(data, {key: parse_value(text) for key, text in changes.items()}, scenario, path)
    return _validated(data, path)


def change_data(
    data: dict[str, Toml], changes: Mapping[str, Toml], scenario: Scenario, path: StrPath
) -> None:
    """Put values in place of those of `data`, which the file of `scenario` at `path` gives.

    Raises
    ------
    ScenarioError
        A key that no scenario may have.
    """
    for key, value in changes.items():
        whole = _with_table(key, data)
        if whole != key:
            raise ScenarioError(path, key, f"unknown key; did you mean '{whole}'?", value)
        _change(data, key, value, path, scenario)
    if "run.integrator" in changes:
        # Another kind of integrator has no use for the step or the tolerances of the file's.
        kind = Integrator.kinds.get(str(changes["run.integrator"]))
        for key in set(STEPPING) - set(parameters_of(kind)):
            if f"run.{key}" not in changes:
                data["run"].pop(key, None)


def _with_table(key: str, data: Mapping[str, Toml]) -> str:
    """Return `key` with the table that was left out before it, if that is run or controller."""
    if key.partition(".")[0] not in Scenario.model_fields:
        for table, known in (
            ("run", RunSection.model_fields),
            ("controller", data.get("controller", {})),
        ):
            if key in known:
                return f"{table}.{key}"
    return key


class Found(NamedTuple):
    """What is at a dotted key of a scenario."""

    value: Toml
    key: str
    """The key with all names spelled out."""
    parts: list[str]
    """The names of `key`, which may hold dots."""


def look_up(scenario: Scenario, key: str, path: StrPath) -> Found:
    """Return what is at a dotted key of `scenario`.

    Raises
    ------
    ScenarioError
        The scenario, read from `path`, has no such key.
    """
    data = scenario.model_dump()
    node, last, trail = _descend(data, key, path)
    numbers = [str(i) for i in range(len(node))] if isinstance(node, list) else []
    if last not in (numbers or node):
        named = [_item_name(item) for item in node if isinstance(item, dict)] if numbers else node
        known = [one for one in named if one] or numbers
        hint = did_you_mean(last, known)
        reason = f"the scenario has no '{last}' there; {hint}{hint and ' '}there are: "
        raise ScenarioError(path, key, reason + _listed(known))
    value = node[int(last)] if isinstance(node, list) else node[last]
    return Found(value, ".".join([*trail, last]), [*trail, last])


def full_name(scenario: Scenario, key: str, path: StrPath) -> str:
    """Return the key with all names spelled out; one that is not in the scenario as it is."""
    try:
        return look_up(scenario, key, path).key
    except ScenarioError:
        return key


def owner_of(scenario: Scenario, parts: Iterable[str]) -> object:
    """Return the table or object of `scenario` at the names `parts`; None if there is none."""
    whole: object = scenario
    return functools.reduce(child_of, parts, whole)


def child_of(owner: object, part: str) -> object:
    """Return what `owner`, a table, list or object, has under a name; None if it has not."""
    if isinstance(owner, list):
        names = [_name_of(one) for one in owner]
        at = int(part) if part.isdecimal() else None
        at = names.index(part) if part and part in names else at
        return None if at is None else owner[at]
    return owner.get(part) if isinstance(owner, Mapping) else getattr(owner, part, None)


def _validated(data: dict[str, Toml], path: StrPath) -> Scenario:
    try:
        scenario = Scenario.model_validate(data)
    except ValidationError as error:
        raise _explain(error, path, data) from None
    for loc, value in _taken_for_numbers(data, scenario):
        reason = f"must be a number, not {'a text' if isinstance(value, str) else 'true or false'}"
        raise ScenarioError(path, _key_at(loc, data, ends=False), reason, value)
    return scenario


def _taken_for_numbers(
    data: Toml, read: object, loc: tuple[int | str, ...] = ()
) -> Iterator[tuple[tuple[int | str, ...], str | bool]]:
    """Yield the texts and truth values of `data` that pydantic has `read` as numbers."""
    if isinstance(data, Mapping) and isinstance(read, list):  # a table alone, of LISTS
        data = [data]
    if isinstance(data, Mapping):
        for key, one in data.items():
            found = read.get(key) if isinstance(read, Mapping) else getattr(read, key, None)
            yield from _taken_for_numbers(one, found, (*loc, key))
    elif isinstance(data, list) and isinstance(read, list | tuple):
        for k, (one, found) in enumerate(zip(data, read, strict=False)):
            yield from _taken_for_numbers(one, found, (*loc, k))
    elif isinstance(data, str | bool) and type(read) in (int, float):
        yield loc, data


def item_key(table: str, items: Sequence[Toml], index: int) -> str:
    """Return the dotted key of an item of a list: by its label or name, else by its index."""
    names = [_name_of(one) for one in items]
    name = names[index]
    return f"{table}.{name}" if name and names.count(name) == 1 else f"{table}[{index}]"


def _read_text(path: StrPath) -> str:
    try:
        return read_text(path, MOST_TEXT)
    except OSError as error:
        raise ScenarioError(path, "", f"cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ScenarioError(path, "", "is not a text file in UTF-8") from None


def parse_value(text: str) -> Toml:
    """Return the value that --set states: in TOML, else the text itself."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text


def _change(
    data: dict[str, Toml], key: str, value: Toml, path: StrPath, scenario: Scenario
) -> None:
    """Put `value` in place of the one at the dotted `key`; names of list items may hold dots.

    `data` is what the file of `scenario` gives.
    """
    node, rest, _ = _descend(data, key, path)
    whole, _, index = key.rpartition(".")
    if index.isdecimal() and not isinstance(node, list):
        # One number of a list that stands at its default.
        default = look_up(scenario, whole, path).value
        if isinstance(default, list):
            _change(data, whole, list(default), path, scenario)
            _change(data, key, value, path, scenario)
            return
    if isinstance(node, list):
        if rest.isdecimal() and int(rest) < len(node):
            node[int(rest)] = value
            return
        names = [_item_name(item) for item in node if isinstance(item, dict)]
        raise ScenarioError(path, key, f"no item '{rest}'; there are: {_listed(names)}")
    # A table that the file does not have yet (it stands at its defaults) is made.
    *tables, last = rest.split(".")
    for table in tables:
        node = node.setdefault(table, {})
        if not isinstance(node, dict):
            raise ScenarioError(path, key, f"'{table}' holds no further keys", value)
    node[last] = value


def _descend(data: dict[str, Toml], key: str, path: StrPath) -> tuple[Toml, str, list[str]]:
    """Follow the dotted `key` as far as `data` goes: table or list, the rest, the names so far."""
    rest, trail = key, list[str]()
    node: Toml = data
    while True:
        if isinstance(node, list):
            heads = {_item_name(item): item for item in node if isinstance(item, dict)}
            heads |= {str(i): item for i, item in enumerate(node)}
        else:
            heads = node
        head = next((h for h in heads if h and rest.startswith(f"{h}.")), None)
        if head is None:
            alone = isinstance(node, list) and len(node) == 1 and trail[-1] in LISTS
            if not alone or rest.split(".")[0] not in _keys_of(trail[-1]):
                return node, rest, trail
            # The name of a table alone may be left out of the key.
            node, trail = node[0], [*trail, _spelled_out(node, "0")]
            continue
        if not isinstance(heads[head], dict | list):
            raise ScenarioError(path, key, f"'{head}' is a value, it holds no further keys")
        single = node is data and head in LISTS and isinstance(heads[head], dict)
        trail = [*trail, _spelled_out(node, head)]
        rest, node = rest[len(head) + 1 :], heads[head]
        # A table alone is a list of one: its name or number may stand in the key as in a list's.
        if single:
            rest = rest.removeprefix("0.")
        if single and (name := _item_name(node)) not in node:
            rest = rest.removeprefix(f"{name}.")


def _spelled_out(node: Toml, head: str) -> str:
    """Return the name of the item that `head` is the index of, where that name tells it."""
    if not isinstance(node, list) or not head.isdecimal() or not isinstance(node[0], dict):
        return head
    names = [_item_name(item) for item in node]
    name = names[int(head)] if int(head) < len(names) else ""
    return name if name and names.count(name) == 1 else head


def _keys_of(table: str) -> Iterable[str]:
    """Return the keys that a table of a list of LISTS may have."""
    (section,) = typing.get_args(Scenario.model_fields[table].annotation)
    if table == "sensor":
        return {key for kind in Sensor.kinds.values() for key in parameters_of(kind)}
    return section.model_fields  # type: ignore[no-any-return]


def _item_name(item: Mapping[str, object]) -> str:
    return _name_of(item) or str(item.get("urdf") or "")


def _name_of(item: object) -> str:
    """Return the label or the name of a table, as data or as an object; "" if it has none."""
    get = item.get if isinstance(item, Mapping) else functools.partial(getattr, item)
    return str(get("label", "") or get("name", "") or "")


def _explain(error: ValidationError, path: StrPath, data: Mapping[str, Toml]) -> ScenarioError:
    """Turn the first of pydantic's complaints into one sentence with the valid choices."""
    details = sorted(error.errors(), key=lambda one: one["type"] != "unknown_key")
    first = details[0]
    kind, context, value = first["type"], first.get("ctx", {}), first["input"]
    loc = first["loc"]
    if kind == "unknown_key":
        loc, value = (*loc, context["key"]), context["value"]
    reason = first["msg"].removeprefix("Value error, ").removeprefix("Input ")
    reason = reason[:1].lower() + reason[1:]
    if kind == "missing":
        reason, value = "is missing", None
    elif kind in ("model_type", "dataclass_type"):
        reason = "must be a table { key = value, ... }"
    elif kind in ("list_type", "tuple_type", "sequence_str") or context.get("class") == "Sequence":
        reason = "must be a list [ ... ]"
    elif kind == "too_short":
        least, count = context["min_length"], context["actual_length"]
        reason = f"must have at least {counted(least, 'item')}, not {count}"
    if len(details) > 1:
        reason += f" (and {len(details) - 1} more: first repair this one)"
    if kind not in ("model_type", "dataclass_type", "unknown_key"):
        value = value if isinstance(value, str | int | float | bool) else None
    return ScenarioError(path, _key_at(loc, data, ends=kind == "missing"), reason, value)


def _key_at(loc: Sequence[int | str], data: object, *, ends: bool) -> str:
    """Return the dotted key of a pydantic location in `data`; `ends`: its last part is missing.

    Other names that `data` does not have are those of the branches of a union.
    """
    key, node = "", data
    for k, part in enumerate(loc):
        if isinstance(part, int):
            items = node if isinstance(node, list) else [node]
            key = item_key(key, items, part) if part < len(items) else f"{key}[{part}]"
            node = items[part] if part < len(items) else None
        elif isinstance(node, Mapping) and (part in node or (ends and k == len(loc) - 1)):
            name = f'"{part}"' if "." in part else part
            key = f"{key}.{name}" if key else name
            node = node.get(part)
    return key


def _listed(names: Iterable[str]) -> str:
    return ", ".join(name for name in names if name) or "none"
