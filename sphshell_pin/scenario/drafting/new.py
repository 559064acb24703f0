"""A new scenario from a robot and a surface, with values chosen for their sizes."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.base.atomic import atomic_file
from sphshell_pin.base.regular_file import why_no_file
from sphshell_pin.dynamics.scene.models import radius_fault
from sphshell_pin.errors import InvalidParameter, NameNotFound, ScenarioError, SphshellError
from sphshell_pin.robots import floats, is_path
from sphshell_pin.robots.inertia import states_masses_alone
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.draft_text import draft_text
from sphshell_pin.scenario.drafting.fingertips import find_tips, only_turns, other_ends
from sphshell_pin.scenario.drafting.hand import TooHeavy, every_tip, hold_in_hand, with_part
from sphshell_pin.scenario.drafting.limb_ends import COVERS, LinkGeometry, Tip
from sphshell_pin.scenario.drafting.part import part_file, word_primitive
from sphshell_pin.scenario.drafting.plan import Hold, Plan, Press
from sphshell_pin.scenario.drafting.pose_search import find_working, sphere_centers
from sphshell_pin.scenario.drafting.poses import joints_aside
from sphshell_pin.scenario.drafting.refusals import CannotReach, CannotStand
from sphshell_pin.scenario.drafting.touch_points import widest_room
from sphshell_pin.scenario.drafting.wording import rounded
from sphshell_pin.scenario.format.bodies import check_masses
from sphshell_pin.scenario.format.build import Built, build_scenario, explain_built
from sphshell_pin.scenario.format.reading import parse_scenario
from sphshell_pin.scenario.format.schema import RobotSection, RunSection, Scenario, ShellSection
from sphshell_pin.scenario.format.shape_tables import Ball, Box, Cylinder, HalfSpace, Primitive
from sphshell_pin.scenario.format.sliders import check_knobs

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene.explain import Explanation

WORDS = ("plane", "box", "sphere", "cylinder", "bowl")
"""Surfaces that need no file."""

# Half the size of a surface that needs no file, in radii of the sphere; radius of a ball whose size
# is free, as a part of the part's middle width, and of the room on its widest face.
_SIZE, _BALL, _OF_ROOM = 15.0, 0.1, 0.5
# Density that gives links with masses alone their moments of inertia [kg/m^3].
_DENSITY = 2700.0
# Ends of other limbs that are tried where one does not come to the part.
_MOST_ENDS = 2
_DOES = {Press: "presses on", Hold: "stands on", type(None): "falls on"}


@dataclass(frozen=True)
class NewScenario:
    """A scenario that was written, and why it is as it is."""

    path: Path
    text: str
    built: Built
    explanation: Explanation
    """Explanation of the start, see Scene.explain."""
    why: tuple[str, ...]
    """One sentence for each choice that was made for the user."""


def new_scenario(
    robot: str | PathLike[str],
    surface: str | PathLike[str] = "plane",
    *,
    frame: str | None = None,
    radius: float | None = None,
    offset: npt.ArrayLike | None = None,
    unit: str | None = None,
    bodies: Sequence[str] | None = None,
    faces: Sequence[str | int] | None = None,
    material: str | None = None,
    against: str | None = None,
    press: float | None = None,
    place: str | None = None,
    at: npt.ArrayLike | str | None = None,
    path: npt.ArrayLike | str | None = None,
    length: float | None = None,
    tips: Literal["one", "all"] = "one",
    base: Literal["fixed", "floating"] | None = None,
    package_dirs: Sequence[str | PathLike[str]] = (),
    xacro_args: Mapping[str, str] | None = None,
    density: float | None = None,
    mimic: bool = True,
    out: str | PathLike[str] | None = None,
    force: bool = False,
    tell: Callable[[str], None] | None = None,
) -> NewScenario:
    """Write a scenario in which `robot` touches `surface`, with values that work for its size.

    Drafts are run; the first is written that touches, holds its force within 5 %, and keeps the
    robot's links out of the part.

    Parameters
    ----------
    robot
        Name of a shipped robot, or path of a URDF, xacro (`xacro_args`: its arguments) or MJCF file
        (`package_dirs`: folders above the packages of its meshes).
    density
        Of the links of a URDF that state no mass [kg/m^3]: they get that of their geometry.
    mimic
        Whether joints that mimic others do so exactly; else they move freely.
    base
        "fixed" or "floating"; by default as its file states it, but a single limb on a free base is
        an arm, which is fixed, and so is a robot that cannot stand on the surface.
    surface
        A surface file, its `unit` where the format has none, or a word of WORDS.
    bodies, faces
        Of a CAD file: those to take, by name or number; by default all of it.
    frame, radius, offset
        Of the sphere: the frame that carries it, its radius [m], and its center (3,) [m] in the
        frame, by default the origin; without a frame it is a known fingertip or foot.
    material, against
        What the sphere and the surface are made of, names of MATERIALS; by default a free body is
        of steel, any other sphere of rubber, or of plastic where rubber is too soft; the surface of
        steel, or of plastic where a hand cannot hold it.
    press
        Normal force [N] of a robot with a fixed base.
    place
        Where the surface stands as seen from its tip, a key of PLACES; by default below, where the
        joints allow it.
    at
        Where on the surface to touch: a point (3,) [m] in its own coordinates, or a kind of its
        faces, with a radius where there are several ("cylinder 5.5 mm").
    path, length
        Of the tip: points (k, 3) [m] on the surface in its own coordinates, or "line", "circle" or
        "raster" from the place that is touched, over `length` [m].
    tips
        "all": all fingertips of a hand hold the surface, which then is a free part, of `against`
        all through; its URDF is written beside the scenario, as NAME_part.urdf.
    out
        The file to write, by default ROBOT_on_SURFACE.toml here; an existing one is replaced with
        `force` only, and only when all went well.

    tell
        Called with a sentence for each draft that failed, while others are tried.

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
    asked = Asked.checked(**locals())
    try:
        return _written(asked)
    except CannotReach as error:
        said = str(error).partition(";")[0]
        for other in error.others[:_MOST_ENDS] if frame is None else ():
            with suppress(SphshellError):
                made = _written(replace(asked, frame=other))
                note = f"frame '{other}', as with '{error.frame}' {said}"
                return replace(made, why=(note, *made.why))
        raise
    except TooHeavy as error:
        if against is not None:
            raise
        made = _written(replace(asked, against="plastic"))
        note = f"the part is of plastic, as with steel {str(error).partition(';')[0]}"
        return replace(made, why=(note, *made.why))
    except CannotStand as error:
        if base is not None:
            raise
        note = f"the base is fixed, as the robot cannot stand on the surface: {error.reason}"
    fixed = _written(replace(asked, base="fixed"))
    return replace(fixed, why=(note, *fixed.why))


def _written(asked: Asked) -> NewScenario:
    """Write the scenario that is asked for; CannotStand as `find_working` raises it."""
    file = _free_path(asked)
    section, bare, shaped = _bare(asked, file)
    loaded, radius, in_hand = bare.assembly.loaded[0], asked.radius, asked.tips == "all"
    if radius and (too_large := radius_fault(bare.assembly.model, radius)):
        raise InvalidParameter("radius", radius, too_large)
    if in_hand:
        tips = every_tip(loaded, asked)
    else:
        tips = find_tips(
            loaded, shipped=section.name, frame=asked.frame, radius=radius, offset=asked.offset
        )
    aside = [set(joints_aside(bare.assembly.model, tip)) for tip in tips]
    check_masses(bare.assembly, set.intersection(*aside))
    shell = _shell_section(asked, file, bare, tips)
    built = _build_bare(section, file, shell, reuse=bare)
    tips = _sized_to(built, tips, asked)
    built = _sided(built, tips, inside=asked.inside)
    (shell,) = built.scenario.shell

    def draft(section: RobotSection, plan: Plan) -> tuple[str, Built]:
        does = "holds" if plan.part else _DOES[type(plan.control)]
        title = f"{loaded.name} {does} {shell.name}"
        if loaded.assumed:
            title += f", its missing inertias from its geometry at {section.density:g} kg/m^3"
        text = draft_text(file.stem, title, section, shell, plan)
        scenario = parse_scenario(text, file)
        check_knobs(scenario, file, ranges=True)
        reuse = with_part(built, plan.part, file.stem) if plan.part else built
        return text, build_scenario(scenario, file, reuse)

    # What is written is what was built, and tried.
    try:
        made = (hold_in_hand if in_hand else find_working)(asked, built, tips, draft)
    except CannotStand:
        raise
    except SphshellError as error:
        if isinstance(error, CannotReach):
            error.others = other_ends(bare.assembly.model, error.frame)
        if shaped != "fixed" or in_hand:
            raise
        raise SphshellError(f"{error}; or let it float, --base floating") from None
    if made.part:
        part = file.with_name(part_file(file.stem))
        _check_free(part, force=asked.force)
        _write(part, made.part)
    _write(file, made.text)
    why = (*made.why, *filter(None, (loaded.assumed,)))
    if shaped is not None and not in_hand:
        why = (f"the base is {shaped}, by the robot's shape: or --base", *why)
    return NewScenario(file, made.text, made.built, explain_built(made.built), why)


def _bare(asked: Asked, file: Path) -> tuple[RobotSection, Built, str | None]:
    """Return the robot's table, the robot alone, and the base that its shape gives it if it does.

    Links that state masses alone get moments of inertia.
    """
    section = _robot_section(asked, file)
    bare = _build_bare(section, file)
    description = bare.assembly.loaded[0].description
    changed: dict[str, object] = {}
    if not asked.density and description is not None and states_masses_alone(description):
        changed["density"] = _DENSITY
    shaped = None if asked.base is not None else _base(bare.assembly.model)
    if shaped is not None:
        changed["base"] = shaped
    if changed:
        section = section.model_copy(update=changed)
        bare = _build_bare(section, file)
    return section, bare, shaped


def _sized_to(built: Built, tips: Sequence[Tip], asked: Asked) -> list[Tip]:
    """Return the `tips`, balls of free size that press on a file's surface as it needs them.

    A round end that is larger than the surface gets a smaller ball on it.
    """
    if asked.word is not None or asked.tips == "all" or asked.radius is not None:
        return list(tips)
    (made,) = built.shells.values()
    middle = float(np.sort(np.ptp(made.box, axis=0))[1])
    floating = floats(built.assembly.model)
    most = rounded(
        0.5 * made.size if floating else min(_BALL * middle, _OF_ROOM * widest_room(made))
    )
    sized = list[Tip]()
    for tip in tips:
        large = tip.radius > made.size
        if most and large and COVERS in tip.source:
            sized.append(LinkGeometry(built.assembly.loaded[0], tip.frame).end(most))
        else:
            sized.append(tip.at_most(most) if most and (large or not floating) else tip)
    return sized


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
    side = "inside" if inside else "outside"
    # The surface is not read again.
    turned = made.from_surface(made.surface(), **{**made.options, "side": side})
    scenario = built.scenario.model_copy(
        update={"shell": [section.model_copy(update={"side": side})]}
    )
    return replace(built, scenario=scenario, shells={section.name: turned})


def _check_free(path: Path, *, force: bool) -> None:
    if path.is_dir() or (path.exists() and not force):
        raise ScenarioError(path, "", "is there already: give another --out, or --force")


def _free_path(asked: Asked) -> Path:
    robot, surface = Path(asked.robot).name.partition(".")[0], Path(asked.surface).stem
    path = Path(f"{robot}_on_{surface}.toml" if asked.out is None else asked.out)
    if path.suffix != ".toml":
        raise ScenarioError(path, "", "a scenario's file must end in .toml")
    _check_free(path, force=asked.force)
    if not path.parent.is_dir():
        raise ScenarioError(path, "", f"the folder {path.parent} does not exist")
    return path


def _robot_section(asked: Asked, path: Path) -> RobotSection:
    robot, file = asked.robot, Path(asked.robot)
    if not is_path(robot):
        if asked.package_dirs or asked.xacro_args or asked.density:
            raise SphshellError(
                f"mesh folders, xacro arguments and a density belong to a file, not to {robot}"
            )
        return RobotSection(name=str(robot), base=asked.base, mimic=asked.mimic)
    place, is_urdf = _relative(file, path), file.suffix.lower() == ".urdf"
    return RobotSection(
        urdf=place if is_urdf else None,
        file=None if is_urdf else place,
        package_dirs=[_relative(Path(one), path) for one in asked.package_dirs],
        xacro_args=dict(asked.xacro_args or {}),
        base=asked.base,
        density=asked.density,
        mimic=asked.mimic,
    )


def _base(model: pin.Model) -> Literal["fixed", "floating"] | None:
    """Return what the base has to be by the robot's shape; None: what its file states will do.

    A single body floats, with rotors or wheels too; a single limb is an arm.
    """
    if not model.nv or (not floats(model) and only_turns(model)):
        return "floating"
    limbs = sum(int(parent) == 1 for parent in model.parents)
    return "fixed" if floats(model) and limbs == 1 else None


def _relative(file: Path, path: Path) -> str:
    """Return `file` relative to the scenario at `path`; absolute where that cannot be."""
    try:
        return Path(os.path.relpath(file, path.parent)).as_posix()
    except ValueError:  # another drive
        return file.absolute().as_posix()


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
    file, word, parts = Path(asked.surface), asked.word, (asked.bodies, asked.faces)
    if word is None:
        return ShellSection(
            name=file.stem.replace(".", "-"),
            file=_relative(file, path),
            unit=asked.unit,
            bodies=None if asked.bodies is None else list(asked.bodies),
            faces=None if asked.faces is None else list(asked.faces),
        )
    if word not in WORDS:
        if file.suffix:
            raise SphshellError(f"surface {file}: {why_no_file(file)}")
        raise NameNotFound("surface", word, "the command (beside files)", WORDS)
    if asked.unit is not None:
        raise SphshellError(f"a unit belongs to a surface file; the {word} is sized in meters")
    if parts != (None, None):
        raise SphshellError(f"bodies and faces belong to a CAD file, not to the {word}")
    largest = max(tip.radius for tip in tips)
    if asked.tips == "all":
        return ShellSection(name=word, primitive=word_primitive(word, largest))
    spread = float(np.linalg.norm(np.ptp(sphere_centers(built, tips), axis=0)))
    size = _round_up(max(_SIZE * largest, spread))
    ball = Ball(size)
    primitives: dict[str, Primitive] = {
        "plane": HalfSpace(2 * size),
        "box": Box([2 * size, 2 * size, 0.4 * size]),
        "sphere": ball,
        "bowl": ball,
        "cylinder": Cylinder(radius=size, length=2 * size),
    }
    return ShellSection(name=word, primitive=primitives[word])


def _round_up(x: float) -> float:
    """Round to the next higher number of two digits."""
    rounded = float(f"{x:.2g}")
    return rounded if rounded >= x else float(f"{1.05 * x:.2g}")


def _write(path: Path, text: str) -> None:
    """Put `text` in place of the file at `path`, whole or not at all."""
    try:
        with atomic_file(path) as file:
            file.write(text.encode())
    except OSError as error:
        raise ScenarioError(path, "", f"cannot be written: {error.strerror}") from None
