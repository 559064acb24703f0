"""A draft of a scenario, tried: it touches, holds its force, and keeps links off the part."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.scenario.drafting.clearance import Links
from sphshell_pin.scenario.drafting.draft_text import HELD
from sphshell_pin.scenario.drafting.plan import Hold, Plan, Press
from sphshell_pin.scenario.drafting.tip_contact import GRAVITY
from sphshell_pin.scenario.format.bodies import joint_spans, to_se3
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.scenario.format.reach import Reach
from sphshell_pin.scenario.running.figures import judge
from sphshell_pin.scenario.running.run import simulate

# Rows at which links are held against the part.
_MOST_ROWS = 300
# Part of the lead-in after which the force is held, and of the rows that may be off it: a tip that
# starts to slide shakes for a moment.
_SETTLED, _SHAKEN = 0.6, 0.1
# Largest force of a first draft, as a part of the one that is asked for.
_PEAK = 1.5
# How far the tip may stay behind its path, in radii: its spring gives way by a fifth of one.
_BEHIND = 0.6
# Time at the end of a run in which a robot stands still [s]. Parts of a run in which fingers touch,
# and after which they have closed; how far the part may move from then on, in radii.
_LAST, _HELD, _CLOSED, _MOVED = 0.3, 0.9, 0.4, 0.2


@dataclass(frozen=True)
class Fault:
    """What fails in a draft: `kind` is "run", "touch", "force", "links", "path" or "figure"."""

    kind: str
    text: str
    """A clause that says what fails, with its values."""
    t: float = 0.0
    """When [s]."""
    link: str = ""
    cut: bool = False
    """Whether the effort limits cut what motors were to do."""


def try_out(built: Built, plan: Plan, links: Links) -> Fault | None:
    """Run a draft; return the first thing that fails, or None."""
    result, stopped = simulate(built)
    if stopped is not None:
        return Fault("run", f"the run stops: {stopped}")
    fault = (
        _touch_fault(plan, result)
        or _link_fault(built, plan, result, links)
        or _force_fault(built, plan, result)
        or _path_fault(built, plan, result)
        or _part_fault(built, plan, result)
        or figure_fault(built, result)
    )
    cut = any(one.cut_time for one in result.stats.joints.values())
    return None if fault is None else replace(fault, cut=cut)


def _touch_fault(plan: Plan, result: Result) -> Fault | None:
    times = {name: one.contact_time for name, one in result.stats.pairs.items()}
    least = min(times, key=times.__getitem__)
    if plan.part and times[least] < _HELD * plan.duration:
        return Fault("touch", f"'{least}' loses the part")
    if isinstance(plan.control, Hold) and len(times) == 2 and not times[least]:
        return Fault("touch", f"'{least}' comes down beside the surface")
    return None if any(times.values()) else Fault("touch", "the sphere never touches the surface")


def _part_fault(built: Built, plan: Plan, result: Result) -> Fault | None:
    """Say how far a part moves in the fingers that have closed on it, if it does."""
    if plan.part is None:
        return None
    span, _ = joint_spans(built.scene.model, "part/root_joint")
    held = result.q[result.t >= _CLOSED * plan.duration][:, span][:, :3]
    moved = float(np.linalg.norm(held - held[0], axis=1).max())
    if moved <= _MOVED * min(tip.radius for tip in plan.tips):
        return None
    return Fault("path", f"the part moves by {1e3 * moved:.2g} mm in the hand")


def _link_fault(built: Built, plan: Plan, result: Result, links: Links) -> Fault | None:
    placement = to_se3(built.scenario.shell[0].placement)
    some = slice(None, None, -(-len(result.t) // _MOST_ROWS))
    for k, (t, q) in enumerate(zip(result.t[some], result.q[some], strict=True)):
        if plan.part:
            span, _ = joint_spans(built.scene.model, "part/root_joint")
            placement = pin.XYZQUATToSE3(q[span])
        whole = whole_posture(built, q, links.model)
        found = links.within(whole, placement, whole=k == 0)
        if found is not None:
            return Fault("links", f"link '{found}' is in the part", float(t), found)
    return None


def _path_fault(built: Built, plan: Plan, result: Result) -> Fault | None:
    """Say where the tip is behind the end of its path, if it is."""
    control = plan.control
    if not isinstance(control, Press) or not control.slides:
        return None
    (tip,), (pair,) = plan.tips, built.scene.pairs
    reach = Reach(built.scene.model, tip.frame, tip.offset)
    away = pair.shells[0].placement.actInv(reach.center(result.q[-1])) - control.path[-1]
    behind = math.sqrt(max(float(away @ away) - tip.radius**2, 0.0))
    if behind < _BEHIND * tip.radius:
        return None
    reached = control.way.length - behind
    said = f"the tip stays {1e3 * behind:.2g} mm behind the end of its path"
    return Fault("path", said, control.lead_in + reached / control.speed)


def whole_posture(built: Built, q: Array, model: pin.Model) -> Array:
    """Return the configuration of the whole robot, a `model`, for that of the scene, q (nq,)."""
    whole, prefix = pin.neutral(model).copy(), built.scenario.robot[0].label
    moving, start = (built.scene.model, q), (built.assembly.model, built.assembly.q0)
    for name in list(model.names)[1:]:
        called = f"{prefix}/{name}" if prefix else name
        source, values = moving if moving[0].existJointName(called) else start
        whole[joint_spans(model, name)[0]] = values[joint_spans(source, called)[0]]
    return np.asarray(whole)


def _force_fault(built: Built, plan: Plan, result: Result) -> Fault | None:
    control, t = plan.control, result.t
    if isinstance(control, Press):
        force, after = control.force, t >= _SETTLED * control.lead_in
        what = f"the force of {force:g} N is not held"
    elif isinstance(control, Hold) and len(plan.tips) > 2 and plan.part is None:
        force = GRAVITY * float(pin.computeTotalMass(built.scene.model))
        after = t >= t[-1] - _LAST
        what = f"the weight of {force:.3g} N is not carried"
    else:
        return None
    forces = _forces(result)
    held, times = forces[after], t[after]
    off, mean = np.abs(held / force - 1), float(held.mean())
    if abs(mean / force - 1) > HELD:
        return Fault("force", f"{what}: the surface bears {mean:.3g} N on average")
    if (off > HELD).mean() > _SHAKEN or not held.all():
        when, worst = float(times[np.argmax(off)]), float(held[np.argmax(off)])
        return Fault("force", f"{what}: the surface bears {worst:.3g} N at t = {when:.3g} s", when)
    if isinstance(control, Press):
        # When it first touches, a hard tip may do no better.
        looked, times = (held, times) if control.repair else (forces, t)
        peak, when = float(looked.max()), float(times[np.argmax(looked)])
        if peak > _PEAK * force:
            return Fault("force", f"{what}: it rises to {peak:.3g} N", when)
    return None


def _forces(result: Result) -> Array:
    """Return the size of the resultant of all normal forces and friction's along it, (n,) [N]."""
    log = result.contacts
    normal = np.zeros((len(result.t), 3))
    total = np.zeros_like(normal)
    pushes = log.normal_force[:, None] * log.normal_world
    np.add.at(normal, log.row, pushes)
    np.add.at(total, log.row, pushes + log.friction_force_world)
    size = np.linalg.norm(normal, axis=1)
    along = np.einsum("ij,ij->i", normal, total)
    sizes: Array = np.divide(along, size, out=np.zeros_like(size), where=size > 0)
    return sizes


def figure_fault(built: Built, result: Result) -> Fault | None:
    """Say which of the scenario's expected figures is not met, if one is not."""
    for one in judge(built, result):
        if not one.met:
            return Fault("figure", f"{one.figure} is {one.measured:.3g}, not {one.expected}")
    return None
