"""Robots without their meshes: the physics of contact needs none, and most time goes into them."""

import copy
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path

import numpy as np
import pinocchio as pin

from sphshell_pin import robots
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.regular_file import StrPath, why_no_file
from sphshell_pin.errors import InvalidParameter, NameNotFound, SphshellError


@dataclass(frozen=True)
class Subject:
    """A robot to check: its `name`, the LoadedRobot, and `notes` on what its file leaves open."""

    name: str
    robot: robots.LoadedRobot
    shipped: str | None
    """The name under which sphshell_pin.robots knows it, or None."""
    notes: tuple[str, ...] = field(default=())


def all_names() -> list[str]:
    """Return the names of all robots this machine has: own ones and example-robot-data's."""
    return list(robots.names())


def check_known(names: Iterable[str]) -> None:
    """Raise SphshellError for the first of `names` that is neither a name nor a file."""
    known = all_names()
    for robot in names:
        if robots.is_path(robot):
            if reason := why_no_file(robot):
                raise SphshellError(f"{robot}: {reason}")
        elif robot not in known and not robots.is_library_name(robot):
            raise NameNotFound("robot", robot, "sphshell_pin.robots", known, "sphshell-pin list")


def load_subject(
    robot: StrPath | pin.Model,
    *,
    free_flyer: bool = False,
    package_dirs: Sequence[StrPath] = (),
    xacro_args: Mapping[str, object] | None = None,
    density: float | None = None,
    mimic: bool = True,
) -> Subject:
    """Load the robot of a name or a file without its meshes, or take a pinocchio.Model.

    Mimic joints are exact unless `mimic` is False, and `density` is that of `robots.load_file`. Of
    collision geometry only the spheres are taken, which may be its fingertips. `free_flyer` frees
    the root link of a file; `package_dirs` and `xacro_args` are those of `robots.load_file`. Raises
    NameNotFound, and RobotError for a description that cannot be read.
    """
    if isinstance(robot, pin.Model):
        if free_flyer:
            raise InvalidParameter("free_flyer", free_flyer, "is for files: the model is made")
        bare = pin.GeometryModel()
        name = robot.name or "model"
        return Subject(name, robots.LoadedRobot(name, robot, bare, bare, pin.neutral(robot)), None)
    if not isinstance(robot, str | PathLike):
        raise InvalidParameter("robot", robot, "must be a name, a file or a pinocchio.Model")
    robot = str(robot)
    check_known([robot])
    name = Path(robot).stem
    if robots.is_library_name(robot):
        source = robots.library_source(robot)
        name, robot = robot, str(source.file)
        package_dirs, xacro_args = source.folders, xacro_args or source.xacro_args
    if robots.is_path(robot):
        file = Path(robot)
        description = robots.read(file, package_dirs, xacro_args, free_flyer=free_flyer or None)
        assumed = ""
        if density is not None:
            description, assumed = robots.with_density(description, density)
        subject = _without_meshes(description, name, None, free_flyer=free_flyer, mimic=mimic)
        return replace(subject, notes=(*filter(None, (assumed,)), *subject.notes))
    if density is not None:
        raise InvalidParameter("density", density, f"belongs to a file, not to {robot}")
    if free_flyer:
        raise InvalidParameter("free_flyer", robot, "must be a file: named robots know it")
    if robot in robots.OWN:
        description = robots.read(robots.URDF_FOLDER / f"{robot}.urdf")
        floating = robots.OWN[robot]
        return _without_meshes(description, robot, robot, free_flyer=floating, mimic=mimic)
    return _from_library(robot, mimic=mimic)


def _from_library(name: str, *, mimic: bool) -> Subject:
    from example_robot_data import robots_loader

    loader = robots_loader.ROBOTS[name]
    reads_files_only = loader.__init__ is robots_loader.RobotLoader.__init__
    if not loader.urdf_filename or not reads_files_only:
        # It is an SDF, or changes what it has read: only itself knows how.
        loaded = robots.load(name, mimic=mimic)
        return Subject(name, loaded, name, loaded.notes)
    inner = Path(loader.path, loader.urdf_subpath, loader.urdf_filename)
    folder = Path(robots_loader.getModelPath(str(inner)))
    description = robots.read(folder / inner)
    rules, notes = robots.mimics_of_library(name, description.mimics)
    description = replace(description, mimics=rules, notes=notes)
    srdf = folder / loader.path / loader.srdf_subpath / loader.srdf_filename

    def pose(model: pin.Model) -> Array:
        # Rotor inertias and the reference posture stand beside the URDF.
        if not loader.srdf_filename:
            return np.asarray(pin.neutral(model))
        rotors, posture = loader.has_rotor_parameters, loader.ref_posture
        return np.array(robots_loader.readParamsFromSrdf(model, str(srdf), False, rotors, posture))

    return _without_meshes(
        description, name, name, free_flyer=loader.free_flyer, mimic=mimic, pose=pose
    )


def _without_meshes(
    description: robots.Description,
    name: str,
    shipped: str | None,
    *,
    free_flyer: bool,
    mimic: bool = True,
    pose: Callable[[pin.Model], Array] | None = None,
) -> Subject:
    model = robots.build_model(description, free_flyer=free_flyer, mimic=mimic)
    q0 = pose(model) if pose is not None else description.q0(model)
    bare = copy.deepcopy(description)
    robots.keep_spheres(bare)
    spheres, _ = robots.build_geometry(bare, model, pin.GeometryType.COLLISION)
    robot = robots.LoadedRobot(
        name, model, spheres, pin.GeometryModel(), q0, description=description
    )
    robot = robots.exactly(robot, description, mimic=mimic, warn=False)
    return Subject(name, robot, shipped, robot.notes)
