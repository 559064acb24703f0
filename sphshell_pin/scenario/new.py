"""A new scenario from a robot and a surface, with values chosen for their sizes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.atomic import atomic_file
from sphshell_pin.checks import check_positive
from sphshell_pin.dynamics.models import find_frame
from sphshell_pin.errors import NameNotFound, ScenarioError, SphshellError
from sphshell_pin.robots import WORKING
from sphshell_pin.scenario.bodies import joint_spans
from sphshell_pin.scenario.build import Built, build_scenario, explain_built
from sphshell_pin.scenario.drafting import draft_text
from sphshell_pin.scenario.knobs import check_knobs
from sphshell_pin.scenario.materials import Material, find_material
from sphshell_pin.scenario.plan import (
    GRAVITY,
    Hold,
    Plan,
    Press,
    bearable,
    plan_fall,
    plan_press,
    plan_stand,
)
from sphshell_pin.scenario.poses import take_stance
from sphshell_pin.scenario.primitives import Ball, Box, Cylinder, HalfSpace, Primitive
from sphshell_pin.scenario.reading import parse_scenario
from sphshell_pin.scenario.schema import RobotSection, RunSection, Scenario, ShellSection
from sphshell_pin.scenario.tips import Tip, find_tips, floats

if TYPE_CHECKING:
    from sphshell_pin.dynamics.explain import Explanation
    from sphshell_pin.shell.shell import Shell

Array = npt.NDArray[np.float64]

WORDS = ("plane", "box", "sphere", "cylinder", "bowl")
"""Surfaces that need no file."""

PLACES: dict[str, tuple[float, float, float]] = {
    "below": (0.0, 0.0, -1.0),
    "above": (0.0, 0.0, 1.0),
    "+x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
}
"""Where the surface is placed, seen from the tip."""

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
    unit: str | None = None,
    bodies: Sequence[str] | None = None,
    faces: Sequence[str | int] | None = None,
    material: str | None = None,
    against: str = "steel",
    press: float | None = None,
    place: str | None = None,
    free_flyer: bool = False,
    package_dirs: Sequence[str | PathLike[str]] = (),
    out: str | PathLike[str] | None = None,
    force: bool = False,
) -> NewScenario:
    """Write a scenario in which `robot` touches `surface`, with values that work for its size.

    Parameters
    ----------
    robot
        Name of a shipped robot, or path of a URDF file (`free_flyer`: its root floats;
        `package_dirs`: folders above the packages of its meshes).
    surface
        A surface file, its `unit` where the format has none, or a word of WORDS.
    bodies, faces
        Of a CAD file: those to take, by name or number; by default all of it.
    frame, radius
        Of the sphere [m], whose center is the frame's origin; by default a known fingertip or foot.
    material, against
        What the sphere and the surface are made of, names of MATERIALS; by default a free body is
        of steel, any other sphere of rubber, or of plastic where rubber is too soft.
    press
        Normal force [N] of a robot with a fixed base.
    place
        Where the surface stands as seen from its tip, a key of PLACES.
    out
        The file to write, by default ROBOT_on_SURFACE.toml here; an existing one is replaced with
        `force` only, and only when all went well.

    Raises
    ------
    UnitMissing
        The surface file has no unit of its own and none is given.
    NameNotFound, FrameNotFound
        No such robot, frame, material, place.
    SphshellError
        What cannot be found out and is not given, or a file that cannot be read or written.
    """
    if radius is not None:
        check_positive("radius", radius, "m")
    if press is not None:
        check_positive("press", press, "N")
    if place is not None and place not in PLACES:
        raise NameNotFound("place", place, "a surface", PLACES)
    for one in (material, against):
        if one is not None:
            find_material(one)
    path = _free_path(out, robot, surface, force=force)
    section = _robot_section(robot, path, free_flyer=free_flyer, package_dirs=package_dirs)
    bare = _build_bare(section, path)
    if not bare.assembly.model.nv and section.path is not None:
        # A single body without a joint would be fixed to the world.
        section = section.model_copy(update={"free_flyer": True})
        bare = _build_bare(section, path)
    loaded = bare.assembly.loaded[0]
    tips = find_tips(loaded, shipped=section.name, frame=frame, radius=radius)
    shell_section, word = _shell_section(surface, unit, (bodies, faces), path, bare, tips)
    with_shell = _build_bare(section, path, shell_section, reuse=bare)
    _check_size(with_shell.shells[shell_section.name], tips)
    request = _Request(material, against, press, place, word)
    section, plan = _plan(section, with_shell, tips, request)
    title = f"{loaded.name} {_DOES[type(plan.control)]} {shell_section.name}"
    text = draft_text(path.stem, title, section, shell_section, plan, _run(plan))
    # What is written is what was built.
    built = _build_text(text, path, with_shell)
    _write(path, text)
    why = (*plan.why, _materials_note(plan))
    return NewScenario(path, text, built, explain_built(built), why)


def _materials_note(plan: Plan) -> str:
    one, other = plan.contact.material.name, plan.contact.against.name
    return f"law and friction of {one} on {other}, typical values: --law and --against name others"


def _build_text(text: str, path: Path, reuse: Built) -> Built:
    scenario = parse_scenario(text, path)
    check_knobs(scenario, path, ranges=True)
    return build_scenario(scenario, path, reuse)


@dataclass(frozen=True)
class _Request:
    """What the user asked for; `word` names a surface that needs no file."""

    material: str | None
    against: str
    press: float | None
    place: str | None
    word: str | None

    def materials(self, tips: Sequence[Tip], load: float) -> tuple[Material, Material]:
        """Return what sphere and surface are made of; `load` [kg] rests on each, 0: it falls."""
        other = find_material(self.against)
        if self.material is not None:
            return find_material(self.material), other
        if not load:
            return find_material("steel"), other
        # A tip is of rubber, unless the mass behind it would press rubber in too far.
        rubber, radius = find_material("rubber"), min(tip.radius for tip in tips)
        bears = bearable(radius, rubber, other) >= load * GRAVITY
        return rubber if bears else find_material("plastic"), other


def _free_path(
    out: str | PathLike[str] | None,
    robot: str | PathLike[str],
    surface: str | PathLike[str],
    *,
    force: bool,
) -> Path:
    path = Path(f"{Path(robot).stem}_on_{Path(surface).stem}.toml" if out is None else out)
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
    free_flyer: bool,
    package_dirs: Sequence[str | PathLike[str]],
) -> RobotSection:
    file = Path(robot)
    if file.suffix.lower() not in (".urdf", ".xml"):
        if free_flyer or package_dirs:
            raise SphshellError(
                f"a free root and mesh folders belong to a URDF file, not to {robot}"
            )
        if file.is_file():
            raise SphshellError(f"{robot}: is not a URDF file, which ends in .urdf or .xml")
        return RobotSection(name=str(robot))
    return RobotSection(
        urdf=_relative(file, path),
        package_dirs=[_relative(Path(one), path) for one in package_dirs],
        free_flyer=free_flyer,
    )


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
    centers = _centers(built, tips)
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
            "state its --unit, or a smaller --radius"
        )


def _round_up(x: float) -> float:
    """Round to the next higher number of two digits."""
    rounded = float(f"{x:.2g}")
    return rounded if rounded >= x else float(f"{1.05 * x:.2g}")


def _centers(built: Built, tips: Sequence[Tip]) -> Array:
    """Return the spheres' centers (k, 3) [m] in the world at the start."""
    model = built.assembly.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, built.assembly.q0)
    return np.array([data.oMf[find_frame(model, tip.frame)].act(tip.offset) for tip in tips])


def _plan(
    section: RobotSection,
    built: Built,
    tips: Sequence[Tip],
    request: _Request,
) -> tuple[RobotSection, Plan]:
    """Return the plan, and the robot's table with what the plan asks of it."""
    press, place, inside = request.press, request.place, request.word == "bowl"
    model, q0 = built.assembly.model, built.assembly.q0
    (shell,) = built.shells.values()
    if floats(model):
        if press is not None or place is not None:
            raise SphshellError(
                "a robot that floats comes down on the surface by its weight: leave out --press "
                "and --place"
            )
        centers = _centers(built, tips)
        root = q0[:7]
        if model.njoints == 2:
            pair = request.materials(tips, 0.0)
            return section, plan_fall(shell, tips[0], centers[0], root, pair, inside=inside)
        data = model.createData()
        inertia = np.diag(pin.crba(model, data, q0))[6:]
        mass = float(pin.computeTotalMass(model))
        leg = float(np.linalg.norm(root[:3] - centers, axis=1).max())
        if inside:
            raise SphshellError("a robot cannot stand in a bowl: take another --surface")
        pair = request.materials(tips, mass / len(tips))
        return section, plan_stand(shell, tuple(tips), centers, mass, inertia, leg, pair)
    tip = tips[0]
    if int(model.frames[find_frame(model, tip.frame)].parentJoint) == 0:
        raise SphshellError(
            f"no joint moves frame '{tip.frame}': name another with --frame, or let the root "
            "float with --free-flyer"
        )
    approach = None if place is None else np.array(PLACES[place])
    stance = take_stance(model, _working_posture(section, model, q0), tip, approach)
    side = {"cylinder": (1.0, 0.0, 0.0), "bowl": (0.0, 0.0, 1.0)}.get(request.word or "")
    toward = None if side is None else np.array(side)
    pair = request.materials(tips, stance.mass)
    plan = plan_press(shell, tip, stance, pair, press, toward=toward, inside=inside)
    start = _changed_joints(model, q0, stance.q)
    return section.model_copy(update={"lock": list(stance.lock), "start": start}), plan


def _working_posture(section: RobotSection, model: pin.Model, q0: Array) -> Array:
    """Return the posture in which the robot is known to work, else its reference posture."""
    known = WORKING.get(section.name or "", ())
    return np.array(known) if len(known) == model.nq else q0


def _changed_joints(model: pin.Model, q0: Array, q: Array) -> dict[str, float | list[float]]:
    start: dict[str, float | list[float]] = {}
    for name in list(model.names)[1:]:
        span, _ = joint_spans(model, name)
        if not np.array_equal(q[span], q0[span]):
            values = [round(float(one), 9) for one in q[span]]
            start[name] = values[0] if len(values) == 1 else values
    return start


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
