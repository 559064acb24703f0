"""Robots by name: own small URDFs beside this file, and example-robot-data's; their fingertips."""

from __future__ import annotations

import os
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.contact.sphere import Sphere
from sphshell_pin.errors import MissingExtra, NameNotFound, SphshellError
from sphshell_pin.robots.description import read_model

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

URDF_FOLDER = Path(__file__).parent / "urdf"

# Own robots, and whether their root floats freely.
OWN: dict[str, bool] = {
    "ball": True,
    "gear_pair": False,
    "three_link_finger": False,
    "turntable": False,
}

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


class RobotError(SphshellError, ValueError):
    """A robot description that cannot be loaded."""


@dataclass(frozen=True)
class LoadedRobot:
    """A robot ready for a Scene: its model, its geometry, a posture to start from."""

    name: str
    model: pin.Model
    collision_model: pin.GeometryModel
    visual_model: pin.GeometryModel
    q0: npt.NDArray[np.float64]
    """A posture (nq,): the robot's reference posture where it has one, else neutral."""


def names() -> list[str]:
    """Return the names `load` knows on this machine: own robots, then example-robot-data's."""
    return [*OWN, *(name for name in _library() if name not in OWN)]


def load(name: str) -> LoadedRobot:
    """Return the robot called `name`.

    Raises
    ------
    MissingExtra
        No own robot has that name, and example-robot-data is not installed.
    NameNotFound
        Nobody has that name.
    RobotError
        Its description cannot be read on this machine (an SDF file, for one).
    """
    if name in OWN:
        return load_urdf(URDF_FOLDER / f"{name}.urdf", free_flyer=OWN[name], name=name)
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
        if "SDF" in reason and not hasattr(pin, "buildModelFromSdf"):
            reason = "it is an SDF file, and the wheel of pinocchio has no SDF reader"
        raise RobotError(f"the robot '{name}' cannot be loaded: {reason}") from error
    # A reference posture may state a free-flyer's quaternion with a few digits only.
    q0 = pin.normalize(robot.model, np.asarray(robot.q0, dtype=float))
    return LoadedRobot(name, robot.model, robot.collision_model, robot.visual_model, q0)


def load_urdf(
    path: str | PathLike[str],
    package_dirs: Iterable[str | PathLike[str]] = (),
    *,
    free_flyer: bool = False,
    name: str | None = None,
) -> LoadedRobot:
    """Return the robot of one's own URDF file.

    `package_dirs` are the folders that hold the packages of `package://` mesh names; the file's own
    folder is always searched. With `free_flyer` the root link floats (nq 7, nv 6).

    Raises
    ------
    RobotError
        The file or one of its meshes is missing or cannot be read, or the robot is too large: a
        chain of more than 1000 links, or more degrees of freedom than 2 GB of memory hold (315).
    """
    file = Path(path)
    if not os.path.isfile(file):
        raise RobotError(f"{file}: no such URDF file")
    dirs = [str(one) for one in package_dirs] + [str(file.parent)]
    for folder in dirs:
        if not os.path.isdir(folder):
            raise RobotError(f"{file}: the mesh package folder {folder} does not exist")
    try:
        model = read_model(file, free_flyer=free_flyer)
    except (ValueError, RuntimeError, OSError) as error:
        raise RobotError(f"{file}: not a URDF that pinocchio can read: {error}") from None
    geometry = []
    for kind in (pin.GeometryType.COLLISION, pin.GeometryType.VISUAL):
        try:
            geometry.append(pin.buildGeomFromUrdf(model, str(file), kind, package_dirs=dirs))
        except (ValueError, RuntimeError) as error:
            searched = ", ".join(dict.fromkeys(str(Path(one)) for one in dirs))
            raise RobotError(
                f"{file}: a mesh cannot be loaded ({str(error).strip().rstrip('.')}); searched in "
                f"{searched}: give the folder above the package with --package-dir, package_dirs "
                "in a scenario or in Python"
            ) from None
    return LoadedRobot(name or model.name, model, *geometry, pin.neutral(model))


def fingertips(name: str) -> list[Sphere]:
    """Return the spheres at the ends of the robot's limbs: fingertips, feet.

    They are the sphere collision geometries of links that carry no further joint, else those of a
    small table of well-known robots; an empty list where neither is known.
    """
    if name in TIPS:
        return [Sphere(radius, frame, np.array(offset)) for frame, radius, offset in TIPS[name]]
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
