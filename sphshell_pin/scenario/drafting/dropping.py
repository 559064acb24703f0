"""A new scenario of a robot that floats: it falls on the surface, or stands on it."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.models import joint_of, mass_matrix
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import joints_without_mass
from sphshell_pin.scenario.drafting.limb_ends import sphere_centers
from sphshell_pin.scenario.drafting.part import GRAVITY
from sphshell_pin.scenario.drafting.plan import Contact, Hold, Plan, chosen_materials
from sphshell_pin.scenario.drafting.poses import joints_aside
from sphshell_pin.scenario.drafting.searching import CannotStand, Search
from sphshell_pin.scenario.drafting.touch_points import come_down, find_touch_point
from sphshell_pin.scenario.drafting.wording import mm, rounded
from sphshell_pin.shell import Shell

_UP = np.array([0.0, 0.0, 1.0])
# Gap at the start of a ball that falls, as a part of its radius, and of what is heavier, where that
# is more than its weight presses it in; how far from the middle a body falls, as a part of the
# surface's box.
_FALL_GAP, _LOW_GAP, _BESIDE = 2.0, 0.1, 0.1
# Sag of a standing robot's joints under its weight [rad].
_SAG = 0.05
# Drafts that are run. A run that is cut before links reach the part ends this part of its time
# earlier, and is no shorter than this [s].
_MOST_RUNS, _BEFORE, _SHORTEST = 3, 0.9, 0.2


class DropSearch(Search):
    """The search for a run in which a robot that floats comes down on the surface."""

    def drafts(self) -> Iterator[Plan]:
        """Yield a run, then shorter ones that end before links come down, too."""
        asked, model = self.asked, self.model
        if any(one is not None for one in (asked.press, asked.place, asked.at, asked.path)):
            raise SphshellError(
                "a robot that floats comes down on the surface by its weight: leave out --press, "
                f"--place, --at and --path{self._hold}"
            )
        falls = joint_of(model, self.tips[0].frame) == 1
        if asked.inside and not falls:
            raise SphshellError("a robot cannot stand in a bowl: take another --surface")
        plan = self._plan(falls=falls)
        self.hold_links(plan.tips, plan.lock)
        while True:
            yield plan
            fault = self.faults[-1]
            end = rounded(_BEFORE * fault.t)
            # What can stand has to stand.
            cut = fault.kind == "links" and (falls or len(plan.tips) < 3)
            if not cut or end < _SHORTEST or len(self.faults) >= _MOST_RUNS:
                return
            down = f"before link '{fault.link}' comes down on the surface"
            note = f"the run ends after {end:g} s, {down}"
            plan = replace(plan, duration=end, why=(*plan.why, note))

    def refusal(self) -> SphshellError:
        """Return the error of the last draft; a robot that can be held cannot stand."""
        large = "take a flatter or larger part, on which all spheres can come down"
        said = f"{self.failed()}; {large}{self._hold}"
        return CannotStand(said, self.faults[-1].text) if self._hold else SphshellError(said)

    @property
    def _hold(self) -> str:
        return ", or hold it with --base fixed" if self.model.njoints > 2 else ""

    def _plan(self, *, falls: bool) -> Plan:
        """Plan a run in which a free body falls on the surface, or a robot stands on all its tips.

        The surface is placed as in its file.
        """
        model, shell, tips = self.model, self.shell, self.tips[:1] if falls else self.tips
        mass, (tip, *_) = float(pin.computeTotalMass(model)) / len(tips), tips
        # A robot is heavier than the ball that it got.
        load = mass if tip.made or not falls else 0.0
        materials = chosen_materials(self.asked, self.tips, load)
        least = min(one.radius for one in tips)
        depth = materials.depth(load * GRAVITY, least)
        gap = min(_LOW_GAP * least, depth) if load else _FALL_GAP * least
        # Beside the middle: a ball in a bowl rolls then.
        beside = falls * _BESIDE * (shell.box[1] - shell.box[0]) * np.array([1.0, 0.5, 0.0])
        centers = sphere_centers(model, self.q0, tips)
        q, radii = self.q0.copy(), np.array([one.radius for one in tips])
        q[:3] += way_down(shell, centers, radii, gap, beside)
        speed = math.sqrt(2 * GRAVITY * gap)
        why = [
            f"the sphere of radius {mm(t.radius)} on frame '{t.frame}': {t.source}" for t in tips
        ]
        if falls:
            why += [f"it falls {mm(gap)} beside the middle of the surface, at {speed:.2g} m/s"]
            lock, contact = joints_aside(model, tips), Contact(materials, speed)
            return Plan(tips, contact, None, 1.0, gap, q, lock, why=tuple(why))
        leg = float(np.linalg.norm(self.q0[:3] - centers, axis=1).max())
        kp = mass * GRAVITY * 0.5 * leg / _SAG
        # A leg turns the body above it as much as itself.
        motors = np.diag(mass_matrix(model, self.q0))[6:]
        inertia = float(np.median(motors)) + mass * (0.5 * leg) ** 2
        control = Hold(rounded(kp), rounded(1.4 * math.sqrt(kp * inertia)), _SAG)
        contact = materials.sticking(tip.radius, speed, mass * GRAVITY, mass)
        why += [f"the robot floats, {mm(gap)} above the surface, and its joints hold the posture"]
        why += ["it will fall over: nothing but its sphere touches"] * (len(tips) < 3)
        why += ["friction sticks, so that it can stand"]
        lock = tuple(joints_without_mass(model, self.q0))
        return Plan(tips, contact, control, 2.0, gap, q, lock, why=tuple(why))


def way_down(
    shell: Shell, centers: Array, radii: Array, gap: float, beside: Array | float = 0.0
) -> Array:
    """Return how spheres move (3,) [m] so that the nearest one has the `gap` [m] to the shell.

    The center of all is above the shell's center then, or `beside` it (3,) [m]; if none of them
    would land on it there, that of the first one.
    """
    place = find_touch_point(shell, radii[0], gap, toward=_UP, beside=beside)
    if len(centers) == 1:
        return np.asarray(place.center - centers[0])
    for anchor in (centers.mean(axis=0), centers[0]):
        way = place.point - anchor
        heights = []
        for center, radius in zip(centers, radii, strict=True):
            above = center + way
            above[2] = shell.box[1, 2] + 2 * (radius + gap)
            down = come_down(shell, above, -_UP, radius, gap).center[2]
            if down > shell.box[0, 2] - radius:
                heights.append(down - center[2])
        if heights:
            return np.array([way[0], way[1], max(heights)])
    raise SphshellError("no sphere lands on the surface: it is too small")
