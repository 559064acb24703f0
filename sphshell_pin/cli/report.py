"""The command report: speed against error on this machine."""

from pathlib import Path

import typer

from sphshell_pin.cli import common
from sphshell_pin.cli.common import command


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
    from sphshell_pin.study.report.contents import findings_table

    # Without --out: the folder is no part of what was measured.
    command = f"sphshell-pin report{' --quick' * quick}"
    with common.progress_bar("report", common.PERCENT, "TimeElapsedColumn", total=1.0) as update:
        made = make_report(
            out,
            quick=quick,
            command=command,
            tell=lambda title, share: update(description=title, completed=share),
        )
    table = findings_table([one for section in made.sections for one in section.findings])
    common.print_table([one.heading for one in table.columns], table.cells)
    if made.caution:
        common.echo(f"caution: {made.caution}", err=True)
    for section in made.failed:
        common.echo(f"not measured: {section.title}: {section.error}", err=True)
    common.say(f"page: {out / PAGE}")
    raise typer.Exit(common.MISSED if made.failed else 0)
