"""What the command sweep prints and draws of a sample of uncertain inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sphshell_pin.cli.app import echo, if_installed, print_table, say
from sphshell_pin.errors import InvalidParameter

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from sphshell_pin.study.sweep import Plan, SweepReport


def report_sample(
    plan: Plan, report: SweepReport, figures: list[str], *, all_: bool, pictures: bool
) -> list[Path]:
    """Print what a sample of `plan` says of `figures` and draw it; return the pictures' paths.

    Unless `all_` are wanted, only the first figure that any run has is looked at in detail. What
    cannot be computed is said in a sentence.
    """
    from sphshell_pin.plot.uncertainty import plot_bands, plot_uncertainty
    from sphshell_pin.study import sweep
    from sphshell_pin.study.sweep.sampling import DRAWN

    design, table, out = plan.design, report.table, report.out
    assert design is not None
    assert out is not None
    inputs = []
    for axis, one in zip(plan.axes, design.dists.values(), strict=True):
        ends = (f"{end:.6g}" for end in one.quantile(np.array([0.05, 0.5, 0.95])))
        inputs.append((axis.key, str(one), *ends, plan.units.get(axis.key, "")))
    print_table(("input", "distribution", "5 %", "median", "95 %", "unit"), inputs)
    if not all_:
        figures = [name for name in figures if table[name].notna().any()][:1]
    rows = table[table["design"].isin(DRAWN)]
    if len(rows):
        _print_quantiles(sweep.quantiles(table), figures)
    drawn: list[tuple[str, Callable[[], Figure]]] = []
    for name in figures:
        shown: dict[str, Any] = {"values": rows[name].to_numpy(float)} if len(rows) else {}
        for what, called, compute, show in (
            ("tornado", "tornado", sweep.tornado, _print_tornado),
            ("indices", "Sobol indices", sweep.sobol_indices, _print_indices),
        ):
            if not design.description[what]:
                continue
            try:
                found = shown[what] = compute(table, name)
            except InvalidParameter as fault:
                echo(f"no {called}: {fault}", err=True)
            else:
                show(name, found)
        if shown:
            units = table.attrs.get("units")
            drawn.append((name, partial(plot_uncertainty, name, units=units, **shown)))
    if not pictures:
        return []
    paths = draw(out, drawn)
    curves = report.curves
    if curves is not None and report.curves_out is not None:
        bands = (
            (name, partial(plot_bands, sweep.quantile_bands(curves, name), name))
            for name in map(str, curves.columns[2:])
        )
        paths += draw(report.curves_out, bands)
    return paths


def draw(file: Path, pictures: Iterable[tuple[str, Callable[[], Figure]]]) -> list[Path]:
    """Write pictures beside a table's `file`, called by what they show; return their paths."""
    from sphshell_pin.plot.figure import write_figure

    paths: list[Path] = []
    with if_installed():
        for name, plot in pictures:
            path = file.with_name(f"{file.stem}.{name.replace('/', '_')}.png")
            paths.append(write_figure(path, plot()))
    return paths


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
