"""Where the sphere of a check sits: a fingertip that is known, or the end of the longest limb."""

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.contact import Sphere
from sphshell_pin.dynamics.scene.models import find_frame, model_reach
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario.drafting.fingertips import find_tips
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.study.robot_check.models import Subject
from sphshell_pin.study.robot_check.postures import random_posture
from sphshell_pin.testing.forces import point_jacobian

# Radii of spheres whose size nobody knows [m]: least and largest. Smaller ones in a URDF's
# collision geometry than _DUMMY [m] only keep a place.
_RADII, _DUMMY = (0.005, 0.05), 0.002
# A sphere on a lever shorter than that, in radii, only rolls: no fingertip.
_FEWEST = 4.0


def find_sphere(
    subject: Subject,
    model: pin.Model,
    rng: np.random.Generator,
    frame: str | None,
    radius: float | None,
) -> tuple[Tip, list[str]]:
    """Return the sphere to check with, and a note where its place is a guess.

    `model` is the robot's without the joints that are held.
    """
    robot, why = subject.robot, "no fingertip is known"
    size = float(np.clip(0.02 * model_reach(robot.model), *_RADII))
    for r in (radius, size):
        try:
            tip = find_tips(robot, shipped=subject.shipped, frame=frame, radius=r)[0]
        except SphshellError:
            if frame is not None and r is not None:
                raise
            continue
        if frame is not None:
            return tip, []
        if radius is None and tip.radius < _DUMMY:
            why = f"the {tip.radius * 1e3:.2g} mm sphere at '{tip.frame}' only keeps a place"
        elif _lever(model, _sphere(tip), rng) < _FEWEST * tip.radius:
            why = f"the sphere at '{tip.frame}' hardly moves but by turning"
        else:
            return tip, []
        break
    end = _longest_limb(model)
    said = f"{why}: the sphere sits at '{end}', the end of the longest limb"
    return Tip(end, radius or size, np.zeros(3), said), [said]


def _sphere(tip: Tip, shift: Array | float = 0.0) -> Sphere:
    return Sphere(tip.radius, tip.frame, tuple(np.array(tip.offset) + shift))


def _lever(model: pin.Model, sphere: Sphere, rng: np.random.Generator) -> float:
    """Return the farthest that a joint moves the sphere's center [m/rad or m/m], of some postures.

    Of a joint that slides, which moves it as far as one likes, it is 1.
    """
    data, longest = model.createData(), 0.0
    for _ in range(5):
        q = random_posture(model, rng)
        columns = np.linalg.norm(center_jacobian(model, data, q, sphere), axis=0)
        longest = max(longest, float(columns.max(initial=0.0)))
    return longest


def _longest_limb(model: pin.Model) -> str:
    """Return the last frame of the limb with most joints; of equal ones that which reaches most."""
    depth, reach = np.zeros(model.njoints, int), np.zeros(model.njoints)
    for j in range(1, model.njoints):
        depth[j] = depth[model.parents[j]] + 1
        reach[j] = reach[model.parents[j]] + np.linalg.norm(model.jointPlacements[j].translation)

    def rank(k: int) -> tuple[int, float, bool]:
        frame = model.frames[k]
        out = float(reach[frame.parentJoint] + np.linalg.norm(frame.placement.translation))
        return int(depth[frame.parentJoint]), round(out, 9), frame.type == pin.FrameType.BODY

    best = max(range(model.nframes), key=rank)
    return str(model.frames[best].name)


def moved_sphere(model: pin.Model, tip: Tip, rng: np.random.Generator) -> tuple[Sphere, list[str]]:
    """Return the sphere, moved off its frame if no joint moves that frame's origin."""
    shift = 10.0 * tip.radius
    for offset in (np.zeros(3), *(shift * np.eye(3))):
        sphere = _sphere(tip, offset)
        if _lever(model, sphere, rng) > 1e-6:
            note = f"no joint moves the origin of '{tip.frame}': the sphere sits {shift:.3g} m off"
            return sphere, [note] if offset.any() else []
    raise SphshellError(
        f"no joint that is free to move moves frame '{tip.frame}': give another with --frame"
    )


def center_of(model: pin.Model, data: pin.Data, sphere: Sphere) -> tuple[int, Array]:
    """Return the joint that carries the sphere, and its center (3,) in the world; `data` is set."""
    frame = find_frame(model, sphere.frame)
    return int(model.frames[frame].parentJoint), np.array(
        data.oMf[frame].act(np.array(sphere.offset))
    )


def center_jacobian(model: pin.Model, data: pin.Data, q: Array, sphere: Sphere) -> Array:
    """Return the Jacobian (3, nv) of the sphere's center at q (nq,); `data` is set."""
    joint, center = center_of(model, placed_data(model, q, data), sphere)
    pin.computeJointJacobians(model, data, q)
    return point_jacobian(model, data, joint, center)


def placed_data(model: pin.Model, q: Array, data: pin.Data | None = None) -> pin.Data:
    """Return `data` (new ones are dear for large models) with the frames' placements at q (nq,)."""
    data = model.createData() if data is None else data
    pin.framesForwardKinematics(model, data, q)
    return data
