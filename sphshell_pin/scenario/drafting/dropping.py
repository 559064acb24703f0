"""A new scenario of a robot that floats: it falls on the surface, or stands on it."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.models import find_frame, mass_matrix
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import joints_without_mass
from sphshell_pin.scenario.drafting.limb_ends import Tip, joint_of
from sphshell_pin.scenario.drafting.plan import Hold, Plan
from sphshell_pin.scenario.drafting.poses import joints_aside
from sphshell_pin.scenario.drafting.searching import CannotStand, NewScenario, Search
from sphshell_pin.scenario.drafting.tip_contact import GRAVITY, Contact, chosen_materials
from sphshell_pin.scenario.drafting.touch_points import come_down, find_touch_point
from sphshell_pin.scenario.drafting.wording import mm, rounded
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.shell import Shell

_UP = np.array([0.0, 0.0, 1.0])
# Gap at the start of a ball that falls, and of feet and of bodies that got a ball, as a part of the
# sphere's radius; how far from the middle a body falls, as a part of the surface's box.
_FALL_GAP, _FOOT_GAP, _BESIDE = 2.0, 0.1, 0.1
# Sag of a standing robot's joints under its weight [rad].
_SAG = 0.05
# Drafts that are run. A run that is cut before links reach the part ends this part of its time
# earlier, and is no shorter than this [s].
_MOST_RUNS, _BEFORE, _SHORTEST = 3, 0.9, 0.2


class DropSearch(Search):
    """The search for a run in which a robot that floats comes down on the surface."""

    def find(self) -> NewScenario:
        """Return the first draft that works; SphshellError if none does."""
        asked, model = self.asked, self.model
        hold = ", or hold it with --base fixed" if model.njoints > 2 else ""
        if any(one is not None for one in (asked.press, asked.place, asked.at, asked.path)):
            raise SphshellError(
                "a robot that floats comes down on the surface by its weight: leave out --press, "
                f"--place, --at and --path{hold}"
            )
        lock = tuple(joints_without_mass(model, self.q0))
        if joint_of(model, self.tips[0].frame) == 1:
            lock = joints_aside(model, self.tips[:1])
            plan = self._fall()
        elif asked.inside:
            raise SphshellError("a robot cannot stand in a bowl: take another --surface")
        else:
            plan = self._stand()
        section, links = self.locked(lock), self.links(plan.tips, lock)
        while True:
            found = self.run(section, plan, links)
            if found is not None:
                return found
            fault = self.faults[-1]
            end = rounded(_BEFORE * fault.t)
            # What can stand has to stand.
            falls = fault.kind == "links" and (plan.control is None or len(plan.tips) < 3)
            if not falls or end < _SHORTEST or len(self.faults) >= _MOST_RUNS:
                large = "take a flatter or larger part, on which all spheres can come down"
                said = f"{self.failed()}; {large}{hold}"
                raise CannotStand(said, fault.text) if hold else SphshellError(said)
            down = f"before link '{fault.link}' comes down on the surface"
            note = f"the run ends after {end:g} s, {down}"
            plan = replace(plan, duration=end, why=(*plan.why, note))

    def _fall(self) -> Plan:
        """Plan a run in which a free body falls on the surface, which is placed as in its file."""
        (tip, *_), shell = self.tips, self.shell
        # A robot is heavier than the ball that it got.
        gap = (_FOOT_GAP if tip.end else _FALL_GAP) * tip.radius
        load = float(pin.computeTotalMass(self.model)) if tip.end else 0.0
        # Beside the middle: a ball in a bowl rolls then.
        beside = _BESIDE * (shell.box[1] - shell.box[0]) * np.array([1.0, 0.5, 0.0])
        touch = find_touch_point(
            shell, tip.radius, gap, toward=_UP, inside=self.asked.inside, beside=beside
        )
        root = self.q0[:7].copy()
        root[:3] += touch.center - sphere_centers(self.built, [tip])[0]
        speed = math.sqrt(2 * GRAVITY * gap)
        why = (
            f"the sphere of radius {mm(tip.radius)} on frame '{tip.frame}': {tip.source}",
            f"it falls {mm(gap)} beside the middle of the surface, at {speed:.2g} m/s",
        )
        contact = Contact(chosen_materials(self.asked, self.tips, load), speed)
        return Plan((tip,), contact, None, 1.0, gap, pin.SE3.Identity(), root, why)

    def _stand(self) -> Plan:
        """Plan a run in which a robot stands on all its spheres."""
        tips, gap = self.tips, _FOOT_GAP * min(tip.radius for tip in self.tips)
        centers = sphere_centers(self.built, tips)
        place = placed_under(self.shell, centers, np.array([tip.radius for tip in tips]), gap)
        share = float(pin.computeTotalMass(self.model)) / len(tips)
        materials = chosen_materials(self.asked, tips, share)
        leg = float(np.linalg.norm(self.q0[:3] - centers, axis=1).max())
        kp = share * GRAVITY * 0.5 * leg / _SAG
        # A leg turns the body above it as much as itself.
        motors = np.diag(mass_matrix(self.model, self.q0))[6:]
        inertia = float(np.median(motors)) + share * (0.5 * leg) ** 2
        speed = math.sqrt(2 * GRAVITY * gap)
        contact = materials.sticking(tips[0].radius, speed, share * GRAVITY, share)
        fall = "it will fall over: nothing but its sphere touches"
        why = (
            *(
                f"the sphere of radius {mm(t.radius)} on frame '{t.frame}': {t.source}"
                for t in tips
            ),
            f"the robot floats, {mm(gap)} above the surface, and its joints hold the posture",
            *([fall] if len(tips) < 3 else []),
            "friction sticks, so that it can stand",
        )
        control = Hold(rounded(kp), rounded(1.4 * math.sqrt(kp * inertia)), _SAG)
        return Plan(tips, contact, control, 2.0, gap, place, None, why)


def sphere_centers(built: Built, tips: Sequence[Tip]) -> Array:
    """Return the spheres' centers (k, 3) [m] in the world at the start."""
    model = built.assembly.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, built.assembly.q0)
    return np.array([data.oMf[find_frame(model, tip.frame)].act(tip.offset) for tip in tips])


def placed_under(shell: Shell, centers: Array, radii: Array, gap: float) -> pin.SE3:
    """Return the placement of the shell so that the nearest of the spheres has the `gap` [m] to it.

    Its center is under the center of the spheres; if none of them would then land on it, under the
    first one.
    """
    touch = find_touch_point(shell, float(radii[0]), gap, toward=_UP)
    for anchor in (centers.mean(axis=0), centers[0]):
        aside = anchor - touch.point
        heights = []
        for center, radius in zip(centers, radii, strict=True):
            above = center - aside
            above[2] = shell.box[1, 2] + 2 * (radius + gap)
            down = come_down(shell, above, -_UP, float(radius), gap).center[2]
            if down > shell.box[0, 2] - radius:
                heights.append(center[2] - down)
        if heights:
            return pin.SE3(np.eye(3), np.array([aside[0], aside[1], min(heights)]))
    raise SphshellError("no sphere lands on the surface: it is too small")
