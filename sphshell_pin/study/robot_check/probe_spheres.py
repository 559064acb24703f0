"""Where the sphere of a check sits: where a scenario of the robot would have it, if that moves."""

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.contact import Sphere
from sphshell_pin.dynamics.scene.models import find_frame, model_reach
from sphshell_pin.errors import SphshellError
from sphshell_pin.scenario.drafting.fingertips import find_tips
from sphshell_pin.study.robot_check.models import Subject
from sphshell_pin.study.robot_check.postures import random_posture
from sphshell_pin.testing.forces import point_jacobian

# Radii of spheres whose size nobody knows [m]: least and largest. Smaller ones in a URDF's
# collision geometry than _DUMMY [m] only keep a place.
_RADII, _DUMMY = (0.005, 0.05), 0.002
# A sphere on a lever shorter than that, in radii, only rolls: no fingertip. One that was asked for
# has to be moved at all [m/rad].
_FEWEST, _LEAST = 4.0, 1e-6


def find_sphere(
    subject: Subject,
    model: pin.Model,
    rng: np.random.Generator,
    frame: str | None,
    radius: float | None,
) -> tuple[Sphere, list[str]]:
    """Return the sphere to check with, and notes where it is not the fingertip that is known.

    `model` is the robot's without the joints that are held, `radius` [m] that of the sphere. One
    that joints hardly move is put off its place; SphshellError if that does not help.
    """
    tip = find_tips(subject.robot, shipped=subject.shipped, frame=frame, radius=radius)[0]
    notes: list[str] = []
    size, least = tip.radius, _LEAST
    if frame is None and radius is None and size < _DUMMY:
        size = float(np.clip(0.02 * model_reach(model), *_RADII))
        said = f"the {tip.radius * 1e3:.2g} mm sphere at '{tip.frame}' only keeps a place"
        notes.append(f"{said}: one of {size * 1e3:.2g} mm stands there")
    if frame is None:
        least = _FEWEST * size
    shift = 10.0 * size
    for offset in (np.zeros(3), *(shift * np.eye(3))):
        sphere = Sphere(size, tip.frame, tuple(np.array(tip.offset) + offset))
        if _lever(model, sphere, rng) > least:
            if offset.any():
                notes.append(f"joints hardly move '{tip.frame}': the sphere sits {shift:.3g} m off")
            return sphere, notes
    raise SphshellError(
        f"no joint that is free to move moves frame '{tip.frame}': give another with --frame"
    )


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
