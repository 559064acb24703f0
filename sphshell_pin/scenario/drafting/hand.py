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
from sphshell_pin.scenario.drafting.fingertips import every_finger
from sphshell_pin.scenario.drafting.force_balance import least_friction
from sphshell_pin.scenario.drafting.grasp import Grasp, Hand, grasps
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.part import Part
from sphshell_pin.scenario.drafting.plan import Hold, Plan
from sphshell_pin.scenario.drafting.poses import NO_LIMIT
from sphshell_pin.scenario.drafting.searching import NewScenario, Search, coordinates
from sphshell_pin.scenario.drafting.tip_contact import GRAVITY, hertz_stiffness, sticking, too_deep
from sphshell_pin.scenario.drafting.wording import rounded
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


class HoldSearch(Search):
    """The search for a grasp in which the tips of a hand hold the surface.

    Where all tips cannot, those do without the fingers of the fewest joints, three at least.
    """

    def find(self) -> NewScenario:
        """Return the first draft that holds the part; SphshellError if none does."""
        if floats(self.model):
            raise SphshellError("a hand with a free root cannot hold a part: leave out --base")
        tips, refused, last = self.tips, "", CannotHold()
        ranks = Hand(self.model, tips).ranks
        order = sorted(range(len(tips)), key=lambda k: -len(ranks[k]))
        for count in range(len(tips), min(len(tips), 3) - 1, -1):
            try:
                found = self._held([tips[k] for k in sorted(order[:count])])
            except CannotHold as error:
                refused, last = refused or str(error), error
                continue
            if refused:
                note = f"{count} of {len(tips)} fingertips hold it: {refused.partition(';')[0]}"
                found = replace(found, why=(note, *found.why))
            return found
        raise last

    def _held(self, tips: Sequence[Tip]) -> NewScenario:
        """Return a scenario in which all of the `tips` hold the part; CannotHold if none works."""
        press, shell = self.asked.press, self.shell
        materials = (
            find_material(self.asked.material or "rubber"),
            find_material(self.asked.against or "steel"),
        )
        part, hand = Part.of(shell, materials[1]), Hand(self.model, tips)
        mu, _ = friction_between(*materials)
        total = _SAFETY * part.mass * GRAVITY / mu if press is None else 2.0 * press
        links, blocked = self.links(tips, hand.lock, self.q0), list[str]()

        def free(q: Array, placement: pin.SE3 | None = None) -> bool:
            if placement is None:
                return not links.crossed(q)
            found = links.within(q, placement, whole=True)
            blocked.extend([] if found is None else [found])
            return found is None

        found = grasps(hand, self.q0, shell, part.weight, total, mu, GAP, free)
        if not found:
            raise _no_grasp(shell, len(tips), blocked)
        said = ""
        for one in found[:_MOST_RUNS]:
            grasp = _pressed(one, part, press, mu)
            plan = _planned(hand, grasp, shell, part, materials)
            if isinstance(plan, str):
                said = plan
                continue
            section = self.locked(hand.lock, label="hand", start=_angles(hand, grasp.q))
            works = self.run(section, plan, links)
            if works is not None:
                return works
            said = self.faults[-1].text
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
    if said := too_deep(press, radius, materials):
        return said
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


def _angles(hand: Hand, q: Array, prefix: str = "") -> dict[str, object]:
    """Return the coordinates of the joints that move the tips."""
    found, names = coordinates(hand.model, q), [hand.model.names[j] for j in hand.joints]
    return {prefix + name: found[name] for name in names}


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
