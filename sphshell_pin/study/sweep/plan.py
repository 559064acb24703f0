"""What a sweep will do: its runs, checked before anything is computed."""

import hashlib
import json
import os
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from sphshell_pin.base.regular_file import StrPath, open_regular
from sphshell_pin.errors import InvalidParameter, ScenarioError, SphshellError
from sphshell_pin.scenario import Built, Scenario, find_scenario, read_scenario, shipped_scenarios
from sphshell_pin.scenario.format.build import build_scenario
from sphshell_pin.scenario.format.reading import change_scenario, full_name, look_up
from sphshell_pin.scenario.format.sliders import check_knobs, meaning
from sphshell_pin.scenario.running.figures import NOT_REPEATABLE, check_expectations, figure_units
from sphshell_pin.scenario.running.run import versions
from sphshell_pin.study.sweep.points import HOW, Dist, Points, Vary, grid_of, sample_of

Changes = Mapping[str, str]
"""Values of one run by dotted key."""


@dataclass(frozen=True)
class Job:
    """What all runs of a sweep share; it goes to each worker."""

    name: str
    """A shipped scenario's name, or the absolute path of a file."""
    scenario: Scenario
    """As read and changed by --set, before any value is varied."""
    sample: Changes
    """A run that could be built where the sweep began: a worker must be able to as well."""
    uses: Mapping[str, str]
    """Versions of libraries and digests of files beside the scenario, by name."""
    token: str
    """Identifies this job."""

    @property
    def path(self) -> Path:
        """The scenario's file; a shipped one may stand elsewhere on a worker's machine."""
        return Path(self.name) if os.path.isabs(self.name) else find_scenario(self.name)


@dataclass(frozen=True)
class Plan:
    """A sweep whose keys and values were checked."""

    points: Points
    runs: list[Changes]
    """What each run changes."""
    digests: list[str]
    """Digests of each run's settings, with the files and libraries that it uses."""
    figures: tuple[str, ...]
    """Columns that a finished run fills."""
    job: Job
    units: Mapping[str, str]
    """Units of keys and figures, those that are known."""


def plan_sweep(
    scenario: StrPath,
    vary: Vary | Iterable[str] | None = None,
    *,
    changes: Changes | None = None,
    dist: Dist | Iterable[str] | None = None,
    n: int | None = None,
    seed: int = 0,
    indices: bool = False,
) -> Plan:
    """Check all runs of a sweep, see `sweep`, and return what it will do."""
    refused: dict[str, object] = {"vary": vary}
    must = "is for values in a grid, dist for a sample: leave one of the two out"
    if dist is None:
        refused = {"n": n, "seed": seed, "indices": indices}
        must = "is for uncertain inputs: say them with dist"
    for name, value in refused.items():
        if value:
            raise InvalidParameter(name, value, must)
    if dist is not None:
        points = sample_of(dist, n, seed=seed, indices=indices)
    elif vary is not None:
        points = grid_of(vary)
    else:
        what = f"what varies, as {HOW}; or dist what is uncertain, as key=normal(mean,deviation)"
        raise InvalidParameter("vary", None, what, "must say")
    path, word = find_scenario(scenario), "vary" if dist is None else "dist"
    _check_keys(list(points.values), changes or {}, path, word)
    fixed = read_scenario(path, changes)
    runs: list[Changes] = [*points.changes]
    digests, uses = _check_runs(runs, fixed, path, sampled=dist is not None)
    probe, built = _build_one(runs, fixed, path)
    check_expectations(built)
    figures = sweep_figures(built)
    for key in points.values:
        if key in figures:
            must = "is what a column of figures is called: give each routine a figure of its own"
            raise InvalidParameter(word, key, must)
    shipped = path == shipped_scenarios().get(path.stem)
    name = path.stem if shipped else str(path.absolute())
    job = Job(name, fixed, probe, uses, digest([str(path.absolute()), digests]))
    # The unit of a key may follow another one that varies.
    ends = [changed(fixed, run, path) for run in (runs[0], runs[-1])]
    units = {name: unit for name, unit in figure_units(built).items() if unit not in ("", "1")}
    for key in points.values:
        unit, other = (_unit(one, key, path) for one in ends)
        if unit and unit == other:
            units[key] = unit
    return Plan(points, runs, digests, tuple(figures), job, units)


def sweep_figures(built: Built) -> list[str]:
    """Return the names of the figures that a row of a sweep has: all that repeat bit for bit."""
    names = [name for name in figure_units(built) if name not in NOT_REPEATABLE]
    return names + [f"met.{name}" for name in judged(built.scenario)]


def judged(scenario: Scenario) -> list[str]:
    """Return the figures of `scenario` that its expectations judge, without those of time."""
    return [name for name in scenario.expect if name not in NOT_REPEATABLE]


def changed(scenario: Scenario, changes: Changes, path: Path) -> Scenario:
    """Return the scenario of a run; a ScenarioError for what no scenario may have."""
    found = change_scenario(scenario, changes, path)
    check_knobs(found, path, ranges=False)
    return found


def digest(data: object) -> str:
    """Return the SHA-256 of `data`, made of what JSON knows, in hexadecimal digits."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def uses_of(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """Return the versions of libraries, and the SHA-256 of each file of `names` in `folder`."""
    found = versions()
    for name in sorted(names):
        path = folder / name
        found[name] = "absent"
        if os.path.isfile(path):
            with open_regular(path) as file:
                found[name] = hashlib.file_digest(file, "sha256").hexdigest()
    return found


def files_of(scenario: Scenario) -> set[str]:
    """Return the files that `scenario` names: surfaces, robots, Python routines, tables of laws."""
    routines = [one.find for one in scenario.source] + list(scenario.figures.values())
    named = [one.file for one in scenario.shell]
    named += [name for one in scenario.robot for name in (one.path, one.srdf)]
    stated = [scenario.controller]
    for pair in scenario.contact:
        stated += pair.law, pair.friction
    for source in scenario.source:
        stated += source.law, source.friction
    named += [file for part in stated for file in part.files]
    named += [routine.rpartition(":")[0] for routine in routines]
    return {name for name in named if name}


def _check_runs(
    runs: list[Changes], scenario: Scenario, path: Path, *, sampled: bool
) -> tuple[list[str], dict[str, str]]:
    """Return the digests of all runs, and all that they use.

    Raises
    ------
    ScenarioError
        A key that no scenario has, or a value that no run may have.
    InvalidParameter
        A distribution that reaches such values.
    """
    uses = uses_of(path.parent, ())
    digests, faults = [], list[ScenarioError]()
    for run in runs:
        try:
            one = changed(scenario, run, path)
        except ScenarioError as fault:
            faults.append(fault)
            if not sampled or len(faults) == len(runs):
                raise
            continue
        files = files_of(one)
        if not files <= uses.keys():
            uses |= uses_of(path.parent, files - uses.keys())
        used = {name: uses[name] for name in (*versions(), *files)}
        digests.append(digest([path.stem, one.model_dump(mode="json"), used]))
    if faults:
        raise InvalidParameter(
            "dist",
            len(faults),
            f"points of {len(runs)} have a value that is not allowed; the first: {faults[0]}; "
            "take a distribution that does not reach it: lognormal(median,factor) is positive, "
            "uniform(low,high) has two ends",
            f"does not fit: {len(faults)}",
        )
    return digests, uses


def _check_keys(keys: list[str], changes: Changes, path: Path, word: str) -> None:
    """Refuse two keys for one value: which of them holds would be a matter of order."""
    scenario = read_scenario(path)
    more = "put all its values together" if word == "vary" else "leave one of the two out"
    # What is not in the file: read_scenario raises if no file may have it.
    meant, fixed = ([full_name(scenario, key, path) for key in some] for some in (keys, changes))
    for key, whole in zip(keys, meant, strict=True):
        if meant.count(whole) > 1:
            raise InvalidParameter(word, key, f"is given twice: {more}")
        if whole in fixed:
            raise InvalidParameter(word, key, "is set as well: leave one of the two out")


def _unit(scenario: Scenario, key: str, path: Path) -> str:
    try:
        return meaning(scenario, look_up(scenario, key, path)).unit
    except ScenarioError:
        return ""  # not in the file; read_scenario raises if no file may have it


def _build_one(runs: list[Changes], scenario: Scenario, path: Path) -> tuple[Changes, Built]:
    """Build the first run, or else the last: where neither can be, no run can be built."""
    faults: list[SphshellError] = []
    for run in (runs[0], runs[-1]):
        try:
            with warnings.catch_warnings(action="ignore"):
                return run, build_scenario(changed(scenario, run, path), path)
        except SphshellError as fault:
            faults.append(fault)
    raise faults[0]
