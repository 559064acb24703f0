"""Run a scenario without a screen and write its results folder."""

from __future__ import annotations

import csv
import json
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from sphshell_pin.errors import (
    Interrupted,
    MissingExtra,
    ResultError,
    SimulationDiverged,
    SphshellError,
)
from sphshell_pin.scenario.build import Built, build
from sphshell_pin.scenario.figures import Verdict, check_expectations, judge, measure_energy

RECORDING = "recording.html"


@dataclass(frozen=True)
class RunReport:
    """What a run left behind."""

    built: Built
    result: Any
    """sphshell_pin.Result; what was computed until then when `stopped` is set."""
    folder: Path
    files: tuple[Path, ...]
    notes: tuple[str, ...]
    """What could not be written, and why; one sentence each."""
    verdicts: tuple[Verdict, ...]
    stopped: SphshellError | None
    """Why the run ended early: Interrupted or SimulationDiverged."""


def run_scenario(
    name: str | PathLike[str],
    out: str | PathLike[str] | None = None,
    *,
    changes: Mapping[str, str] | None = None,
    recording: bool = True,
    progress: Callable[[float], object] | None = None,
) -> RunReport:
    """Build and run the scenario called `name` (shipped, or a path) and write its results folder.

    `out` is the folder, results/<name> by default; `changes` are values by dotted key. An
    interrupted or diverged run is written like any other, and `stopped` says so.

    Raises
    ------
    ScenarioError, NameNotFound, MissingExtra
        The scenario cannot be built.
    ResultError
        The folder cannot be written; told before the run starts.
    """
    built = build(name, changes)
    return run_built(built, out, recording=recording, progress=progress)


def run_built(
    built: Built,
    out: str | PathLike[str] | None = None,
    *,
    recording: bool = True,
    progress: Callable[[float], object] | None = None,
) -> RunReport:
    """Run a scenario that is already built; see `run_scenario`."""
    check_expectations(built)
    folder = prepare_folder(Path("results") / built.name if out is None else out)
    result, stopped = simulate(built, progress)
    verdicts = tuple(judge(built, result)) if stopped is None else ()
    files, notes = _write_all(built, result, folder, verdicts, stopped, recording=recording)
    return RunReport(built, result, folder, tuple(files), tuple(notes), verdicts, stopped)


def simulate(
    built: Built, progress: Callable[[float], object] | None = None
) -> tuple[Any, SphshellError | None]:
    """Run without writing; return the result, and why it ended early (None: it did not)."""
    run = built.scenario.run
    try:
        result = built.simulation.run(
            built.q0,
            built.v0,
            run.duration,
            built.controller,
            run.control_dt,
            record_dt=run.record_dt,
            progress=progress,
        )
    except (Interrupted, SimulationDiverged) as error:
        return error.result, error
    return result, None


def prepare_folder(out: str | PathLike[str]) -> Path:
    """Make the results folder and prove that it can be written.

    Raises
    ------
    ResultError
        It cannot be.
    """
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise ResultError(
            folder,
            f"the results folder cannot be written: {error.strerror}; give another with --out",
        ) from None
    return folder


def _write_all(
    built: Built,
    result: Any,
    folder: Path,
    verdicts: Iterable[Verdict],
    stopped: SphshellError | None,
    *,
    recording: bool,
) -> tuple[list[Path], list[str]]:
    files: list[Path] = []
    notes: list[str] = []

    def keep(made: Path) -> None:
        """Put a finished file in place of an earlier one in a single step."""
        os.replace(made, folder / made.name)
        files.append(folder / made.name)

    try:
        with tempfile.TemporaryDirectory(dir=folder, prefix=".writing-") as scratch:
            desk = Path(scratch)
            result.save(desk / "run.npz")
            keep(desk / "run.npz")
            write_contacts(desk / "contacts.csv", result)
            keep(desk / "contacts.csv")
            _write_summary(desk / "summary.json", built, result, verdicts, stopped)
            keep(desk / "summary.json")
            for made in _try_view(notes, lambda: _write_figures(result, desk, built)):
                keep(made)
            if recording:
                for made in _try_view(notes, lambda: _write_recording(result, desk, built)):
                    keep(made)
    except OSError as error:
        # MissingExtra aside, nothing in here raises OSError but the disk.
        raise ResultError(
            folder, f"the results cannot be written: {error.strerror or error}"
        ) from None
    stale = folder / RECORDING
    if stale not in files and stale.exists():
        stale.unlink()
        notes.append(f"{RECORDING} of an earlier run was removed: this run wrote none")
    return files, notes


def _try_view(notes: list[str], write: Callable[[], list[Path]]) -> list[Path]:
    """Return what `write` made; without the packages it needs, note why it made nothing."""
    try:
        return write()
    except MissingExtra as error:
        notes.append(str(error))
        return []


def _write_figures(result: Any, desk: Path, built: Built) -> list[Path]:
    from sphshell_pin.plot import save_figures

    return list(save_figures(result, desk, scene=built.scene))


def _write_recording(result: Any, desk: Path, built: Built) -> list[Path]:
    from sphshell_pin.view.recording import write_recording

    path = desk / RECORDING
    write_recording(
        path,
        result,
        built.scene,
        visual_model=built.visual_model,
        speed=built.scenario.run.recording_speed,
        title=built.scenario.title,
    )
    return [path]


def write_contacts(path: str | PathLike[str], result: Any) -> None:
    """Write the contact log of `result` as comma-separated values, one row for each contact."""
    columns = result.contact_columns()
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(np.asarray(one).tolist() for one in columns.values()), strict=True))


def _write_summary(
    path: Path,
    built: Built,
    result: Any,
    verdicts: Iterable[Verdict],
    stopped: SphshellError | None,
) -> None:
    import coal
    import pinocchio as pin

    import sphshell_pin

    summary = {
        "scenario": built.name,
        "title": built.scenario.title,
        "complete": stopped is None,
        "stopped": None if stopped is None else str(stopped),
        "stats": result.stats,
        "energy": measure_energy(result),
        "expected": [
            {"figure": v.figure, "expected": v.expected, "measured": v.measured, "met": v.met}
            for v in verdicts
        ],
        "versions": {
            "sphshell_pin": sphshell_pin.__version__,
            "pinocchio": pin.__version__,
            "coal": coal.__version__,
            "numpy": np.__version__,
        },
        "settings": built.scenario.model_dump(mode="json"),
    }
    text = json.dumps(_plain(summary), indent=2, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def _plain(value: Any) -> Any:
    """Return `value` made of what JSON knows; it has no infinity: null stands for it."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value if value is None or isinstance(value, str | int | float) else str(value)
