"""The search for a draft that works: directions to press in, places of the part, and repairs."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.contact.materials import Material
from sphshell_pin.dynamics.scene.joint_components import JointComponents
from sphshell_pin.dynamics.scene.models import find_frame, mass_matrix
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import WORKING, floats
from sphshell_pin.scenario.drafting.asked import PLACES, Asked
from sphshell_pin.scenario.drafting.asked_places import asked_touches
from sphshell_pin.scenario.drafting.clearance import Links
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.paths import SHORTEST_PATH, Way, find_way
from sphshell_pin.scenario.drafting.placing import Bench, Place, nearest_side
from sphshell_pin.scenario.drafting.plan import (
    TIP_GAP,
    WEAK,
    Plan,
    Press,
    plan_fall,
    plan_stand,
    press_force,
    press_gap,
    press_plan,
)
from sphshell_pin.scenario.drafting.poses import NO_LIMIT, approaches, joints_aside
from sphshell_pin.scenario.drafting.refusals import Tried, cannot_stand, refusal
from sphshell_pin.scenario.drafting.tip_contact import chosen_materials
from sphshell_pin.scenario.drafting.touch_points import sides, touch_points
from sphshell_pin.scenario.drafting.trial import Fault, try_out
from sphshell_pin.scenario.drafting.wording import mm, rounded
from sphshell_pin.scenario.format.bodies import joint_spans
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.scenario.format.schema import RobotSection

# Drafts that are run, in all, before a path is given up, and of a robot that floats.
_MOST_RUNS, _MOST_SLIDES, _MOST_DROPS = 10, 6, 3
# Places at which the tip cannot slide, before one of them is taken.
_MOST_STILL = 40
# Part of a path up to where it failed that is tried again.
_CUT = 0.8
# Between links and part at the start, along the approach, in radii of the sphere.
_ROOM = 0.1
# Time to settle of a draft that failed while the tip slid or after a hard touch [s].
_CALM_LEAD_IN = 1.5
# A run that is cut before links reach the part ends this part of its time earlier, and is no
# shorter than this [s].
_BEFORE, _SHORTEST = 0.9, 0.2

Draft = Callable[[RobotSection, Plan], tuple[str, Built]]


class Working(NamedTuple):
    """A scenario that works."""

    text: str
    built: Built
    why: tuple[str, ...]
    """One sentence for each choice that was made for the user."""
    part: str = ""
    """The URDF of a free part that it names."""


def repaired(one: Plan, fault: Fault) -> Plan | None:
    """Return what to try in place of a draft that failed; None: nothing."""
    press = one.control
    if not isinstance(press, Press) or one.repair in ("stays", "cut"):
        return None
    if fault.kind == "force" and not one.repair:
        return replace(one, control=press.calmed(), repair="calmed")
    # Up to where it failed the path will do.
    along = np.cumsum([0.0, *np.linalg.norm(np.diff(press.path, axis=0), axis=1)])
    count = int((along < _CUT * press.speed * (fault.t - press.lead_in)).sum())
    if not press.slides or along[max(count - 1, 0)] < SHORTEST_PATH * one.tips[0].radius:
        return None
    length = along[count - 1]
    return replace(
        one,
        control=replace(press, path=press.path[:count]),
        duration=rounded(one.duration - (along[-1] - length) / press.speed, 3),
        why=(*_still_true(one), f"the tip slides over {mm(length)}: farther {fault.text}"),
        repair="cut",
    )


def _still_true(plan: Plan) -> tuple[str, ...]:
    return tuple(one for one in plan.why if not one.startswith("the tip slides"))


def find_working(asked: Asked, built: Built, tips: Sequence[Tip], draft: Draft) -> Working:
    """Return a scenario that works.

    `draft(section, plan)` writes and builds one. Each is run: the first that touches, holds its
    force and keeps the robot's links out of the part is taken.

    Raises
    ------
    SphshellError
        None does; the text says what fails and what to change. CannotStand of a robot that floats.
    """
    if floats(built.assembly.model):
        return _drop(asked, built, tips, draft)
    search = _Search(asked, built, tips[0], draft)
    found = search.find()
    if found is None:
        raise refusal(tips[0].frame, asked, search.tried)
    return found


def sphere_centers(built: Built, tips: Sequence[Tip]) -> Array:
    """Return the spheres' centers (k, 3) [m] in the world at the start."""
    model = built.assembly.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, built.assembly.q0)
    return np.array([data.oMf[find_frame(model, tip.frame)].act(tip.offset) for tip in tips])


class Candidate(NamedTuple):
    """A place with what a plan needs to press there."""

    place: Place
    way: Way
    materials: tuple[Material, Material]
    force: float
    gap: float
    weak: bool
    """Whether the efforts that its file states do not carry the robot."""


class _Search:
    """The search for a place where the tip of a robot with a fixed base presses."""

    def __init__(self, asked: Asked, built: Built, tip: Tip, draft: Draft) -> None:
        self.asked, self.built, self.tip, self.draft = asked, built, tip, draft
        (self.section,), self.tried = built.scenario.robot, Tried()
        self.model = model = built.assembly.model
        (self.shell,) = built.shells.values()
        if int(model.frames[find_frame(model, tip.frame)].parentJoint) == 0:
            raise SphshellError(
                f"no joint moves frame '{tip.frame}': name another with --frame, or let the root "
                "float with --free-flyer"
            )
        geometry, aside = built.assembly.loaded[0].collision_model, joints_aside(model, tip)
        known = WORKING.get(self.section.name or "", ())
        self.q = np.array(known) if len(known) == model.nq else built.assembly.q0
        self.links = Links(model, geometry, self.shell, [tip], aside, self.q)
        self.room = _ROOM * tip.radius

    def find(self) -> Working | None:
        """Return the first draft that works, None if none does."""
        for section, plan in self._plans():
            found = self._repaired(section, plan)
            if found is not None:
                return found
        return None

    def _plans(self) -> Iterator[tuple[RobotSection, Plan]]:
        """Yield what is tried: paths, then one place of those that failed, then other places."""
        still: list[Candidate] = []
        for one in self._candidates():
            if not one.way.why:
                yield self._planned(one)
                if self.tried.runs >= _MOST_SLIDES:
                    break
                continue
            # It presses there, if it slides nowhere.
            still.append(one)
            if len(still) >= _MOST_STILL:
                break
        if self.asked.slides:
            self.tried.ways += [one.way.why for one in still]
            still = []
        yield from self.tried.stays
        yield from map(self._planned, still)

    def _candidates(self) -> Iterator[Candidate]:
        asked, tip = self.asked, self.tip
        for found in self._places():
            stance = found.stance
            pair = chosen_materials(asked, [tip], stance.mass)
            weak = not stance.force
            stance = replace(stance, force=NO_LIMIT) if weak else stance
            try:
                force = press_force(stance, tip, pair, asked.press)
            except SphshellError as error:  # of this posture: another one may do
                self.tried.errors.append(error)
                continue
            gap = press_gap(tip.radius, force, stance.mass, pair)
            place = found.with_gap(gap)
            way = find_way(asked, place, self.links, tip.radius, gap, self.room)
            yield Candidate(place, way, pair, force, gap, weak)

    def _planned(self, one: Candidate) -> tuple[RobotSection, Plan]:
        stance = one.place.stance
        kinds = stated_kinds(self.model, stance.lock)
        stands = {
            "lock": list(stance.lock),
            "start": _changed_joints(self.model, self.built.assembly.q0, stance.q),
            "joints": [kind for kind in kinds if not (one.weak and kind == "effort")],
        }
        return self.section.model_copy(update=stands), press_plan(self.tip, *one)

    def _places(self) -> Iterator[Place]:
        """Yield places of the part before the tip, those on the floor of the robot's base first.

        The tip presses down if nothing else is asked for, else as its limb points, else sideways.
        """
        asked, model, shell, tip = self.asked, self.model, self.shell, self.tip
        gap = TIP_GAP * tip.radius
        bench = Bench(self.built, tip, self.links, self.q, 2 * gap, self.tried)
        directions = [PLACES[asked.place]] if asked.place else list(PLACES.values())
        pressed = approaches(model, self.q, tip, directions)
        if asked.fixed:
            spots = asked_touches(asked, shell, tip.radius, gap)
            choices = [(nearest_side(spots[0].normal), spots)]
        else:
            side = {"cylinder": np.eye(3)[0], "bowl": np.eye(3)[2]}.get(asked.word or "")
            choices = [
                (one, list(touch_points(shell, tip.radius, gap, toward=one, inside=asked.inside)))
                for one in (sides(shell) if side is None else [side])
            ]
        for approach in pressed[:1] if asked.place else pressed:
            # Upright ones first, as they stand in their file.
            ordered = sorted(choices, key=lambda one: abs(one[0][2] + approach[2]) > 1e-3)
            for room in (self.room, 0.0):
                for side, some in ordered:
                    for on_floor in (True, False):
                        yield from bench.places(side, some, approach, on_floor=on_floor, room=room)

    def _repaired(self, section: RobotSection, plan: Plan) -> Working | None:
        """Run a draft, and those that repair it; return the first that works."""
        tried = self.tried
        one: Plan | None = plan
        while one is not None and tried.runs < _MOST_RUNS:
            text, built = self.draft(section, one)
            fault = try_out(built, one, self.links)
            tried.runs += 1
            if fault is None:
                return Working(text, built, (*one.why, one.contact.note))
            tried.faults.append(fault)
            if self.asked.tell is not None:
                self.asked.tell(f"tried, run {tried.runs}: {fault.text}")
            if one.repair == "" and len(tried.stays) < _MOST_STILL and not self.asked.slides:
                tried.stays += [(section, other) for other in _still(one, fault)]
            if fault.cut and "effort" in section.joints:
                kinds = [kind for kind in section.joints if kind != "effort"]
                section = section.model_copy(update={"joints": kinds})
                one = replace(plan, why=(*plan.why, WEAK))
                continue
            one = repaired(one, fault)
            one = None if one and self.asked.slides and one.repair == "cut" else one
        return None


def stated_kinds(model: pin.Model, lock: Sequence[str]) -> list[str]:
    """Return what the model states of the joints that move, as `[robot] joints` lists it."""
    return list(JointComponents.from_model(model).without(lock).kinds())


def _still(plan: Plan, fault: Fault) -> list[Plan]:
    """Return the plan that presses in one place, which a path may have failed.

    It is tried if no path works anywhere.
    """
    control, why = plan.control, plan.why
    if not isinstance(control, Press) or (fault.kind == "links" and fault.t < control.lead_in):
        return []
    if control.slides:
        why = (
            *_still_true(plan),
            f"the tip presses in one place and does not slide: with a path {fault.text}",
        )
    stays = replace(control, path=control.path[:1], lead_in=_CALM_LEAD_IN)
    return [replace(plan, control=stays, duration=_CALM_LEAD_IN + 0.5, repair="stays", why=why)]


def _drop(asked: Asked, built: Built, tips: Sequence[Tip], draft: Draft) -> Working:
    model, q0 = built.assembly.model, built.assembly.q0
    (shell,) = built.shells.values()
    if any(one is not None for one in (asked.press, asked.place, asked.at, asked.path)):
        said = "a robot that floats comes down on the surface by its weight: leave out --press, "
        hold = ", or hold it with --base fixed" if model.njoints > 2 else ""
        raise SphshellError(f"{said}--place, --at and --path{hold}")
    centers = sphere_centers(built, tips)
    root, lock = q0[:7], tuple[str, ...]()
    if int(model.frames[find_frame(model, tips[0].frame)].parentJoint) == 1:
        lock = joints_aside(model, tips[0])
        pair = chosen_materials(asked, tips, 0.0)
        plan = plan_fall(shell, tips[0], centers[0], root, pair, inside=asked.inside)
        tips = tips[:1]
    else:
        if asked.inside:
            raise SphshellError("a robot cannot stand in a bowl: take another --surface")
        inertia = np.diag(mass_matrix(model, q0))[6:]
        mass = float(pin.computeTotalMass(model))
        leg = float(np.linalg.norm(root[:3] - centers, axis=1).max())
        pair = chosen_materials(asked, tips, mass / len(tips))
        plan = plan_stand(shell, tuple(tips), centers, mass, inertia, leg, pair)
    links = Links(model, built.assembly.loaded[0].collision_model, shell, tips, lock)
    stated = {"joints": stated_kinds(model, lock), "lock": list(lock)}
    section = built.scenario.robot[0].model_copy(update=stated)
    tried = Tried(postures=1)
    while True:
        text, made = draft(section, plan)
        fault = try_out(made, plan, links)
        tried.runs += 1
        if fault is None:
            return Working(text, made, (*plan.why, plan.contact.note))
        tried.faults.append(fault)
        end = rounded(_BEFORE * fault.t)
        # What can stand has to stand.
        falls = fault.kind == "links" and (plan.control is None or len(plan.tips) < 3)
        if not falls or end < _SHORTEST or tried.runs >= _MOST_DROPS:
            raise cannot_stand(tried, has_joints=model.njoints > 2)
        note = f"the run ends after {end:g} s, before link '{fault.link}' comes down on the surface"
        plan = replace(plan, duration=end, why=(*plan.why, note))


def _changed_joints(model: pin.Model, q0: Array, q: Array) -> dict[str, float | list[float]]:
    start: dict[str, float | list[float]] = {}
    for name in list(model.names)[1:]:
        span, _ = joint_spans(model, name)
        if not np.array_equal(q[span], q0[span]):
            values = [round(float(one), 9) for one in q[span]]
            start[name] = values[0] if len(values) == 1 else values
    return start
