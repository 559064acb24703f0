"""Run a scenario without a screen and write its results folder."""

import contextlib
import hashlib
import json
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from sphshell_pin import errors
from sphshell_pin._versions import __version__
from sphshell_pin.base.atomic.files import held_folder
from sphshell_pin.base.regular_file import StrPath, open_regular, read_text
from sphshell_pin.base.tables import csv_text
from sphshell_pin.base.texts import json_text, plain
from sphshell_pin.dynamics.control.controllers import Controller
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_parts import Origin
from sphshell_pin.scenario.format.build import Built, build
from sphshell_pin.scenario.format.reading import shipped_scenarios
from sphshell_pin.scenario.running.figures import Verdict, check_expectations, judge, measure_energy
from sphshell_pin.scenario.running.kept_scenario import keep

RECORDING = "recording.html"
SUMMARY = "summary.json"
STOPPED = "-stopped"
"""Ends the name of the folder for what stopped early, beside that of complete results."""

# What a run writes: a later one replaces all of it, so that no folder mixes two runs.
RESULTS = (
    "run.npz",
    "contacts.csv",
    "sensors.csv",
    SUMMARY,
    "force_and_depth.png",
    "energy.png",
    "contact_map.png",
    "sensors.png",
    RECORDING,
)


@dataclass(frozen=True)
class RunReport:
    """What a run left behind."""

    built: Built
    result: Result
    """What was computed until then when `stopped` is set."""
    folder: Path
    files: tuple[Path, ...]
    notes: tuple[str, ...]
    """What could not be written, and why; one sentence each."""
    verdicts: tuple[Verdict, ...]
    stopped: errors.SphshellError | None
    """Why the run ended early: Interrupted or SimulationDiverged."""
    warnings: tuple[str, ...] = ()
    """What in the run shows that the scenario is probably a mistake; one sentence each."""


def run_scenario(
    name: StrPath,
    out: StrPath | None = None,
    *,
    changes: Mapping[str, str] | None = None,
    recording: bool = True,
    figures: bool = True,
    progress: Callable[[float], object] | None = None,
) -> RunReport:
    """Build and run the scenario called `name` (shipped, or a path) and write its results folder.

    `out` is the folder, results/<name> by default; `changes` are values by dotted key. An
    interrupted or diverged run is written like any other, and `stopped` says so; where the folder
    has the results of a complete run, it is written to a folder beside it, "NAME-stopped". Files
    take the place of an earlier run's all at once, when all are on disk (`base.atomic`). Without
    `recording` or `figures` no recording.html or no pictures are made, which take most of the time
    of a short run.

    Raises
    ------
    ScenarioError, NameNotFound, MissingExtra
        The scenario cannot be built.
    ResultError
        The folder cannot be written, or another run is writing it; raised before the run starts.
    KeyboardInterrupt
        On Ctrl-C while the results are written; its text says so if they are there.
    """
    built = build(name, changes)
    return run_built(built, out, recording=recording, figures=figures, progress=progress)


def run_built(
    built: Built,
    out: StrPath | None = None,
    *,
    recording: bool = True,
    figures: bool = True,
    progress: Callable[[float], object] | None = None,
) -> RunReport:
    """Run a scenario that is already built; see `run_scenario`."""
    check_expectations(built)
    folder = Path("results") / built.name if out is None else Path(out)
    with contextlib.ExitStack() as held:
        place = held.enter_context(held_folder(folder, SUMMARY))
        result, stopped = simulate(built, progress)
        verdicts, fault = _judge(built, result) if stopped is None else ((), None)
        notes: list[str] = []
        if stopped is not None and _holds_complete(folder):
            notes.append(f"the complete results of an earlier run stay in {folder}")
            named = folder if folder.name else folder.absolute()
            folder = named.with_name(named.name + STOPPED)
            place = held.enter_context(held_folder(folder, SUMMARY))
        try:
            staging = place.staging()
            result.save(staging / "run.npz", home=folder)
            write_contacts(staging / "contacts.csv", result)
            if result.sensors:
                write_sensors(staging / "sensors.csv", result)
            interrupted = _draw(built, result, staging, notes, recording=recording, figures=figures)
            _write_summary(staging, built, result, verdicts, stopped)
            files = tuple(folder / name for name in RESULTS if (staging / name).exists())
            if folder / RECORDING not in files and (folder / RECORDING).exists():
                notes.append(f"{RECORDING} of an earlier run was removed: this run wrote none")
            place.replace(staging, RESULTS)
        except OSError as error:
            cause = error.__cause__ if isinstance(error.__cause__, OSError) else error
            reason = f"the results cannot be written: {cause.strerror or cause}"
            raise errors.ResultError(folder, reason) from None
    if fault is not None:
        raise fault
    if interrupted:
        raise KeyboardInterrupt(f"the results are in {folder}, but not all pictures of them")
    said = _beyond_hertz(result)
    if stopped is None and isinstance(built.controller, Controller):
        said = (*said, *built.controller._result_warnings(result))
    return RunReport(built, result, folder, files, tuple(notes), verdicts, stopped, said)


def _beyond_hertz(result: Result) -> tuple[str, ...]:
    """Say of each contact when the theory of its law first ended."""
    first = {e.pair: e.t for e in reversed(result.events) if e.kind == "beyond_hertz"}
    return tuple(
        f"contact '{pair}': from t = {t:.4g} s Hertz's theory does not hold: the ellipse of "
        "contact is more than half as long as the sphere, or a socket fits the sphere closely; "
        "make the bodies stiffer, or take a FoundationLaw"
        for pair, t in first.items()
    )


def _judge(built: Built, result: Result) -> tuple[tuple[Verdict, ...], Exception | None]:
    """Return the verdicts; or the fault of a figure of the user's, raised when all is written."""
    try:
        return tuple(judge(built, result)), None
    except Exception as fault:
        return (), fault


def simulate(
    built: Built, progress: Callable[[float], object] | None = None
) -> tuple[Result, errors.SphshellError | None]:
    """Run without writing; return the result, and why it ended early (None: it did not)."""
    run = built.scenario.run
    try:
        with warnings.catch_warnings():
            # explain_built and the report say them.
            for kind in (errors.WeakLawWarning, errors.SetupWarning):
                warnings.simplefilter("ignore", kind)
            result = built.simulation.run(
                built.q0,
                built.v0,
                run.duration,
                built.controller,
                run.control_dt,
                record_dt=run.record_dt,
                record=run.record,
                progress=progress,
            )
    except (errors.Interrupted, errors.SimulationDiverged) as error:
        error.result = replace(error.result, origin=origin_of(built))
        return error.result, error
    return replace(result, origin=origin_of(built)), None


def origin_of(built: Built) -> Origin:
    """Return the origin that a Result of this scenario records."""
    shipped = shipped_scenarios().get(built.name)
    scenario = built.name if shipped == built.path else str(built.path.absolute())
    settings = built.scenario.model_dump(mode="json").items()
    folder = built.path.absolute().parent
    return Origin(
        scenario,
        {key: plain(value) for key, value in settings},
        partial(keep, built.scenario, folder, built.assembly.loaded, dict(built.shells)),
    )


def _holds_complete(folder: Path) -> bool:
    """Whether `folder` has results that a run which stopped early must not replace."""
    try:
        summary = json.loads(read_text(folder / SUMMARY))
        return bool(summary["complete"])
    except (OSError, ValueError, KeyError, TypeError):
        # Somebody's results without a summary count as complete.
        return any((folder / name).exists() for name in RESULTS)


def _draw(
    built: Built, result: Result, staging: Path, notes: list[str], *, recording: bool, figures: bool
) -> bool:
    """Write the pictures; note which of them cannot be made, as the numbers matter more.

    Returns whether Ctrl-C ended it. Raises ResultError for one that cannot be written.
    """
    scenario = built.scenario

    def write_recording() -> None:
        speed, title = scenario.run.recording_speed, scenario.title
        view = result.view(built.scene, built.visual_model, speed=speed, title=title)
        view.save(staging / RECORDING)

    writers: dict[str, Callable[[], object]] = {}
    if figures:
        writers["figures"] = lambda: result.save_figures(staging, built.scene)
    if recording:
        writers[RECORDING] = write_recording
    for what, write in writers.items():
        try:
            write()
        except KeyboardInterrupt:
            return True
        except errors.MissingExtra as error:
            notes.append(str(error))
        except Exception as error:
            if isinstance(error, errors.ResultError) and isinstance(error.__cause__, OSError):
                raise
            named = "" if isinstance(error, errors.ResultError) else f"{type(error).__name__}: "
            notes.append(f"{what} could not be made: {named}{error}".removesuffix(": "))
    return False


def write_contacts(path: Path, result: Result) -> None:
    """Write the contact log of `result` as comma-separated values, one row for each contact."""
    path.write_text(csv_text(result.contact_columns()), encoding="utf-8", newline="")


def write_sensors(path: Path, result: Result) -> None:
    """Write the readings of the sensors as comma-separated values, one row for each time."""
    path.write_text(csv_text(result.sensor_columns()), encoding="utf-8", newline="")


def _write_summary(
    staging: Path,
    built: Built,
    result: Result,
    verdicts: Iterable[Verdict],
    stopped: errors.SphshellError | None,
) -> None:
    summary = {
        "scenario": built.name,
        "title": built.scenario.title,
        "complete": stopped is None,
        "stopped": None if stopped is None else str(stopped),
        "stats": asdict(result.stats),
        "energy": measure_energy(result),
        "expected": [
            {"figure": v.figure, "expected": v.expected, "measured": v.measured, "met": v.met}
            for v in verdicts
        ],
        "versions": versions(),
        "files": {name: _digest(staging / name) for name in RESULTS if (staging / name).exists()},
        "settings": origin_of(built).settings,
    }
    (staging / SUMMARY).write_text(json_text(summary, indent=2), encoding="utf-8")


def versions() -> dict[str, str]:
    """Return the versions of what decides a run's numbers."""
    import coal
    import pinocchio as pin

    return {
        "sphshell_pin": __version__,
        "pinocchio": pin.__version__,
        "coal": coal.__version__,
        "numpy": np.__version__,
    }


def _digest(path: Path) -> str:
    with open_regular(path) as file:
        return f"sha256:{hashlib.file_digest(file, 'sha256').hexdigest()}"
