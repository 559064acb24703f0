"""A new scenario in which a hand holds a free part between all its fingertips."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin

from sphshell_pin.contact.materials import find_material
from sphshell_pin.dynamics.scene.models import mass_matrix
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import LoadedRobot, floats
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.fingertips import every_finger
from sphshell_pin.scenario.drafting.force_balance import least_friction
from sphshell_pin.scenario.drafting.grasp import Grasp, Hand, grasps
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.part import GRAVITY, Part
from sphshell_pin.scenario.drafting.plan import Hold, Materials, Plan
from sphshell_pin.scenario.drafting.poses import NO_LIMIT
from sphshell_pin.scenario.drafting.searching import Search, coordinates
from sphshell_pin.scenario.drafting.wording import rounded
from sphshell_pin.shell.shell import Shell

GAP, DURATION = 1e-4, 1.5
"""Gap of each fingertip at the start [m], and duration of the run [s]."""

# Weights that friction could carry under the forces by default, and grasps that are run.
_SAFETY, _MOST_RUNS = 3.0, 6
# How far the joints' springs are drawn by the largest torque [rad].
_DRAWN = 0.1


class TooHeavy(SphshellError):
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

    refused: list[SphshellError]
    """Why none of so many tips, or fewer, can hold it."""

    def drafts(self) -> Iterator[Plan]:
        """Yield grasps of all tips, then of fewer."""
        if floats(self.model):
            raise SphshellError("a hand with a free root cannot hold a part: leave out --base")
        tips, self.refused = self.tips, []
        ranks = Hand(self.model, tips).ranks
        order = sorted(range(len(tips)), key=lambda k: -len(ranks[k]))
        for count in range(len(tips), min(len(tips), 3) - 1, -1):
            for plan in self._grasps([tips[k] for k in sorted(order[:count])]):
                said = [str(error).partition(";")[0] for error in self.refused[:1]]
                notes = [f"{count} of {len(tips)} fingertips hold it: {one}" for one in said]
                yield replace(plan, why=(*notes, *plan.why))

    def refusal(self) -> SphshellError:
        """Return why the fewest tips do not hold it."""
        return self.refused[-1]

    def _grasps(self, tips: Sequence[Tip]) -> Iterator[Plan]:
        """Yield drafts in which all of the `tips` hold the part; say at the end why none works."""
        press, shell = self.asked.press, self.shell
        names = self.asked.material or "rubber", self.asked.against or "steel"
        materials = Materials(*map(find_material, names))
        part, hand = Part.of(shell, materials.surface), Hand(self.model, tips)
        mu, weight = materials.friction, part.inertia.mass * GRAVITY
        total = _SAFETY * weight / mu if press is None else 2.0 * press
        links, said = self.hold_links(tips, hand.lock, self.q0), ""
        found, blocked = grasps(hand, links, self.q0, part, total, mu, GAP)
        for one in found[:_MOST_RUNS]:
            try:
                yield _planned(hand, _pressed(one, part, press, mu), shell, part, materials)
                said = self.faults[-1].text
            except SphshellError as error:
                said = str(error)
        heavy = (
            f"no grasp of {min(len(found), _MOST_RUNS)} that were tried works: {said}; a lighter "
            "--against, another --press, or a smaller part"
        )
        self.refused.append(TooHeavy(heavy) if found else _no_grasp(shell, len(tips), blocked))


def _planned(hand: Hand, grasp: Grasp, shell: Shell, part: Part, materials: Materials) -> Plan:
    """Plan a scenario with the grasp; SphshellError for what is wrong before anything is run."""
    model, forces, torques = hand.model, grasp.normal_forces(), hand.torques(grasp)
    radius, press = float(hand.radii.min()), float(forces.max())
    weight = pin.computeGeneralizedGravity(model, model.createData(), grasp.q)
    limits = np.array(model.upperEffortLimit)
    stated = (limits > 0) & (limits < NO_LIMIT)
    over = np.flatnonzero(stated & (np.abs(torques + weight) > limits))
    if len(over):
        limit = f"the effort limit of {limits[over[0]]:g} N m"
        raise SphshellError(f"{limit} allows no press of {press:.3g} N")
    if said := materials.too_deep(press, radius):
        raise SphshellError(said)
    kp = rounded(float(np.abs(torques).max()) / _DRAWN)
    inertia = np.diag(mass_matrix(model, grasp.q))[hand.reaches[0].columns]
    kd = rounded(1.4 * math.sqrt(kp * float(np.median(inertia))))
    # The springs are drawn from where the tips are as deep in the part as they press.
    depths = (forces / [materials.stiffness(float(one)) for one in hand.radii]) ** (2 / 3)
    pressed = hand.close_on(grasp.q, shell, grasp.placement, -depths)
    deep = grasp.q if pressed is None else pressed[0]
    angles = coordinates(model, pin.integrate(model, deep, torques / kp))
    drawn = {f"hand/{name}": angles[name] for name in (model.names[j] for j in hand.joints)}
    used, mass = grasp.friction / materials.friction, part.inertia.mass
    frames = ", ".join(f"'{tip.frame}'" for tip in hand.tips)
    why = (
        f"{len(hand.tips)} fingertips, {hand.tips[0].source}: {frames}",
        f"the part is {materials.surface.name} all through and weighs {mass:.3g} kg",
        f"the fingertips press with {press:.3g} N at most; its weight and their forces use "
        f"{100 * used:.0f} % of the friction",
    )
    contact, k = materials.sticking(radius, 0.1, press, mass / len(hand.tips)), int(forces.argmax())
    start = DURATION, GAP, grasp.q, hand.lock, grasp.placement
    control = Hold(kp, kd, _DRAWN, drawn, press)
    return Plan(hand.tips, contact, control, *start, why, part, strongest=k)


def _no_grasp(shell: Shell, count: int, blocked: Counter[str]) -> SphshellError:
    sizes = " x ".join(f"{1e3 * one:.3g}" for one in np.ptp(shell.box, axis=0))
    for link, _ in blocked.most_common(1):
        return SphshellError(
            f"link '{link}' would be in the part, or another one, wherever all {count} fingertips "
            f"touch it and could hold it: take a part of another size than {sizes} mm"
        )
    return SphshellError(
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
