"""Where a robot carries its sphere: known fingertips and feet, or the end of its only limb."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.dynamics.models import find_frame
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import TIPS, LoadedRobot, end_spheres, fingertips

Array = npt.NDArray[np.float64]

# Words in the names of frames that mark the end of a limb, in the order of trust.
_END_WORDS = ("tcp", "tip", "tool", "ee_link", "eef", "end_effector", "foot", "feet")


@dataclass(frozen=True)
class Tip:
    """A sphere on a robot: `radius` [m], center `offset` (3,) [m] in `frame`; how it is known."""

    frame: str
    radius: float
    offset: Array
    source: str


def find_tips(
    robot: LoadedRobot,
    *,
    shipped: str | None,
    frame: str | None,
    radius: float | None,
    offset: Array | None = None,
) -> list[Tip]:
    """Return the spheres of `robot` to put on a surface.

    One for a robot with a fixed base, all feet of one that floats. `shipped` is the name of a
    shipped robot; `frame`, `radius` [m] and `offset` (3,) [m] in the frame are what the user gave.

    Raises
    ------
    FrameNotFound
        The robot has no such frame.
    SphshellError
        Which frame or which radius cannot be found out.
    """
    known = _known(robot, shipped)
    if frame is not None:
        find_frame(robot.model, frame)
        found = [one for one in known if one.frame == frame]
        if offset is not None or not found:
            asked = np.zeros(3) if offset is None else offset
            return [_sized(Tip(frame, 0.0, asked, "as it was asked for"), radius)]
        return [_sized(found[0], radius)]
    if known:
        chosen = known if floats(robot.model) else known[:1]
        return [_sized(one, radius) for one in chosen]
    return [
        _sized(Tip(one, 0.0, np.zeros(3), source), radius) for one, source in _ends(robot.model)
    ]


def floats(model: pin.Model) -> bool:
    """Whether the root of the robot is free to move in space."""
    return bool(model.njoints > 1 and model.joints[1].shortname() == "JointModelFreeFlyer")


def _known(robot: LoadedRobot, shipped: str | None) -> list[Tip]:
    if shipped in TIPS:
        spheres, source = fingertips(shipped), "a fingertip this package knows of"
    else:
        spheres, source = end_spheres(robot), "the sphere of its collision geometry"
    model = robot.model
    return [
        Tip(one.frame, one.radius, np.array(one.offset), source)
        for one in spheres
        if int(model.frames[find_frame(model, one.frame)].parentJoint) > 0
    ]


def _sized(tip: Tip, radius: float | None) -> Tip:
    if radius is not None:
        # A center that stands one radius before the frame goes on touching it.
        touching = tip.radius and abs(np.linalg.norm(tip.offset) - tip.radius) < 1e-9
        offset = tip.offset * (radius / tip.radius) if touching else tip.offset
        return Tip(tip.frame, radius, offset, tip.source)
    if not tip.radius:
        raise SphshellError(
            f"frame '{tip.frame}' carries no sphere that is known: state its radius in meters, for "
            "a fingertip --radius 0.012"
        )
    return tip


def _ends(model: pin.Model) -> list[tuple[str, str]]:
    """Return the frames at the ends of the limbs that may be meant, and why."""
    leaves = set(range(1, model.njoints)) - {int(one) for one in model.parents}
    carriers = {int(one.parentFrame) for one in model.frames}
    names = [
        one.name
        for i, one in enumerate(model.frames)
        if int(one.parentJoint) in leaves and i not in carriers
    ]
    if len(names) == 1:
        return [(names[0], "the only end of the robot")]
    for word in _END_WORDS:
        found = [name for name in names if word in name.lower()]
        if len(found) == 1 or (found and floats(model)):
            return [(name, f"an end of the robot called '{word}'") for name in found]
    raise SphshellError(
        f"the robot has several ends: state which frame carries the sphere with --frame, for "
        f"instance one of {', '.join(names[:8]) or ', '.join(f.name for f in model.frames)}"
    )
