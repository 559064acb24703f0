"""What the command sweep prints and draws of a sample of uncertain inputs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import typer

from sphshell_pin.cli.app import make_table, plain, terminal
from sphshell_pin.errors import InvalidParameter, MissingExtra

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console

    from sphshell_pin.study.sweep import Plan, SweepReport


def report_sample(
    plan: Plan, report: SweepReport, figures: list[str], *, all_: bool, pictures: bool
) -> list[Path]:
    """Print what a sample of `plan` says of `figures` and draw it; return the pictures' paths.

    Unless `all_` are wanted, only the first figure that any run has is looked at in detail. What
    cannot be computed is said in a sentence.
    """
    from sphshell_pin.study.sweep import quantiles, sobol_indices, tornado

    design, table = plan.design, report.table
    assert design is not None
    console = terminal()
    _print_inputs(console, plan)
    if not all_:
        figures = [name for name in figures if table[name].notna().any()][:1]
    sampled = design.description["sample"] is not None
    if sampled:
        _print_quantiles(console, quantiles(table), figures)
    paths: list[Path] = []
    for name in figures:
        asked = design.description
        found_tornado = _try("tornado", tornado, table, name) if asked["tornado"] else None
        found_indices = (
            _try("Sobol indices", sobol_indices, table, name) if asked["indices"] else None
        )
        if found_tornado is not None:
            _print_tornado(console, name, found_tornado)
        if found_indices is not None:
            _print_indices(console, name, found_indices)
        if pictures:
            _add_picture(paths, report, name, found_tornado, found_indices)
    if pictures and report.curves is not None:
        _add_bands(paths, report)
    return paths


def _try(
    what: str,
    compute: Callable[[pd.DataFrame, str], pd.DataFrame],
    table: pd.DataFrame,
    figure: str,
) -> pd.DataFrame | None:
    """Compute `what` was asked for, or print why it cannot be."""
    try:
        return compute(table, figure)
    except InvalidParameter as fault:
        typer.echo(f"no {what}: {fault}", err=True)
        return None


def _print_inputs(console: Console, plan: Plan) -> None:
    assert plan.design is not None
    rows = make_table("input", "distribution", "5 %", "median", "95 %", "unit")
    for axis, one in zip(plan.axes, plan.design.dists.values(), strict=True):
        ends = one.quantile(np.array([0.05, 0.5, 0.95]))
        rows.add_row(plain(axis.key), str(one), *(f"{end:.6g}" for end in ends), plain(axis.unit))
    console.print(rows)


def _print_quantiles(console: Console, found: pd.DataFrame, figures: list[str]) -> None:
    """Print the quantiles of the figures that vary; in how many runs expectations are met."""
    percents = [name for name in found.columns if name not in ("mean", "runs")]
    rows = make_table("figure", *(f"{one} %" for one in percents), "runs")
    met = make_table("expectation", "met in")
    for name, row in found.iterrows():
        if str(name).startswith("met."):
            met.add_row(
                plain(str(name).removeprefix("met.")), f"{100 * row['mean']:.4g} % of the runs"
            )
        elif name in figures or (not str(name).startswith("final.") and row[5] < row[95]):
            values = (f"{row[one]:.6g}" for one in percents)
            rows.add_row(plain(str(name)), *values, str(int(row["runs"])))
    for one in (rows, met):
        if one.row_count:
            console.print(one)


def _print_tornado(console: Console, figure: str, found: pd.DataFrame) -> None:
    rows = make_table("input alone", "at 5 %", "at 95 %", f"{plain(figure)} at 5 %", "at 95 %")
    for key, row in found.iterrows():
        ends = (row[one] for one in ("low_value", "high_value", "low", "high"))
        rows.add_row(plain(str(key)), *(f"{one:.6g}" for one in ends))
    console.print(rows)
    console.print(
        f"{figure} is {found['median'].iloc[0]:.6g} with all inputs at their medians",
        highlight=False,
    )


def _print_indices(console: Console, figure: str, found: pd.DataFrame) -> None:
    rows = make_table(
        f"Sobol indices of {plain(figure)}",
        "first order",
        "95 % interval",
        "total",
        "95 % interval",
    )
    for key, row in found.iterrows():
        shown = []
        for kind in ("first", "total"):
            low, high = row[f"{kind}_low"], row[f"{kind}_high"]
            shown += [f"{row[kind]:.4f}", f"{low:.4f} to {high:.4f}"]
        rows.add_row(plain(str(key)), *shown)
    console.print(rows)


def _add_picture(
    paths: list[Path],
    report: SweepReport,
    figure: str,
    tornado: pd.DataFrame | None,
    indices: pd.DataFrame | None,
) -> None:
    from sphshell_pin.plot.figure import write_figure
    from sphshell_pin.plot.uncertainty import plot_uncertainty
    from sphshell_pin.study.sweep.sampling import DRAWN

    assert report.out is not None
    rows = report.table[report.table["design"].isin(DRAWN)]
    values = rows[figure].to_numpy(float) if len(rows) else None
    units = report.table.attrs.get("units")
    if values is None and tornado is None and indices is None:
        return
    path = report.out.with_name(f"{report.out.stem}.{figure.replace('/', '_')}.png")
    try:
        paths.append(write_figure(path, plot_uncertainty(figure, values, tornado, indices, units)))
    except MissingExtra as missing:
        typer.echo(str(missing), err=True)


def _add_bands(paths: list[Path], report: SweepReport) -> None:
    from sphshell_pin.plot.figure import write_figure
    from sphshell_pin.plot.uncertainty import plot_bands
    from sphshell_pin.study.sweep import quantile_bands

    assert report.curves is not None
    assert report.curves_out is not None
    for curve in report.curves.columns[2:]:
        name = str(curve).replace("/", "_")
        path = report.curves_out.with_name(f"{report.curves_out.stem}.{name}.png")
        try:
            bands = quantile_bands(report.curves, str(curve))
            paths.append(write_figure(path, plot_bands(bands, str(curve))))
        except MissingExtra as missing:
            typer.echo(str(missing), err=True)
            return
