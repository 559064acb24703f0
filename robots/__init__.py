"""Robots by name (own small URDFs, example-robot-data's) and by file, and their fingertips."""

import warnings
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.base.regular_file import MOST_TEXT, StrPath, read_bytes, why_no_file
from sphshell_pin.contact.sphere import Sphere
from sphshell_pin.dynamics.scene.mimic import Mimic, shortened, with_mimics
from sphshell_pin.errors import MissingExtra, NameNotFound, RobotWarning, SphshellError
from sphshell_pin.robots.description import Description as Description
from sphshell_pin.robots.description import check_poses, check_size, parsed
from sphshell_pin.robots.files import RobotError as RobotError
from sphshell_pin.robots.files import build_geometry as build_geometry
from sphshell_pin.robots.files import build_model as build_model
from sphshell_pin.robots.files import is_path as is_path
from sphshell_pin.robots.files import keep_spheres as keep_spheres
from sphshell_pin.robots.files import read as read
from sphshell_pin.robots.finding import is_library_name as is_library_name
from sphshell_pin.robots.finding import library_source as library_source
from sphshell_pin.robots.inertia import few
from sphshell_pin.robots.inertia import joints_without_mass as joints_without_mass
from sphshell_pin.robots.inertia import mass_fault as mass_fault
from sphshell_pin.robots.inertia import with_density as with_density

_AT_ORIGIN = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)  # of a root that floats

URDF_FOLDER = Path(__file__).parent / "urdf"

# Own robots, and whether their root floats freely.
OWN = {"ball": True, "gear_pair": False, "three_link_finger": False, "turntable": False}

# Fingertips of robots whose collision geometry has no spheres: frame, radius [m], offset [m].
TIPS: dict[str, tuple[tuple[str, float, tuple[float, float, float]], ...]] = {
    "panda": (("panda_hand_tcp", 0.012, (0.0, 0.0, 0.0)),),
    "finger_edu": (("finger_tip_link", 0.016, (0.0, 0.0, 0.0)),),
    "ur3": (("tool0", 0.012, (0.0, 0.0, 0.012)),),
    "ur5": (("tool0", 0.012, (0.0, 0.0, 0.012)),),
    "ur10": (("tool0", 0.012, (0.0, 0.0, 0.012)),),
}


# Postures to work in [rad], of arms whose reference posture is stretched out: the flange down.
_FLANGE_DOWN = (0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0)
WORKING: dict[str, tuple[float, ...]] = {
    f"{arm}{kind}": _FLANGE_DOWN
    for arm in ("ur3", "ur5", "ur10")
    for kind in ("", "_limited", "_gripper")
}


@dataclass(frozen=True)
class LoadedRobot:
    """A robot ready for a Scene: its model, its geometry, a posture to start from."""

    name: str
    model: pin.Model
    collision_model: pin.GeometryModel
    visual_model: pin.GeometryModel
    q0: npt.NDArray[np.float64]
    """A posture (nq,): the robot's reference posture where it has one, else neutral."""
    notes: tuple[str, ...] = ()
    """What its file states that is not modeled, one sentence each."""
    description: Description | None = None
    """Its file, as it was read; None of a robot of example-robot-data."""
    assumed: str = ""
    """What its file does not state and was taken from elsewhere, in one sentence."""


def names() -> list[str]:
    """Return the names `load` knows on this machine: own robots, then example-robot-data's."""
    return [*OWN, *(name for name in _library() if name not in OWN)]


def load(
    name: str, *, free_flyer: bool | None = None, mimic: bool = False, pose: str | None = None
) -> LoadedRobot:
    """Return the robot called `name`, its mimic joints free unless `mimic` is set.

    Names that end in _description are those of the package robot_descriptions.

    `mimic` and `pose` are those of `load_file`. With `free_flyer` the root link floats, with False
    it is fixed where the reference posture has it; by default it is as its collection has it.

    Raises
    ------
    MissingExtra
        No own robot has that name, and example-robot-data is not installed.
    NameNotFound
        Nobody has that name, or the robot has no pose called `pose`.
    RobotError
        Its description cannot be read on this machine (an SDF file, for one).
    """
    load_named = partial(load_file, name=name, mimic=mimic, pose=pose)
    if name in OWN:
        free = OWN[name] if free_flyer is None else free_flyer
        return load_named(URDF_FOLDER / f"{name}.urdf", free_flyer=free)
    if is_library_name(name):
        file, folders, xacro_args = library_source(name)
        return load_named(file, folders, free_flyer=free_flyer, xacro_args=xacro_args)
    try:
        import example_robot_data
    except ImportError:
        raise MissingExtra("example-robot-data-loaders", "robots", f"the robot '{name}'") from None
    if name not in _library():
        raise NameNotFound("robot", name, "sphshell_pin.robots", names(), "sphshell-pin list")
    try:
        robot = example_robot_data.load(name)
    except Exception as error:
        reason = str(error)
        if "SDF" in reason or "Sdf" in reason:
            reason = "it is an SDF file, and the wheel of pinocchio has no SDF reader"
            reason += ": give its URDF or MJCF"
        raise RobotError(f"the robot '{name}' cannot be loaded: {reason}") from error
    # A reference posture may state a free-flyer's quaternion with a few digits only.
    q0 = pin.normalize(robot.model, np.asarray(robot.q0, dtype=float))
    loaded = LoadedRobot(name, robot.model, robot.collision_model, robot.visual_model, q0)
    if free_flyer is False and floats(robot.model):
        loaded, pose = _held(_posed(loaded, pose, name), robot.urdf), None
    elif free_flyer and not floats(robot.model):
        loaded = load_file(robot.urdf, free_flyer=True, name=name)
        loaded = replace(loaded, q0=np.append(_AT_ORIGIN, q0))
    if mimic:
        rules, note = mimics_of_library(name, read(robot.urdf).mimics)
        loaded = replace(_mimicking(loaded, rules, name), notes=note)
    return _posed(loaded, pose, name)


def load_file(
    path: StrPath,
    package_dirs: Iterable[StrPath] = (),
    *,
    free_flyer: bool | None = None,
    mimic: bool = False,
    name: str | None = None,
    xacro_args: Mapping[str, object] | None = None,
    srdf: StrPath | None = None,
    pose: str | None = None,
    density: float | None = None,
) -> LoadedRobot:
    """Return the robot of one's own file: URDF, xacro (`xacro_args` are its arguments) or MJCF.

    `package_dirs` are the folders that hold the packages of `package://` names; the file's own
    folder and those above it, ROS_PACKAGE_PATH and AMENT_PREFIX_PATH are searched too. With
    `free_flyer` the root link floats (nq 7, nv 6), with False it is fixed; by default it is fixed
    in URDF, and as the file states it in MJCF.

    With `mimic`, joints that mimic others (URDF `<mimic>`, MJCF `<equality><joint>`) do so exactly:
    the model's nq and nv are those of the other joints (`sphshell_pin.dynamics.scene.mimic`).
    Without it they move freely, as Pinocchio reads them.

    `density` [kg/m^3] gives the links of a URDF that state no mass that of their collision
    geometry, else of their visual one; `assumed` of the robot says so.

    `srdf` is a file with poses (its `<group_state>`). `pose` names the one that becomes `q0`; in
    MJCF it may be a `<key>`.

    Limits, damping, dry friction and armature are in the model's attributes of those names. Warns
    with RobotWarning of meshes that are missing, and of what the file states that is not
    modeled.

    Raises
    ------
    RobotError
        The file is missing or cannot be read, or the robot is too large: a chain of more than 1000
        links, or more degrees of freedom than 2 GB of memory hold (315). The floating root link has
        no mass. With `mimic`: a kinematic loop, or a joint that mimics none that is there.
    NameNotFound
        There is no pose of that name.
    MissingExtra
        A xacro file without the package xacro.
    """
    description = read(path, package_dirs, xacro_args, free_flyer=free_flyer)
    assumed = ""
    if density is not None:
        description, assumed = with_density(description, density)
    model = build_model(description, free_flyer=free_flyer, mimic=mimic)
    _load_poses(model, srdf)
    collision, missing = build_geometry(description, model, pin.GeometryType.COLLISION)
    visual, without = build_geometry(description, model, pin.GeometryType.VISUAL)
    touch = "; what lacks its collision mesh touches nothing" if missing else ""
    missing = [*dict.fromkeys((*missing, *without))]
    robot = LoadedRobot(
        name or model.name,
        model,
        collision,
        visual,
        description.q0(model),
        description=description,
        assumed=assumed,
    )
    if missing:
        hint = f"searched in {description.folders.searched()} (see --package-dir)"
        if description.is_mjcf:
            hint = "correct file= of the mesh, or meshdir= of <compiler>"
        warnings.warn(
            f"{path}: without these meshes, which are missing or broken: {few(missing)}{touch}; "
            f"{hint}",
            RobotWarning,
            stacklevel=2,
        )
    return _posed(exactly(robot, description, mimic=mimic), pose, str(path))


def exactly(
    robot: LoadedRobot, description: Description, *, mimic: bool, warn: bool = True
) -> LoadedRobot:
    """Return `robot` with mimic joints exact if `mimic`; note what its file states beyond that.

    RobotError names kinematic loops and couplings, which without `mimic` are only warned of.
    """
    file, loops = description.file, description.loops
    if loops and mimic:
        raise RobotError(
            f"{file}: not supported: {few(loops, most=2)}; leave them out of the file, or load it "
            "with mimic = false (--no-mimic), which lets these joints move freely"
        )
    if loops:
        loops = (
            f"joints move freely that the file couples: {few(loops, most=2)}; "
            "docs/joints.md shows how Pinocchio closes loops in a loop of your own",
        )
    for note in (*loops, *description.notes) if warn else ():
        warnings.warn(f"{file}: {note}", RobotWarning, stacklevel=3)
    robot = replace(robot, notes=(*loops, *description.notes))
    return _mimicking(robot, description.mimics, str(file)) if mimic else robot


def mimics_of_library(
    name: str, rules: Iterable[Mimic]
) -> tuple[tuple[Mimic, ...], tuple[str, ...]]:
    """Return the rules of a robot of example-robot-data, corrected, and what was corrected."""
    if name != "alex_psyonic_hands":
        return tuple(rules), ()
    # Its file leaves out of the mimicked joints' names which hand they are of.
    corrected = tuple(
        replace(rule, of=f"{rule.joint.partition('_')[0]}_{rule.of}") for rule in rules
    )
    first = corrected[0]
    return corrected, (
        "its file names mimicked joints without the hand, "
        f"'{first.of.partition('_')[2]}' for '{first.of}': read with it",
    )


def _held(robot: LoadedRobot, urdf: str) -> LoadedRobot:
    """Return a robot of `urdf` that floats with its root fixed where q0 has it."""
    # Pinocchio's routine that locks a joint confuses joints and links of the same name.
    held, root = load_file(urdf, name=robot.name), pin.XYZQUATToSE3(robot.q0[:7])
    model, collision, visual = held.model, held.collision_model, held.visual_model
    for one in ("armature", "rotorInertia", "rotorGearRatio"):
        setattr(model, one, np.array(getattr(robot.model, one))[6:])
    for joint in range(1, model.njoints):
        if model.parents[joint] == 0:
            model.jointPlacements[joint] = root * model.jointPlacements[joint]
    for frame in list(model.frames)[1:]:
        if frame.parentJoint == 0:
            frame.placement = root * frame.placement
    for shape in (*collision.geometryObjects, *visual.geometryObjects):
        if shape.parentJoint == 0:
            shape.placement = root * shape.placement
    return replace(held, q0=robot.q0[7:], description=None)


def floats(model: pin.Model) -> bool:
    """Whether the root of the robot is free to move in space."""
    return bool(model.njoints > 1 and model.joints[1].shortname() == "JointModelFreeFlyer")


def _mimicking(robot: LoadedRobot, rules: Iterable[Mimic], what: str) -> LoadedRobot:
    """Return `robot` with `rules` in its model; joints, frames and so the geometry stay."""
    rules = tuple(rules)
    if not rules:
        return robot
    try:
        model = with_mimics(robot.model, rules)
    except SphshellError as error:
        raise RobotError(f"{what}: {error}") from None
    return replace(robot, model=model, q0=shortened(model, robot.q0))


def _load_poses(model: pin.Model, srdf: StrPath | None) -> None:
    if srdf is None:
        return
    if reason := why_no_file(srdf):
        raise RobotError(f"{srdf}: {reason}")
    try:
        text = read_bytes(srdf, MOST_TEXT)
        check_size(text)
        root = parsed(text)
        check_poses(root, model)
        pin.loadReferenceConfigurationsFromXML(model, ET.tostring(root, encoding="unicode"), False)
    except (ValueError, RuntimeError, OSError) as error:
        raise RobotError(f"{srdf}: not an SRDF that pinocchio can read: {error}") from None


def _posed(robot: LoadedRobot, pose: str | None, what: str) -> LoadedRobot:
    """Return `robot` with q0 in one of its reference poses."""
    if pose is None:
        return robot
    poses = {one.key(): one.data() for one in robot.model.referenceConfigurations}
    if pose not in poses:
        raise NameNotFound("pose", pose, what, poses)
    return replace(robot, q0=pin.normalize(robot.model, np.asarray(poses[pose], dtype=float)))


def fingertips(name: str) -> list[Sphere]:
    """Return the spheres at the ends of the robot's limbs: fingertips, feet.

    They are the sphere collision geometries of links that carry no further joint, else those of a
    small table of well-known robots; an empty list where neither is known.
    """
    if name in TIPS:
        return [Sphere(radius, frame, offset) for frame, radius, offset in TIPS[name]]
    return end_spheres(load(name))


def end_spheres(robot: LoadedRobot) -> list[Sphere]:
    """Return the sphere collision geometries of the links of `robot` without a further joint."""
    parents = {int(parent) for parent in robot.model.parents} - {0}
    return [sphere for joint, sphere in _spheres(robot) if joint not in parents]


def collision_spheres(robot: LoadedRobot) -> list[Sphere]:
    """Return all spheres of the collision geometry of `robot`, in the frames of their links."""
    return [sphere for _, sphere in _spheres(robot)]


def _spheres(robot: LoadedRobot) -> Iterator[tuple[int, Sphere]]:
    """Yield each sphere of the collision geometry with the joint that carries it."""
    for geometry in robot.collision_model.geometryObjects:
        if type(geometry.geometry).__name__ == "Sphere":
            frame = robot.model.frames[geometry.parentFrame]
            x, y, z = frame.placement.actInv(geometry.placement).translation.tolist()
            yield (
                int(geometry.parentJoint),
                Sphere(float(geometry.geometry.radius), frame.name, (x, y, z)),
            )


def _library() -> list[str]:
    """Return the names of example-robot-data, or nothing where it is not installed."""
    try:
        from example_robot_data.robots_loader import ROBOTS
    except ImportError:
        return []
    return sorted(ROBOTS)
