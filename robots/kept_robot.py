"""Robots that are kept with the results of a run: shown later from what is kept, and no other file.

Kept are the description as it was read (a xacro file expanded, an MJCF with what it includes) and
the meshes that show the robot. Both may have been changed since.
"""

import warnings
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from sphshell_pin.errors import RobotWarning
from sphshell_pin.robots import LoadedRobot, exactly, files
from sphshell_pin.robots.description import Description
from sphshell_pin.robots.packages import Folders


def text_of(description: Description) -> str:
    """Return the URDF or MJCF of a description."""
    return ET.tostring(description.root, encoding="unicode")


def meshes_of(description: Description) -> dict[str, Path | None]:
    """Return the files of the meshes that show the robot by name, None for one that is missing."""
    if description.mjcf is not None:
        meshes = map(description.mjcf.mesh, description.mjcf.geoms)
        paths = {mesh[0] for mesh in meshes if mesh is not None}
        return {str(path): path if path.is_file() else None for path in sorted(paths)}
    names = [one.get("filename", "") for one in description.root.iterfind("link/visual//mesh")]
    return {name: description.folders.find(name) for name in names}


def load_kept(
    text: str,
    file: str,
    meshes: Mapping[str, Path],
    q0: Sequence[float],
    *,
    free_flyer: bool | None,
    mimic: bool,
    name: str,
) -> LoadedRobot:
    """Return the robot that `text_of` gave, `file` was its name.

    No file is read but `meshes`, by their names. Warns with RobotWarning of those that are missing.
    Raises RobotError as `robots.load_file` does.
    """
    description = files.described(
        text.encode(), Folders(Path(file), kept=meshes), free_flyer=free_flyer
    )
    model = files.build_model(description, free_flyer=free_flyer, mimic=mimic)
    visual, missing = files.build_geometry(description, model, pin.GeometryType.VISUAL)
    files.keep_spheres(description)
    spheres, _ = files.build_geometry(description, model, pin.GeometryType.COLLISION)
    robot = LoadedRobot(name, model, spheres, visual, description.q0(model))
    robot = exactly(robot, description, mimic=mimic, warn=False)
    q = np.array(q0)
    if q.shape != (robot.model.nq,) or not np.isfinite(q).all():
        raise files.RobotError(f"{file}: its posture {q0} is not one of {robot.model.nq} numbers")
    if missing:
        warnings.warn(
            f"{file}: without these visual meshes, which the results do not hold: "
            f"{', '.join(missing)}",
            RobotWarning,
            stacklevel=2,
        )
    return replace(robot, q0=pin.normalize(robot.model, q))
