"""Fits parameters of a scenario to measured data."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.base.texts import counted
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.scenario.format import reading
from sphshell_pin.scenario.format.build import build_scenario
from sphshell_pin.scenario.format.schema import Scenario
from sphshell_pin.scenario.format.sliders import check_knobs
from sphshell_pin.study.fit.data import Experiment, Source, read_experiment
from sphshell_pin.study.fit.parameters import Free, Wanted, free_parameters
from sphshell_pin.study.fit.report import Fit
from sphshell_pin.study.fit.search import Progress, Search, Trial

Data = Source | Experiment | Sequence[Source | Experiment]


def fit(
    scenario: StrPath,
    data: Data,
    parameters: Wanted,
    *,
    changes: Mapping[str, object] | None = None,
    columns: Collection[str] | None = None,
    level: float = 0.95,
    progress: Progress | None = None,
) -> Fit:
    """Fit parameters of a scenario to measured data, by least squares over whole runs.

    Parameters
    ----------
    scenario : name of a shipped scenario, or path of a file
    data : a csv file, columns by their headers, an Experiment, or a sequence of these. A header is
        a name with its unit: "t [s]", "pairs.PAIR.normal_force [N]", "q.JOINT [rad]". A column
        "NAME.sigma" has the standard deviations of NAME; others are estimated from the residuals
    parameters : keys such as "contact.tip.law.stiffness", KEY=LO:HI with a range that the value
        must stay in, or a mapping from keys to ranges (low, high) (None: the bounds of the key).
        The scenario's values are where the search starts
    changes : values by dotted key that differ from the file's in all experiments
    columns : names of the columns to use; by default all
    level : probability of the intervals
    progress : called after each run with the number of runs and the misfit: the root of the mean
        square of the weighted residuals

    Returns
    -------
    Fit

    Raises
    ------
    DataError
        What is wrong with the data, and where.
    ScenarioError, InvalidParameter, NameNotFound
        A key, a value or a name that is wrong.
    SphshellError
        The run at the start values fails: why.
    """
    if not 0.0 < level < 1.0:
        raise InvalidParameter("level", level, "must lie between 0 and 1")
    path = reading.find_scenario(scenario)
    texts = {key: str(value) for key, value in (changes or {}).items()}
    base = reading.read_scenario(path, texts)
    free = free_parameters(parameters, base, path)
    trials = _trials(base, path, free, data, columns)
    search = Search(trials, free, progress)
    search.run()
    return search.report(str(scenario), level)


def _trials(
    base: Scenario, path: Path, free: Sequence[Free], data: Data, columns: Collection[str] | None
) -> list[Trial]:
    several = isinstance(data, Sequence) and not isinstance(data, str)
    given: Sequence[Source | Experiment] = data if several else [data]  # type: ignore[list-item, assignment]
    if not given:
        raise InvalidParameter("data", [], "must be at least one csv file or experiment")
    trials: list[Trial] = []
    for number, one in enumerate(given, 1):
        experiment = one if isinstance(one, Experiment) else Experiment(one)
        texts = {key: str(value) for key, value in experiment.changes.items()}
        for key, text in texts.items():
            if any(reading.full_name(base, key, path) in one.keys for one in free):
                raise InvalidParameter(key, text, "is fitted, so no experiment can set it")
        scenario = reading.change_scenario(base, texts, path) if texts else base
        check_knobs(scenario, path, ranges=False)
        trial = Trial(build_scenario(scenario, path, trials[-1].built if trials else None))
        known = {name: unit for name, (unit, _) in trial.measure(np.zeros(1)).items()}
        series = read_experiment(experiment, number, known, scenario.run.duration, columns)
        trials.append(replace(trial, data=series))
    size = sum(len(one.t) for trial in trials for one in trial.data)
    if size <= len(free):
        must = f"must be more than parameters, of which there are {len(free)}"
        raise InvalidParameter("data", size, must, given=f"with {counted(size, 'value')}")
    return trials
