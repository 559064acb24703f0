"""The command sweep: one scenario, many runs with other values, one table."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from sphshell_pin.cli import common
from sphshell_pin.errors import InvalidParameter, NameNotFound

if TYPE_CHECKING:
    import pandas as pd

    from sphshell_pin.study.sweep import Plan, SweepReport

# So many failed runs are listed one by one.
_MOST_FAILURES = 5


@common.command()
def sweep(
    *,
    scenario: common.ScenarioArgument,
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
    dt: common.DtOption = None,
    duration: common.DurationOption = None,
    compiled: common.CompiledOption = False,
    set_: common.SetOption = None,
    package_dir: common.PackageDirOption = None,
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
    from sphshell_pin.study.sweep import plan_sweep, run_plan

    plan = plan_sweep(
        scenario,
        vary,
        changes=common.changes_of(set_, dt, duration, compiled),
        dist=dist,
        n=n,
        seed=seed,
        indices=indices,
    )
    name = plan.job.path.stem
    for figure in plot or ():
        if figure not in plan.figures:
            raise NameNotFound("figure", figure, "a run of this scenario", plan.figures)
    file = out or Path("results") / name / "sweep.parquet"
    columns = "MofNCompleteColumn", "[red]{task.fields[failures]}[/red]", "TimeRemainingColumn"
    try:
        with common.progress_bar("runs", *columns, total=None, failures="") as update:

            def progress(done: int, failed: int, total: int) -> None:
                failures = f"{failed} failed" if failed else ""
                update(completed=done, total=total, failures=failures)

            report = run_plan(
                plan, workers=workers, scheduler=scheduler, out=file, progress=progress
            )
    except KeyboardInterrupt as stop:
        again = shlex.join(["sphshell-pin", *sys.argv[1:]])
        raise KeyboardInterrupt(f"{stop}; to go on: {again}" if str(stop) else "") from None
    total = len(plan.runs)
    before = f"; {report.resumed} were done before" if report.resumed else ""
    done = f"{total - report.failed} done, {report.failed} failed{before}"
    common.say(f": {total} runs, {done}", bold=name)
    figures = plot or _first_figures(report.table)
    if plan.points.parts:
        _print_sample(plan, report.table)
    else:
        _print_ranges(report.table)
    files = [file]
    for figure in figures:
        found = _indices(report.table, figure)
        files += _draw(file, report.table, figure, found) if pictures else []
    _print_failures(plan, report)
    common.say(f"files: {', '.join(map(str, files))}")
    if report.failed == total:
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


def _print_ranges(table: pd.DataFrame) -> None:
    """Print the range of each figure of a grid."""
    from sphshell_pin.study.sweep.indices import figures_of

    rows = []
    for name in figures_of(table):
        column = table[name]
        if not name.startswith("final.") and column.nunique() > 1:
            low, high = column.idxmin(), column.idxmax()
            rows.append((name, f"{column[low]:.6g}", f"{low}", f"{column[high]:.6g}", f"{high}"))
    common.print_table(("figure", "smallest", "in run", "largest", "in run"), rows)


def _print_sample(plan: Plan, table: pd.DataFrame) -> None:
    """Print the inputs of a sample, and the quantiles of the figures that vary."""
    from sphshell_pin.study.sweep import quantiles

    inputs = []
    for key, one in plan.points.dists.items():
        ends = (f"{end:.6g}" for end in one.ppf([0.05, 0.5, 0.95]))
        inputs.append((key, *ends, plan.units.get(key, "")))
    common.print_table(("input", "5 %", "median", "95 %", "unit"), inputs)
    found = quantiles(table)
    rows, met = [], []
    for name, row in ((str(name), row) for name, row in found.iterrows()):
        if name.startswith("met."):
            met.append((name.removeprefix("met."), f"{100 * row['mean']:.4g} % of the runs"))
        elif not name.startswith("final.") and row[5] < row[95]:
            rows.append((name, *(f"{one:.6g}" for one in row.iloc[:5]), f"{row['runs']:.0f}"))
    common.print_table(("figure", "5 %", "25 %", "median", "75 %", "95 %", "runs"), rows)
    common.print_table(("expectation", "met in"), met)


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
    titles = (f"indices of {figure}", *map(str, found.columns))
    rows = ((str(key), *(f"{x:.6g}" for x in row)) for key, row in found.iterrows())
    common.print_table(titles, rows)
    return found


def _print_failures(plan: Plan, report: SweepReport) -> None:
    failed = report.table[report.table["status"] == "failed"]
    for _, row in failed.head(_MOST_FAILURES).iterrows():
        values = [
            f"{key} = {row[key]} {plan.units.get(key, '')}".rstrip() for key in plan.points.values
        ]
        common.echo(f"run {row['run']} failed ({', '.join(values)}): {row['error']}", err=True)
    if len(failed) > _MOST_FAILURES:
        common.echo(f"and {len(failed) - _MOST_FAILURES} more: see the column error", err=True)
