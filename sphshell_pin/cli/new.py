"""The command that writes a new scenario."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NoReturn

from sphshell_pin.cli import common
from sphshell_pin.cli.files import faces_of
from sphshell_pin.errors import SphshellError, UnitMissing

if TYPE_CHECKING:
    from sphshell_pin.scenario.drafting.searching import NewScenario


_FRAMES = 8  # of a robot in a list


@common.command()
def new(
    *,
    robot: str,
    surface: str = "plane",
    frame: str | None = None,
    radius: str | None = None,
    offset: tuple[float, float, float] | None = None,
    unit: str | None = None,
    body: list[str] | None = None,
    face: list[str] | None = None,
    law: str | None = None,
    against: str | None = None,
    press: float | None = None,
    place: str | None = None,
    at: str | None = None,
    path: str | None = None,
    length: str | None = None,
    tips: Literal["one", "all"] = "one",
    base: Literal["fixed", "floating"] | None = None,
    free_flyer: bool = False,
    package_dir: list[Path] | None = None,
    xacro_arg: list[str] | None = None,
    density: float | None = None,
    no_mimic: bool = False,
    out: Path | None = None,
    force: bool = False,
) -> None:
    """Write a scenario: this robot, this surface, and values that work for their size.

    It is run first, and written only if it touches, holds its force within 5 %, and keeps the
    robot's links out of the part; else the message says what fails and what to change.

    Example: sphshell-pin new --robot panda --surface blade.stl --unit mm

    Options
    -------
    robot : A shipped robot (sphshell-pin list), a URDF, xacro (which is code) or MJCF file, a name
        of robot_descriptions, or a folder: its robots are listed.
    surface : A surface file, or one of: plane, box, sphere, cylinder, bowl.
    frame : Frame that carries the sphere; by default a known tip or the end of a limb.
    offset X Y Z : Center of the sphere in the frame [m]; by default the end of its link.
    unit : Length unit of the surface file: mm, cm, m, inch, ...
    law : Material of the sphere: steel, aluminium, plastic, wood, rubber, silicone.
    against : Material of the surface; by default steel, or plastic where steel is too heavy.
    press N : Normal force [N].
    place : Where the surface is, seen from the tip: below, above, +x, -x, +y, -y; by default below,
        if the joints allow it.
    at X,Y,Z|FACE : Where to touch: a point of the part [m], or a face as check lists them: plane,
        'cylinder 5.5 mm'; the largest one.
    path POINTS|SHAPE : Of the tip: points of the part [m], 'x,y,z; x,y,z', or line, circle, raster.
    length LENGTH : Of a path: 0.06 [m] or 60mm.
    tips : all: the fingertips of a hand hold the surface, as a free part.
    base : Of the robot; by default as its file and its shape say.
    free_flyer : The same as --base floating.
    out : The file to write; default: ROBOT_on_SURFACE.toml.
    force : Replace the file if it is there already.
    """
    if Path(robot).is_dir():
        _list_robots(robot)
    from sphshell_pin.scenario.drafting.new import new_scenario

    title = f"{Path(robot).name} and {Path(surface).name}: searching posture, place and values"
    try:
        with common.progress_bar(title, "TimeElapsedColumn", line_every=2.0, total=None):
            made = new_scenario(
                robot,
                surface,
                frame=frame,
                radius=common.length_of("--radius", radius),
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
                length=common.length_of("--length", length),
                tips=tips,
                base="floating" if free_flyer else base,
                package_dirs=package_dir or (),
                xacro_args=common.xacro_args_of(xacro_arg),
                density=density,
                mimic=not no_mimic,
                out=out,
                force=force,
                # What was tried goes to the error stream, the answer to the other.
                tell=lambda what: common.echo(what, err=True),
            )
    except UnitMissing as error:
        raise SphshellError(f"the unit {error.must('--unit {}')}") from error
    _show(made)


def _list_robots(folder: str) -> NoReturn:
    """Print the robots in a folder, each as it is found, and end: one has to be named."""
    from sphshell_pin.robots.finding import find_robots

    count = 0
    for one in find_robots(folder):
        count += 1
        common.say(f"{one.file}: {one.joints} joints" if one.joints else f"{one.file}")
        if one.frames:
            shown = ", ".join(one.frames[:_FRAMES]) + (", ..." if one.frames[_FRAMES:] else "")
            common.say(f"  frames at its ends: {shown}")
        if one.missing:
            common.say(f"  missing: {one.missing}")
    which = f"say which of these {count} robots: --robot FILE" if count else "holds no robot's file"
    raise SphshellError(f"{folder}: {which}")


def _show(made: NewScenario) -> None:
    for section in made.built.scenario.shell:
        if section.file is not None:
            common.say(f"{made.built.shells[section.name].health}\n")
    common.say(f"{made.explanation}\n")
    common.say("Chosen:")
    for one in made.why:
        common.say(f"  {one}")
    common.say(f"\nWritten: {made.path}")
    common.say("Next:")
    for way in ("run", "view"):
        common.say(f"  sphshell-pin {way} {shlex.quote(str(made.path))}")
