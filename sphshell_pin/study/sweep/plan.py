"""What a sweep will do: its runs, checked before anything is computed."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from sphshell_pin.errors import InvalidParameter, ScenarioError, SphshellError
from sphshell_pin.scenario import Built, Scenario, find_scenario, read_scenario, shipped_scenarios
from sphshell_pin.scenario.format.build import build_scenario
from sphshell_pin.scenario.format.reading import full_name, look_up
from sphshell_pin.scenario.format.sliders import meaning
from sphshell_pin.scenario.running.figures import check_expectations, figure_units
from sphshell_pin.scenario.running.run import versions
from sphshell_pin.study.sweep.distributions import Dist
from sphshell_pin.study.sweep.grid import HOW, Axis, Value, Vary, axes_of, points_of, text_of
from sphshell_pin.study.sweep.job import Job, Run, digest, digest_files, files_of, need
from sphshell_pin.study.sweep.sampling import Design, design_of
from sphshell_pin.study.sweep.table import varied_columns
from sphshell_pin.study.sweep.worker import changed, sweep_figures, verdict_names

if TYPE_CHECKING:
    import pandas as pd

_START = re.compile(r"robot\.(?:\w+\.)?(start|speed)\.(.+)")


@dataclass(frozen=True)
class Plan:
    """A sweep whose keys and values were checked."""

    axes: tuple[Axis, ...]
    points: list[tuple[Value, ...]]
    """The values of each run, in the order of `axes`."""
    runs: list[Run]
    digests: list[str]
    """Digests of each run's settings."""
    figures: tuple[str, ...]
    """Columns that a finished run fills."""
    job: Job
    head: Mapping[str, object]
    """What the runs of this sweep share; those of another may not stand in its table."""
    design: Design | None
    """What the runs of a sample are for."""
    units: Mapping[str, str]
    """Units of keys and figures, those that are known."""

    @property
    def varied(self) -> pd.DataFrame:
        """The columns of the varied keys, as a pandas.DataFrame."""
        frame: pd.DataFrame = need("pandas").DataFrame(varied_columns(self.axes, self.points))
        return frame


def plan_sweep(
    scenario: str | PathLike[str],
    vary: Vary | Iterable[str] | None = None,
    *,
    changes: Mapping[str, str] | None = None,
    together: bool = False,
    verdicts: bool = False,
    dist: Dist | Iterable[str] | None = None,
    sample: str | None = None,
    n: int | None = None,
    seed: int = 0,
    indices: bool = False,
    tornado: bool = False,
) -> Plan:
    """Check all runs of a sweep, see `sweep`, and return what it will do."""
    refused: dict[str, object] = {"vary": vary, "together": together}
    must = "is for values in a grid, dist for a sample: leave one of the two out"
    if dist is None:
        refused = {"sample": sample, "n": n, "seed": seed, "indices": indices, "tornado": tornado}
        must = "is for uncertain inputs: say them with dist"
    for name, value in refused.items():
        if value:
            raise InvalidParameter(name, value, must)
    design = None
    if dist is not None:
        design = design_of(dist, sample, n, seed=seed, indices=indices, tornado=tornado)
        word, axes, points = "dist", design.axes, design.points
    elif vary is not None:
        word, axes = "vary", axes_of(vary)
        points = points_of(axes, together)
    else:
        what = f"what varies, as {HOW}; or dist what is uncertain, as key=normal(mean,deviation)"
        raise InvalidParameter("vary", None, what, "must say")
    path = find_scenario(scenario)
    _check_keys(axes, changes or {}, path, word)
    fixed = read_scenario(path, changes)
    runs = [
        Run(i, {axis.key: text_of(value) for axis, value in zip(axes, point, strict=True)})
        for i, point in enumerate(points)
    ]
    digests, names = _check_runs(runs, fixed, path, design)
    probe, built = _build_one(runs, fixed, path)
    figures = sweep_figures(built)
    if verdicts:
        check_expectations(built)
        figures += [f"met.{name}" for name in verdict_names(fixed)]
    for axis in axes:
        if axis.key in figures:
            raise InvalidParameter(
                word,
                axis.key,
                "is what a column of figures is called: give each routine a figure of its own",
            )
    shipped = path == shipped_scenarios().get(path.stem)
    files, used = digest_files(path.parent, names), versions()
    head = {"scenario": path.stem, "verdicts": verdicts, "files": files, "versions": used}
    job = Job(
        name=path.stem if shipped else str(path.absolute()),
        shipped=shipped,
        scenario=fixed,
        sample=probe,
        verdicts=verdicts,
        files=files,
        versions=used,
        token=digest([str(path.absolute()), head, digests]),
    )
    units = _units(axes, runs, fixed, built)
    return Plan(axes, points, runs, digests, tuple(figures), job, head, design, units)


def _check_runs(
    runs: list[Run], scenario: Scenario, path: Path, design: Design | None
) -> tuple[list[str], set[str]]:
    """Return the digests of all runs' settings, and the files that they name.

    Raises
    ------
    ScenarioError
        A key that no scenario has, or a value that no run may have.
    InvalidParameter
        A distribution that reaches such values.
    """
    digests, names = [], set[str]()
    faults: list[ScenarioError] = []
    for run in runs:
        try:
            one = changed(scenario, run, path)
        except ScenarioError as fault:
            faults.append(fault)
            if design is None or len(faults) == len(runs):
                raise
        else:
            digests.append(digest(one.model_dump(mode="json")))
            names |= files_of(one)
    if faults:
        raise InvalidParameter(
            "dist",
            len(faults),
            f"points of {len(runs)} have a value that is not allowed; the first: {faults[0]}; "
            "take a distribution that does not reach it: lognormal(median,factor) is positive, "
            "uniform(low,high) has two ends",
            f"does not fit: {len(faults)}",
        )
    return digests, names


def _check_keys(axes: Iterable[Axis], changes: Mapping[str, str], path: Path, word: str) -> None:
    """Refuse two keys for one value: which of them holds would be a matter of order."""
    scenario = read_scenario(path)
    more = "put all its values together" if word == "vary" else "leave one of the two out"
    keys = [axis.key for axis in axes]
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


def _units(
    axes: tuple[Axis, ...], runs: list[Run], scenario: Scenario, built: Built
) -> dict[str, str]:
    """Return the units of figures and axes, but of axes whose unit follows another that varies."""
    units = dict(figure_units(built))
    ends = [changed(scenario, run, built.path) for run in (runs[0], runs[-1])]
    for axis in axes:
        unit, other = (_unit(one, axis.key, built.path) for one in ends)
        found = _START.fullmatch(axis.key)
        if found and len(scenario.robot) == 1:
            # A start value has the unit of the joint, which the built scene knows.
            unit = other = units.get(f"final.{'q' if found[1] == 'start' else 'v'}.{found[2]}", "")
        if unit and unit == other:
            units[axis.key] = unit
    return units


def _build_one(runs: list[Run], scenario: Scenario, path: Path) -> tuple[Run, Built]:
    """Build the first run, or else the last: where neither can be, no run can be built."""
    faults: list[SphshellError] = []
    for run in (runs[0], runs[-1]):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return run, build_scenario(changed(scenario, run, path), path)
        except SphshellError as fault:
            faults.append(fault)
    raise faults[0]
