"""What happens in a worker: the scenario is built once, then changed and run again and again."""

import os
import platform
import signal
import threading
import warnings
from dataclasses import replace
from pathlib import Path

from sphshell_pin.dynamics import Result
from sphshell_pin.errors import Interrupted, SphshellError, SweepError
from sphshell_pin.scenario import Built, judge
from sphshell_pin.scenario.format.build import build_scenario
from sphshell_pin.scenario.format.reading import change_scenario
from sphshell_pin.scenario.format.schema import Scenario
from sphshell_pin.scenario.format.sliders import check_knobs, with_numbers
from sphshell_pin.scenario.running.figures import (
    MORE_STATS,
    NOT_REPEATABLE,
    figure_names,
    measuring,
)
from sphshell_pin.scenario.running.run import simulate, versions
from sphshell_pin.study.sweep.job import DONE, FAILED, Job, Outcome, Run, digest_files

_MORE_OF_PAIR = ("impulse", "peak_force_time")

# One run at a time: the threads of a Dask worker take turns, as a scenario's own routines may
# share what they remember.
_turn = threading.Lock()
# What was built last, by the job's token: its surfaces and robots serve the next run.
_built: dict[str, Built] = {}


def sweep_figures(built: Built) -> list[str]:
    """Return the names of the figures that a row of a sweep has: all that repeat bit for bit."""
    names = [name for name in figure_names(built) if name not in NOT_REPEATABLE]
    names += [f"pairs.{pair.name}.{one}" for pair in built.scene.pairs for one in _MORE_OF_PAIR]
    return names + list(MORE_STATS)


def verdict_names(scenario: Scenario) -> list[str]:
    """Return the figures of `scenario` that its expectations judge, without those of time."""
    return [name for name in scenario.expect if name not in NOT_REPEATABLE]


def changed(scenario: Scenario, run: Run, path: Path) -> Scenario:
    """Return the scenario of `run`.

    Raises
    ------
    ScenarioError
        A key or a value that no scenario may have.
    """
    found = change_scenario(scenario, run.changes, path)
    check_knobs(found, path, ranges=False)
    return found


def dask_setup(_: object) -> None:
    """Let a worker that this sweep starts, by Dask's name for such a hook, not end by Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def run_one(job: Job, run: Run) -> Outcome:
    """Build and run the scenario of `run`; a fault of that run is part of the outcome.

    Raises
    ------
    SweepError
        This worker cannot do any run of the job.
    """
    with _turn:
        if job.token not in _built:
            prepare(job)
        return _try_run(job, run)


def prepare(job: Job) -> None:
    """Make this process ready for the runs of `job`.

    Raises
    ------
    SweepError
        It cannot run them: other versions, other files, a scenario that cannot be built here.
    """
    here, this = versions(), f"worker {platform.node()}:{os.getpid()}"
    other = [f"{name} {here[name]}" for name in here if here[name] != job.versions[name]]
    if other:
        wanted = ", ".join(f"{name} {version}" for name, version in job.versions.items())
        raise SweepError(f"{this} has {', '.join(other)}; the sweep was started with {wanted}")
    try:
        path = job.path
        for name, digest in digest_files(path.parent, job.files).items():
            if digest != job.files[name]:
                have = "no" if digest == "absent" else "another"
                raise SweepError(f"{this} has {have} file {path.parent / name}")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            built = build_scenario(changed(job.scenario, job.sample, path), path)
    except SweepError:
        raise
    except Exception as fault:
        # Most faults cannot be sent from one process to another; their sentence can.
        raise SweepError(f"{this} cannot build the scenario: {_sentence(fault)}") from None
    _built.clear()
    _built[job.token] = built


def _try_run(job: Job, run: Run) -> Outcome:
    path = job.path
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            before = _built[job.token]
            built = None if before.functions else with_numbers(before, run.changes)
            if built is None:
                # The user's routines are loaded anew: no run gets what they remember of another.
                before = replace(before, functions={})
                built = build_scenario(changed(job.scenario, run, path), path, before)
            _built[job.token] = built
            result, stopped = simulate(built)
    except (Exception, SystemExit) as fault:  # a routine of the user's may call exit()
        return Outcome(run.number, FAILED, _sentence(fault, path), {})
    if isinstance(stopped, Interrupted):
        raise KeyboardInterrupt
    if stopped is not None:
        return Outcome(run.number, FAILED, _sentence(stopped, path), {})
    status, error, figures = _measure(job, built, result)
    return Outcome(run.number, status, error, figures)


def _measure(job: Job, built: Built, result: Result) -> tuple[str, str, dict[str, float]]:
    """Return all figures that can be measured; the first that cannot makes the run a failed one."""
    error, figures, measure = "", {}, measuring(built, result)
    for name in sweep_figures(built):
        try:
            figures[name] = measure(name)
        except (Exception, SystemExit) as fault:
            error = error or _sentence(fault)
    if job.verdicts and not error:
        wanted = verdict_names(built.scenario)
        figures |= {
            f"met.{one.figure}": float(one.met)
            for one in judge(built, result)
            if one.figure in wanted
        }
    return FAILED if error else DONE, error, figures


def _sentence(fault: BaseException, path: Path | None = None) -> str:
    """Return the sentence of `fault`, the same wherever the scenario stands."""
    text = str(fault)
    if path is not None:
        text = text.removeprefix(f"{path}: ").replace(f"{path.parent}{os.sep}", "")
    if not isinstance(fault, SphshellError):
        text = f"{type(fault).__name__}: {text}"
    return ", ".join([" ".join(text.split()), *getattr(fault, "__notes__", ())])
