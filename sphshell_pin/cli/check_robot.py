"""The command check-robot, which judges contact on a robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sphshell_pin.cli import common
from sphshell_pin.cli.common import command
from sphshell_pin.errors import FrameNotFound, SphshellError

if TYPE_CHECKING:
    from sphshell_pin.study.robot_check import RobotReport


@command("check-robot")
def check_robot_(
    robot: list[str] | None = None,
    *,
    every: bool = False,
    frame: str | None = None,
    radius: str | None = None,
    free_flyer: bool = False,
    package_dir: list[Path] | None = None,
    xacro_arg: list[str] | None = None,
    density: float | None = None,
    no_mimic: bool = False,
    mend: Path | None = None,
    quick: bool = False,
    seed: Annotated[int, common.option("Seed of the random postures.", min=0)] = 0,
    json: Path | None = None,
) -> None:
    """Check contact on robots: forces, momentum, energy, derivatives, contacts missed.

    A sphere is put on the robot and a curved shell under it; the contact is compared with
    computations independent of the compiled core. Exit code 1: a check failed; 2: a robot could not
    be checked.

    Example: sphshell-pin check-robot panda my_robot.urdf

    Options
    -------
    robot : Names of shipped robots (sphshell-pin list), or URDF, xacro (which is code) or MJCF
        files.
    every --all : Check every robot there is.
    frame : Frame that carries the sphere; by default a known tip, or the end of the longest limb.
    free_flyer : The root link of the URDF floats.
    mend OUT.urdf : Write a URDF of the robot that needs none of these options.
    quick : Fewer postures and runs.
    json FILE : Write all figures to this file.
    """
    from sphshell_pin.base.atomic.file import check_writable, write_whole
    from sphshell_pin.study import robot_check as study
    from sphshell_pin.study.robot_check import models, report

    if every and robot:
        raise SphshellError("give robots or --all, not both")
    if not every and not robot:
        raise SphshellError("say which robots: names, files, or --all")
    names = models.all_names() if every else list(robot or [])
    models.check_known(names)
    if mend is not None and len(names) != 1:
        raise SphshellError("--mend writes one robot: give one")
    for path in (json, mend):
        if path is not None:
            check_writable(path)
    if mend is not None:
        from sphshell_pin.robots.mending import mended

        args = common.xacro_args_of(xacro_arg)
        text, changes = mended(names[0], package_dir or (), args, density)
        write_whole(mend, text.encode())
        common.say(f"Written: {mend}")
        for change in changes:
            common.say(f"  {change}")
        names, package_dir, xacro_arg, density = [str(mend)], None, None, None
    sizes = study.QUICK if quick else study.Sizes()
    check = partial(
        study.check_robot,
        frame=frame,
        radius=common.length_of("--radius", radius),
        free_flyer=free_flyer,
        package_dirs=package_dir or (),
        xacro_args=common.xacro_args_of(xacro_arg),
        density=density,
        mimic=not no_mimic,
        seed=seed,
        sizes=sizes,
    )
    reports, stopped = _check(names, check)
    _print(reports)
    if stopped:
        left = len(names) - len(reports)
        common.echo(f"interrupted: {left} of {len(names)} robots were not checked", err=True)
        raise typer.Exit(common.INTERRUPTED)
    command = "sphshell-pin check-robot " + ("--all" if every else " ".join(names))
    if json is not None:
        text = report.as_json(reports, f"{command} --json {json}", seed, sizes)
        write_whole(json, text.encode())
    verdicts = [one.verdict for one in reports]
    # A robot that was asked for by name and cannot be checked is wrong input, and so is what
    # no robot there is can be checked with.
    unread = report.NOT_CHECKED in verdicts and (not every or len(set(verdicts)) == 1)
    raise typer.Exit(common.MISSED if report.FAILED in verdicts else common.ERROR if unread else 0)


def _check(
    names: Sequence[str], check: Callable[..., RobotReport]
) -> tuple[list[RobotReport], bool]:
    """Return the reports that `check` gives, and whether Ctrl-C came before the last."""
    from sphshell_pin.study.robot_check import RobotReport

    reports: list[RobotReport] = []
    with common.progress_bar("", "MofNCompleteColumn", total=len(names)) as update:
        try:
            for name in names:

                def show(title: str, name: str = name) -> None:
                    update(description=f"{Path(name).name}: {title}")

                try:
                    report = check(name, progress=show)
                except FrameNotFound as error:
                    if len(names) == 1:
                        raise
                    # The others may have it.
                    report = RobotReport(name, reason=str(error))
                reports.append(report)
                update(advance=1)
        except KeyboardInterrupt:
            return reports, True
    return reports, False


def _print(reports: Sequence[RobotReport]) -> None:
    """Print the largest error of each check, and what is to be said of the robots."""
    from sphshell_pin.study.robot_check.checks import CHECKS
    from sphshell_pin.study.robot_check.report import PASS, error_text, remarks

    rows = []
    for key, check in CHECKS.items():
        found = [(one.findings[key].error, one.name) for one in reports if key in one.findings]
        if found:
            error, name = max(found)
            color = "red" if error > check.tolerance else ""
            rows.append(
                (key, common.colored(error_text(error), color), f"{check.tolerance:g}", name)
            )
    common.print_table(("check", "largest error", "allowed", "of robot"), rows)
    for sentence in remarks(reports):
        common.say(sentence)
    passed = sum(one.verdict == PASS for one in reports)
    common.say(f"{passed} of {len(reports)} robots pass")
