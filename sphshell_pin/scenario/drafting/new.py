"""A new scenario from a robot and a surface, with values chosen for their sizes."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.atomic import atomic_file
from sphshell_pin.checks import check_positive, check_vector
from sphshell_pin.contact.materials import Material, find_material
from sphshell_pin.dynamics.scene.models import radius_fault
from sphshell_pin.errors import InvalidParameter, NameNotFound, ScenarioError, SphshellError
from sphshell_pin.robots import floats, is_path
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.draft_text import draft_text
from sphshell_pin.scenario.drafting.fingertips import Tip, find_tips
from sphshell_pin.scenario.drafting.hand import every_tip, hold_in_hand
from sphshell_pin.scenario.drafting.part import part_file, word_primitive
from sphshell_pin.scenario.drafting.plan import Hold, Plan, Press
from sphshell_pin.scenario.drafting.pose_search import PLACES, Request, find_working, sphere_centers
from sphshell_pin.scenario.drafting.refusals import CannotStand
from sphshell_pin.scenario.format.build import Built, build_scenario, explain_built
from sphshell_pin.scenario.format.reading import parse_scenario
from sphshell_pin.scenario.format.schema import RobotSection, RunSection, Scenario, ShellSection
from sphshell_pin.scenario.format.shape_tables import Ball, Box, Cylinder, HalfSpace, Primitive
from sphshell_pin.scenario.format.sliders import check_knobs

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene.explain import Explanation
    from sphshell_pin.shell.shell import Shell

Array = npt.NDArray[np.float64]

WORDS = ("plane", "box", "sphere", "cylinder", "bowl")
"""Surfaces that need no file."""

# Half the size of a surface that needs no file, in radii of the sphere.
_SIZE = 15.0
_DOES = {Press: "presses on", Hold: "stands on", type(None): "falls on"}


@dataclass(frozen=True)
class NewScenario:
    """A scenario that was written, and why it is as it is."""

    path: Path
    text: str
    built: Built
    explanation: Explanation
    """Of the start, see Scene.explain."""
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
    against: str = "steel",
    press: float | None = None,
    place: str | None = None,
    at: npt.ArrayLike | str | None = None,
    path: npt.ArrayLike | str | None = None,
    length: float | None = None,
    tips: Literal["one", "all"] = "one",
    base: Literal["fixed", "floating"] | None = None,
    package_dirs: Sequence[str | PathLike[str]] = (),
    xacro_args: Mapping[str, str] | None = None,
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
        of steel, any other sphere of rubber, or of plastic where rubber is too soft.
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
    _check_asked(radius, press, place, (material, against))
    asked = Asked.checked(at, path, length)
    file = _free_path(out, robot, surface, force=force)
    section = _robot_section(
        robot,
        file,
        base=base,
        package_dirs=package_dirs,
        xacro_args=xacro_args or {},
    )
    bare = _build_bare(section, file)
    shaped = None if base is not None else _base(bare.assembly.model)
    if shaped is not None:
        section = section.model_copy(update={"base": shaped})
        bare = _build_bare(section, file)
    loaded = bare.assembly.loaded[0]
    too_large = radius and radius_fault(bare.assembly.model, radius)
    if radius and too_large:
        raise InvalidParameter("radius", radius, too_large)
    center = None if offset is None else check_vector("offset", offset, 3, " [m]")
    if tips == "all":
        found = every_tip(loaded, frame, radius, place)
    else:
        found = find_tips(loaded, shipped=section.name, frame=frame, radius=radius, offset=center)
    shell_section, word = _shell_section(surface, unit, (bodies, faces), file, bare, found)
    if word is not None and tips == "all":
        held = word_primitive(word, max(one.radius for one in found))
        shell_section = shell_section.model_copy(update={"primitive": held})
    with_shell = _build_bare(section, file, shell_section, reuse=bare)
    _check_size(with_shell.shells[shell_section.name], found)
    shell_section, with_shell = _sided(shell_section, with_shell, word)
    if tips == "all":
        pair = find_material(material or "rubber"), find_material(against)
        return _held(section, shell_section, with_shell, found, pair, press, file, force=force)
    request = Request(material, against, press, place, word, asked, tell)
    title = f"{loaded.name} {{}} {shell_section.name}"

    def draft(section: RobotSection, plan: Plan) -> tuple[str, Built]:
        does = title.format(_DOES[type(plan.control)])
        text = draft_text(file.stem, does, section, shell_section, plan, _run(plan))
        return text, _build_text(text, file, with_shell)

    # What is written is what was built, and tried.
    try:
        text, built, plan = find_working(section, with_shell, found, request, draft)
    except CannotStand as error:
        if base is not None:
            raise
        note = f"the base is fixed, as the robot cannot stand on the surface: {error.reason}"
        fixed = new_scenario(
            robot,
            surface,
            frame=frame,
            radius=radius,
            offset=offset,
            unit=unit,
            bodies=bodies,
            faces=faces,
            material=material,
            against=against,
            base="fixed",
            package_dirs=package_dirs,
            xacro_args=xacro_args,
            out=out,
            force=force,
            tell=tell,
        )
        return replace(fixed, why=(note, *fixed.why))
    except SphshellError as error:
        if shaped != "fixed":
            raise
        raise SphshellError(f"{error}; or let it float, --base floating") from None
    _write(file, text)
    of_base = () if shaped is None else (f"the base is {shaped}, by the robot's shape: or --base",)
    why = (*of_base, *plan.why, _materials_note(plan))
    return NewScenario(file, text, built, explain_built(built), why)


def _check_asked(
    radius: float | None, press: float | None, place: str | None, materials: Sequence[str | None]
) -> None:
    if radius is not None:
        check_positive("radius", radius, "m")
    if press is not None:
        check_positive("press", press, "N")
    if place is not None and place not in PLACES:
        raise NameNotFound("place", place, "a surface", PLACES)
    for one in materials:
        if one is not None:
            find_material(one)


def _held(
    section: RobotSection,
    shell: ShellSection,
    built: Built,
    tips: Sequence[Tip],
    materials: tuple[Material, Material],
    press: float | None,
    file: Path,
    *,
    force: bool,
) -> NewScenario:
    """Write the scenario in which the fingertips hold the surface, and its part's URDF."""
    grasp = hold_in_hand(
        section,
        shell,
        built,
        tips,
        materials,
        press,
        file.stem,
        lambda text, reuse: _build_text(text, file, reuse),
    )
    part = file.with_name(part_file(file.stem))
    if part.exists() and not force:
        raise ScenarioError(part, "", "is there already: give another --out, or --force")
    _write(part, grasp.urdf)
    _write(file, grasp.text)
    return NewScenario(file, grasp.text, grasp.built, explain_built(grasp.built), grasp.why)


def _sided(shell: ShellSection, built: Built, word: str | None) -> tuple[ShellSection, Built]:
    """Return the surface's table with the side that spheres may touch, and what is built of it."""
    made = built.shells[shell.name]
    if not made.is_closed:
        return shell, built
    side: Literal["inside", "outside"] = "inside" if word == "bowl" else "outside"
    section = shell.model_copy(update={"side": side})
    # The surface is not read again.
    turned = made.from_surface(made.surface(), **{**made.options, "side": side})
    scenario = built.scenario.model_copy(update={"shell": [section]})
    return section, replace(built, scenario=scenario, shells={shell.name: turned})


def _materials_note(plan: Plan) -> str:
    one, other = plan.contact.material.name, plan.contact.against.name
    return f"law and friction of {one} on {other}, typical values: --law and --against name others"


def _build_text(text: str, path: Path, reuse: Built) -> Built:
    scenario = parse_scenario(text, path)
    check_knobs(scenario, path, ranges=True)
    return build_scenario(scenario, path, reuse)


def _free_path(
    out: str | PathLike[str] | None,
    robot: str | PathLike[str],
    surface: str | PathLike[str],
    *,
    force: bool,
) -> Path:
    path = Path(
        f"{Path(robot).name.partition('.')[0]}_on_{Path(surface).stem}.toml" if out is None else out
    )
    if path.suffix != ".toml":
        raise ScenarioError(path, "", "a scenario's file must end in .toml")
    if path.is_dir() or (path.exists() and not force):
        raise ScenarioError(path, "", "is there already: give another --out, or --force")
    if not path.parent.is_dir():
        raise ScenarioError(path, "", f"the folder {path.parent} does not exist")
    return path


def _robot_section(
    robot: str | PathLike[str],
    path: Path,
    *,
    base: Literal["fixed", "floating"] | None,
    package_dirs: Sequence[str | PathLike[str]],
    xacro_args: Mapping[str, str],
) -> RobotSection:
    file = Path(robot)
    if not is_path(robot):
        if package_dirs or xacro_args:
            raise SphshellError(
                f"mesh folders and xacro arguments belong to a file, not to {robot}"
            )
        return RobotSection(name=str(robot), base=base)
    place, is_urdf = _relative(file, path), file.suffix.lower() == ".urdf"
    return RobotSection(
        urdf=place if is_urdf else None,
        file=None if is_urdf else place,
        package_dirs=[_relative(Path(one), path) for one in package_dirs],
        xacro_args=dict(xacro_args),
        base=base,
    )


def _base(model: pin.Model) -> Literal["fixed", "floating"] | None:
    """Return what the base has to be by the robot's shape; None: what its file states will do.

    A single body floats, a single limb is an arm.
    """
    if not model.nv:
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
    section: RobotSection,
    path: Path,
    shell: ShellSection | None = None,
    reuse: Built | None = None,
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


def _shell_section(
    surface: str | PathLike[str],
    unit: str | None,
    parts: tuple[Sequence[str] | None, Sequence[str | int] | None],
    path: Path,
    built: Built,
    tips: Sequence[Tip],
) -> tuple[ShellSection, str | None]:
    """Return the surface's table, and the word that stood for it."""
    file = Path(surface)
    if file.is_file():
        name = file.stem.replace(".", "-")
        bodies, faces = parts
        section = ShellSection(
            name=name,
            file=_relative(file, path),
            unit=unit,
            bodies=None if bodies is None else list(bodies),
            faces=None if faces is None else list(faces),
        )
        return section, None
    word = str(surface)
    if word not in WORDS:
        if file.suffix:
            raise SphshellError(f"no such surface file: {file}")
        raise NameNotFound("surface", word, "the command (beside files)", WORDS)
    if unit is not None:
        raise SphshellError(f"a unit belongs to a surface file; the {word} is sized in meters")
    if parts != (None, None):
        raise SphshellError(f"bodies and faces belong to a CAD file, not to the {word}")
    centers = sphere_centers(built, tips)
    spread = float(np.linalg.norm(np.ptp(centers, axis=0)))
    size = _round_up(max(_SIZE * max(tip.radius for tip in tips), spread))
    ball = Ball(size)
    primitives: dict[str, Primitive] = {
        "plane": HalfSpace(2 * size),
        "box": Box([2 * size, 2 * size, 0.4 * size]),
        "sphere": ball,
        "bowl": ball,
        "cylinder": Cylinder(radius=size, length=2 * size),
    }
    return ShellSection(name=word, primitive=primitives[word]), word


def _check_size(shell: Shell, tips: Sequence[Tip]) -> None:
    radius = min(tip.radius for tip in tips)
    if shell.size < radius:
        raise SphshellError(
            f"the surface measures {shell.size:.3g} m, less than the sphere's radius {radius:g} m: "
            f"state its --unit, or a smaller sphere, --radius {500 * shell.size:.2g}mm"
        )


def _round_up(x: float) -> float:
    """Round to the next higher number of two digits."""
    rounded = float(f"{x:.2g}")
    return rounded if rounded >= x else float(f"{1.05 * x:.2g}")


def _run(plan: Plan) -> RunSection:
    # Measured on balls, arms, hands and legs: the implicit integrator is never much slower than
    # others, and ten times faster than fixed steps that resolve the contact.
    falls = plan.control is None
    return RunSection(
        duration=plan.duration,
        integrator="implicit",
        rtol=1e-5,
        record_dt=1e-3 if falls else 5e-3,
        recording_speed=0.5 if falls else 1.0,
    )


def _write(path: Path, text: str) -> None:
    """Put `text` in place of the file at `path`, whole or not at all."""
    try:
        with atomic_file(path) as file:
            file.write(text.encode())
    except OSError as error:
        raise ScenarioError(path, "", f"cannot be written: {error.strerror}") from None
