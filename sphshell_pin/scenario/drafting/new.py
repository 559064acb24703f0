"""A new scenario from a robot and a surface, with values chosen for their sizes."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sphshell_pin.base.atomic import write_whole
from sphshell_pin.base.regular_file import StrPath, why_no_file
from sphshell_pin.dynamics.scene.models import radius_fault
from sphshell_pin.errors import InvalidParameter, NameNotFound, ScenarioError, SphshellError
from sphshell_pin.robots import RobotError, floats, is_path, joints_without_mass
from sphshell_pin.robots.inertia import few, lacks_masses, lacks_moments
from sphshell_pin.scenario.drafting.asked import WORDS, Asked
from sphshell_pin.scenario.drafting.dropping import DropSearch
from sphshell_pin.scenario.drafting.fingertips import find_tips, only_turns
from sphshell_pin.scenario.drafting.hand import HoldSearch, TooHeavy, every_tip
from sphshell_pin.scenario.drafting.limb_ends import LinkGeometry, Tip, sphere_centers
from sphshell_pin.scenario.drafting.part import part_file
from sphshell_pin.scenario.drafting.pose_search import PressSearch
from sphshell_pin.scenario.drafting.poses import joints_aside
from sphshell_pin.scenario.drafting.searching import CannotReach, CannotStand, NewScenario, Search
from sphshell_pin.scenario.drafting.touch_points import widest_room
from sphshell_pin.scenario.drafting.wording import rounded
from sphshell_pin.scenario.format.bodies import check_masses
from sphshell_pin.scenario.format.build import Built, build_scenario
from sphshell_pin.scenario.format.schema import RobotSection, RunSection, Scenario, ShellSection
from sphshell_pin.scenario.format.shape_tables import Ball, Box, Cylinder, HalfSpace, Primitive

# Half the size of a surface that needs no file, in radii of the sphere; radius of a ball whose size
# is free, as a part of the part's middle width, and of the room on its widest face.
_SIZE, _BALL, _OF_ROOM = 15.0, 0.1, 0.5
# Such surfaces that a hand can hold; half their width there, in radii of a fingertip.
HELD_WORDS, _IN_HAND = ("sphere", "cylinder", "box"), 2.5
# Density of links without masses whose geometry is known, that of aluminium [kg/m^3].
_DENSITY = 2700.0
# Ends of other limbs that are tried where one does not come to the part.
_MOST_ENDS = 2


def new_scenario(robot: StrPath, surface: StrPath = "plane", **options: Any) -> NewScenario:
    """Write a scenario in which `robot` touches `surface`, with values that work for its size.

    Drafts are run; the first is written that touches, holds its force within 5 %, and keeps the
    robot's links out of the part. `options` are the fields of `Asked`.

    Raises
    ------
    UnitMissing
        The surface file has no unit of its own and none is given.
    NameNotFound, FrameNotFound
        No such robot, frame, material, place.
    SphshellError
        What cannot be found out and is not given, a file that cannot be read or written, or that no
        draft works: the text says what fails in it and what to change.
    """
    first = Asked(robot, surface, **options)
    attempts: list[tuple[tuple[str, ...], Asked]] = [((), first)]
    for notes, asked in attempts:
        try:
            made = _written(asked)
        except SphshellError as error:
            if (asked.frame, asked.tip) == (first.frame, first.tip):
                refused = error
            attempts += [((*notes, note), other) for note, other in _instead(error, asked)]
        else:
            return replace(made, why=tuple(one for one in (*notes, *made.why) if one))
    raise refused


def _instead(error: SphshellError, asked: Asked) -> Iterator[tuple[str, Asked]]:
    """Yield what to try where that fails which is asked for: why, and what is asked instead."""
    said = str(error).partition(";")[0]
    if isinstance(error, CannotReach) and asked.tip is None:
        for one in error.others[:_MOST_ENDS] if asked.frame is None else ():
            yield f"frame '{one}', as with '{error.frame}' {said}", replace(asked, frame=one)
        # A sphere of which the place is asked for stays there.
        stays = asked.offset is not None or (asked.frame and asked.radius)
        if error.out is not None and not stays:
            yield "", replace(asked, tip=error.out)
    if isinstance(error, TooHeavy) and asked.against is None:
        yield f"the part is of plastic, as with steel {said}", replace(asked, against="plastic")
    if isinstance(error, RobotError) and asked.mimic:
        note = f"joints that are coupled move freely (--no-mimic), as else: {said}"
        yield note, replace(asked, mimic=False)
    if isinstance(error, CannotStand) and asked.base is None:
        note = f"the base is fixed, as the robot cannot stand on the surface: {error.reason}"
        yield note, replace(asked, base="fixed")


def _written(asked: Asked) -> NewScenario:
    """Write the scenario that is asked for; errors as of `new_scenario`."""
    file = _free_path(asked)
    section, bare, shaped = _bare(asked, file)
    loaded, radius, in_hand = bare.assembly.loaded[0], asked.radius, asked.tips == "all"
    if radius and (too_large := radius_fault(bare.assembly.model, radius)):
        raise InvalidParameter("radius", radius, too_large)
    tips: Sequence[Tip] = [asked.tip] if asked.tip is not None else ()
    if in_hand:
        tips = every_tip(loaded, asked)
    elif not tips:
        tips = find_tips(
            loaded, shipped=section.name, frame=asked.frame, radius=radius, offset=asked.offset
        )
    check_masses(bare.assembly, joints_aside(bare.assembly.model, tips))
    built = _build_bare(section, file, _shell_section(asked, file, bare, tips), reuse=bare)
    tips = _sized_to(built, tips, asked)
    built = _sided(built, tips, inside=asked.inside)
    # What is written is what was built, and tried.
    search: type[Search] = DropSearch if floats(built.assembly.model) else PressSearch
    try:
        made = (HoldSearch if in_hand else search)(asked, built, tips, file).find()
    except SphshellError as error:
        if shaped == "fixed" and not in_hand:
            error.args = (f"{error}; or let it float, --base floating",)
        raise
    if made.part:
        write_whole(file.with_name(part_file(file.stem)), made.part.encode())
    write_whole(file, made.text.encode())
    shape = f"the base is {shaped}, by the robot's shape: or --base"
    masses = loaded.assumed
    masses += ": another with --density" if masses and asked.density is None else ""
    idle = few([repr(one) for one in joints_without_mass(loaded.model, loaded.q0)])
    idle = idle and f"held, as nothing that they move has a mass: joints {idle}"
    return replace(made, why=(shape if shaped and not in_hand else "", *made.why, masses, idle))


def _bare(asked: Asked, file: Path) -> tuple[RobotSection, Built, str | None]:
    """Return the robot's table, the robot alone, and the base that its shape gives it if it does.

    Bodies that lack masses or moments of inertia get those of their geometry.
    """
    section = _robot_section(asked, file)
    bare = _build_bare(section, file)
    loaded, density = bare.assembly.loaded[0], asked.density
    model, shaped = loaded.model, None
    if asked.base is None:
        # A single body floats, with rotors or wheels too; a single limb is an arm, and what stands
        # beside a free body is not carried by it.
        roots, limbs = (list(model.parents)[1:].count(joint) for joint in (0, 1))
        if not model.nv or (not floats(model) and only_turns(model)):
            shaped = "floating"
        elif floats(model) and (limbs == 1 or roots > 1):
            shaped = "fixed"
    base = shaped or asked.base
    if section.name is None and density is None:
        known, free = loaded.description, base == "floating"
        if lacks_moments(known) or lacks_masses(model, known, floating=free):
            density = _DENSITY
    if (base, density) != (section.base, section.density):
        section = section.model_copy(update={"base": base, "density": density})
        bare = _build_bare(section, file)
    return section, bare, shaped


def _sized_to(built: Built, tips: Sequence[Tip], asked: Asked) -> Sequence[Tip]:
    """Return the `tips`, balls of free size that press on a file's surface as it needs them.

    A round end that is larger than the surface gets a smaller ball on it, but of a shipped robot.
    """
    (made,), floating = built.shells.values(), floats(built.assembly.model)
    shipped = built.scenario.robot[0].name is not None
    middle = float(np.sort(np.ptp(made.box, axis=0))[1])
    stated = asked.radius is not None or asked.tip is not None or asked.tips == "all"
    if asked.word is not None or stated:
        return tips
    most = rounded(
        0.5 * made.size if floating else min(_BALL * middle, _OF_ROOM * widest_room(made))
    )

    def sized(tip: Tip) -> Tip:
        large = tip.radius > made.size
        if large and tip.ahead is None and asked.offset is None and not shipped:
            return LinkGeometry(built.assembly.loaded[0], tip.frame).end(most)
        return tip.at_most(most) if large or not floating else tip

    return [sized(tip) for tip in tips] if most else tips


def _sided(built: Built, tips: Sequence[Tip], *, inside: bool) -> Built:
    """Return `built` with the side of its surface that spheres may touch.

    SphshellError for a surface smaller than the sphere.
    """
    (section,), (made,) = built.scenario.shell, built.shells.values()
    radius = min(tip.radius for tip in tips)
    if made.size < radius:
        raise SphshellError(
            f"the surface measures {made.size:.3g} m, less than the sphere's radius {radius:g} m: "
            f"state its --unit, or a smaller sphere, --radius {500 * made.size:.2g}mm"
        )
    if not made.is_closed:
        return built
    side = {"side": "inside" if inside else "outside"}
    # The surface is not read again.
    turned = made.from_surface(made.surface(), **{**made.options, **side})
    scenario = built.scenario.model_copy(update={"shell": [section.model_copy(update=side)]})
    return replace(built, scenario=scenario, shells={section.name: turned})


def _free_path(asked: Asked) -> Path:
    robot, surface = Path(asked.robot).name.partition(".")[0], Path(asked.surface).stem
    path = Path(f"{robot}_on_{surface}.toml" if asked.out is None else asked.out)
    if path.suffix != ".toml":
        raise ScenarioError(path, "", "a scenario's file must end in .toml")
    part = [path.with_name(part_file(path.stem))] if asked.tips == "all" else []
    for one in (path, *part):
        if one.is_dir() or (one.exists() and not asked.force):
            raise ScenarioError(one, "", "is there already: give another --out, or --force")
    if not path.parent.is_dir():
        raise ScenarioError(path, "", f"the folder {path.parent} does not exist")
    return path


def _robot_section(asked: Asked, path: Path) -> RobotSection:
    """Return the robot's table; what is to float loads as its file states, without masses too."""
    robot, file = asked.robot, Path(asked.robot)
    base = None if asked.base == "floating" else asked.base
    if not is_path(robot):
        if asked.package_dirs or asked.xacro_args or asked.density:
            raise SphshellError(
                f"mesh folders, xacro arguments and a density belong to a file, not to {robot}"
            )
        return RobotSection(name=str(robot), base=base, mimic=asked.mimic)
    key = "urdf" if file.suffix.lower() == ".urdf" else "file"
    source: dict[str, Any] = {key: os.path.relpath(file, path.parent)}
    return RobotSection(
        **source,
        package_dirs=[os.path.relpath(one, path.parent) for one in asked.package_dirs],
        xacro_args=dict(asked.xacro_args or {}),
        base=base,
        density=asked.density,
        mimic=asked.mimic,
    )


def _build_bare(
    section: RobotSection, path: Path, shell: ShellSection | None = None, reuse: Built | None = None
) -> Built:
    """Build robot and surface without contacts.

    An error does not name the scenario's file, as that does not exist yet.
    """
    shells = [] if shell is None else [shell]
    scenario = Scenario(title="", robot=[section], shell=shells, run=RunSection(duration=1.0))
    try:
        return build_scenario(scenario, path, reuse)
    except ScenarioError as error:
        if isinstance(error.__cause__, SphshellError):
            raise error.__cause__ from None
        raise


def _shell_section(asked: Asked, path: Path, built: Built, tips: Sequence[Tip]) -> ShellSection:
    """Return the surface's table."""
    file, word = Path(asked.surface), asked.word
    if word is None:
        return ShellSection(
            name=file.stem.replace(".", "-"),
            file=os.path.relpath(file, path.parent),
            unit=asked.unit,
            bodies=None if asked.bodies is None else list(asked.bodies),
            faces=None if asked.faces is None else list(asked.faces),
        )
    if word not in WORDS:
        if file.suffix:
            raise SphshellError(f"surface {file}: {why_no_file(file)}")
        raise NameNotFound("surface", word, "the command (beside files)", WORDS)
    if (asked.unit, asked.bodies, asked.faces) != (None, None, None):
        said = f"not to the {word}, which is sized in meters"
        raise SphshellError(f"a unit, bodies and faces belong to a surface file, {said}")
    if asked.tips == "all" and word not in HELD_WORDS:
        held = ", ".join(HELD_WORDS)
        raise SphshellError(f"a hand cannot hold a {word}: --tips all takes {held}")
    largest = max(tip.radius for tip in tips)
    half, length = _IN_HAND * largest, 4 * _IN_HAND * largest
    if asked.tips == "one":
        centers = sphere_centers(built.assembly.model, built.assembly.q0, tips)
        spread = float(np.linalg.norm(np.ptp(centers, axis=0)))
        least = max(_SIZE * largest, spread)
        half = rounded(least) if rounded(least) >= least else rounded(1.05 * least)
        length = (0.4 if word == "box" else 2.0) * half
    primitives: dict[str, Primitive] = {
        "plane": HalfSpace(2 * half),
        "box": Box([2 * half, 2 * half, length]),
        "sphere": Ball(half),
        "bowl": Ball(half),
        "cylinder": Cylinder(radius=half, length=length),
    }
    return ShellSection(name=word, primitive=primitives[word])
