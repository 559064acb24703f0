"""The search for a draft that works: directions to press in, places of the part, and repairs."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.base.texts import counted
from sphshell_pin.dynamics.scene.models import joint_of
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import WORKING
from sphshell_pin.scenario.drafting.asked import PLACES, Asked
from sphshell_pin.scenario.drafting.fingertips import other_ends
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.paths import SHORTEST_PATH, find_way
from sphshell_pin.scenario.drafting.placing import STEEP, Bench, Place
from sphshell_pin.scenario.drafting.plan import (
    TIP_GAP,
    Plan,
    Press,
    chosen_materials,
    press_force,
    press_gap,
)
from sphshell_pin.scenario.drafting.poses import Limb, approaches
from sphshell_pin.scenario.drafting.searching import CannotReach, Search
from sphshell_pin.scenario.drafting.touch_points import (
    TouchPoint,
    asked_touches,
    sides,
    touch_points,
)
from sphshell_pin.scenario.drafting.trial import Fault
from sphshell_pin.scenario.drafting.vectors import nearest_axis
from sphshell_pin.scenario.format.build import Built

# Drafts that are run, in all and before a path is given up.
_MOST_RUNS, _MOST_SLIDES = 10, 6
# Places at which the tip cannot slide, before one of them is taken.
_MOST_STILL = 40
# Part of a path up to where it failed that is tried again.
_CUT = 0.8
# Between links and part at the start, along the approach, in radii of the sphere.
_ROOM = 0.1
# Time to settle of a draft that failed while the tip slid or after a hard touch [s].
_CALM_LEAD_IN = 1.5
_ADVICE = {
    "run": "take a softer --law, or a larger --radius",
    "touch": "take another --place, or another --frame",
    "force": "take a smaller --radius, another --press or --place",
    "path": "take a shorter --length, another --at or --place",
    "links": "take another --place, a smaller part, or a sphere farther out (--frame, --offset)",
    "figure": "take another --law or --radius",
}


def repaired(one: Press, fault: Fault) -> Press | None:
    """Return what to try in place of a draft that failed; None: nothing."""
    if one.repair == "stays" and fault.kind == "force" and 0.0 < fault.t < one.lead_in:
        return replace(one, lead_in=2 * one.lead_in, repair="slower")
    if one.repair in ("stays", "slower", "cut"):
        return None
    if fault.kind == "force" and not one.repair:
        return replace(one, calm=True, repair="calmed")
    # Up to where it failed the path will do.
    along = np.cumsum([0.0, *np.linalg.norm(np.diff(one.way.points, axis=0), axis=1)])
    count = int((along < _CUT * one.speed * (fault.t - one.lead_in)).sum())
    if along[max(count - 1, 0)] < SHORTEST_PATH * one.place.stance.tip.radius:
        return None
    way = replace(one.way, points=one.way.points[:count], why=fault.text)
    return replace(one, way=way, repair="cut")


class PressSearch(Search):
    """The search for a place where the tip of a robot with a fixed base presses."""

    def __init__(self, asked: Asked, built: Built, tips: Sequence[Tip], file: Path) -> None:
        super().__init__(asked, built, tips, file)
        self.tip = tip = tips[0]
        if joint_of(self.model, tip.frame) == 0:
            raise SphshellError(
                f"no joint moves frame '{tip.frame}': name another with --frame, or let the root "
                "float with --free-flyer"
            )
        known = WORKING.get(self.section.name or "", ())
        q = np.array(known) if len(known) == self.model.nq else self.q0
        self.limb = Limb(self.model, tip)
        links = self.hold_links(tips, self.limb.lock, q)
        self.room = _ROOM * tip.radius
        self.bench = Bench(links, self.limb, q, 2 * TIP_GAP * tip.radius)
        self.even = False
        """Whether the sphere touched one face in some place that was tried."""
        self.stays: list[Press] = []
        """What presses in one place, where a path failed."""
        self.refused: list[str] = []
        """Why nothing that was asked for could be run."""

    def drafts(self) -> Iterator[Plan]:
        """Yield drafts, each with those that repair it."""
        for press in self._presses():
            one: Press | None = press
            while one is not None and len(self.faults) < _MOST_RUNS:
                yield one.plan()
                one = self._next(press, one, self.faults[-1])

    def _next(self, press: Press, failed: Press, fault: Fault) -> Press | None:
        """Return what to run in place of what `failed`, a repair of `press`; None: nothing."""
        early = fault.kind == "links" and fault.t < failed.lead_in
        if not (failed.repair or self.asked.slides or early):
            # It presses in one place if no path works anywhere.
            why = f"with a path {fault.text}" if failed.slides else failed.way.why
            way = replace(failed.way, points=failed.way.points[:1], why=why)
            self.stays.append(replace(failed, way=way, lead_in=_CALM_LEAD_IN, repair="stays"))
        if fault.cut and not failed.weak:
            return replace(press, weak=True)
        found = repaired(failed, fault)
        return None if found and self.asked.slides and found.repair == "cut" else found

    def _presses(self) -> Iterator[Press]:
        """Yield what is tried: paths, then one place of those that failed, then other places."""
        still: list[Press] = []
        for one in self._everywhere():
            if one.slides:
                yield one
            else:
                still.append(one)
            if len(self.faults) >= _MOST_SLIDES or len(still) >= _MOST_STILL:
                break
        if not self.asked.slides:
            yield from [*self.stays, *still]
        elif still:
            why = still[0].way.why
            self.refused.append(f"the path cannot be taken: {why}; {_ADVICE['path']}")

    def _everywhere(self) -> Iterator[Press]:
        """Yield what presses in each place, with the longest path there."""
        asked, radius = self.asked, self.tip.radius
        for found in self._places():
            stance, pair = found.stance, chosen_materials(asked, [self.tip], found.stance.mass)
            try:
                force = press_force(stance, pair, asked.press)
            except SphshellError as error:  # of this posture: another one may do
                self.refused.append(str(error))
                continue
            self.even |= found.on_face
            gap = press_gap(radius, force, stance.mass, pair)
            place = found.with_gap(gap)
            way = find_way(asked, place, self.held, gap, self.room)
            weak, hollow = not stance.force, asked.inside
            yield Press(place, way, pair, force, gap, weak=weak, hollow=hollow)

    def _places(self) -> Iterator[Place]:
        """Yield places of the part before the tip, those on the floor of the robot's base first.

        The tip presses down if nothing else is asked for, else as its limb points, else sideways.
        """
        asked, shell, radius = self.asked, self.shell, self.tip.radius
        gap, choices = TIP_GAP * radius, list[tuple[Array, list[TouchPoint]]]()
        if asked.at is not None or isinstance(asked.path, np.ndarray):
            spots = asked_touches(asked, shell, radius, gap)
            axis, normal = nearest_axis(spots[0].normal), spots[0].normal
            choices.append((axis if axis @ normal > STEEP else normal, spots))
        else:
            word = {"cylinder": np.eye(3)[0], "bowl": np.eye(3)[2]}.get(asked.word or "")
            for side in sides(shell) if word is None else [word]:
                choices.append((side, list(touch_points(shell, radius, gap, side))))
        place = PLACES.get(asked.place or "")
        for approach in [np.array(place)] if place else approaches(self.limb, self.bench.q):
            # Upright ones first, as they stand in their file.
            ordered = sorted(choices, key=lambda one: abs(one[0][2] + approach[2]) > 1e-3)
            tries = itertools.product((self.room, 0.0), ordered, (True, False))
            for room, (side, some), on_floor in tries:
                yield from self.bench.places(side, some, approach, on_floor=on_floor, room=room)

    def refusal(self) -> SphshellError:
        """Return the error that says why no draft works, and what to change."""
        bench, frame = self.bench, self.tip.frame
        ((link, _),) = bench.blocked.most_common(1) or [("", 0)]
        other_limb = bool(link)
        if not bench.postures:
            said = (
                f"the tip on frame '{frame}' cannot move along {self.asked.place or 'any axis'} in "
                "any posture that was tried; its joints do not allow it: take another --place or "
                "--frame"
            )
            other_limb = True
        elif self.faults:
            said = f"{self.failed()}; {_ADVICE[self.faults[-1].kind]}"
            # The force is held on faces, which links may have kept the tip from.
            other_limb = other_limb and not self.even
        elif self.refused:
            said, other_limb = self.refused[0], False
        elif link:
            said = (
                f"link '{link}' would be in the part, or another one: in each of "
                f"{counted(bench.postures, 'posture')} and {counted(bench.tried, 'place')} on the "
                f"part that were tried; {_ADVICE['links']}"
            )
        else:
            said = "the surface has no point to touch"
        if not other_limb:
            return SphshellError(said)
        return CannotReach(said, frame, other_ends(self.model, frame), bench.out_of_limb())
