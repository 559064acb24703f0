"""A draft of a scenario, tried: it touches, holds its force, and keeps links off the part."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.scenario.drafting.clearance import Links
from sphshell_pin.scenario.drafting.draft_text import HELD
from sphshell_pin.scenario.drafting.part import GRAVITY
from sphshell_pin.scenario.drafting.plan import Hold, Plan, Press
from sphshell_pin.scenario.drafting.vectors import unit
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
    """What fails in a draft: `kind` is "run", "touch", "force", "links", "path" or "figure".

    `text` is a clause that says it with its values, `t` [s] is when; `link` names a link that is in
    the part, and `cut` says whether the effort limits cut what motors were to do.
    """

    kind: str
    text: str
    t: float = 0.0
    link: str = ""
    cut: bool = False


def try_out(built: Built, plan: Plan, links: Links) -> Fault | None:
    """Run a draft; return the first thing that fails, or None."""
    result, stopped = simulate(built)
    if stopped is not None:
        return Fault("run", f"the run stops: {stopped}")
    cut = any(one.cut_time for one in result.stats.joints.values())
    return next((replace(one, cut=cut) for one in _faults(built, plan, result, links)), None)


def _faults(built: Built, plan: Plan, result: Result, links: Links) -> Iterator[Fault]:
    times = {name: one.contact_time for name, one in result.stats.pairs.items()}
    least = min(times, key=times.__getitem__)
    if plan.part and times[least] < _HELD * plan.duration:
        yield Fault("touch", f"'{least}' loses the part")
    if isinstance(plan.control, Hold) and len(times) == 2 and not times[least]:
        yield Fault("touch", f"'{least}' comes down beside the surface")
    if not any(times.values()):
        yield Fault("touch", "the sphere never touches the surface")
    root = joint_spans(built.scene.model, "part/root_joint")[0] if plan.part else slice(0)
    placement = to_se3(built.scenario.shell[0].placement)
    for k in range(0, len(result.t), -(-len(result.t) // _MOST_ROWS)):
        q = result.q[k]
        placement = pin.XYZQUATToSE3(q[root]) if plan.part else placement
        found = links.within(whole_posture(built, q, links.model), placement, whole=k == 0)
        if found is not None:
            yield Fault("links", f"link '{found}' is in the part", float(result.t[k]), found)
    if fault := _force_fault(built, plan, result) or _path_fault(built, plan, result):
        yield fault
    if plan.part:
        # The fingers have closed on it by then.
        held = result.q[result.t >= _CLOSED * plan.duration][:, root][:, :3]
        away = float(np.linalg.norm(held - held[0], axis=1).max())
        if away > _MOVED * min(tip.radius for tip in plan.tips):
            yield Fault("path", f"the part moves by {1e3 * away:.2g} mm in the hand")
    for one in judge(built, result):
        if not one.met:
            yield Fault("figure", f"{one.figure} is {one.measured:.3g}, not {one.expected}")


def _path_fault(built: Built, plan: Plan, result: Result) -> Fault | None:
    """Say where the tip is behind the end of its path, if it is."""
    control = plan.control
    if not isinstance(control, Press) or not control.slides:
        return None
    (tip,), (pair,) = plan.tips, built.scene.pairs
    reach = Reach(built.scene.model, tip.frame, tip.offset)
    away = pair.shells[0].placement.actInv(reach.center(result.q[-1])) - control.path[-1]
    behind = math.sqrt(max(float(away @ away) - tip.radius**2, 0.0))
    when = control.lead_in + (control.way.length - behind) / control.speed
    said = f"the tip stays {1e3 * behind:.2g} mm behind the end of its path"
    return Fault("path", said, when) if behind >= _BEHIND * tip.radius else None


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
    return np.asarray(np.einsum("ij,ij->i", unit(normal), total))
