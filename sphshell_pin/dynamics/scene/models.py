"""Questions to a Pinocchio model: frames by name, joints held, joints that no run can move."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array
from sphshell_pin.base.checks import check_name
from sphshell_pin.dynamics.scene.mimic import group_of, mimics
from sphshell_pin.errors import FrameNotFound, InvalidParameter, NameNotFound, SphshellError
from sphshell_pin.units import size_warning

# How far beyond a limit a joint may be for having been rounded [rad or m].
_BEYOND = 1e-6


def find_frame(model: pin.Model, name: str, called: str = "frame") -> int:
    """Return the index of the frame called `name`.

    Names may repeat (a link called as its joint): a body's frame comes first, then an operational
    frame, then any other. FrameNotFound lists the names; `called` is the argument's name.
    """
    check_name(called, name)
    found = [k for k, frame in enumerate(model.frames) if frame.name == name]
    if not found:
        raise FrameNotFound(name, [frame.name for frame in model.frames])
    order = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)
    kinds = [model.frames[k].type for k in found]
    first = next((kinds.index(kind) for kind in order if kind in kinds), 0)
    return found[first]


def joint_of(model: pin.Model, frame: str) -> int:
    """Return the joint that carries the frame called so; FrameNotFound lists the names."""
    return int(model.frames[find_frame(model, frame)].parentJoint)


def find_moving_frame(model: pin.Model, name: str) -> int:
    """Return the index of the frame called `name`; InvalidParameter if no joint moves it."""
    if not joint_of(model, name):
        raise InvalidParameter("frame", name, "is fixed to the world: nothing would move")
    return find_frame(model, name)


def frame_on_joint(model: pin.Model, joint: int) -> str | None:
    """Return the name of a frame that `find_frame` finds on `joint`, the joint's own if it can."""
    names = [model.names[joint], *(f.name for f in model.frames if f.parentJoint == joint)]
    known = {frame.name for frame in model.frames}
    for name in names:
        if name in known and model.frames[find_frame(model, name)].parentJoint == joint:
            return str(name)
    return None


def reduced_model(model: pin.Model, lock: tuple[str, ...], q: Array) -> pin.Model:
    """Return a copy of `model` in which the joints named by `lock` are held at q (nq,).

    Of joints that mimic one another, one that is held holds all. NameNotFound lists the joints;
    InvalidParameter says why Pinocchio cannot hold one.
    """
    return reduced_geometry(model, pin.GeometryModel(), lock, q)[0]


def reduced_geometry(
    model: pin.Model, geometry: pin.GeometryModel, lock: tuple[str, ...], q: Array
) -> tuple[pin.Model, pin.GeometryModel]:
    """Return `reduced_model`, and the geometry of `model` for it."""
    held = held_joints(model, lock)
    for joint in held:
        _check_joint_frame(model, model.names[joint], joint)
    # Pinocchio looks frames up by name, and fails where a link is called as a joint: usual in ROS.
    distinct, given = pin.Model(model), {}
    seen = {frame.name for frame in model.frames if frame.type == pin.FrameType.JOINT}
    for k, frame in enumerate(model.frames):
        if frame.type == pin.FrameType.JOINT:
            continue
        if frame.name in seen:
            name = f"{frame.name} #{k}"
            distinct.frames[k].name, given[name] = name, frame.name
        seen.add(frame.name)
    try:
        reduced, shape = pin.buildReducedModel(distinct, geometry, held, q)
        for k, frame in enumerate(reduced.frames):
            if frame.name in given:
                reduced.frames[k].name = given[frame.name]
        return reduced, shape
    except (ValueError, RuntimeError, IndexError) as error:
        what = f"cannot be held ({str(error).strip()}): name other joints to lock"
        raise InvalidParameter("lock", list(lock), what) from None


def held_joints(model: pin.Model, lock: tuple[str, ...]) -> list[int]:
    """Return the joints that are held with those named by `lock`: the groups of mimic joints too.

    NameNotFound lists the joints.
    """
    for name in lock:
        find_joint(model, name)
    names = dict.fromkeys(one for name in lock for one in group_of(model, name))
    return [int(model.getJointId(name)) for name in names]


def check_model(model: pin.Model) -> None:
    """Raise InvalidParameter for a model that Pinocchio's algorithms would not survive.

    That is one whose joints are not in the order parents first, whose lists differ in length, or
    whose inertias, placements or gravity are not finite, or whose joints have indices out of range.
    """
    fault = _core.model_fault(model)
    if fault is not None:
        name, value, must = fault
        raise InvalidParameter(name, value, must, f"= {value}")


def _check_joint_frame(model: pin.Model, name: str, joint: int) -> None:
    """Pinocchio reads the frame of a joint it locks, unchecked, before the frames on the joint."""
    on_joint = [frame for frame in model.frames if frame.parentJoint == joint]
    first = on_joint[0] if on_joint else None
    if first is None or first.name != name or first.type != pin.FrameType.JOINT:
        raise InvalidParameter(
            "lock",
            name,
            "is a joint that cannot be held, as its own frame is missing or comes after other "
            "frames on it: call model.addJointFrame(joint) right after model.addJoint",
        )


def unit_warning(model: pin.Model, radius: float, shell_size: float) -> str | None:
    """Tell, in a sentence, that a sphere, or the shell for it, is too large for the robot.

    `radius` [m] of the sphere, `shell_size` [m] the shell's box diagonal; None if all is well.
    """
    too_large = radius_fault(model, radius)
    if too_large:
        return f"the sphere's radius = {radius:g} {too_large}"
    for reference, what in ((radius, "sphere's radius"), (model_reach(model), "robot's reach")):
        sentence = size_warning(shell_size, reference, what)
        if sentence:
            return sentence
    return None


def radius_fault(model: pin.Model, radius: float) -> str | None:
    """Tell that the `radius` [m] of a sphere is more than the robot's reach; None if it is not."""
    reach = model_reach(model)
    if not 0 < reach < radius:
        return None
    return f"[m] is more than the robot's reach, {reach:.3g} m: is it in mm?"


def model_reach(model: pin.Model) -> float:
    """Length [m] of the longest chain of joint placements to a link's mass: the robot's size."""
    reach, ends = np.zeros(model.njoints), [0.0]
    for j in range(1, model.njoints):
        step = float(np.linalg.norm(model.jointPlacements[j].translation))
        reach[j] = reach[model.parents[j]] + step
        ends.append(float(reach[j] + np.linalg.norm(model.inertias[j].lever)))
    return max(ends)


def mass_matrix(model: pin.Model, q: Array) -> Array:
    """Return the mass matrix (nv, nv) at q (nq,): M e_k is the torque of a unit acceleration.

    Pinocchio's own (crba) is wrong where joints are not numbered depth first and where a tree
    branches behind a mimic joint; its recursive Newton-Euler algorithm is right for both.
    """
    weightless = pin.Model(model)
    weightless.gravity.vector = np.zeros(6)
    data, at_rest = weightless.createData(), np.zeros(model.nv)
    columns = [pin.rnea(weightless, data, q, at_rest, one) for one in np.eye(model.nv)]
    mass = np.array(columns).reshape(model.nv, model.nv)
    return np.asarray(0.5 * (mass + mass.T))


def apparent_mass(model: pin.Model, q: Array, joint: int, point: Array) -> float:
    """Return the mass [kg] that a force at a `point` (3,) [m] of a joint's frame has to move.

    It is the harmonic mean over the directions of space, 3 / trace(J M^-1 J^T) with the Jacobian J
    of the point and the mass matrix M at q (nq,) (Khatib 1987): of a free ball at its center the
    ball's mass. It is at most the mass of all bodies, which a point that cannot move gets.
    """
    data = model.createData()
    mass = mass_matrix(model, q)
    pin.computeJointJacobians(model, data, q)
    jacobian = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.LOCAL)
    jacobian = jacobian.reshape(6, model.nv)  # of one velocity it comes as a vector
    moved = jacobian[:3] - pin.skew(point) @ jacobian[3:]
    mobility = float(np.trace(moved @ np.linalg.solve(mass, moved.T)))
    total = float(pin.computeTotalMass(model))
    return 3.0 / mobility if mobility * total > 3.0 else total


def find_joint(model: pin.Model, name: str) -> pin.JointModel:
    """Return the joint called `name`; NameNotFound lists the joints."""
    names = list(model.names)[1:]
    if name not in names:
        raise NameNotFound("joint", name, "the model", names)
    return model.joints[model.getJointId(name)]


def set_joint(model: pin.Model, q: Array, name: str, value: float | Sequence[float]) -> None:
    """Write the position of one joint into `q` [m, rad; a free-flyer's x y z and quaternion].

    That of a mimic joint moves the joint that it mimics.

    Raises
    ------
    NameNotFound
        The model has no such joint.
    SphshellError
        `value` has not as many numbers as the joint.
    """
    joint = find_joint(model, name)
    rule = mimics(model).get(name)
    if rule is not None:
        number = value[0] if isinstance(value, Sequence) and len(value) == 1 else value
        if isinstance(number, Sequence) or rule.ratio == 0.0:
            raise SphshellError(f"joint '{name}' mimics '{rule.of}': give that joint's position")
        set_joint(model, q, rule.of, (number - rule.offset) / rule.ratio)
        return
    span = slice(joint.idx_q, joint.idx_q + joint.nq)
    if not isinstance(value, Sequence):
        if joint.nv != 1:
            raise SphshellError(f"joint '{name}' takes a list of {joint.nq} numbers")
        # A continuous joint is stored as the cosine and the sine of its angle.
        q[span] = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
        return
    if len(value) != joint.nq:
        raise SphshellError(f"joint '{name}' takes {joint.nq} numbers, not {len(value)}")
    q[span] = value


def beyond_limits(model: pin.Model, q: Array) -> list[str]:
    """Say which joints of one coordinate are beyond their limits at q (nq,)."""
    said = []
    for name, joint in zip(list(model.names)[1:], list(model.joints)[1:], strict=True):
        if joint.nq != 1:
            continue
        at = float(q[joint.idx_q])
        low = float(model.lowerPositionLimit[joint.idx_q])
        high = float(model.upperPositionLimit[joint.idx_q])
        # A model that states none has infinite ones, or the same for both.
        if low < high and not low - _BEYOND <= at <= high + _BEYOND:
            said.append(
                f"joint '{name}' starts at {at:.6g}, beyond its limits {low:.6g} to {high:.6g} "
                "[rad or m]: change the start"
            )
    return said
