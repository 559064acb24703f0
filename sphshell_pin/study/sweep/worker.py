"""What happens in a worker: the scenario is built once, then changed and run again and again."""

import os
import platform
import signal
import threading
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from sphshell_pin.errors import Interrupted, SphshellError, SweepError
from sphshell_pin.scenario import Built, judge
from sphshell_pin.scenario.format.build import build_scenario
from sphshell_pin.scenario.format.sliders import with_numbers
from sphshell_pin.scenario.running.figures import measuring
from sphshell_pin.scenario.running.run import simulate, versions
from sphshell_pin.study.sweep.plan import Changes, Job, changed, judged, sweep_figures, uses_of


@dataclass(frozen=True)
class Outcome:
    """What a run left behind."""

    error: str
    """Why it failed, in one sentence; empty otherwise."""
    figures: Mapping[str, float] = field(default_factory=dict)


# One run at a time: the threads of a Dask worker take turns, as a scenario's own routines may
# share what they remember.
_turn = threading.Lock()
# What was built last, by the job's token: its surfaces and robots serve the next run.
_built: dict[str, Built] = {}


def dask_setup(_: object) -> None:
    """Let a worker that this sweep starts, by Dask's name for such a hook, not end by Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def run_one(job: Job, changes: Changes) -> Outcome:
    """Build and run the scenario with `changes`; a fault of that run is part of the outcome.

    Raises
    ------
    SweepError
        This worker cannot do any run of the job.
    """
    with _turn:
        if job.token not in _built:
            prepare(job)
        try:
            with warnings.catch_warnings(action="ignore"):
                return _run(job, changes)
        except (Exception, SystemExit) as fault:  # a routine of the user's may call exit()
            return Outcome(_sentence(fault, job.path))


def prepare(job: Job) -> None:
    """Make this process ready for the runs of `job`.

    Raises
    ------
    SweepError
        It cannot run them: other versions, other files, a scenario that cannot be built here.
    """
    this = f"worker {platform.node()}:{os.getpid()}"
    try:
        path = job.path
        here = uses_of(path.parent, job.uses.keys() - versions().keys())
        if other := [name for name in job.uses if here.get(name) != job.uses[name]]:
            raise SweepError(f"{this} has another {', another '.join(other)} than the sweep")
        with warnings.catch_warnings(action="ignore"):
            built = build_scenario(changed(job.scenario, job.sample, path), path)
    except SweepError:
        raise
    except Exception as fault:
        # Most faults cannot be sent from one process to another; their sentence can.
        raise SweepError(f"{this} cannot build the scenario: {_sentence(fault)}") from None
    _built.clear()
    _built[job.token] = built


def _run(job: Job, changes: Changes) -> Outcome:
    before, path = _built[job.token], job.path
    built = None if before.functions else with_numbers(before, changes)
    if built is None:
        # The user's routines are loaded anew: no run gets what they remember of another.
        before = replace(before, functions={})
        built = build_scenario(changed(job.scenario, changes, path), path, before)
    _built[job.token] = built
    result, stopped = simulate(built)
    if isinstance(stopped, Interrupted):
        raise KeyboardInterrupt
    if stopped is not None:
        raise stopped
    error, figures, measure = "", {}, measuring(built, result)
    expected = judged(built.scenario)
    for name in sweep_figures(built):
        try:
            if not name.startswith("met."):
                figures[name] = measure(name)
        except (Exception, SystemExit) as fault:
            # All others are measured; the first that cannot be makes the run a failed one.
            error = error or _sentence(fault)
    if expected and not error:
        verdicts = {one.figure: float(one.met) for one in judge(built, result)}
        figures |= {f"met.{name}": verdicts[name] for name in expected}
    return Outcome(error, figures)


def _sentence(fault: BaseException, path: Path | None = None) -> str:
    """Return the sentence of `fault`, the same wherever the scenario stands."""
    text = str(fault)
    if path is not None:
        text = text.removeprefix(f"{path}: ").replace(f"{path.parent}{os.sep}", "")
    if not isinstance(fault, SphshellError):
        text = f"{type(fault).__name__}: {text}"
    return ", ".join([" ".join(text.split()), *getattr(fault, "__notes__", ())])
