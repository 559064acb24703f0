"""The command compare: finished runs over each other."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sphshell_pin.cli.app import app, faults, make_table, plain, terminal
from sphshell_pin.cli.export import file_of, with_scene

if TYPE_CHECKING:
    from sphshell_pin.study.compare import Comparison, Difference

# Rows of each printed table.
MOST_ROWS = 24


@app.command()
def compare(
    *,
    context: typer.Context,
    runs: Annotated[
        list[Path],
        typer.Argument(help="Two or more finished runs: run.npz or results folders."),
    ],
    out: Annotated[
        Path, typer.Option(help="Folder of figures.csv, curves.csv and compare.png.")
    ] = Path("results/compare"),
    picture: Annotated[
        bool, typer.Option("--picture/--no-picture", help="Draw compare.png.")
    ] = True,
) -> None:
    """Lay finished runs over each other: figures and curves, with their differences from the first.

    Contacts, joints and sensors are matched by name. Curves are compared within the time that both
    runs have, as lines between their recorded rows. Printed is what differs; the tables have all.

    Example: sphshell-pin compare results/soft results/stiff
    """
    with faults(context):
        from sphshell_pin.atomic.files import write_folder
        from sphshell_pin.study.compare import compare as compare_runs
        from sphshell_pin.study.compare import measured, tables_of
        from sphshell_pin.tables import csv_text

        labels = labels_of(runs)
        comparison = compare_runs(
            [measured(label, *with_scene(run)) for label, run in zip(labels, runs, strict=True)]
        )
        files = {
            f"{name}.csv": csv_text(table).encode() for name, table in tables_of(comparison).items()
        }
        if picture:
            files |= _picture(comparison)
        written = write_folder(out, files, ("figures.csv", "curves.csv", "compare.png"))
        for other in comparison.others:
            _print(comparison.runs[0].label, other)
        names = ", ".join(path.name for path in written)
        terminal().print(f"files in {out}: {names}", markup=False, highlight=False)


def labels_of(runs: list[Path]) -> list[str]:
    """Return a short name for each run: its folder's or its file's, its path where they repeat."""
    paths = [file_of(run).absolute() for run in runs]
    short = [one.parent.name if one.name == "run.npz" else one.stem for one in paths]
    if len(set(short)) == len(short):
        return short
    named = [str(run) for run in runs]
    return [name if name not in named[:k] else f"{name} ({k + 1})" for k, name in enumerate(named)]


def _picture(comparison: Comparison) -> dict[str, bytes]:
    from sphshell_pin.errors import MissingExtra
    from sphshell_pin.plot.compare import plot_compare
    from sphshell_pin.plot.figure import png

    try:
        return {"compare.png": png(plot_compare(comparison))}
    except MissingExtra as missing:
        typer.echo(str(missing), err=True)
        return {}


def _print(first: str, other: Difference) -> None:
    """Print what of `other` is not as in the run `first`."""
    console = terminal()
    console.print(f"[bold]{plain(other.label)}[/bold] beside {plain(first)}", highlight=False)
    if other.settings:
        table = make_table("setting", first, other.label)
        for key, mine, yours in other.settings[:MOST_ROWS]:
            table.add_row(plain(key), plain(_shown(mine)), plain(_shown(yours)))
        console.print(table)
    figures = [one for one in other.figures if not one.same]
    table = make_table("figure", first, other.label, "difference", "relative")
    for one in figures[:MOST_ROWS]:
        table.add_row(
            plain(f"{one.name} [{one.unit}]" if one.unit else one.name),
            f"{one.first:.6g}",
            f"{one.other:.6g}",
            f"{one.absolute:+.3g}",
            "-" if math.isnan(one.relative) else f"{100 * one.relative:+.3g} %",
        )
    if figures:
        console.print(table)
    curves = [one for one in other.curves if one.values.any()]
    table = make_table("curve", "largest difference", "at", "rms", "of its range")
    for curve in curves[:MOST_ROWS]:
        table.add_row(
            plain(curve.name),
            f"{curve.largest:.4g} {curve.unit}",
            f"{curve.at:.4g} s",
            f"{curve.rms:.3g} {curve.unit}",
            "-" if math.isnan(curve.of_range) else f"{100 * curve.of_range:.3g} %",
        )
    if curves:
        console.print(table)
    for title, rows in (("settings", other.settings), ("figures", figures), ("curves", curves)):
        if len(rows) > MOST_ROWS:
            more = f"{len(rows) - MOST_ROWS} more {title} differ"
            console.print(f"{more}: see the tables" if title != "settings" else more)
    same = len(other.figures) - len(figures), len(other.curves) - len(curves)
    console.print(f"equal to the last bit: {same[0]} figures, {same[1]} curves", highlight=False)
    if other.span is None:
        console.print("no curves are compared: the runs have no time in common", highlight=False)
    for label, parts in ((first, other.only_first), (other.label, other.only_other)):
        if parts:
            console.print(f"in {plain(label)} alone: {plain(', '.join(parts))}", highlight=False)


def _shown(value: object) -> str:
    text = "-" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
