"""What of a model hangs beyond one of its frames: for a sensor between that and the rest."""

from dataclasses import dataclass

import pinocchio as pin

from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import InvalidParameter

# Where a file attaches bodies: an operational frame is only a place on one.
_ATTACHED = (pin.FrameType.JOINT, pin.FrameType.FIXED_JOINT, pin.FrameType.BODY)


@dataclass(frozen=True)
class Subtree:
    """All that hangs on one joint of a scene beyond a frame on it.

    `joint` carries the frame, at `placement`; `inertia` of what moves with this joint, in the
    joint's frame; `children`, the joints attached to that; `frames`, the numbers of the frames on
    it; all numbers are those of the scene's model.
    """

    joint: int
    placement: pin.SE3
    inertia: pin.Inertia
    children: tuple[int, ...]
    frames: frozenset[int]


def subtree_of(scene: Scene, name: str) -> Subtree:
    """Return what hangs beyond the frame `name`: its link, and all that is attached to that.

    The file says what is attached to what, before joints are locked. Of a body that it does not
    divide, all belongs to the link of its joint.

    Raises
    ------
    FrameNotFound
        The model has no such frame.
    InvalidParameter
        It is an operational frame: nothing is attached there.
    """
    model, (whole, q) = scene.model, scene.whole
    here = model.frames[find_frame(model, name)]
    frame = whole.frames[find_frame(whole, name)]
    if frame.type not in _ATTACHED:
        raise InvalidParameter(
            "frame",
            name,
            "is a point on a link, where the model attaches nothing: name a link or a joint, "
            "what hangs beyond it is measured",
        )
    inside = frames_of_subtree(whole, name)
    joint = int(frame.parentJoint)
    everything = _carries_all(whole, name)
    if everything:
        inertia = whole.inertias[joint]
    else:
        inertia = pin.Inertia.Zero()
        for k in inside:
            part = whole.frames[k]
            if part.inertia.mass > 0:
                inertia = inertia + part.placement.act(part.inertia)
    data = whole.createData()
    pin.framesForwardKinematics(whole, data, q)
    pose = data.oMi[joint] * frame.placement

    def seen(inertia: pin.Inertia, joint: int) -> pin.Inertia:
        """In the frame; a massless one has no place."""
        return pose.actInv(data.oMi[joint]).act(inertia) if inertia.mass > 0 else inertia

    total = seen(inertia, joint)
    waiting = [
        c for c in _children(whole, joint) if everything or _parent_frame(whole, c) in inside
    ]
    children = []
    while waiting:
        child = waiting.pop()
        if model.existJointName(whole.names[child]):
            children.append(int(model.getJointId(whole.names[child])))
            continue
        # A locked one is a part of the body.
        total = total + seen(whole.inertias[child], child)
        inside |= {k for k, one in enumerate(whole.frames) if one.parentJoint == child}
        waiting += _children(whole, child)
    known = {(whole.frames[k].name, whole.frames[k].type) for k in inside}
    # The frame of a locked joint has become that of a fixed one.
    locked = {name for name, kind in known if kind == pin.FrameType.JOINT}
    frames = frozenset(
        k
        for k, one in enumerate(model.frames)
        if one.parentJoint == here.parentJoint
        and (
            (one.name, one.type) in known
            or (one.type == pin.FrameType.FIXED_JOINT and one.name in locked)
        )
    )
    inertia = here.placement.act(total) if total.mass > 0 else total
    return Subtree(int(here.parentJoint), here.placement, inertia, tuple(sorted(children)), frames)


def frames_of_subtree(model: pin.Model, name: str) -> set[int]:
    """Return the frames on the joint of the frame `name` that are attached to it, itself too."""
    first = find_frame(model, name)
    joint = model.frames[first].parentJoint
    on_joint = [k for k, one in enumerate(model.frames) if one.parentJoint == joint]
    if _carries_all(model, name):
        return set(on_joint)
    # The mass of a link on a fixed joint is with the frame of that joint.
    parent = int(model.frames[first].parentFrame)
    if (
        model.frames[first].type == pin.FrameType.BODY
        and model.frames[parent].type == pin.FrameType.FIXED_JOINT
        and parent > 0
    ):
        first = parent
    inside = {first}
    grown = True
    while grown:
        more = {k for k in on_joint if model.frames[k].parentFrame in inside} - inside
        inside |= more
        grown = bool(more)
    return inside


def _carries_all(model: pin.Model, name: str) -> bool:
    """Whether the frame is that of a joint or of the link that the joint moves."""
    number = find_frame(model, name)
    frame = model.frames[number]
    root = _joint_frame(model, int(frame.parentJoint))
    return number == root or (
        frame.type == pin.FrameType.BODY and frame.parentFrame == root and frame.parentJoint > 0
    )


def _children(model: pin.Model, joint: int) -> list[int]:
    return [c for c in range(1, model.njoints) if model.parents[c] == joint]


def _parent_frame(model: pin.Model, joint: int) -> int:
    """Return the number of the frame that the joint is attached to, -1 if the model says none."""
    own = _joint_frame(model, joint)
    return int(model.frames[own].parentFrame) if own >= 0 else -1


def _joint_frame(model: pin.Model, joint: int) -> int:
    """Return the number of the joint's own frame, -1 where it has none."""
    if joint == 0:
        return 0
    for k, one in enumerate(model.frames):
        if one.type == pin.FrameType.JOINT and one.parentJoint == joint:
            return k
    return -1
