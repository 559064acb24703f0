"""Where a robot carries its sphere: known fingertips and feet, or the end of its only limb."""

import math
import re
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.contact import Sphere
from sphshell_pin.dynamics.scene.mimic import group_of
from sphshell_pin.dynamics.scene.models import find_frame, frame_on_joint, model_reach
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import TIPS, LoadedRobot, end_spheres, fingertips, floats
from sphshell_pin.scenario.drafting.limb_ends import (
    AT_TIP,
    LinkGeometry,
    Tip,
    gripper_joints,
    joint_of,
)

_ASKED, _OF_GEOMETRY = "as it was asked for", "the sphere of its collision geometry"
_LOWEST, _AS_LOW = "one of its lowest ends", 0.1
"""Ends on which a robot stands, where no name says which: by height, as a part of its reach."""
# Beginnings of words in the names of frames that mark a tool, in the order of trust; of frames at
# the end of a limb.
_TOOL_WORDS = ("tcp", "tool", "ee", "eef", "effector", "grasp", "grip", "flange")
# How many times as heavy as its only limb a body is that carries a wheel, and is no foot of an arm.
_MUCH = 10.0
_FOOT_WORDS = ("foot", "feet", "ankle")
_END_WORDS = ("tip", "tcp", "tool", *_FOOT_WORDS)


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
        Which frame cannot be found out, or the sphere is inside its own link.
    """
    if not robot.model.nv:
        raise SphshellError("the robot has no joint: let its root float with --base floating")
    held = gripper_joints(robot.model)
    limbs = _limbs(robot.model, held)
    if shipped in TIPS:
        known = _carried(fingertips(shipped), "a fingertip this package knows of")
    else:
        known = _carried(end_spheres(robot), _OF_GEOMETRY)
    known = [one for one in known if joint_of(robot.model, one.frame) not in {0, *held}]
    if frame is not None:
        find_frame(robot.model, frame)
        known = [one for one in known if one.frame == frame]
    elif not floats(robot.model):
        known = _outermost(
            [one for one in known if joint_of(robot.model, one.frame) in limbs], robot
        )
    if known and offset is not None:
        known = [replace(known[0], offset=offset, source=_ASKED)]
    # A smaller sphere than that of the collision geometry would be inside it.
    smaller = [one for one in known if offset is None and radius and radius < one.radius]
    if smaller and shipped is None:
        known = [_at_end(robot, one.frame, _ASKED, radius, None, asked=False) for one in smaller]
    if not known:
        names = _ends(robot.model, held, limbs) if frame is None else [(frame, _ASKED)]
        known = [_at_end(robot, *one, radius, offset, asked=frame is not None) for one in names]
        known = _lowest(robot, known) if names[0][1] == _LOWEST else known
    found = [_sized(one, radius) for one in known]
    # The sphere of a shipped robot is where it belongs, whatever size is asked for.
    for one in found if shipped is None or offset is not None else ():
        _check_outside(robot, one)
    return found


def other_ends(model: pin.Model, frame: str) -> list[str]:
    """Return the frames at the ends of other limbs than that of `frame`, the likeliest first."""
    held, used, found = gripper_joints(model), {joint_of(model, frame)}, list[str]()
    with suppress(SphshellError):  # it does not say which one
        while _leaves(model, held) - used:
            limbs = set(range(1, model.njoints)) - used - held
            name = _ends(model, held, limbs)[0][0]
            if joint_of(model, name) in used:
                break
            used.add(joint_of(model, name))
            found.append(name)
    return found


def only_turns(model: pin.Model) -> bool:
    """Whether what its body carries only turns, without end: rotors or wheels, and what tilts them.

    Limbs of at most two joints, the last without limits, and lighter than the body; a single one
    much.
    """
    first = 2 if floats(model) else 1
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    # A range of 0 is that of a sensor, which a simulator keeps by a joint.
    turns = {
        j
        for j in _leaves(model) - {first - 1}
        if model.joints[j].nq != 1 or low[model.joints[j].idx_q] < high[model.joints[j].idx_q]
    }
    leaves = turns or _leaves(model)
    depths = [len(model.supports[j]) - first for j in leaves]
    endless = all(_is_endless(model, j) for j in leaves)
    carried = sum(one.mass for one in list(model.inertias)[first:])
    heavy = model.inertias[first - 1].mass > carried * (1 if len(depths) > 1 else _MUCH)
    return endless and heavy and max(depths, default=3) <= 2


def _is_endless(model: pin.Model, joint: int) -> bool:
    """Whether a joint turns without end, about whatever axis: by a cosine and a sine."""
    return bool(model.joints[joint].nq == 2 and model.joints[joint].nv == 1)


def every_finger(robot: LoadedRobot) -> list[Tip]:
    """Return the fingertips of a hand: spheres of its collision geometry, else at links' ends.

    A ball at the end of each link that has geometry and carries no further joint.
    """
    model, tips = robot.model, _carried(end_spheres(robot), _OF_GEOMETRY)
    if len(tips) > 1:
        return tips
    tips = []
    for joint in sorted(_leaves(model)):
        frame = frame_on_joint(model, joint)
        link = None if frame is None else LinkGeometry(robot, frame)
        if link is not None and frame is not None and len(link.corners):
            tips.append(link.end())
    return tips


def _at_end(
    robot: LoadedRobot,
    frame: str,
    source: str,
    radius: float | None,
    offset: Array | None,
    *,
    asked: bool,
) -> Tip:
    """Return a sphere at the end of the link of `frame`.

    At the frame itself where that is before the link, or `asked` for with a radius.
    """
    link = LinkGeometry(robot, frame)
    end = link.end(radius)
    if offset is not None:
        return replace(end, offset=offset, source=_ASKED, ahead=None)
    placed = not robot.model.frames[find_frame(robot.model, frame)].placement.isIdentity()
    placed = placed and link.link != frame  # a body of an MJCF may be anywhere beside its joint
    before = placed and -math.inf < link.depth(np.zeros(3)) < -0.5 * end.radius
    if before or (asked and radius):
        still = None if radius else np.zeros(3)
        return replace(end, offset=np.zeros(3), source=source, ahead=still)
    return end if asked else replace(end, source=f"{source}; {end.source}")


def _check_outside(robot: LoadedRobot, tip: Tip) -> None:
    """Raise SphshellError for a sphere that is inside its own link, where it touches nothing."""
    if joint_of(robot.model, tip.frame) == 0:
        return
    link = LinkGeometry(robot, tip.frame)
    depth = link.depth(tip.offset)
    if depth > AT_TIP * tip.radius:
        end = link.end()
        x, y, z = (float(f"{one:.4f}") + 0.0 for one in end.offset)
        raise SphshellError(
            f"the sphere of radius {1e3 * tip.radius:.3g} mm on frame '{tip.frame}' is inside link "
            f"'{link.link}', its center {1e3 * depth:.3g} mm deep: it can touch nothing; a ball at "
            f"the end of this link: --frame {tip.frame} --offset {x:g} {y:g} {z:g} --radius "
            f"{end.radius:g}"
        )


def _outermost(tips: Sequence[Tip], robot: LoadedRobot) -> list[Tip]:
    """Return that of the `tips` beside the first one which is farthest from their joint."""
    frames = [robot.model.frames[find_frame(robot.model, tip.frame)] for tip in tips]
    away = [
        float(np.linalg.norm(frame.placement.act(tip.offset)))
        if frame.parentJoint == frames[0].parentJoint
        else -1.0
        for tip, frame in zip(tips, frames, strict=True)
    ]
    return [tips[int(np.argmax(away))]] if tips else []


def _lowest(robot: LoadedRobot, tips: Sequence[Tip]) -> list[Tip]:
    """Return those of the `tips` that are as low as the lowest one."""
    model, data = robot.model, robot.model.createData()
    pin.framesForwardKinematics(model, data, robot.q0)
    heights = [data.oMf[find_frame(model, t.frame)].act(t.offset)[2] - t.radius for t in tips]
    most = min(heights) + _AS_LOW * model_reach(model)
    return [tip for tip, height in zip(tips, heights, strict=True) if height <= most]


def _carried(spheres: Sequence[Sphere], source: str) -> list[Tip]:
    return [Tip(one.frame, one.radius, np.array(one.offset), source) for one in spheres]


def _sized(tip: Tip, radius: float | None) -> Tip:
    if radius is None:
        return tip
    # A center that stands one radius before the frame goes on touching it.
    touching = tip.radius and abs(np.linalg.norm(tip.offset) - tip.radius) < 1e-9
    offset = tip.offset * (radius / tip.radius) if touching else tip.offset
    return Tip(tip.frame, radius, offset, tip.source)


def _leaves(model: pin.Model, held: Collection[int] = ()) -> set[int]:
    """Return the joints without `held` that carry no further one."""
    left = set(range(1, model.njoints)) - set(held)
    return left - {int(model.parents[one]) for one in left}


def _limbs(model: pin.Model, held: Collection[int]) -> set[int]:
    """Return the joints without `held` whose links may be a tip: not a head or a caster by an arm.

    From where it parts from the longest chain of joints, its own is more than half as long as what
    is left of that one, and unlike that one does not turn without end alone; all joints of a robot
    that floats.
    """
    chains = {
        j: set(map(int, model.supports[j])) - {0} for j in range(1, model.njoints) if j not in held
    }
    longest = max(chains.values(), key=len, default=set())

    def endless(chain: set[int]) -> bool:
        return all(_is_endless(model, j) for j in chain)

    def is_limb(chain: set[int]) -> bool:
        own = chain - longest
        wheels = endless(own) and not endless(longest)
        return not own or (not wheels and 2 * len(own) > len(longest - chain))

    return {j for j, chain in chains.items() if floats(model) or is_limb(chain)}


def _freest(model: pin.Model, names: Sequence[str]) -> str:
    """Return the frame that is farthest from the others: of fingertips, the thumb's."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    places = np.array([data.oMf[find_frame(model, name)].translation for name in names])
    away = np.linalg.norm(places[:, None] - places, axis=2).round(6)
    away[away == 0.0] = np.inf  # two frames at one place
    return names[int(np.argmax(away.min(axis=1)))]


def _ends(model: pin.Model, held: Collection[int], limbs: Collection[int]) -> list[tuple[str, str]]:
    """Return the frames at the ends of the `limbs` that may be meant, and why.

    The joints `held` are those of grippers, whose jaws are no ends.
    """
    leaves, free = _leaves(model, held), floats(model)
    if free and only_turns(model):
        return [(frame_on_joint(model, 1) or model.names[1], "its body, beside rotors or wheels")]
    carriers = {int(one.parentFrame) for one in model.frames}
    childless = [
        one
        for i, one in enumerate(model.frames)
        if int(one.parentJoint) in limbs and i not in carriers
    ]
    names = [one.name for one in childless if int(one.parentJoint) in leaves]
    for word in () if free else _TOOL_WORDS:
        begins = re.compile(rf"(?<![a-z0-9]){word}{'(?![a-z0-9])' if len(word) == 2 else ''}")
        tools = [one for one in childless if begins.search(one.name.lower())]
        if tools:
            tools.sort(key=lambda one: (-len(model.supports[one.parentJoint]), len(one.name)))
            several = f", one of {len(tools)}" if len(tools) > 1 else ""
            return [(tools[0].name, f"a frame called '{word}'{several}")]
    jaws = {int(model.parents[one]) for one in held} - set(held)
    if not names and len(leaves) == 1 and leaves <= jaws:
        (joint,) = leaves
        return [(frame_on_joint(model, joint) or model.names[joint], "what carries the gripper")]
    if len(names) == 1 or (names and model.njoints == 2):
        return [(names[0], "the only end of the robot" if len(names) == 1 else "its only body")]
    for word in _FOOT_WORDS if free else _END_WORDS:
        found = [name for name in names if word in name.lower()]
        if len(found) > 1 and not free:
            return [(_freest(model, found), f"the freest of {len(found)} ends called '{word}'")]
        if found:
            return [(name, f"an end of the robot called '{word}'") for name in found]
    last = max(sorted(leaves), key=lambda j: len(model.supports[j]))
    if names and {model.names[j] for j in leaves} <= set(group_of(model, model.names[last])):
        return [(names[0], f"one of {len(leaves)} ends that move together")]
    if free and len(names) > 1:
        return [(name, _LOWEST) for name in names]
    if free or len(model.supports[last]) <= 2:
        if names:
            return [(_freest(model, names), f"the freest of {len(names)} ends, others: --frame")]
        raise SphshellError(
            "the robot has several ends: state which frame carries the sphere with --frame, for "
            f"instance one of {', '.join(frame.name for frame in model.frames)}"
        )
    which = "only limb" if len(leaves) == 1 else f"longest of {len(leaves)} limbs"
    return [(str(model.names[last]), f"the end of the {which}")]
