"""Commands on surface files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from sphshell_pin.cli.app import argument, command, option, print_table, say
from sphshell_pin.errors import SphshellError, UnitMissing

FORMATS = ".stl .obj .ply .off .shl, .step .iges .brep"

ChordErrorOption = Annotated[
    float | None, option("Of CAD: largest distance of the elements from the exact surface \\[m].")
]
BodyOption = Annotated[
    list[str] | None, option("Of CAD: take this body; may be given several times.", metavar="NAME")
]
FaceOption = Annotated[
    list[str] | None,
    option(
        "Of CAD: take this face, by name or number; may be given several times.", metavar="NAME"
    ),
]

TimeLimitOption = Annotated[
    float | None, option("Of CAD: end OpenCASCADE after this time \\[s], 600 unless given.")
]
MemoryLimitOption = Annotated[
    float | None, option("Of CAD: let OpenCASCADE take so much memory \\[bytes], 8e9 unless given.")
]


@command()
def check(
    file: Annotated[Path, argument(f"A surface file: {FORMATS}")],
    unit: Annotated[str | None, option("Length unit of the file: mm, cm, m, inch, ...")] = None,
    side: Annotated[str, option("Where spheres may be: both, outside, inside.")] = "both",
    scale: Annotated[
        str | None, option("Use of the SCALE of a .shl file: apply, ignore, or a number instead.")
    ] = None,
    chord_error: ChordErrorOption = None,
    body: BodyOption = None,
    face: FaceOption = None,
    time_limit: TimeLimitOption = None,
    memory_limit: MemoryLimitOption = None,
) -> None:
    """Print the health of a surface file: what was found, what was repaired, how far it is curved.

    Example: sphshell-pin check blade.stl --unit mm
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
    say(str(shell.health))


@command()
def convert(
    source: Annotated[Path, argument(f"The file to read: {FORMATS}")],
    target: Annotated[Path, argument("The file to write; its suffix names the format.")],
    unit_in: Annotated[
        str | None, option("Length unit of the file to read; STEP and IGES state it.")
    ] = None,
    unit_out: Annotated[
        str | None, option("Length unit of the file to write; the same unless given.")
    ] = None,
    chord_error: ChordErrorOption = None,
    body: BodyOption = None,
    face: FaceOption = None,
    time_limit: TimeLimitOption = None,
    memory_limit: MemoryLimitOption = None,
) -> None:
    """Write a surface file in another format, and measure how far apart the two are.

    CAD becomes a mesh within the chord error, CAD to CAD keeps the exact surfaces, a mesh becomes
    planar CAD faces.

    Example: sphshell-pin convert blade.step blade.stl --chord-error 1e-4
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
    rows = []
    for held in (done.source, done.target):
        size, area = f"{held.size:.6g} m", f"{held.area:.6g} m^2"
        rows.append((str(held.path), held.unit, f"{held.count} {held.kind}", size, area))
    print_table(("file", "unit", "holds", "size", "area"), rows)
    say(
        f"deviation measured at {len(done.forth) + len(done.back)} points: "
        f"largest {done.largest:.3g} m, root mean square {done.rms:.3g} m"
    )
    for note in done.notes:
        say(f"note: {note}")


def faces_of(names: list[str] | None) -> list[str | int] | None:
    """Return faces by name, or by number where the name is one."""
    return None if names is None else [int(n) if n.isdecimal() else n for n in names]


def _number_or_word(text: str | None) -> str | float | None:
    try:
        return text if text is None else float(text)
    except ValueError:
        return text
