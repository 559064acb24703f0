"""Where a robot carries its sphere: known fingertips and feet, or the end of its only limb."""

import math
import re
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.mimic import group_of
from sphshell_pin.dynamics.scene.models import find_frame, frame_on_joint, joint_of, model_reach
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import TIPS, LoadedRobot, end_spheres, fingertips, floats
from sphshell_pin.scenario.drafting.limb_ends import (
    AT_TIP,
    LinkGeometry,
    Tip,
    gripper_joints,
    sphere_centers,
)
from sphshell_pin.scenario.drafting.wording import mm

_ASKED, _OF_GEOMETRY = "as it was asked for", "the sphere of its collision geometry"
_SMALLER = "smaller than that of its collision geometry, as it was asked for"
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
    model = robot.model
    if not model.nv:
        raise SphshellError("the robot has no joint: let its root float with --base floating")
    held = gripper_joints(model)
    limbs = _limbs(model, held)
    known = _tips_of(robot, shipped)
    known = [one for one in known if joint_of(model, one.frame) not in {0, *held}]
    if frame is not None:
        find_frame(model, frame)
        known = [one for one in known if one.frame == frame]
    elif not floats(model):
        known = _outermost(model, [one for one in known if joint_of(model, one.frame) in limbs])
    if known and offset is not None:
        known = [replace(known[0], offset=offset, source=_ASKED)]
    elif radius and shipped is None:
        # A smaller sphere than that of the collision geometry would be inside it.
        for k, one in enumerate(known):
            known[k] = _at_end(robot, one.frame, _SMALLER, radius) if radius < one.radius else one
    if not known:
        ends = [(frame, _ASKED)] if frame else _ends(model, held, limbs)
        chosen = ends if floats(model) else ends[:1]
        known = [_at_end(robot, *one, radius, offset) for one in chosen]
        if ends[0][1] == _LOWEST:
            bottoms = sphere_centers(model, robot.q0, known)[:, 2] - [one.radius for one in known]
            low = bottoms <= bottoms.min() + _AS_LOW * model_reach(model)
            known = [known[k] for k in np.flatnonzero(low)]
    if radius is not None:
        for k, one in enumerate(known):
            # A center that stands one radius before the frame goes on touching it.
            touching = one.radius and abs(np.linalg.norm(one.offset) - one.radius) < 1e-9
            at = one.offset * (radius / one.radius) if touching else one.offset
            known[k] = Tip(one.frame, radius, at, one.source)
    # The sphere of a shipped robot is where it belongs, whatever size is asked for.
    for one in known if shipped is None or offset is not None else ():
        _check_outside(robot, one)
    return known


def other_ends(model: pin.Model, frame: str) -> list[str]:
    """Return the frames at the ends of other limbs than that of `frame`, the likeliest first."""
    held = gripper_joints(model)
    found = {joint_of(model, frame): frame}
    for name, _ in _ends(model, held, _limbs(model, held)):
        found.setdefault(joint_of(model, name), name)
    return list(found.values())[1:]


def only_turns(model: pin.Model) -> bool:
    """Whether what its body carries only turns, without end: rotors or wheels, and what tilts them.

    Limbs of at most two joints, the last without limits, and lighter than the body; a single one
    much.
    """
    first = 2 if floats(model) else 1
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    leaves = _leaves(model)
    # A range of 0 is that of a sensor, which a simulator keeps by a joint.
    places = {j: model.joints[j] for j in leaves - {first - 1}}
    turns = {j for j, one in places.items() if one.nq != 1 or low[one.idx_q] < high[one.idx_q]}
    depths = [len(model.supports[j]) - first for j in turns or leaves]
    endless = all(_is_endless(model, j) for j in turns or leaves)
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
    tips = _tips_of(robot, None)
    if len(tips) > 1:
        return tips
    frames = [frame_on_joint(robot.model, joint) for joint in sorted(_leaves(robot.model))]
    links = [LinkGeometry(robot, frame) for frame in frames if frame is not None]
    return [link.end() for link in links if len(link.corners)]


def _tips_of(robot: LoadedRobot, shipped: str | None) -> list[Tip]:
    """Return the spheres that are known of a `shipped` robot, else those of collision geometry."""
    known = shipped in TIPS and fingertips(shipped)
    source = "a fingertip this package knows of" if known else _OF_GEOMETRY
    spheres = known or end_spheres(robot)
    return [Tip(one.frame, one.radius, np.array(one.offset), source) for one in spheres]


def _at_end(
    robot: LoadedRobot, frame: str, source: str, radius: float | None, offset: Array | None = None
) -> Tip:
    """Return a sphere at the end of the link of `frame`.

    At the frame itself where that is before the link, or asked for with a radius.
    """
    link, asked = LinkGeometry(robot, frame), source == _ASKED
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
    link = LinkGeometry(robot, tip.frame)
    depth = link.depth(tip.offset)
    if depth > AT_TIP * tip.radius and joint_of(robot.model, tip.frame):
        end = link.end()
        x, y, z = (float(f"{one:.4f}") + 0.0 for one in end.offset)
        raise SphshellError(
            f"the sphere of radius {mm(tip.radius)} on frame '{tip.frame}' is inside link "
            f"'{link.link}', its center {mm(depth)} deep: it can touch nothing; a ball at the end "
            f"of this link: --frame {tip.frame} --offset {x:g} {y:g} {z:g} --radius {end.radius:g}"
        )


def _outermost(model: pin.Model, tips: Sequence[Tip]) -> list[Tip]:
    """Return that of the `tips` beside the first one which is farthest from their joint."""

    def away(tip: Tip) -> float:
        placement = model.frames[find_frame(model, tip.frame)].placement
        return float(np.linalg.norm(placement.act(tip.offset)))

    beside = [t for t in tips if joint_of(model, t.frame) == joint_of(model, tips[0].frame)]
    return sorted(beside, key=away, reverse=True)[:1]


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
    limbs = set(chains) if floats(model) else longest & set(chains)
    for j, chain in chains.items():
        own = chain - longest
        wheels = all(_is_endless(model, one) for one in own)
        wheels = wheels and not all(_is_endless(model, one) for one in longest)
        if not wheels and 2 * len(own) > len(longest - chain):
            limbs.add(j)
    return limbs


def _freest_first(model: pin.Model, names: Sequence[str]) -> list[str]:
    """Return frames, those farthest from the others first: of fingertips, the thumb's."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    frames = [data.oMf[find_frame(model, name)] for name in names]
    places = np.reshape([frame.translation for frame in frames], (-1, 3))
    away = np.linalg.norm(places[:, None] - places, axis=-1).round(6)
    away[away == 0.0] = np.inf  # two frames at one place
    return [names[k] for k in np.argsort(-away.min(axis=1, initial=np.inf), kind="stable")]


def _ends(model: pin.Model, held: Collection[int], limbs: Collection[int]) -> list[tuple[str, str]]:
    """Return the frames at the ends of the `limbs` that may be meant, and why.

    The joints `held` are those of grippers, whose jaws are no ends. Of a robot with a fixed base
    the likeliest comes first; one that floats is meant to stand on all.
    """
    free = floats(model)
    if free and only_turns(model):
        return [(frame_on_joint(model, 1) or model.names[1], "its body, beside rotors or wheels")]
    leaves = sorted(_leaves(model, held), key=lambda j: (-len(model.supports[j]), j))
    carriers = {int(one.parentFrame) for one in model.frames}
    childless = [one for i, one in enumerate(model.frames) if i not in carriers]
    childless = [one for one in childless if int(one.parentJoint) in limbs]
    names = [one.name for one in childless if int(one.parentJoint) in leaves]
    found = list[tuple[str, str]]()
    for word in () if free else _TOOL_WORDS:
        begins = re.compile(rf"(?<![a-z0-9]){word}{'(?![a-z0-9])' if len(word) == 2 else ''}")
        tools = [one for one in childless if begins.search(one.name.lower())]
        tools.sort(key=lambda one: (-len(model.supports[one.parentJoint]), len(one.name)))
        several = f", one of {len(tools)}" if len(tools) > 1 else ""
        found += [(one.name, f"a frame called '{word}'{several}") for one in tools]
    if len(names) == 1 or (names and model.njoints == 2):
        only = "the only end of the robot" if len(names) == 1 else "its only body"
        return [*found, (names[0], only)]
    for word in _FOOT_WORDS if free else _END_WORDS:
        called = [name for name in names if word in name.lower()]
        if free and called:
            return [(name, f"an end of the robot called '{word}'") for name in called]
        some = f"the freest of {len(called)} ends" if len(called) > 1 else "an end of the robot"
        found += [(name, f"{some} called '{word}'") for name in _freest_first(model, called)]
    if names and {model.names[j] for j in leaves} <= set(group_of(model, model.names[leaves[0]])):
        return [*found, (names[0], f"one of {len(leaves)} ends that move together")]
    if free:
        return [(name, _LOWEST) for name in names or [model.names[j] for j in leaves]]
    if names and len(model.supports[leaves[0]]) <= 2:
        which = f"the freest of {len(names)} ends, others: --frame"
        return [*found, *((name, which) for name in _freest_first(model, names))]
    which = "only limb" if len(leaves) == 1 else f"longest of {len(leaves)} limbs"
    return [*found, *((model.names[j], f"the end of the {which}") for j in leaves if j in limbs)]
