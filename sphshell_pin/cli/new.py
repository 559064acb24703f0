"""The command that writes a new scenario."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NoReturn

from sphshell_pin.cli.app import (
    DensityOption,
    MimicOption,
    PackageDirOption,
    RadiusOption,
    XacroArgOption,
    command,
    echo,
    length_of,
    option,
    progress_bar,
    say,
    xacro_args_of,
)
from sphshell_pin.cli.files import BodyOption, FaceOption, faces_of
from sphshell_pin.errors import SphshellError, UnitMissing

if TYPE_CHECKING:
    from sphshell_pin.scenario.drafting.new import NewScenario


_FRAMES = 8  # of a robot in a list


@command()
def new(
    robot: Annotated[
        str,
        option(
            "A shipped robot (sphshell-pin list), a URDF, xacro (which is code) or MJCF file, a "
            "name of robot_descriptions, or a folder: its robots are listed."
        ),
    ],
    surface: Annotated[
        str, option("A surface file, or one of: plane, box, sphere, cylinder, bowl.")
    ] = "plane",
    frame: Annotated[
        str | None,
        option("Frame that carries the sphere; by default a known tip or the end of a limb."),
    ] = None,
    radius: RadiusOption = None,
    offset: Annotated[
        tuple[float, float, float] | None,
        option(
            "Center of the sphere in the frame \\[m]; by default the end of its link.",
            metavar="X Y Z",
        ),
    ] = None,
    unit: Annotated[
        str | None, option("Length unit of the surface file: mm, cm, m, inch, ...")
    ] = None,
    body: BodyOption = None,
    face: FaceOption = None,
    law: Annotated[
        str | None,
        option("Material of the sphere: steel, aluminium, plastic, wood, rubber, silicone."),
    ] = None,
    against: Annotated[str, option("Material of the surface.")] = "steel",
    press: Annotated[float | None, option("Normal force \\[N].", metavar="N")] = None,
    place: Annotated[
        str | None,
        option(
            "Where the surface is, seen from the tip: below, above, +x, -x, +y, -y; by "
            "default below, if the joints allow it."
        ),
    ] = None,
    at: Annotated[
        str | None,
        option(
            "Where to touch: a point of the part \\[m], or a face as check lists them: plane, "
            "'cylinder 5.5 mm'; the largest one.",
            metavar="X,Y,Z|FACE",
        ),
    ] = None,
    path: Annotated[
        str | None,
        option(
            "Of the tip: points of the part \\[m], 'x,y,z; x,y,z', or line, circle, raster.",
            metavar="POINTS|SHAPE",
        ),
    ] = None,
    length: Annotated[
        str | None, option("Of a path: 0.06 \\[m] or 60mm.", metavar="LENGTH")
    ] = None,
    tips: Annotated[
        Literal["one", "all"],
        option("all: the fingertips of a hand hold the surface, as a free part."),
    ] = "one",
    base: Annotated[
        Literal["fixed", "floating"] | None,
        option("Of the robot; by default as its file and its shape say."),
    ] = None,
    free_flyer: Annotated[bool, option("The same as --base floating.", "--free-flyer")] = False,
    package_dir: PackageDirOption = None,
    xacro_arg: XacroArgOption = None,
    density: DensityOption = None,
    no_mimic: MimicOption = False,
    out: Annotated[
        Path | None, option("The file to write; default: ROBOT_on_SURFACE.toml.")
    ] = None,
    force: Annotated[bool, option("Replace the file if it is there already.", "--force")] = False,
) -> None:
    """Write a scenario: this robot, this surface, and values that work for their size.

    It is run first, and written only if it touches, holds its force within 5 %, and keeps the
    robot's links out of the part; else the message says what fails and what to change.

    Example: sphshell-pin new --robot panda --surface blade.stl --unit mm
    """
    if Path(robot).is_dir():
        _list_robots(robot)
    from sphshell_pin.scenario.drafting.new import new_scenario

    title = f"{robot} and {surface}: searching posture, place and values"
    try:
        with progress_bar(title, "TimeElapsedColumn", total=None):
            made = new_scenario(
                robot,
                surface,
                frame=frame,
                radius=length_of("--radius", radius),
                offset=offset,
                unit=unit,
                bodies=body,
                faces=faces_of(face),
                material=law,
                against=against,
                press=press,
                place=place,
                at=at,
                path=path,
                length=length_of("--length", length),
                tips=tips,
                base="floating" if free_flyer else base,
                package_dirs=package_dir or (),
                xacro_args=xacro_args_of(xacro_arg),
                density=density,
                mimic=not no_mimic,
                out=out,
                force=force,
                # What was tried goes to the error stream, the answer to the other.
                tell=lambda what: echo(what, err=True),
            )
    except UnitMissing as error:
        raise SphshellError(f"the unit {error.must('--unit {}')}") from error
    _show(made)


def _list_robots(folder: str) -> NoReturn:
    """Print the robots in a folder, each as it is found, and end: one has to be named."""
    from sphshell_pin.robots.workspace import find_robots

    count = 0
    for one in find_robots(folder):
        count += 1
        say(f"{one.file}: {one.joints} joints" if one.joints else f"{one.file}")
        if one.frames:
            shown = ", ".join(one.frames[:_FRAMES]) + (", ..." if one.frames[_FRAMES:] else "")
            say(f"  frames at its ends: {shown}")
        if one.missing:
            say(f"  missing: {one.missing}")
    which = f"say which of these {count} robots: --robot FILE" if count else "holds no robot's file"
    raise SphshellError(f"{folder}: {which}")


def _show(made: NewScenario) -> None:
    for section in made.built.scenario.shell:
        if section.file is not None:
            say(f"{made.built.shells[section.name].health}\n")
    say(f"{made.explanation}\n")
    say("Chosen:")
    for one in made.why:
        say(f"  {one}")
    say(f"\nWritten: {made.path}")
    say("Next:")
    for way in ("run", "view"):
        say(f"  sphshell-pin {way} {shlex.quote(str(made.path))}")
