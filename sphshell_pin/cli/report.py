"""The command report: speed against error on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from sphshell_pin.cli import common
from sphshell_pin.cli.common import command

if TYPE_CHECKING:
    from sphshell_pin.study.report import Report


@command()
def report(*, quick: bool = False, out: Path = Path("results/report")) -> None:
    """Measure speed against error on this machine and write a page of it.

    Contact forces, queries, integrators and steps, each against its aim. The machine should have
    nothing else to do. Exit code 1: a section could not be measured; a missed aim is no error.

    Example: sphshell-pin report --quick

    Options
    -------
    quick : Some two minutes: fewer rounds and sizes.
    out : Folder of the page and its tables.
    """
    from sphshell_pin.study.report import PAGE, make_report

    # Without --out: the folder is no part of what was measured.
    command = f"sphshell-pin report{' --quick' * quick}"
    with common.progress_bar("report", common.PERCENT, "TimeElapsedColumn", total=1.0) as update:
        made = make_report(
            out,
            quick=quick,
            command=command,
            tell=lambda title, share: update(description=title, completed=share),
        )
    _print(made)
    common.say(f"page: {out / PAGE}")
    raise typer.Exit(common.MISSED if made.failed else 0)


def _print(made: Report) -> None:
    rows = []
    for one in [one for section in made.sections for one in section.findings]:
        cell = common.colored(one.verdict, "green" if one.met else "red")
        rows.append((one.what, one.text, one.spread_text, one.aim_text, cell))
    common.print_table(("figure", "median", "quartiles", "aim", "verdict"), rows)
    if made.caution:
        common.echo(f"caution: {made.caution}", err=True)
    for section in made.failed:
        common.echo(f"not measured: {section.title}: {section.error}", err=True)
