"""The command fit: parameters of a scenario from measured data."""

from __future__ import annotations

import math
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from sphshell_pin.cli import common
from sphshell_pin.errors import InvalidParameter

if TYPE_CHECKING:
    from sphshell_pin.study.fit import Experiment


@common.command()
def fit(
    data: list[Path] | None = None,
    *,
    scenario: str,
    param: list[str],
    experiment: list[str] | None = None,
    column: list[str] | None = None,
    out: Path | None = None,
    picture: bool = True,
    compiled: bool = False,
    set_: list[str] | None = None,
    package_dir: list[Path] | None = None,
) -> None:
    """Fit values of a scenario to measured data, and write the scenario with the fitted values.

    The scenario's values are where the search starts. Exit code 1 says that the data do not
    determine a value.

    Example: sphshell-pin fit drop.csv ball.toml --param contact.tip.law.stiffness

    Options
    -------
    data DATA.csv : Measured data: columns by name and unit.
    param KEY[=LO:HI] : What is fitted, in this range if it is given; may be given several times.
        KEY+KEY: one value for both.
    experiment 'DATA.csv KEY=VALUE...' : Data of an experiment with other values than the scenario;
        may be given several times.
    column NAME : Use this column; by default all; several times.
    out : Folder of the files; by default results/SCENARIO.
    picture : Draw fit and residuals.
    """
    from sphshell_pin.base.atomic.files import write_folder
    from sphshell_pin.plot.figure import png
    from sphshell_pin.scenario.format.reading import find_scenario, read_scenario
    from sphshell_pin.study.fit import Experiment
    from sphshell_pin.study.fit import fit as fit_scenario
    from sphshell_pin.study.fit.parameters import free_parameters
    from sphshell_pin.study.fit.writing import scenario_text

    changes = common.changes_of(set_, compiled=compiled)
    given = [Experiment(path) for path in data or []]
    given += [_experiment(text) for text in experiment or []]
    path = find_scenario(scenario)
    # Where no value can be written, it is said before the runs.
    free = free_parameters(param, read_scenario(path, changes), path)
    starts = {key: repr(one.start) for one in free for key in one.keys}
    scenario_text(path, {**changes, **starts}, path.parent)
    status = "{task.completed} runs, misfit {task.fields[misfit]}"
    columns = "SpinnerColumn", status, "TimeElapsedColumn"
    with common.progress_bar("fit", *columns, total=None, misfit="-") as update:

        def progress(runs: int, misfit: float) -> None:
            shown = "-" if math.isnan(misfit) else f"{misfit:.4g} sigma"
            update(completed=runs, misfit=shown)

        found = fit_scenario(
            scenario, given, param, changes=changes, columns=column, progress=progress
        )
    folder, name = out or Path("results") / path.stem, f"{path.stem}.fitted.toml"
    # What fails in the making leaves no file behind.
    made = {name: found.scenario_text(folder, changes).encode()}
    made["fit.json"] = found.to_json().encode()
    if picture:
        with common.if_installed():
            made["fit.png"] = png(found.plot())
    # Never new values beside an old report.
    files = write_folder(folder, made, ["fit.json", name, "fit.png"])
    done = f": {len(given)} experiments, {found.runs} runs, {found.level:.0%} intervals"
    common.say(done, bold=found.scenario)
    common.echo(found)
    common.say(f"files: {', '.join(map(str, files))}")
    if not found.determined:
        raise typer.Exit(common.MISSED)


def _experiment(text: str) -> Experiment:
    """Return the experiment that "DATA.csv KEY=VALUE ..." states."""
    from sphshell_pin.study.fit import Experiment

    try:
        file, *changes = shlex.split(text)
    except ValueError:
        file, changes = "", []
    if not file or not all("=" in one for one in changes):
        raise InvalidParameter("--experiment", text, "must be 'DATA.csv KEY=VALUE ...'")
    return Experiment(file, common.changes_of(changes), " ".join([Path(file).stem, *changes]))
