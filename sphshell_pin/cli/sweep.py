"""The command sweep: one scenario, many runs with other values, one table."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from sphshell_pin.base.tables import column
from sphshell_pin.cli import common
from sphshell_pin.errors import InvalidParameter, NameNotFound

if TYPE_CHECKING:
    import pandas as pd


# So many failed runs are listed one by one.
_MOST_FAILURES = 5


@common.command()
def sweep(
    *,
    scenario: str,
    vary: list[str] | None = None,
    dist: list[str] | None = None,
    n: int | None = None,
    seed: int = 0,
    indices: bool = False,
    out: Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    plot: list[str] | None = None,
    pictures: bool = True,
    dt: float | None = None,
    duration: float | None = None,
    compiled: bool = False,
    set_: list[str] | None = None,
    package_dir: list[Path] | None = None,
) -> None:
    """Run a scenario with many values, over processes or a Dask cluster; write one table.

    With --dist the values are drawn from distributions: quantiles, Sobol indices.

    The same command resumes where an earlier one was stopped, and does failed runs again.

    Example: sphshell-pin sweep sphere_on_shell --vary contact.law.k=1e3:1e5:log:20

    Options
    -------
    vary KEY=VALUES : What varies: lo:hi:n, lo:hi:log:n or a,b,c; several keys make a grid.
    dist 'KEY=DISTRIBUTION' : An uncertain input: normal(mean, deviation), uniform(low, high) or
        lognormal(median, factor): 68 % from median / factor to median * factor.
    n : Number of points of a Sobol sequence, a power of 2.
    seed : Seed of the points.
    indices : Sobol indices: n (d + 2) runs for d uncertain inputs.
    out : Table, .parquet; by default sweep.parquet in results/SCENARIO.
    workers : Processes; by default one per processor; 0: this one alone.
    scheduler : Address of a Dask scheduler whose workers do the runs.
    plot FIGURE : Figure to draw; may be given several times.
    pictures : Draw curves or maps of the table.
    """
    from sphshell_pin.study.sweep import plan_sweep, quantiles, run_plan
    from sphshell_pin.study.sweep.indices import figures_of

    changes = common.changes_of(set_, dt, duration, compiled)
    plan = plan_sweep(scenario, vary, changes=changes, dist=dist, n=n, seed=seed, indices=indices)
    name, total, before = plan.job.path.stem, len(plan.runs), list[int]()
    for figure in plot or ():
        if figure not in plan.figures:
            raise NameNotFound("figure", figure, "a run of this scenario", plan.figures)
    file = out or Path("results") / name / "sweep.parquet"
    columns = "MofNCompleteColumn", "[red]{task.fields[failures]}[/red]", "TimeRemainingColumn"
    try:
        with common.progress_bar("runs", *columns, total=total, failures="") as update:

            def progress(done: int, failed: int, total: int) -> None:
                before.append(done)
                update(completed=done, failures=f"{failed} failed" if failed else "")

            table = run_plan(
                plan, workers=workers, scheduler=scheduler, out=file, progress=progress
            )
    except KeyboardInterrupt as stop:
        again = shlex.join(["sphshell-pin", *sys.argv[1:]])
        raise KeyboardInterrupt(f"{stop}; to go on: {again}" if str(stop) else "") from None
    failed = table[table["status"] == "failed"]
    more = f"; {before[0]} were done before" if before[0] else ""
    done = f"{total - len(failed)} done, {len(failed)} failed{more}"
    common.say(f": {total} runs, {done}", bold=name)
    shown = [one for one in figures_of(table) if _varies(table[one])]
    if plan.points.parts:
        found = quantiles(table).loc[[*plan.points.values, *shown], [5, 50, 95, "mean", "runs"]]
    else:
        found = table[shown].agg(["min", "idxmin", "max", "idxmax"]).T
        found.columns = ["smallest", "in run", "largest", "in this run"]
    found.index = [column(one, plan.units.get(one, "")) for one in found.index]
    _print("quantiles [%]" if plan.points.parts else "figure", found)
    files = [file]
    for figure in plot or _first_figures(table):
        of_inputs = _indices(table, figure)
        files += _draw(file, table, figure, of_inputs) if pictures else []
    for _, row in failed.head(_MOST_FAILURES).iterrows():
        stated = [f"{key} = {row[key]} {plan.units.get(key, '')}" for key in plan.points.values]
        values = ", ".join(map(str.rstrip, stated))
        common.echo(f"run {row['run']} failed ({values}): {row['error']}", err=True)
    if len(failed) > _MOST_FAILURES:
        common.echo(f"and {len(failed) - _MOST_FAILURES} more: see the column error", err=True)
    common.say(f"files: {', '.join(map(str, files))}")
    if len(failed) == total:
        raise typer.Exit(common.ERROR)


def _first_figures(table: pd.DataFrame) -> list[str]:
    """Return the first of the scenario's own figures, else the first peak force, if any."""
    names = [str(name) for name in table.columns if table[name].notna().any()]
    own = [name for name in names if name.startswith("figures.")]
    return [*own, *(name for name in names if name.endswith(".peak_force"))][:1]


def _draw(file: Path, table: pd.DataFrame, figure: str, indices: pd.DataFrame | None) -> list[Path]:
    """Write the picture of `figure` beside the table's `file`; return its path, if any."""
    from sphshell_pin.plot.figure import write_figure
    from sphshell_pin.plot.sweep import plot_sweep
    from sphshell_pin.plot.uncertainty import plot_uncertainty

    path = file.with_name(f"{file.stem}.{figure.replace('/', '_')}.png")
    try:
        with common.if_installed():
            if "design" in table:
                return [write_figure(path, plot_uncertainty(table, figure, indices))]
            return [write_figure(path, plot_sweep(table, figure))]
    except InvalidParameter as fault:
        common.echo(f"no picture: {fault}", err=True)
    return []


def _indices(table: pd.DataFrame, figure: str) -> pd.DataFrame | None:
    """Print the Sobol indices of a figure and return them, if the sweep has them.

    Where they cannot be computed, that is said.
    """
    from sphshell_pin.study.sweep import sobol_indices

    if "A" not in set(table.get("design", ())):
        return None
    try:
        found = sobol_indices(table, figure)
    except InvalidParameter as fault:
        common.echo(f"no indices: {fault}", err=True)
        return None
    _print(f"indices of {figure}", found)
    return found


def _varies(values: pd.Series[float]) -> bool:
    """Whether a figure is worth a line: it is not the same in all runs, or says what was met."""
    name, count = str(values.name), values.nunique()
    return not name.startswith("final.") and count > (0 if name.startswith("met.") else 1)


def _print(title: str, table: pd.DataFrame) -> None:
    """Print a table of numbers with the names of its rows."""
    rows = ((str(name), *(f"{x:.6g}" for x in row)) for name, row in table.iterrows())
    common.print_table((title, *map(str, table.columns)), rows)
