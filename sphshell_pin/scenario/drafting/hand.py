"""A new scenario in which a hand holds a free part between all its fingertips."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.materials import find_material, friction_between
from sphshell_pin.dynamics.scene.mimic import mimics
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import LoadedRobot, floats
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.clearance import Links, SelfContact
from sphshell_pin.scenario.drafting.fingertips import every_finger
from sphshell_pin.scenario.drafting.force_balance import least_friction
from sphshell_pin.scenario.drafting.grasp import Grasp, Hand, grasps
from sphshell_pin.scenario.drafting.hand_text import DURATION, GAP, HandDraft
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.part import Part, part_file
from sphshell_pin.scenario.drafting.pose_search import Working, stated_kinds
from sphshell_pin.scenario.drafting.tip_contact import GRAVITY
from sphshell_pin.scenario.drafting.trial import figure_fault
from sphshell_pin.scenario.format.bodies import joint_spans
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.scenario.format.schema import RobotSection
from sphshell_pin.scenario.running.run import simulate
from sphshell_pin.shell.shell import Shell

# Weights that friction could carry under the forces by default.
_SAFETY = 3.0
# Grasps that are run; the part of a run after which the hand holds, and how far the part may move
# from then on, in radii.
_MOST_RUNS, _SETTLED, _MOVED = 6, 0.4, 0.2


class CannotHold(SphshellError):
    """No grasp of all fingertips that were asked for holds the part."""


def every_tip(robot: LoadedRobot, asked: Asked) -> list[Tip]:
    """Return all fingertips of `robot`.

    SphshellError for fewer than two, and for options that belong to a single one.
    """
    for option in ("frame", "radius", "place"):
        if getattr(asked, option) is not None:
            raise SphshellError(f"--{option} belongs to a single tip: leave it out with --tips all")
    tips = every_finger(robot)
    if len(tips) < 2:
        raise SphshellError(
            "--tips all needs two fingertips or more, links with geometry that carry no further "
            f"joint; this robot has {len(tips)}"
        )
    return tips


def hold_in_hand(
    asked: Asked, built: Built, tips: Sequence[Tip], name: str, make: Callable[[str, Built], Built]
) -> Working:
    """Return a scenario `name` in which the `tips` of a robot hold the surface of `built`.

    The largest normal force of a tip is what is asked for; `make(text, reuse)` builds a text. Each
    draft is run; the first that holds the part is taken. Where all tips cannot, those do without
    the fingers of the fewest joints, three at least.

    Raises
    ------
    SphshellError
        None does; the text says why, and what to change.
    """
    ranks = Hand(built.assembly.model, tips).ranks()
    order = sorted(range(len(tips)), key=lambda k: -len(ranks[k]))
    refused, last = "", CannotHold()
    for count in range(len(tips), min(len(tips), 3) - 1, -1):
        some = [tips[k] for k in sorted(order[:count])]
        try:
            found = _held(asked, built, some, name, make)
        except CannotHold as error:
            refused, last = refused or str(error), error
            continue
        if refused:
            note = f"{count} of {len(tips)} fingertips hold it: {refused.partition(';')[0]}"
            found = found._replace(why=(note, *found.why))
        return found
    raise last


def _held(
    asked: Asked, built: Built, tips: Sequence[Tip], name: str, make: Callable[[str, Built], Built]
) -> Working:
    """Return a scenario in which all of the `tips` hold the surface; CannotHold if none works."""
    materials = find_material(asked.material or "rubber"), find_material(asked.against)
    press = asked.press
    model = built.assembly.model
    if floats(model):
        raise SphshellError("a hand with a free root cannot hold a part: leave out --base")
    (shell,) = built.shells.values()
    part = Part.of(shell, materials[1])
    hand = Hand(model, tips)
    mu, _ = friction_between(*materials)
    total = _SAFETY * part.mass * GRAVITY / mu if press is None else 2.0 * press
    hand_geometry = built.assembly.loaded[0].collision_model
    rules = mimics(model)
    moving = {model.names[j] for j in hand.joints}
    lock = tuple(name for name in list(model.names)[1:] if name not in rules and name not in moving)
    links = Links(model, hand_geometry, shell, tips, lock)
    touching = SelfContact(model, hand_geometry, built.assembly.q0)
    blocked: list[str] = []

    def free_of_part(q: Array, placement: pin.SE3) -> bool:
        found = links.within(q, placement, whole=True)
        if found is not None:
            blocked.append(found.link)
        return found is None

    found = grasps(
        hand,
        built.assembly.q0,
        shell,
        part.weight,
        total,
        mu,
        GAP,
        lambda q: not touching.found(q),
        free_of_part,
    )
    if not found:
        raise _no_grasp(shell, len(tips), blocked)
    reuse = _with_part(built, part, name)
    kinds = stated_kinds(model, lock)
    fault = ""
    for one in found[:_MOST_RUNS]:
        grasp = _pressed(one, part, press, mu)
        draft = HandDraft(built, hand, grasp, part, materials, lock, name)
        fault = draft.fault()
        if fault:
            continue
        for joints in draft.choices(kinds):
            text = draft.text(joints)
            made = make(text, reuse)
            fault = _try(made, draft, links)
            if not fault:
                return Working(text, made, draft.why(kinds, joints), part.urdf())
    raise CannotHold(
        f"no grasp of {min(len(found), _MOST_RUNS)} that were tried works: {fault}; a lighter "
        "--against, another --press, or a smaller part"
    )


def _no_grasp(shell: Shell, count: int, blocked: Sequence[str]) -> CannotHold:
    sizes = " x ".join(f"{1e3 * one:.3g}" for one in shell.box[1] - shell.box[0])
    if blocked:
        link = max(set(blocked), key=blocked.count)
        return CannotHold(
            f"link '{link}' would be in the part, or another one, wherever all {count} fingertips "
            f"touch it and could hold it: take a part of another size than {sizes} mm"
        )
    return CannotHold(
        f"the {count} fingertips cannot hold a part of {sizes} mm: nowhere that was tried do all "
        "touch it with forces inside their friction cones; take a part of another size, or its "
        "--unit"
    )


def _with_part(built: Built, part: Part, name: str) -> Built:
    """Return `built` with the part as a second robot, so that neither is read from files."""
    loaded = (built.assembly.loaded[0], part.loaded())
    section = RobotSection(urdf=part_file(name), free_flyer=True, label="part")
    scenario = built.scenario.model_copy(update={"robot": [*built.scenario.robot, section]})
    return replace(built, scenario=scenario, assembly=replace(built.assembly, loaded=loaded))


def _pressed(grasp: Grasp, part: Part, press: float | None, mu: float) -> Grasp:
    """Return the grasp with forces of which the largest normal one is `press` [N]."""
    if press is None:
        return grasp
    total = 2.0 * press
    for _ in range(4):
        wrench = part.weight(grasp.placement)
        found = least_friction(grasp.points, grasp.normals, wrench, total, mu)
        if found is None:
            break
        grasp = replace(grasp, friction=found[0], forces=found[1])
        total *= press / grasp.normal_forces().max()
    return grasp


def _try(built: Built, draft: HandDraft, links: Links) -> str:
    """Run a draft; return what fails, or an empty text."""
    result, stopped = simulate(built)
    if stopped is not None:
        return f"the run stops: {stopped}"
    for name, pair in result.stats.pairs.items():
        if pair.contact_time < 0.9 * DURATION:
            return f"'{name}' loses the part"
    model = built.scene.model
    span, _ = joint_spans(model, "part/root_joint")
    held = result.q[result.t >= _SETTLED * DURATION]
    moved = float(np.linalg.norm(held[:, span][:, :3] - held[0, span][:3], axis=1).max())
    if moved > _MOVED * float(draft.hand.radii.min()):
        return f"the part moves by {1e3 * moved:.2g} mm in the hand"
    q = draft.grasp.q.copy()
    names = [draft.hand.model.names[j] for j in draft.hand.joints]
    to_q = np.concatenate([np.r_[joint_spans(draft.hand.model, one)[0]] for one in names])
    from_q = np.concatenate([np.r_[joint_spans(model, f"hand/{one}")[0]] for one in names])
    for row in result.q[:: max(1, len(result.q) // 60)]:
        q[to_q] = row[from_q]
        found = links.within(q, pin.XYZQUATToSE3(row[span]))
        if found is not None:
            return f"link '{found.link}' is in the part"
    unmet = figure_fault(built, result)
    return "" if unmet is None else unmet.text
