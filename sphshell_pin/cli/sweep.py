"""The command sweep: one scenario, many runs with other values, one table."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import typer

from sphshell_pin.cli.common import (
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
    if_installed,
    print_table,
    progress_bar,
    say,
)
from sphshell_pin.errors import InvalidParameter, NameNotFound

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from sphshell_pin.study.sweep import Plan, SweepReport

    Pictures = list[tuple[str, Callable[[], Figure]]]

# So many failed runs are listed one by one.
_MOST_FAILURES = 5


@command()
def sweep(
    *,
    scenario: ScenarioArgument,
    vary: list[str] | None = None,
    together: bool = False,
    dist: list[str] | None = None,
    sample: str | None = None,
    n: int | None = None,
    seed: int = 0,
    indices: bool = False,
    tornado: bool = False,
    out: Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    plot: list[str] | None = None,
    pictures: bool = True,
    verdicts: bool = False,
    retry_failed: bool = False,
    dt: DtOption = None,
    duration: DurationOption = None,
    compiled: CompiledOption = False,
    set_: SetOption = None,
    package_dir: PackageDirOption = None,
) -> None:
    """Run a scenario with many values, over processes or a Dask cluster; write one table.

    With --dist the values are drawn from distributions: quantiles, tornado, Sobol indices.

    The same command resumes where an earlier one was stopped.

    Example: sphshell-pin sweep sphere_on_shell --vary contact.law.k=1e3:1e5:log:20

    Options
    -------
    vary KEY=VALUES : What varies: lo:hi:n, lo:hi:log:n or a,b,c; several keys make a grid.
    together : Take the values of all keys in step: no grid.
    dist 'KEY=DISTRIBUTION' : An uncertain input: normal(mean, deviation), uniform(low, high) or
        lognormal(median, factor): 68 % from median / factor to median * factor.
    sample KIND : Points: sobol (a Sobol sequence) or lhs (a Latin hypercube).
    n : Number of points; a power of 2 for sobol.
    seed : Seed of the points.
    indices : Sobol indices: n (d + 2) runs for d uncertain inputs.
    tornado : 2 d + 1 runs more: each input alone at 5 and at 95 %.
    out : Table, .parquet; by default sweep.parquet in results/SCENARIO.
    workers : Processes; by default one per processor; 0: this one alone.
    scheduler : Address of a Dask scheduler whose workers do the runs.
    plot FIGURE : Figure to draw; may be given several times.
    pictures : Draw curves or maps of the table.
    verdicts : A column for each expectation: met or not.
    retry_failed : Do failed runs of an earlier call again.
    """
    from sphshell_pin.study.sweep import plan_sweep, run_plan

    plan = plan_sweep(
        scenario,
        vary,
        changes=changes_of(set_, dt, duration, compiled),
        together=together,
        verdicts=verdicts,
        dist=dist,
        sample=sample,
        n=n,
        seed=seed,
        indices=indices,
        tornado=tornado,
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
    total = len(plan.runs)
    before = f"; {report.resumed} were done before" if report.resumed else ""
    done = f"{total - report.failed} done, {report.failed} failed{before}"
    say(f": {total} runs, {done}", bold=str(plan.head["scenario"]))
    if not plot:
        figures = [name for name in figures if report.table[name].notna().any()][:1]
    report_plan = _report_grid if plan.design is None else _report_sample
    drawn = report_plan(plan, report.table, figures)
    files = [file, *(_draw(file, drawn) if pictures else [])]
    _print_failures(plan, report)
    say(f"files: {', '.join(map(str, files))}")
    if report.failed == total:
        raise typer.Exit(ERROR)


def _drawn(plan: Plan, plot: list[str], *, wanted: bool) -> list[str]:
    """Return the figures that may be drawn; refuse wrong ones before anything runs."""
    from sphshell_pin.plot.sweep import drawable_keys
    from sphshell_pin.study.sweep.table import main_figures

    for name in plot:
        if name not in plan.figures:
            raise NameNotFound("figure", name, "a run of this scenario", plan.figures)
    if plan.design is None and wanted:
        try:
            drawable_keys(plan.varied)
        except InvalidParameter as fault:
            if plot:
                raise
            echo(f"no picture: {fault}", err=True)
            return []
    return plot or main_figures(plan.figures)


def _draw(file: Path, pictures: Pictures) -> list[Path]:
    """Write pictures beside the table's `file`, called by what they show; return their paths."""
    from sphshell_pin.plot.figure import write_figure

    paths: list[Path] = []
    with if_installed():
        for name, plot in pictures:
            path = file.with_name(f"{file.stem}.{name.replace('/', '_')}.png")
            paths.append(write_figure(path, plot()))
    return paths


def _report_grid(plan: Plan, table: pd.DataFrame, figures: list[str]) -> Pictures:
    """Print the range of each figure; return the pictures of `figures`."""
    from sphshell_pin.plot.sweep import plot_sweep

    rows = []
    for name in plan.figures:
        column = table[name]
        if not name.startswith("final.") and column.nunique() > 1:
            low, high = column.idxmin(), column.idxmax()
            rows.append((name, f"{column[low]:.6g}", f"{low}", f"{column[high]:.6g}", f"{high}"))
    print_table(("figure", "smallest", "in run", "largest", "in run"), rows)
    return [(name, partial(plot_sweep, table, name)) for name in figures]


def _report_sample(plan: Plan, table: pd.DataFrame, figures: list[str]) -> Pictures:
    """Print inputs, quantiles, tornado and indices of a sample; return the pictures of `figures`.

    What cannot be computed is said in a sentence.
    """
    from sphshell_pin.plot.uncertainty import plot_uncertainty
    from sphshell_pin.study import sweep
    from sphshell_pin.study.sweep.sampling import DRAWN

    assert plan.design is not None
    inputs = []
    for key, one in plan.design.dists.items():
        ends = (f"{end:.6g}" for end in one.quantile(np.array([0.05, 0.5, 0.95])))
        inputs.append((key, str(one), *ends, plan.units.get(key, "")))
    print_table(("input", "distribution", "5 %", "median", "95 %", "unit"), inputs)
    rows = table[table["design"].isin(DRAWN)]
    if len(rows):
        _print_quantiles(sweep.quantiles(table), figures)
    pictures: Pictures = []
    for name in figures:
        shown: dict[str, Any] = {"values": rows[name].to_numpy(float)} if len(rows) else {}
        for what, called, part, compute, show in (
            ("tornado", "tornado", "median", sweep.tornado, _print_tornado),
            ("indices", "Sobol indices", "A", sweep.sobol_indices, _print_indices),
        ):
            if part in plan.design.parts:
                try:
                    shown[what] = compute(table, name)
                    show(name, shown[what])
                except InvalidParameter as fault:
                    echo(f"no {called}: {fault}", err=True)
        if shown:
            units = table.attrs.get("units")
            pictures.append((name, partial(plot_uncertainty, name, units=units, **shown)))
    return pictures


def _print_quantiles(found: pd.DataFrame, figures: list[str]) -> None:
    """Print the quantiles of the figures that vary; in how many runs expectations are met."""
    percents = [name for name in found.columns if name not in ("mean", "runs")]
    rows, met = [], []
    for name, row in ((str(name), row) for name, row in found.iterrows()):
        if name.startswith("met."):
            met.append((name.removeprefix("met."), f"{100 * row['mean']:.4g} % of the runs"))
        elif name in figures or (not name.startswith("final.") and row[5] < row[95]):
            rows.append((name, *(f"{row[one]:.6g}" for one in percents), str(int(row["runs"]))))
    print_table(("figure", *(f"{one} %" for one in percents), "runs"), rows)
    print_table(("expectation", "met in"), met)


def _print_tornado(figure: str, found: pd.DataFrame) -> None:
    ends = found[["low_value", "high_value", "low", "high"]]
    print_table(
        ("input alone", "at 5 %", "at 95 %", f"{figure} at 5 %", "at 95 %"),
        ((str(key), *(f"{one:.6g}" for one in row)) for key, row in ends.iterrows()),
    )
    say(f"{figure} is {found['median'].iloc[0]:.6g} with all inputs at their medians")


def _print_indices(figure: str, found: pd.DataFrame) -> None:
    rows = []
    for key, row in found.iterrows():
        shown = [str(key)]
        for kind in ("first", "total"):
            low, high = row[f"{kind}_low"], row[f"{kind}_high"]
            shown += [f"{row[kind]:.4f}", f"{low:.4f} to {high:.4f}"]
        rows.append(shown)
    interval = "95 % interval"
    titles = (f"Sobol indices of {figure}", "first order", interval, "total", interval)
    print_table(titles, rows)


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
