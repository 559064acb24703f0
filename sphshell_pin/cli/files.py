"""Commands on surface files."""

from __future__ import annotations

from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sphshell_pin.cli.app import (
    MISSED,
    command,
    length_of,
    option,
    print_table,
    say,
)
from sphshell_pin.errors import SphshellError, UnitMissing

if TYPE_CHECKING:
    from sphshell_pin.study.against import Against

MOST_ROWS = 16  # of the printed table

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
    file: Path,
    *,
    unit: str | None = None,
    side: str = "both",
    scale: str | None = None,
    chord_error: ChordErrorOption = None,
    body: BodyOption = None,
    face: FaceOption = None,
    time_limit: TimeLimitOption = None,
    memory_limit: MemoryLimitOption = None,
    against: Path | None = None,
    against_unit: str | None = None,
    radius: str | None = None,
    tolerance: float = 0.01,
    json: Path | None = None,
) -> None:
    """Print the health of a surface file: what was found, what was repaired, how far it is curved.

    With --against, press spheres into all faces of two files of one part, and print the faces on
    which contact differs. Exit code 1: it does.

    Example: sphshell-pin check blade.stl --unit mm

    Options
    -------
    file : A surface file: .stl .obj .ply .off .shl, .step .iges .brep
    unit : Length unit of the file: mm, cm, m, inch, ...
    side : Where spheres may be: both, outside, inside.
    scale : Use of the SCALE of a .shl file: apply, ignore, or a number instead.
    against : Another file of the same part: compare contact on all faces of both.
    against_unit : Length unit of that file.
    radius : With --against: radius of the spheres, 2 % of the size unless given.
    tolerance : With --against: share by which forces may differ.
    json : With --against: write all figures to this file.
    """
    from sphshell_pin import Shell
    from sphshell_pin.shell.cad import CAD_SUFFIXES

    def load(file: Path, unit: str | None, unit_option: str, first: bool = True) -> Shell:
        # Where there are two files, options of CAD belong to those that are CAD.
        cad = against is None or file.suffix.lower() in CAD_SUFFIXES
        try:
            return Shell.from_file(
                file,
                unit,
                _number_or_word(scale) if first else None,
                chord_error=chord_error if cad else None,
                bodies=body if cad and first else None,
                faces=faces_of(face) if cad and first else None,
                time_limit=time_limit if cad else None,
                memory_limit=memory_limit if cad else None,
                side=side if against is None else "both",
            )
        except UnitMissing as error:
            raise SphshellError(f"the unit {error.must(unit_option + ' {}')}") from error

    shell = load(file, unit, "--unit")
    if against is None:
        shell.curvature_report()
        say(str(shell.health))
        return
    from sphshell_pin.study.against import compare_shells

    other = load(against, against_unit, "--against-unit", False)
    found = compare_shells(shell, other, length_of("--radius", radius), tolerance)
    _print_against(found, (file.name, against.name))
    if json is not None:
        from sphshell_pin.base.atomic import write_whole

        text = dumps({"files": [str(file), str(against)], **found.to_dict()}, indent=1)
        write_whole(json, text.encode())
    raise typer.Exit(0 if found.same else MISSED)


def _print_against(found: Against, names: tuple[str, str]) -> None:
    """Print the faces that differ most, and the verdict."""
    rows = [
        (
            f"{'AB'[one.of]} {one.name}",
            one.kind,
            f"{one.area:.1e}",
            str(one.places),
            f"{one.worst:+.1e}",
            f"{one.worst / found.radius:+.1e}",
            f"{one.median / found.radius:.0e}",
            f"{one.worst / found.size:+.1e}",
            "{:.2f}-{:.2f}".format(*one.force),
            f"{one.lost}+{one.extra}",
        )
        for one in found.off[:MOST_ROWS]
    ]
    if rows:
        columns = ("face", "kind", "[m^2]", "places", "worst [m]", "of r", "median", "of size")
        print_table((*columns, "force", "lost+extra"), rows)
    if len(found.off) > len(rows):
        say(f"{len(found.off) - len(rows)} more faces differ")
    if found.unreached:
        say(f"{found.unreached} faces are not compared: no sphere of this radius touches one alone")
    spheres = f"spheres of radius {found.radius:.3g} m, {found.depth:.3g} m deep"
    say(f"A {names[0]}, B {names[1]}; {spheres}")
    say(found.verdict())


@command()
def convert(
    source: Path,
    target: Path,
    *,
    unit_in: str | None = None,
    unit_out: str | None = None,
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

    Options
    -------
    source : The file to read: .stl .obj .ply .off .shl, .step .iges .brep
    target : The file to write; its suffix names the format.
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
