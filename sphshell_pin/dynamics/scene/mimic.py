"""Joints that mimic others, q = ratio * q_other + offset, exactly: the others' coordinates remain.

A Pinocchio model with JointModelMimic has nq, nv, limits and torques of the remaining coordinates;
its joints and frames are those of the model in which every joint moves freely, in the same order.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from sphshell_pin.base.arrays import Array
from sphshell_pin.errors import SphshellError

# [rad, m] Between a joint's stated position and the one that its mimic rule gives it.
_OFF = 1e-6
_WITHOUT = "load the robot with mimic = false"

# Constant for every joint of a model. Limits are those of the joint that the others mimic.
_SUMMED_SQUARE = ("damping", "armature")
_LIMITS_OF_POSITION = ("lowerPositionLimit", "upperPositionLimit")
_LIMITS_OF_RATE = ("upperVelocityLimit", "lowerVelocityLimit")
_LIMITS_OF_EFFORT = ("lowerEffortLimit", "upperEffortLimit")


@dataclass(frozen=True)
class Mimic:
    """The joint `joint` is at `ratio` times the position of joint `of`, plus `offset` [rad, m]."""

    joint: str
    of: str
    ratio: float = 1.0
    offset: float = 0.0

    def __str__(self) -> str:
        """Say it as a formula."""
        offset = f" {self.offset:+g}" if self.offset else ""
        return f"'{self.joint}' = {self.ratio:g} * '{self.of}'{offset}"


def is_mimic(joint: pin.JointModel) -> bool:
    """Whether `joint` mimics another one, and has no coordinate of its own."""
    return bool(joint.shortname() == "JointModelMimic")


def mimics(model: pin.Model) -> dict[str, Mimic]:
    """Return the rule of every joint of `model` that mimics another, by its name."""
    leaders = {
        model.joints[j].idx_v: model.names[j]
        for j in range(1, model.njoints)
        if model.joints[j].nv > 0
    }
    found = {}
    for name, joint in zip(model.names, model.joints, strict=True):
        if is_mimic(joint):
            rule = joint.extract()
            found[name] = Mimic(name, leaders[joint.idx_v], float(rule.scaling), float(rule.offset))
    return found


def group_of(model: pin.Model, name: str) -> list[str]:
    """Return the joints that move with joint `name`: itself, what it mimics, what mimics that."""
    rules = mimics(model)
    leader = leader_of(rules, name)
    return [one for one in list(model.names)[1:] if leader_of(rules, one) == leader]


def leader_of(rules: dict[str, Mimic], name: str) -> str:
    """Return the joint whose coordinate moves joint `name`."""
    return rules[name].of if name in rules else name


def with_mimics(model: pin.Model, rules: Iterable[Mimic]) -> pin.Model:
    """Return a copy of `model` in which the joints of `rules` mimic others exactly.

    Rules may be chained. The coordinate of a group is that of its first joint in Pinocchio's order;
    its limits of position, speed and effort are those of the joint that the others mimic, its
    damping, dry friction and armature the sums over the group, as seen from that coordinate.

    Raises
    ------
    SphshellError
        A rule names a joint that does not exist or has several coordinates, mimics itself, or
        cannot be turned round.
    """
    rules = list(rules)
    made = model
    for root, members in _groups(model, rules).items():
        made = _grouped(model, made, root, members)
    if made is model:
        return pin.Model(model)
    for name, q in [(one.key(), one.data()) for one in model.referenceConfigurations]:
        made.referenceConfigurations[name] = shortened(made, np.asarray(q, dtype=float))
    return made


def count_of_all(model: pin.Model) -> int:
    """Return nq of the model in which mimic joints would move freely."""
    return sum(_widths(model))


def shortened(model: pin.Model, q_all: ArrayLike, *, check: bool = False) -> Array:
    """Return of the coordinates of all joints those (nq,) that `model` has.

    With `check`, SphshellError names the first mimic joint that is not where its rule puts it.
    """
    q_all = np.asarray(q_all, dtype=float)
    rules, at = mimics(model), {}
    place = 0
    for name, width in zip(list(model.names)[1:], _widths(model), strict=True):
        at[name] = q_all[place : place + width]
        place += width
    kept = [at[name] for name in list(model.names)[1:] if name not in rules]
    if check:
        for rule in rules.values():
            check_follows(rule, joint_angle(at[rule.joint]), joint_angle(at[rule.of]))
    return np.concatenate(kept) if kept else np.zeros(0)


def check_follows(rule: Mimic, value: float, of: float) -> None:
    """Raise SphshellError unless joint `rule.joint` at `value` follows `rule.of` at `of`."""
    wanted = rule.ratio * of + rule.offset
    if abs(value - wanted) > _OFF * max(1.0, abs(wanted)):
        raise SphshellError(
            f"joint '{rule.joint}' cannot be at {value:.9g}: it mimics '{rule.of}', {rule}, which "
            f"puts it at {wanted:.9g}; leave it out, or {_WITHOUT}"
        )


def joint_angle(value: Sequence[float] | Array) -> float:
    """Return the coordinate of a joint; of one that turns without end its angle, -pi to pi [rad].

    value : (1,), or (2,): its cosine and its sine
    """
    return float(value[0]) if len(value) == 1 else float(np.arctan2(value[1], value[0]))


def _widths(model: pin.Model) -> list[int]:
    """Return how many coordinates each joint has, a mimic joint those of what it mimics."""
    widths = {joint.idx_v: joint.nq for joint in list(model.joints)[1:] if joint.nv > 0}
    return [
        widths[joint.idx_v] if is_mimic(joint) else joint.nq for joint in list(model.joints)[1:]
    ]


def _groups(model: pin.Model, rules: list[Mimic]) -> dict[str, dict[str, tuple[float, float]]]:
    """Return, by the joint that all others mimic, ratio and offset of each of a group's joints."""
    names = set(list(model.names)[1:])
    by_name = {rule.joint: rule for rule in rules}
    groups: dict[str, dict[str, tuple[float, float]]] = {}
    for rule in by_name.values():
        said = f"joint '{rule.joint}' mimics '{rule.of}'"
        for name in (rule.joint, rule.of):
            if name not in names:
                why = f"{said}, but the robot has no joint '{name}' that moves"
                raise SphshellError(f"{why}: correct the name in the file, or {_WITHOUT}")
            if model.joints[model.getJointId(name)].nv != 1:
                raise SphshellError(
                    f"{said}, but '{name}' has several degrees of freedom: {_WITHOUT}"
                )
        ratio, offset, root, seen = rule.ratio, rule.offset, rule.of, {rule.joint}
        if not np.isfinite([ratio, offset]).all():
            raise SphshellError(f"{said} by no finite numbers")
        while root in by_name:
            if root in seen:
                why = f"{said}, which in the end mimics '{root}' again"
                raise SphshellError(f"{why}: one joint of a group must mimic none")
            seen.add(root)
            next_rule = by_name[root]
            ratio, offset = ratio * next_rule.ratio, ratio * next_rule.offset + offset
            root = next_rule.of
        groups.setdefault(root, {root: (1.0, 0.0)})[rule.joint] = (ratio, offset)
    return groups


def _grouped(
    model: pin.Model, made: pin.Model, root: str, members: dict[str, tuple[float, float]]
) -> pin.Model:
    """Return `made` with the joints `members` of `model` in one coordinate; all mimic `root`."""
    order = sorted(members, key=model.getJointId)
    leader = order[0]
    ratio, offset = members[leader]
    for name, (one, _) in members.items():
        if one == 0.0:
            why = f"joint '{name}' mimics '{root}' with multiplier 0"
            raise SphshellError(f"{why}: make it a fixed joint, or {_WITHOUT}")
    kinds = {model.joints[model.getJointId(name)].nq for name in order}
    if len(kinds) > 1:
        raise SphshellError(
            f"of the joints {', '.join(order)} some are continuous and some are not: Pinocchio "
            "lets none mimic the other; give all the same type, or load with mimic = false"
        )
    # q = a * q_leader + b, seen from the first joint.
    seen = {name: (a / ratio, b - a / ratio * offset) for name, (a, b) in members.items()}
    for name in order[1:]:
        made = pin.transformJointIntoMimic(
            made, made.getJointId(leader), made.getJointId(name), *map(float, seen[name])
        )
    _sum_up(model, made, leader, seen)
    if leader != root:
        _take_limits(model, made, leader, root, members[leader])
    return made


def _sum_up(
    model: pin.Model, made: pin.Model, leader: str, seen: dict[str, tuple[float, float]]
) -> None:
    at = made.joints[made.getJointId(leader)].idx_v
    from_v = {name: model.joints[model.getJointId(name)].idx_v for name in seen}
    for what in _SUMMED_SQUARE:
        of = np.asarray(getattr(model, what))
        _put(made, [what], at, [sum(a**2 * of[from_v[name]] for name, (a, _) in seen.items())])
    lower, upper = np.asarray(model.lowerDryFrictionLimit), np.asarray(model.upperDryFrictionLimit)
    ends = [
        sorted((a * lower[from_v[name]], a * upper[from_v[name]])) for name, (a, _) in seen.items()
    ]
    _put(made, ("lowerDryFrictionLimit", "upperDryFrictionLimit"), at, np.sum(ends, axis=0))


def _take_limits(
    model: pin.Model, made: pin.Model, leader: str, root: str, rule: tuple[float, float]
) -> None:
    """Give the coordinate of `leader`, q = a * q_root + b, the limits of `root`."""
    a, b = rule
    new, old = made.joints[made.getJointId(leader)], model.joints[model.getJointId(root)]
    with np.errstate(over="ignore"):
        if new.nq == 1:
            ends = sorted(a * getattr(model, name)[old.idx_q] + b for name in _LIMITS_OF_POSITION)
            _put(made, _LIMITS_OF_POSITION, new.idx_q, ends)
        rates = [abs(a) * getattr(model, name)[old.idx_v] for name in _LIMITS_OF_RATE]
        _put(made, _LIMITS_OF_RATE, new.idx_v, rates)
        efforts = sorted(getattr(model, name)[old.idx_v] / a for name in _LIMITS_OF_EFFORT)
        _put(made, _LIMITS_OF_EFFORT, new.idx_v, efforts)


def _put(model: pin.Model, names: Sequence[str], at: int, values: Iterable[float]) -> None:
    """Write an entry of each of the arrays called `names` of a model."""
    for name, value in zip(names, values, strict=True):
        array = np.array(getattr(model, name))
        array[at] = value
        setattr(model, name, array)
