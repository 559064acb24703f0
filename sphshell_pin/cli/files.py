"""Commands on surface files."""

from pathlib import Path

from sphshell_pin.cli import common
from sphshell_pin.errors import SphshellError, UnitMissing


@common.command()
def check(
    file: Path,
    *,
    unit: str | None = None,
    side: str = "both",
    scale: str | None = None,
    chord_error: float | None = None,
    body: list[str] | None = None,
    face: list[str] | None = None,
    time_limit: float | None = None,
    memory_limit: float | None = None,
) -> None:
    """Print the health of a surface file: what was found, what was repaired, how far it is curved.

    Example: sphshell-pin check blade.stl --unit mm

    Options
    -------
    file : A surface file: .stl .obj .ply .off .shl, .step .iges .brep
    unit : Length unit of the file: mm, cm, m, inch, ...
    side : Where spheres may be: both, outside, inside.
    scale : Use of the SCALE of a .shl file: apply, ignore, or a number instead.
    """
    from sphshell_pin import Shell

    try:
        shell = Shell.from_file(
            file,
            unit,
            _number_or_word(scale),
            chord_error=chord_error,
            bodies=body,
            faces=faces_of(face),
            time_limit=time_limit,
            memory_limit=memory_limit,
            side=side,
        )
    except UnitMissing as error:
        raise SphshellError(f"the unit {error.must('--unit {}')}") from error
    shell.curvature_report()
    common.say(str(shell.health))


@common.command()
def convert(
    source: Path,
    target: Path,
    *,
    unit_in: str | None = None,
    unit_out: str | None = None,
    chord_error: float | None = None,
    body: list[str] | None = None,
    face: list[str] | None = None,
    time_limit: float | None = None,
    memory_limit: float | None = None,
) -> None:
    """Write a surface file in another format, and measure how far apart the two are.

    CAD becomes a mesh within the chord error.

    Example: sphshell-pin convert blade.step blade.stl --chord-error 1e-4

    Options
    -------
    source : The file to read: .stl .obj .ply .off .shl, .step .iges .brep
    target : The file to write: .stl .obj .ply .off .shl
    unit_in : Length unit of the file to read; STEP and IGES state it.
    unit_out : Length unit of the file to write; the same unless given.
    """
    from sphshell_pin.shell.converting import convert as convert_file

    try:
        done = convert_file(
            source,
            target,
            unit_in,
            unit_out,
            chord_error=chord_error,
            bodies=body,
            faces=faces_of(face),
            time_limit=time_limit,
            memory_limit=memory_limit,
        )
    except UnitMissing as error:
        raise SphshellError(f"the unit {error.must('--unit-in {}')}") from error
    rows = [
        (str(path), f"{held.num_elements}", f"{held.size:.6g} m", f"{held.health.area:.6g} m^2")
        for path, held in ((source, done.source), (target, done.target))
    ]
    common.print_table(("file", "elements", "size", "area"), rows)
    common.say(f"largest distance of a vertex of either from the other: {done.largest:.3g} m")
    for note in done.notes:
        common.say(f"note: {note}")


def faces_of(names: list[str] | None) -> list[str | int] | None:
    """Return faces by name, or by number where the name is one."""
    return None if names is None else [int(n) if n.isdecimal() else n for n in names]


def _number_or_word(text: str | None) -> str | float | None:
    try:
        return text if text is None else float(text)
    except ValueError:
        return text
