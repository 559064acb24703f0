"""What the workers of a sweep get, and what one run leaves behind."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from sphshell_pin.base.regular_file import open_regular
from sphshell_pin.errors import import_extra
from sphshell_pin.scenario.format.reading import find_scenario
from sphshell_pin.scenario.format.schema import Scenario

DONE, FAILED = "done", "failed"


@dataclass(frozen=True)
class Run:
    """One run of a sweep: its `number`, counted from zero, and the `changes` by dotted key."""

    number: int
    changes: Mapping[str, str]


@dataclass(frozen=True)
class Outcome:
    """What a run left behind."""

    number: int
    status: str
    """DONE or FAILED."""
    error: str
    """Why it failed, in one sentence; empty otherwise."""
    figures: Mapping[str, float]


@dataclass(frozen=True)
class Job:
    """What all runs of a sweep share; it goes to each worker."""

    name: str
    """A shipped scenario's name, or the absolute path of a file."""
    shipped: bool
    scenario: Scenario
    """As read and changed by --set, before any value is varied."""
    sample: Run
    """A run that could be built where the sweep began: a worker must be able to as well."""
    verdicts: bool
    """Whether the scenario's expectations are judged."""
    files: Mapping[str, str]
    """Digests of the surfaces, robots and routines beside the scenario, by name."""
    versions: Mapping[str, str]
    token: str
    """Identifies this job."""

    @property
    def path(self) -> Path:
        """The scenario's file; a shipped one may stand elsewhere on a worker's machine."""
        return find_scenario(self.name) if self.shipped else Path(self.name)


def need(module: str) -> ModuleType:
    """Return the optional `module`.

    Raises
    ------
    MissingExtra
        It is not installed.
    """
    return import_extra(module, "sweep", "a sweep")


def digest(data: object) -> str:
    """Return the SHA-256 of `data`, made of what JSON knows, in hexadecimal digits."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def files_of(scenario: Scenario) -> set[str]:
    """Return the files that `scenario` names: surfaces, robots, Python routines, tables of laws."""
    routines = [one.find for one in scenario.source] + list(scenario.figures.values())
    named = [one.file for one in scenario.shell]
    named += [name for one in scenario.robot for name in (one.path, one.srdf)]
    stated = [scenario.controller]
    for one in scenario.contact:
        stated += one.law, one.friction
    for other in scenario.source:
        stated += other.law, other.friction
    named += [file for one in stated for file in one.files]
    named += [routine.rpartition(":")[0] for routine in routines]
    return {name for name in named if name}


def digest_files(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """Return the SHA-256 of each file of `names` in `folder`; "absent" for what is no file."""
    found = {}
    for name in sorted(names):
        path = folder / name
        found[name] = "absent"
        if os.path.isfile(path):
            with open_regular(path) as file:
                found[name] = hashlib.file_digest(file, "sha256").hexdigest()
    return found
