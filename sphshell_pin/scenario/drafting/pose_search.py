"""The search for a draft that works: postures, and places and turns of the part."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.contact.materials import Material, find_material
from sphshell_pin.dynamics.scene.joint_components import JointComponents
from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import WORKING
from sphshell_pin.scenario.drafting.clearance import Links, SelfContact
from sphshell_pin.scenario.drafting.fingertips import Tip, floats
from sphshell_pin.scenario.drafting.plan import (
    GRAVITY,
    Plan,
    Press,
    bearable,
    plan_fall,
    plan_stand,
    press_plans,
)
from sphshell_pin.scenario.drafting.poses import Stance, stances
from sphshell_pin.scenario.drafting.trial import Fault, try_out
from sphshell_pin.scenario.format.bodies import joint_spans
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.scenario.format.schema import RobotSection

Array = npt.NDArray[np.float64]

PLACES: dict[str, tuple[float, float, float]] = {
    "below": (0.0, 0.0, -1.0),
    "above": (0.0, 0.0, 1.0),
    "+x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
}
"""Where the surface is placed, seen from the tip."""

# Drafts that are run: of one posture, and in all.
_MOST_OF_STANCE, _MOST_RUNS = 3, 9
# Between links and part at the start, along the approach, in radii of the sphere.
_ROOM = 0.1
# Of a draft that fails while the tip slides or after a hard touch: time to settle [s].
_CALM_LEAD_IN = 1.5
# A run that is cut before links reach the part ends this part of its time earlier, and is no
# shorter than this [s].
_BEFORE, _SHORTEST = 0.9, 0.2

Draft = Callable[[RobotSection, Plan], tuple[str, Built]]


@dataclass(frozen=True)
class Request:
    """What the user asked for; `word` names a surface that needs no file."""

    material: str | None
    against: str
    press: float | None
    place: str | None
    word: str | None

    def materials(self, tips: Sequence[Tip], load: float) -> tuple[Material, Material]:
        """Return what sphere and surface are made of; `load` [kg] rests on each, 0: it falls."""
        other = find_material(self.against)
        if self.material is not None:
            return find_material(self.material), other
        if not load:
            return find_material("steel"), other
        # A tip is of rubber, unless the mass behind it would press rubber in too far.
        rubber, radius = find_material("rubber"), min(tip.radius for tip in tips)
        bears = bearable(radius, rubber, other) >= load * GRAVITY
        return rubber if bears else find_material("plastic"), other


@dataclass
class _Tried:
    """What a search came across, for the sentence that refuses."""

    postures: int = 0
    places: int = 0
    runs: int = 0
    blocked: Counter[str] = field(default_factory=Counter)
    faults: list[Fault] = field(default_factory=list)
    without: tuple[str, ...] = ()
    """Kinds of what acts in the joints that are left out."""
    note: str = ""
    """Why they are."""
    errors: list[SphshellError] = field(default_factory=list)

    def leave_out(self, kind: str, fault: Fault) -> None:
        """Leave one more kind of what the file states of the joints out, for this `fault`."""
        self.without = (*self.without, kind)
        self.note = (
            f"the {' and '.join(self.without)} that the robot's file states for its joints is not "
            f"modeled, because with it {fault.text}"
        )


def find_working(
    section: RobotSection, built: Built, tips: Sequence[Tip], request: Request, draft: Draft
) -> tuple[str, Built, Plan]:
    """Return the text of a scenario that works, what is built of it, and its plan.

    `draft(section, plan)` writes and builds one. Each is run: the first that touches, holds its
    force and keeps the robot's links out of the part is taken.

    Raises
    ------
    SphshellError
        None does; the text says what fails and what to change.
    """
    if floats(built.assembly.model):
        return _drop(section, built, tips, request, draft)
    return _press(section, built, tips, request, draft)


def sphere_centers(built: Built, tips: Sequence[Tip]) -> Array:
    """Return the spheres' centers (k, 3) [m] in the world at the start."""
    model = built.assembly.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, built.assembly.q0)
    return np.array([data.oMf[find_frame(model, tip.frame)].act(tip.offset) for tip in tips])


def _press(
    section: RobotSection, built: Built, tips: Sequence[Tip], request: Request, draft: Draft
) -> tuple[str, Built, Plan]:
    tip, model, q0 = tips[0], built.assembly.model, built.assembly.q0
    (shell,) = built.shells.values()
    if int(model.frames[find_frame(model, tip.frame)].parentJoint) == 0:
        raise SphshellError(
            f"no joint moves frame '{tip.frame}': name another with --frame, or let the root "
            "float with --free-flyer"
        )
    geometry = built.assembly.loaded[0].collision_model
    q_work = _working_posture(section, model, q0)
    approach = None if request.place is None else np.array(PLACES[request.place])
    side = {"cylinder": (1.0, 0.0, 0.0), "bowl": (0.0, 0.0, 1.0)}.get(request.word or "")
    toward = None if side is None else np.array(side)
    tried = _Tried()
    touching = SelfContact(model, geometry, q_work).found
    postures: list[Stance] = []

    def found_now() -> Iterator[Stance]:
        for one in stances(model, q_work, tip, approach, touching):
            postures.append(one)
            tried.postures += 1
            yield one

    rooms = ((_ROOM * tip.radius, one) for one in found_now())
    for room, stance in itertools.chain(rooms, ((0.0, one) for one in postures)):
        links = Links(model, geometry, shell, [tip], stance.lock)

        def blocked(
            placement: pin.SE3, stance: Stance = stance, links: Links = links, room: float = room
        ) -> bool:
            tried.places += 1
            # With a little room, as the tip yields when it is pressed on and slides.
            nearer = pin.SE3(placement.rotation, placement.translation - room * stance.approach)
            found = links.within(stance.q, nearer, whole=True)
            if found is not None:
                tried.blocked[found.link] += 1
            return found is not None

        pair = request.materials(tips, stance.mass)
        inside = request.word == "bowl"
        plans = press_plans(
            shell, tip, stance, pair, request.press, blocked, toward=toward, inside=inside
        )
        start = _changed_joints(model, q0, stance.q)
        stood = section.model_copy(
            update={
                "lock": list(stance.lock),
                "start": start,
                "joints": stated_kinds(model, stance.lock),
            }
        )
        try:
            found = _first_working(stood, plans, links, draft, tried)
        except SphshellError as error:  # of this posture: another one may do
            tried.errors.append(error)
            continue
        if found is not None:
            return found
        if tried.runs >= _MOST_RUNS:
            break
    raise _refusal(tip, request, tried)


def stated_kinds(model: pin.Model, lock: Sequence[str]) -> list[str]:
    """Return what the model states of the joints that move, as `[robot] joints` lists it."""
    return list(JointComponents.from_model(model).without(lock).kinds())


def _first_working(
    section: RobotSection, plans: Iterator[Plan], links: Links, draft: Draft, tried: _Tried
) -> tuple[str, Built, Plan] | None:
    runs = 0
    for plan in plans:
        queue = [plan]
        while queue:
            one = queue.pop(0)
            if tried.without and not one.left_out:
                one = replace(one, left_out=tried.without, why=(*one.why, tried.note))
            text, built = draft(_without(section, one), one)
            fault = try_out(built, one, links)
            tried.runs += 1
            runs += 1
            if fault is None:
                return text, built, one
            tried.faults.append(fault)
            kept = fault.kind in ("links", "run") or fault.excess
            left = [] if kept else _without(section, one).joints
            if "friction" in left:
                tried.leave_out("friction", fault)
                queue = [plan]
            elif not queue and one.repair == "":
                queue = _repairs(one, fault)
            elif not queue and "damping" in left:
                # The tip creeps to the surface, or drags behind.
                tried.leave_out("damping", fault)
                queue = [plan]
        if runs >= _MOST_OF_STANCE or tried.runs >= _MOST_RUNS:
            return None
    return None


def _without(section: RobotSection, plan: Plan) -> RobotSection:
    """Return the robot's table without what the plan leaves out of the joints."""
    kinds = [kind for kind in section.joints if kind not in plan.left_out]
    return section.model_copy(update={"joints": kinds})


def _repairs(plan: Plan, fault: Fault) -> list[Plan]:
    """Return what may repair the `fault` of a plan in the same place."""
    control = plan.control
    if not isinstance(control, Press) or (fault.kind == "links" and fault.t < control.lead_in):
        return []
    repairs = []
    if fault.kind == "force" and any(control.posture_stiffness):
        loose = replace(control, posture_stiffness=())
        repairs.append(replace(plan, control=loose, repair="loose"))
    stays = replace(control, path=control.path[:1], lead_in=_CALM_LEAD_IN)
    duration = _CALM_LEAD_IN + 0.5
    why = plan.why
    if len(control.path) > 1:
        why = (*why, f"the tip presses in one place and does not slide: with a path {fault.text}")
    return [*repairs, replace(plan, control=stays, duration=duration, repair="stays", why=why)]


def _drop(
    section: RobotSection, built: Built, tips: Sequence[Tip], request: Request, draft: Draft
) -> tuple[str, Built, Plan]:
    model, q0 = built.assembly.model, built.assembly.q0
    (shell,) = built.shells.values()
    inside = request.word == "bowl"
    if request.press is not None or request.place is not None:
        raise SphshellError(
            "a robot that floats comes down on the surface by its weight: leave out --press "
            "and --place"
        )
    centers = sphere_centers(built, tips)
    root = q0[:7]
    if model.njoints == 2:
        pair = request.materials(tips, 0.0)
        plan = plan_fall(shell, tips[0], centers[0], root, pair, inside=inside)
        tips = tips[:1]
    else:
        if inside:
            raise SphshellError("a robot cannot stand in a bowl: take another --surface")
        data = model.createData()
        inertia = np.diag(pin.crba(model, data, q0))[6:]
        mass = float(pin.computeTotalMass(model))
        leg = float(np.linalg.norm(root[:3] - centers, axis=1).max())
        pair = request.materials(tips, mass / len(tips))
        plan = plan_stand(shell, tuple(tips), centers, mass, inertia, leg, pair)
    links = Links(model, built.assembly.loaded[0].collision_model, shell, tips, ())
    section = section.model_copy(update={"joints": stated_kinds(model, ())})
    tried = _Tried(postures=1)
    while True:
        text, made = draft(section, plan)
        fault = try_out(made, plan, links)
        tried.runs += 1
        if fault is None:
            return text, made, plan
        tried.faults.append(fault)
        end = float(f"{_BEFORE * fault.t:.2g}")
        # What can stand has to stand.
        falls = fault.kind == "links" and (plan.control is None or len(plan.tips) < 3)
        if not falls or end < _SHORTEST or tried.runs >= _MOST_OF_STANCE:
            raise _refusal(tips[0], request, tried, floating=True)
        note = f"the run ends after {end:g} s, before link '{fault.link}' comes down on the surface"
        plan = replace(plan, duration=end, why=(*plan.why, note))


def _working_posture(section: RobotSection, model: pin.Model, q0: Array) -> Array:
    """Return the posture in which the robot is known to work, else its reference posture."""
    known = WORKING.get(section.name or "", ())
    return np.array(known) if len(known) == model.nq else q0


def _changed_joints(model: pin.Model, q0: Array, q: Array) -> dict[str, float | list[float]]:
    start: dict[str, float | list[float]] = {}
    for name in list(model.names)[1:]:
        span, _ = joint_spans(model, name)
        if not np.array_equal(q[span], q0[span]):
            values = [round(float(one), 9) for one in q[span]]
            start[name] = values[0] if len(values) == 1 else values
    return start


def _refusal(tip: Tip, request: Request, tried: _Tried, *, floating: bool = False) -> SphshellError:
    """Return the error that says why no draft works, and what to change."""
    way = f"along {request.place}" if request.place else "where its limb points"
    if not tried.postures:
        return SphshellError(
            f"the tip on frame '{tip.frame}' cannot move {way} in any posture that was tried: its "
            "joints do not allow it; take another --place or --frame"
        )
    if tried.faults:
        fault = tried.faults[-1]
        when = f" at t = {fault.t:.2g} s" if fault.link else ""
        advice = _ADVICE_FLOATING if floating else _ADVICE[fault.kind]
        return SphshellError(
            f"no draft works ({_count(tried.runs, 'run')}): {fault.text}{when}; {advice}"
        )
    if tried.errors:
        return tried.errors[0]
    if tried.blocked:
        ((link, _),) = tried.blocked.most_common(1)
        advice = _ADVICE_BOWL if request.word == "bowl" else _ADVICE["links"]
        return SphshellError(
            f"link '{link}' would be in the part, or another one: in each of "
            f"{_count(tried.postures, 'posture')} and {_count(tried.places, 'place')} on the part "
            f"that were tried; {advice}"
        )
    return SphshellError("the surface has no point to touch")


_ADVICE = {
    "run": "take a softer --law, or a larger --radius",
    "touch": "take another --place, or another --frame",
    "force": "take a smaller --radius, another --press or --place",
    "links": "take another --place, a smaller part, or a sphere farther out (--frame, --offset)",
    "figure": "take another --law or --radius",
}
_ADVICE_BOWL = "the bowl is a whole ball, which the limb would pass: take the file of an open one"
_ADVICE_FLOATING = (
    "take a flatter or larger part, on which all spheres can come down, or another --law"
)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
