"""A scenario's file with other values in place; comments and order stay."""

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit

from sphshell_pin.base.regular_file import read_text
from sphshell_pin.errors import ScenarioError
from sphshell_pin.scenario.format.reading import change_data, change_scenario, parse_scenario
from sphshell_pin.study.sweep.plan import files_of


def scenario_text(source: Path, changes: Mapping[str, str], folder: Path) -> str:
    """Return the text of the scenario at `source` with values changed by dotted key.

    `folder` is where the text will be a file: names of files are relative to it.

    Raises
    ------
    ScenarioError
        A key or a value that no scenario may have.
    """
    text = read_text(source)
    before = parse_scenario(text, source)
    wanted = change_scenario(before, changes, source)
    document = tomlkit.parse(text)
    values = {key: _value(text) for key, text in changes.items()}
    change_data(document, values, before, source)
    written = document.as_string()
    if parse_scenario(written, source) != wanted:
        keys = ", ".join(changes)
        raise ScenarioError(source, keys, "cannot be written into the file: state the keys in it")
    here, there = source.parent.absolute(), folder.absolute()
    named = files_of(before) | {one for robot in before.robot for one in robot.package_dirs}
    moved = [re.escape(one) for one in named if here != there and not os.path.isabs(one)]
    if not moved:
        return written
    # Between quotes, or before the name of a function.
    pattern, way = rf"""(?<=["'])(?:{"|".join(moved)})(?=["':])""", os.path.relpath(here, there)
    return re.sub(pattern, lambda one: os.path.normpath(os.path.join(way, one[0])), written)


def _value(text: str) -> Any:
    """Return a value as --set takes it, in its own spelling; other words are texts."""
    try:
        return tomlkit.value(text)
    except ValueError:
        return text
