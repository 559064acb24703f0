"""The command sweep: one scenario, many runs with other values, one table."""

from __future__ import annotations

import shlex
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sphshell_pin.cli.app import (
    ERROR,
    CompiledOption,
    DtOption,
    DurationOption,
    PackageDirOption,
    ScenarioArgument,
    SetOption,
    changes_of,
    command,
    echo,
    option,
    print_table,
    progress_bar,
    say,
)
from sphshell_pin.cli.sampling import draw, report_sample
from sphshell_pin.errors import InvalidParameter, NameNotFound

if TYPE_CHECKING:
    from sphshell_pin.study.sweep import Plan, SweepReport

# So many failed runs are listed one by one.
_MOST_FAILURES = 5


@command()
def sweep(
    *,
    scenario: ScenarioArgument,
    vary: Annotated[
        list[str] | None,
        option(
            "What varies: lo:hi:n, lo:hi:log:n or a,b,c; several keys make a grid.",
            metavar="KEY=VALUES",
        ),
    ] = None,
    together: Annotated[
        bool, option("Take the values of all keys in step: no grid.", "--together")
    ] = False,
    dist: Annotated[
        list[str] | None,
        option(
            "An uncertain input: normal(mean, deviation), uniform(low, high) or "
            "lognormal(median, factor): 68 % from median / factor to median * factor.",
            metavar="'KEY=DISTRIBUTION'",
        ),
    ] = None,
    sample: Annotated[
        str | None,
        option("Points: sobol (a Sobol sequence) or lhs (a Latin hypercube).", metavar="KIND"),
    ] = None,
    n: Annotated[int | None, option("Number of points; a power of 2 for sobol.", "--n")] = None,
    seed: Annotated[int, option("Seed of the points.")] = 0,
    indices: Annotated[
        bool, option("Sobol indices: n (d + 2) runs for d uncertain inputs.", "--indices")
    ] = False,
    tornado: Annotated[
        bool, option("2 d + 1 runs more: each input alone at 5 and at 95 %.", "--tornado")
    ] = False,
    bands: Annotated[
        list[str] | None,
        option("Record a curve of each run; draw quantiles over time.", metavar="CURVE"),
    ] = None,
    band_steps: Annotated[int | None, option("Equal steps of the curves; by default 200.")] = None,
    out: Annotated[
        Path | None, option("Table, .parquet or .h5; by default sweep.parquet in results/SCENARIO.")
    ] = None,
    workers: Annotated[
        int | None, option("Processes; by default one per processor; 0: this one alone.")
    ] = None,
    scheduler: Annotated[
        str | None, option("Address of a Dask scheduler whose workers do the runs.")
    ] = None,
    plot: Annotated[
        list[str] | None, option("Figure to draw; may be given several times.", metavar="FIGURE")
    ] = None,
    pictures: Annotated[
        bool, option("Draw curves or maps of the table.", "--pictures/--no-pictures")
    ] = True,
    verdicts: Annotated[
        bool, option("A column for each expectation: met or not.", "--verdicts")
    ] = False,
    retry_failed: Annotated[
        bool, option("Do failed runs of an earlier call again.", "--retry-failed")
    ] = False,
    dt: DtOption = None,
    duration: DurationOption = None,
    compiled: CompiledOption = False,
    set_: SetOption = None,
    package_dir: PackageDirOption = None,
) -> None:
    """Run a scenario with many values, over processes or a Dask cluster; write one table.

    With --dist the values are drawn from distributions: quantiles, bands, tornado, Sobol indices.

    The same command resumes where an earlier one was stopped.

    Example: sphshell-pin sweep sphere_on_shell --vary contact.law.k=1e3:1e5:log:20
    """
    from sphshell_pin.plot.sweep import plot_sweep
    from sphshell_pin.study.sweep import plan_sweep, run_plan

    changes = changes_of(set_, dt, duration, compiled)
    plan = plan_sweep(
        scenario,
        vary,
        changes=changes,
        together=together,
        verdicts=verdicts,
        dist=dist,
        sample=sample,
        n=n,
        seed=seed,
        indices=indices,
        tornado=tornado,
        bands=bands or (),
        band_steps=band_steps,
    )
    figures = _drawn(plan, plot or [], wanted=pictures)
    file = out or Path("results") / str(plan.head["scenario"]) / "sweep.parquet"
    columns = "MofNCompleteColumn", "[red]{task.fields[failures]}[/red]", "TimeRemainingColumn"
    try:
        with progress_bar("runs", *columns, total=None, failures="") as update:

            def progress(done: int, failed: int, total: int) -> None:
                failures = f"{failed} failed" if failed else ""
                update(completed=done, total=total, failures=failures)

            report = run_plan(
                plan,
                workers=workers,
                scheduler=scheduler,
                out=file,
                retry_failed=retry_failed,
                progress=progress,
                note=lambda sentence: echo(sentence, err=True),
            )
    except KeyboardInterrupt as stop:
        again = shlex.join(["sphshell-pin", *sys.argv[1:]])
        raise KeyboardInterrupt(f"{stop}; to go on: {again}" if str(stop) else "") from None
    _print_head(plan, report)
    files = [file, *([] if report.curves_out is None else [report.curves_out])]
    if plan.design is None:
        if not plot:
            figures = [name for name in figures if report.table[name].notna().any()][:1]
        files += draw(file, [(one, partial(plot_sweep, report.table, one)) for one in figures])
        _print_ranges(plan, report)
    else:
        files += report_sample(plan, report, figures, all_=bool(plot), pictures=pictures)
    _print_failures(plan, report)
    names = ", ".join(map(str, files))
    say(f"files: {names}; journal with wall times: {report.journal}")
    if report.failed == len(plan.runs):
        raise typer.Exit(ERROR)


def _drawn(plan: Plan, plot: list[str], *, wanted: bool) -> list[str]:
    """Return the figures that may be drawn; refuse wrong ones before anything runs."""
    from sphshell_pin.plot.sweep import drawable_keys
    from sphshell_pin.study.sweep.table import main_figures

    for name in plot:
        if name not in plan.figures:
            raise NameNotFound("figure", name, "a run of this scenario", plan.figures)
    own = main_figures(plan.figures)
    if plan.design is not None:
        return plot or own
    if not wanted:
        return []
    try:
        drawable_keys(plan.varied)
    except InvalidParameter as fault:
        if plot:
            raise
        echo(f"no picture: {fault}", err=True)
        return []
    return plot or own


def _print_head(plan: Plan, report: SweepReport) -> None:
    total = len(plan.runs)
    before = f"; {report.resumed} were done before" if report.resumed else ""
    done = f"{total - report.failed} done, {report.failed} failed{before}"
    say(f": {total} runs, {done}", bold=str(plan.head["scenario"]))
    if report.deaths:
        echo(f"{report.deaths} workers died; their runs were done again", err=True)


def _print_ranges(plan: Plan, report: SweepReport) -> None:
    rows = []
    for name in plan.figures:
        column = report.table[name]
        if name.startswith("final.") or column.nunique() < 2:
            continue
        low, high = column.idxmin(), column.idxmax()
        rows.append((name, f"{column[low]:.6g}", f"{low}", f"{column[high]:.6g}", f"{high}"))
    print_table(("figure", "smallest", "in run", "largest", "in run"), rows)


def _print_failures(plan: Plan, report: SweepReport) -> None:
    failed = report.table[report.table["status"] == "failed"]
    for _, row in failed.head(_MOST_FAILURES).iterrows():
        values = [
            f"{axis.key} = {row[axis.key]} {plan.units.get(axis.key, '')}".rstrip()
            for axis in plan.axes
        ]
        echo(f"run {row['run']} failed ({', '.join(values)}): {row['error']}", err=True)
    if len(failed) > _MOST_FAILURES:
        echo(f"and {len(failed) - _MOST_FAILURES} more: see the column error", err=True)
