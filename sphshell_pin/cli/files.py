"""Commands on surface files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from sphshell_pin.cli.app import app, faults, terminal


@app.command()
def check(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="A surface file: .stl .obj .ply .off .shl")],
    unit: Annotated[
        str | None, typer.Option(help="Length unit of the file: mm, cm, m, inch, ...")
    ] = None,
    side: Annotated[
        str, typer.Option(help="Where spheres may be: both, outside, inside.")
    ] = "both",
    scale: Annotated[
        str | None,
        typer.Option(help="Use of the SCALE of a .shl file: apply, ignore, or a number instead."),
    ] = None,
) -> None:
    """Print the health of a surface file: what was found in it, and what was repaired.

    Example: sphshell-pin check blade.stl --unit mm
    """
    with faults(context):
        from sphshell_pin import Shell
        from sphshell_pin.errors import SphshellError, UnitMissing

        try:
            shell = Shell.from_file(file, unit, _number_or_word(scale), side=_side(side))
        except UnitMissing as error:
            raise SphshellError(f"the unit {error.must('--unit {}')}") from error
        terminal().print(str(shell.health), markup=False, highlight=False)


def _number_or_word(text: str | None) -> str | float | None:
    try:
        return text if text is None else float(text)
    except ValueError:
        return text


def _side(side: str) -> Any:
    from sphshell_pin.errors import InvalidParameter

    if side not in ("both", "outside", "inside"):
        raise InvalidParameter("--side", side, "must be both, outside or inside")
    return side
