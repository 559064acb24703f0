"""Robots without their meshes: the physics of contact needs none, and most time goes into them."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path

import numpy as np
import pinocchio as pin

from sphshell_pin import robots
from sphshell_pin.errors import InvalidParameter, NameNotFound, SphshellError
from sphshell_pin.robots.description import read_model

# Robots that are no URDF end on these.
_SUFFIXES = (".urdf", ".xml", ".sdf", ".xacro", ".mjcf")


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


def is_path(robot: str) -> bool:
    """Whether `robot` is meant as a file, not as a name."""
    return Path(robot).suffix.lower() in _SUFFIXES or "/" in robot or os.path.isfile(robot)


def check_known(names: Iterable[str]) -> None:
    """Raise SphshellError for the first of `names` that is neither a name nor a file."""
    known = all_names()
    for robot in names:
        if is_path(robot):
            if not os.path.isfile(robot):
                what = "is a folder, not a URDF file" if os.path.isdir(robot) else "no such file"
                raise SphshellError(f"{robot}: {what}")
        elif robot not in known:
            raise NameNotFound("robot", robot, "sphshell_pin.robots", known, "sphshell-pin list")


def load_subject(robot: str | PathLike[str] | pin.Model, *, free_flyer: bool = False) -> Subject:
    """Load the robot of a name or a URDF file without its meshes, or take a pinocchio.Model.

    Of collision geometry only the spheres are taken, which may be its fingertips. `free_flyer`
    frees the root link of a URDF file. Raises NameNotFound, and RobotError for a description that
    cannot be read.
    """
    if isinstance(robot, pin.Model):
        if free_flyer:
            raise InvalidParameter("free_flyer", free_flyer, "is for URDF files: the model is made")
        bare = pin.GeometryModel()
        name = robot.name or "model"
        return Subject(name, robots.LoadedRobot(name, robot, bare, bare, pin.neutral(robot)), None)
    if not isinstance(robot, str | PathLike):
        raise InvalidParameter("robot", robot, "must be a name, a URDF file or a pinocchio.Model")
    robot = str(robot)
    check_known([robot])
    if is_path(robot):
        return _from_urdf(Path(robot), Path(robot).stem, None, free_flyer=free_flyer)
    if free_flyer:
        raise InvalidParameter("free_flyer", robot, "must be a URDF file: named robots know it")
    if robot in robots.OWN:
        file = robots.URDF_FOLDER / f"{robot}.urdf"
        return _from_urdf(file, robot, robot, free_flyer=robots.OWN[robot])
    return _from_library(robot)


def _from_library(name: str) -> Subject:
    from example_robot_data import robots_loader

    loader = robots_loader.ROBOTS[name]
    reads_files_only = loader.__init__ is robots_loader.RobotLoader.__init__
    if not loader.urdf_filename or not reads_files_only:
        # It is an SDF, or changes what it has read: only itself knows how.
        return Subject(name, robots.load(name), name)
    inner = Path(loader.path, loader.urdf_subpath, loader.urdf_filename)
    folder = Path(robots_loader.getModelPath(str(inner)))
    subject = _from_urdf(folder / inner, name, name, free_flyer=loader.free_flyer)
    if not loader.srdf_filename:
        return subject
    # Rotor inertias and the reference posture stand beside the URDF.
    robot = subject.robot
    q0 = robots_loader.readParamsFromSrdf(
        robot.model,
        str(folder / loader.path / loader.srdf_subpath / loader.srdf_filename),
        False,
        loader.has_rotor_parameters,
        loader.ref_posture,
    )
    whole = robots.LoadedRobot(
        name, robot.model, robot.collision_model, robot.visual_model, np.array(q0)
    )
    return Subject(name, whole, name, subject.notes)


def _from_urdf(file: Path, name: str, shipped: str | None, *, free_flyer: bool) -> Subject:
    try:
        model = read_model(file, free_flyer=free_flyer)
        tree = ET.parse(file)  # well-formed and not deep: this has been checked
    except (ValueError, RuntimeError, OSError, LookupError) as error:
        reason = " ".join(str(error).split())
        raise robots.RobotError(f"{file}: not a URDF that can be read: {reason}") from None
    notes = []
    mimics = [str(one.get("name")) for one in tree.iter("joint") if one.find("mimic") is not None]
    mimics = [joint for joint in mimics if joint in set(model.names)]
    if mimics:
        notes.append(
            "mimic joints move freely here, as forward dynamics has no such constraint: "
            f"{listed(mimics)}"
        )
    _keep_spheres(tree.getroot())
    text = ET.tostring(tree.getroot(), encoding="unicode")
    try:
        spheres = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    except (ValueError, RuntimeError) as error:
        raise robots.RobotError(f"{file}: its geometry cannot be read: {error}") from None
    robot = robots.LoadedRobot(name, model, spheres, pin.GeometryModel(), pin.neutral(model))
    return Subject(name, robot, shipped, tuple(notes))


def _keep_spheres(root: ET.Element) -> None:
    """Drop every geometry of a URDF but the spheres of its collision geometry."""
    for link in root.iter("link"):
        for part in [*link.findall("visual"), *link.findall("collision")]:
            if part.tag == "visual" or part.find("geometry/sphere") is None:
                link.remove(part)


def listed(names: list[str], most: int = 4) -> str:
    """Return the names in quotes; of more than `most` the first, and how many there are."""
    text = ", ".join(f"'{name}'" for name in names[:most])
    return f"{text}, ... ({len(names)} of them)" if len(names) > most else text
