"""A new scenario in which a hand holds a free part between all its fingertips."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.materials import Material, find_material, friction_between
from sphshell_pin.dynamics.scene.models import mass_matrix
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import LoadedRobot, floats
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.clearance import Links
from sphshell_pin.scenario.drafting.fingertips import every_finger
from sphshell_pin.scenario.drafting.force_balance import least_friction
from sphshell_pin.scenario.drafting.grasp import Grasp, Hand, grasps
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.part import Part, part_file
from sphshell_pin.scenario.drafting.plan import Hold, Plan
from sphshell_pin.scenario.drafting.pose_search import Draft, Working, stated_kinds
from sphshell_pin.scenario.drafting.poses import NO_LIMIT
from sphshell_pin.scenario.drafting.tip_contact import GRAVITY, bearable, hertz_stiffness, sticking
from sphshell_pin.scenario.drafting.trial import try_out
from sphshell_pin.scenario.drafting.wording import mm, rounded
from sphshell_pin.scenario.format.bodies import joint_spans
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.scenario.format.schema import RobotSection
from sphshell_pin.shell.shell import Shell

GAP, DURATION = 1e-4, 1.5
"""Gap of each fingertip at the start [m], and duration of the run [s]."""

# Weights that friction could carry under the forces by default, and grasps that are run.
_SAFETY, _MOST_RUNS = 3.0, 6
# How far the joints' springs are drawn by the largest torque [rad].
_DRAWN = 0.1


class CannotHold(SphshellError):
    """No grasp of all fingertips that were asked for holds the part."""


class TooHeavy(CannotHold):
    """There are grasps, and none of them bears the part's weight."""


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


def hold_in_hand(asked: Asked, built: Built, tips: Sequence[Tip], draft: Draft) -> Working:
    """Return a scenario in which the `tips` of a robot hold the surface of `built`.

    The largest normal force of a tip is what is asked for; `draft(section, plan)` writes and builds
    one. Each is run; the first that holds the part is taken. Where all tips cannot, those do
    without the fingers of the fewest joints, three at least.

    Raises
    ------
    SphshellError
        None does; the text says why, and what to change.
    """
    if floats(built.assembly.model):
        raise SphshellError("a hand with a free root cannot hold a part: leave out --base")
    ranks = Hand(built.assembly.model, tips).ranks
    order = sorted(range(len(tips)), key=lambda k: -len(ranks[k]))
    refused, last = "", CannotHold()
    for count in range(len(tips), min(len(tips), 3) - 1, -1):
        some = [tips[k] for k in sorted(order[:count])]
        try:
            found = _held(asked, built, some, draft)
        except CannotHold as error:
            refused, last = refused or str(error), error
            continue
        if refused:
            note = f"{count} of {len(tips)} fingertips hold it: {refused.partition(';')[0]}"
            found = found._replace(why=(note, *found.why))
        return found
    raise last


def _held(asked: Asked, built: Built, tips: Sequence[Tip], draft: Draft) -> Working:
    """Return a scenario in which all of the `tips` hold the surface; CannotHold if none works."""
    materials = find_material(asked.material or "rubber"), find_material(asked.against or "steel")
    model, q0, press = built.assembly.model, built.assembly.q0, asked.press
    (shell,) = built.shells.values()
    part, hand = Part.of(shell, materials[1]), Hand(model, tips)
    mu, _ = friction_between(*materials)
    total = _SAFETY * part.mass * GRAVITY / mu if press is None else 2.0 * press
    geometry = built.assembly.loaded[0].collision_model
    links = Links(model, geometry, shell, tips, hand.lock, q0)
    blocked: list[str] = []

    def free(q: Array, placement: pin.SE3 | None = None) -> bool:
        if placement is None:
            return not links.crossed(q)
        found = links.within(q, placement, whole=True)
        blocked.extend([] if found is None else [found.link])
        return found is None

    found = grasps(hand, q0, shell, part.weight, total, mu, GAP, free)
    if not found:
        raise _no_grasp(shell, len(tips), blocked)
    kinds, said = stated_kinds(model, hand.lock), ""
    for one in found[:_MOST_RUNS]:
        grasp = _pressed(one, part, press, mu)
        stated = {
            "label": "hand",
            "lock": list(hand.lock),
            "joints": kinds,
            "start": _angles(hand, grasp.q, ""),
        }
        section = built.scenario.robot[0].model_copy(update=stated)
        plan = _planned(hand, grasp, shell, part, materials)
        if isinstance(plan, str):
            said = plan
            continue
        text, made = draft(section, plan)
        fault = try_out(made, plan, links)
        if fault is None:
            return Working(text, made, (*plan.why, plan.contact.note), part.urdf())
        said = fault.text
    raise TooHeavy(
        f"no grasp of {min(len(found), _MOST_RUNS)} that were tried works: {said}; a lighter "
        "--against, another --press, or a smaller part"
    )


def _planned(
    hand: Hand, grasp: Grasp, shell: Shell, part: Part, materials: tuple[Material, Material]
) -> Plan | str:
    """Plan a scenario with the grasp; what is wrong with it before anything is run."""
    model, forces, torques = hand.model, grasp.normal_forces(), hand.torques(grasp)
    radius, press = float(hand.radii.min()), float(forces.max())
    weight = pin.computeGeneralizedGravity(model, model.createData(), grasp.q)
    limits = np.array(model.upperEffortLimit)
    stated = (limits > 0) & (limits < NO_LIMIT)
    over = np.flatnonzero(stated & (np.abs(torques + weight) > limits))
    if len(over):
        return f"the effort limit of {limits[over[0]]:g} N m allows no press of {press:.3g} N"
    if press > bearable(radius, *materials) * 7.5**1.5:
        return (
            f"{press:.3g} N would press a {materials[0].name} sphere of radius {mm(radius)} in by "
            "more than half of it"
        )
    kp = rounded(float(np.abs(torques).max()) / _DRAWN)
    inertia = np.diag(mass_matrix(model, grasp.q))[hand.reaches[0].columns]
    kd = rounded(1.4 * math.sqrt(kp * float(np.median(inertia))))
    # The springs are drawn from where the tips are as deep in the part as they press.
    depths = (forces / [hertz_stiffness(float(one), *materials) for one in hand.radii]) ** (2 / 3)
    pressed = hand.close_on(grasp.q, shell, grasp.placement, -depths)
    deep = grasp.q if pressed is None else pressed[0]
    drawn = _angles(hand, pin.integrate(model, deep, torques / kp), "hand/")
    used = grasp.friction / friction_between(*materials)[0]
    frames = ", ".join(f"'{tip.frame}'" for tip in hand.tips)
    why = (
        f"{len(hand.tips)} fingertips, {hand.tips[0].source}: {frames}",
        f"the part is {materials[1].name} all through and weighs {part.mass:.3g} kg",
        f"the fingertips press with {press:.3g} N at most; its weight and their forces use "
        f"{100 * used:.0f} % of the friction",
    )
    return Plan(
        hand.tips,
        sticking(materials, radius, 0.1, press, part.mass / len(hand.tips)),
        Hold(kp, kd, _DRAWN, drawn, press),
        DURATION,
        GAP,
        grasp.placement,
        pin.SE3ToXYZQUAT(grasp.placement),
        why,
        part,
        int(np.argmax(forces)),
    )


def _angles(hand: Hand, q: Array, prefix: str) -> dict[str, object]:
    """Return the coordinates of the joints that move the tips."""
    names = [hand.model.names[j] for j in hand.joints]
    at = {prefix + name: q[joint_spans(hand.model, name)[0]].round(6).tolist() for name in names}
    return {name: one[0] if len(one) == 1 else one for name, one in at.items()}


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


def with_part(built: Built, part: Part, name: str) -> Built:
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
