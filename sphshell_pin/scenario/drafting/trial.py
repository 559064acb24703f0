"""A draft of a scenario, tried: it touches, holds its force, and keeps links off the part."""

import math
from dataclasses import dataclass

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
# How far the tip may stay behind its path, in radii: its spring gives way by a fifth of one.
_BEHIND = 0.6
# Time at the end of a run in which a robot stands still [s].
_LAST = 0.3


@dataclass(frozen=True)
class Fault:
    """What fails in a draft: `kind` is "run", "touch", "force", "links", "path" or "figure"."""

    kind: str
    text: str
    """A clause that says what fails, with its values."""
    t: float = 0.0
    """When [s]."""
    link: str = ""
    excess: bool = False
    """Whether the force is too large: nothing in the joints keeps it off."""


def try_out(built: Built, plan: Plan, links: Links) -> Fault | None:
    """Run a draft; return the first thing that fails, or None."""
    result, stopped = simulate(built)
    if stopped is not None:
        return Fault("run", f"the run stops: {stopped}")
    return (
        _touch_fault(result)
        or _link_fault(built, result, links)
        or _force_fault(built, plan, result)
        or _path_fault(built, plan, result)
        or figure_fault(built, result)
    )


def _touch_fault(result: Result) -> Fault | None:
    if any(one.contact_time > 0 for one in result.stats.pairs.values()):
        return None
    return Fault("touch", "the sphere never touches the surface")


def _link_fault(built: Built, result: Result, links: Links) -> Fault | None:
    placement = to_se3(built.scenario.shell[0].placement)
    some = slice(None, None, -(-len(result.t) // _MOST_ROWS))
    for k, (t, q) in enumerate(zip(result.t[some], result.q[some], strict=True)):
        found = links.within(whole_posture(built, q), placement, whole=k == 0)
        if found is not None:
            return Fault("links", f"link '{found.link}' is in the part", float(t), found.link)
    return None


def _path_fault(built: Built, plan: Plan, result: Result) -> Fault | None:
    """Say where the tip is behind the end of its path, if it is."""
    control = plan.control
    if not isinstance(control, Press) or len(control.path) < 2:
        return None
    (tip,), (pair,) = plan.tips, built.scene.pairs
    reach = Reach(built.scene.model, tip.frame, tip.offset)
    away = pair.shells[0].placement.actInv(reach.center(result.q[-1])) - control.path[-1]
    behind = math.sqrt(max(float(away @ away) - tip.radius**2, 0.0))
    if behind < _BEHIND * tip.radius:
        return None
    return Fault("path", f"the tip stays {1e3 * behind:.2g} mm behind the end of its path")


def whole_posture(built: Built, q: Array) -> Array:
    """Return the configuration of the whole robot for that of the scene, q (nq,)."""
    whole, model = built.assembly.q0.copy(), built.scene.model
    for name in list(model.names)[1:]:
        to_q, _ = joint_spans(built.assembly.model, name)
        from_q, _ = joint_spans(model, name)
        whole[to_q] = q[from_q]
    return whole


def _force_fault(built: Built, plan: Plan, result: Result) -> Fault | None:
    control, t = plan.control, result.t
    if isinstance(control, Press):
        force, after = control.force, t >= _SETTLED * control.lead_in
        what = f"the force of {force:g} N is not held"
    elif isinstance(control, Hold) and len(plan.tips) > 2:
        force = GRAVITY * float(pin.computeTotalMass(built.scene.model))
        after = t >= t[-1] - _LAST
        what = f"the weight of {force:.3g} N is not carried"
    else:
        return None
    held = _forces(result)[after]
    off = np.abs(held / force - 1) > HELD
    if (held == 0).any():
        k = int(np.flatnonzero(held == 0)[0])
        return Fault("force", f"{what}: nothing touches at t = {t[after][k]:.3g} s")
    mean = float(held.mean())
    if abs(mean / force - 1) > HELD:
        text = f"{what}: the surface bears {mean:.3g} N on average"
        return Fault("force", text, excess=mean > force)
    if off.mean() > _SHAKEN:
        k = int(np.argmax(np.abs(held / force - 1)))
        return Fault(
            "force", f"{what}: the surface bears {held[k]:.3g} N at t = {t[after][k]:.3g} s"
        )
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
