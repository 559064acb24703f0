"""The command report: speed against error on this machine."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sphshell_pin.cli.app import MISSED, app, faults, make_table, plain, progress_bar, terminal

if TYPE_CHECKING:
    from sphshell_pin.study.report import Report


@app.command()
def report(
    context: typer.Context,
    quick: Annotated[
        bool, typer.Option("--quick", help="Some four minutes: fewer rounds and sizes.")
    ] = False,
    peers: Annotated[
        bool, typer.Option("--peers", help="The same scenes in other engines, too.")
    ] = False,
    validation: Annotated[
        bool,
        typer.Option(
            "--validation",
            help="Against published experiments instead; --quick leaves out the slow cases.",
        ),
    ] = False,
    out: Annotated[Path, typer.Option(help="Folder of the page and its tables.")] = Path(
        "results/report"
    ),
) -> None:
    """Measure speed against error on this machine and write a page of it.

    Contact forces, queries, integrators, steps and hard cases, each against its aim. The machine
    should have nothing else to do. Exit code 1: a section could not
    be measured; a missed aim is listed, and is no error.

    Example: sphshell-pin report --quick
    """
    if validation and peers:
        raise typer.BadParameter("--validation runs no other engines: leave out --peers")
    with faults(context):
        from rich.progress import TextColumn, TimeElapsedColumn

        from sphshell_pin.study.report import PAGE, make_report
        from sphshell_pin.study.validation import make_validation

        # Without --out: the folder is no part of what was measured.
        flags = {"--quick": quick, "--peers": peers, "--validation": validation}
        command = " ".join(["sphshell-pin report", *(name for name, on in flags.items() if on)])
        make = make_validation if validation else functools.partial(make_report, with_peers=peers)
        bar = progress_bar(TextColumn("{task.percentage:>3.0f} %"), TimeElapsedColumn())
        with bar:
            task = bar.add_task("report", total=1.0)
            made = make(
                out,
                quick=quick,
                command=command,
                tell=lambda title, share: bar.update(task, description=title, completed=share),
            )
        _print(made)
        terminal().print(f"page: {out / PAGE}", markup=False, highlight=False)
    raise typer.Exit(MISSED if made.failed else 0)


def _print(made: Report) -> None:
    table = make_table("figure", "median", "quartiles", "aim", "verdict")
    for section in made.sections:
        for finding in section.findings:
            word = {True: "[green]met[/green]", False: "[red]missed[/red]", None: ""}[finding.met]
            word = "[red]not measured[/red]" if finding.unmeasured else word
            texts = (finding.what, finding.text, finding.spread_text, finding.aim_text)
            table.add_row(*(plain(text) for text in texts), word)
    terminal().print(table)
    for line in [line for section in made.sections for line in section.unmeasured]:
        typer.echo(f"not measured: {line}", err=True)
    if made.caution:
        typer.echo(f"caution: {made.caution}", err=True)
    for section in made.failed:
        typer.echo(f"not measured: {section.title}: {section.error}", err=True)
