"""The search for a draft that works: directions to press in, places of the part, and repairs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeGuard

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.contact.materials import Material, find_material
from sphshell_pin.dynamics.scene.joint_components import JointComponents
from sphshell_pin.dynamics.scene.models import find_frame, model_reach
from sphshell_pin.errors import SphshellError
from sphshell_pin.robots import WORKING, floats
from sphshell_pin.scenario.drafting.asked import Asked
from sphshell_pin.scenario.drafting.clearance import Links, SelfContact
from sphshell_pin.scenario.drafting.fingertips import Tip
from sphshell_pin.scenario.drafting.placing import Bench, Place, nearest_side
from sphshell_pin.scenario.drafting.plan import (
    GRAVITY,
    TIP_GAP,
    Hold,
    Plan,
    Press,
    Way,
    bearable,
    find_way,
    plan_fall,
    plan_stand,
    press_force,
    press_gap,
    press_plan,
)
from sphshell_pin.scenario.drafting.poses import Stance, home_approach, joints_aside
from sphshell_pin.scenario.drafting.refusals import Tried, cannot_stand, refusal
from sphshell_pin.scenario.drafting.touch_points import sides, touch_points
from sphshell_pin.scenario.drafting.trial import Fault, try_out
from sphshell_pin.scenario.format.bodies import joint_spans
from sphshell_pin.scenario.format.build import Built
from sphshell_pin.scenario.format.schema import RobotSection
from sphshell_pin.shell.shell import Shell

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

# Drafts that are run, in all, before a path is given up, and of a robot that floats.
_MOST_RUNS, _MOST_SLIDES, _MOST_DROPS = 10, 6, 3
# Places at which the tip cannot slide, before one of them is taken.
_MOST_STILL = 12
# Of the part above the floor, in turn, as parts of the robot's reach.
_LIFTS = (0.0, 0.1, 0.25)
# How far joints may be under the floor [m]: not at all, but for rounding.
_AT_FLOOR = 1e-6
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
    asked: Asked
    tell: Callable[[str], None] | None = None
    """Called with what failed, while the search goes on."""

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


def find_working(
    section: RobotSection, built: Built, tips: Sequence[Tip], request: Request, draft: Draft
) -> tuple[str, Built, Plan]:
    """Return the text of a scenario that works, what is built of it, and its plan.

    `draft(section, plan)` writes and builds one. Each is run: the first that touches, holds its
    force and keeps the robot's links out of the part is taken.

    Raises
    ------
    SphshellError
        None does; the text says what fails and what to change. CannotStand of a robot that floats.
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
    tried = Tried()
    geometry = built.assembly.loaded[0].collision_model
    links = Links(model, geometry, shell, [tip], joints_aside(model, tip))
    still: list[Candidate] = []

    def work(one: Candidate) -> tuple[str, Built, Plan] | None:
        place, way, pair, force, gap = one
        tried.force = force
        stood = section.model_copy(
            update={
                "lock": list(place.stance.lock),
                "start": _changed_joints(model, q0, place.stance.q),
                "joints": stated_kinds(model, place.stance.lock),
            }
        )
        plan = press_plan(tip, place, way, pair, force, gap)
        return _first_working(stood, plan, links, draft, tried, request)

    for found in _places(section, built, tip, shell, links, request, tried):
        pair = request.materials(tips, found.stance.mass)
        try:
            force = press_force(found.stance, tip, pair, request.press)
        except SphshellError as error:  # of this posture: another one may do
            tried.errors.append(error)
            continue
        gap = press_gap(tip.radius, force, pair)
        place = found.with_gap(gap)
        nearer = place.placement.copy()
        nearer.translation -= _ROOM * tip.radius * place.stance.approach

        def free(q: Array, nearer: pin.SE3 = nearer) -> bool:
            return links.within(q, nearer) is None

        way = find_way(shell, place, tip.radius, gap, request.asked, free)
        one = Candidate(place, way, pair, force, gap)
        if way.why:
            # It presses there, if it slides nowhere.
            still.append(one)
            if len(still) >= _MOST_STILL:
                break
            continue
        if (done := work(one)) is not None:
            return done
        if tried.runs >= _MOST_SLIDES:
            break
    if request.asked.slides:
        tried.ways += [one.way.why for one in still]
        still = []
    for stood, plan in tried.stays:
        if (done := _first_working(stood, plan, links, draft, tried, request)) is not None:
            return done
    for one in still:
        if (done := work(one)) is not None:
            return done
    if request.press is None and tried.faults and tried.faults[-1].kind == "force":
        # What gives way turns less under a smaller force.
        gentle = replace(request, press=float(f"{tried.force / 2:.2g}"))
        text, made, plan = _press(section, built, tips, gentle, draft)
        note = f"half the force that suits its joints: {tried.faults[-1].text}"
        return text, made, replace(plan, why=(*plan.why, note))
    raise refusal(tip.frame, request.place, request.word, tried)


class Candidate(NamedTuple):
    """A place with what a plan needs to press there."""

    place: Place
    way: Way
    materials: tuple[Material, Material]
    force: float
    gap: float


def _places(
    section: RobotSection,
    built: Built,
    tip: Tip,
    shell: Shell,
    links: Links,
    request: Request,
    tried: Tried,
) -> Iterator[Place]:
    """Yield places of the part before the tip, those on the floor of the robot's base first.

    The tip presses down if nothing else is asked for, else as its limb points, else sideways.
    """
    model, geometry = built.assembly.model, built.assembly.loaded[0].collision_model
    q_work = _working_posture(section, model, built.assembly.q0)
    gap = TIP_GAP * tip.radius
    touching = SelfContact(model, geometry, q_work)
    data, at = model.createData(), pin.GeometryData(geometry)
    lowest = _floor(geometry)

    def usable(q: Array, floor: float | None) -> bool:
        if touching.found(q):
            return False
        pin.updateGeometryPlacements(model, data, geometry, at, q)
        heights = [
            pose.act(one.geometry.aabb_center)[2]
            for one, pose in zip(geometry.geometryObjects, at.oMg, strict=True)
            if one.parentJoint
        ]
        heights += [data.oMi[j].translation[2] for j in range(1, model.njoints)]
        return floor is None or min(heights) > floor - _AT_FLOOR

    def blocked(stance: Stance, placement: pin.SE3) -> str | None:
        # With a little room, as the tip yields when it is pressed on and slides.
        nearer = placement.copy()
        nearer.translation -= room * stance.approach
        found = links.within(stance.q, nearer, whole=True)
        return None if found is None else found.link

    bench = Bench(model, q_work, tip, shell, lowest, 2 * gap, usable, blocked, tried)
    approaches = [np.array(PLACES[request.place])] if request.place else None
    if approaches is None:
        down = np.array(PLACES["below"])
        found = [down, home_approach(model, q_work, tip), *map(np.array, PLACES.values())]
        approaches = list({tuple(one): one for one in found}.values())
    lifts = [part * model_reach(model) for part in _LIFTS]
    inside = request.word == "bowl"
    known = {"cylinder": np.eye(3)[0], "bowl": np.eye(3)[2]}.get(request.word or "")
    if request.asked.fixed:
        spots = request.asked.touches(shell, tip.radius, gap)
        choices = [(nearest_side(spots[0].normal), spots)]
    else:
        choices = [
            (side, list(touch_points(shell, tip.radius, gap, toward=side, inside=inside)))
            for side in ([known] if known is not None else sides(shell))
        ]
    for approach in approaches:
        # Upright ones first, as they stand in their file.
        ordered = sorted(choices, key=lambda one: abs(one[0][2] + approach[2]) > 1e-3)
        for room in (_ROOM * tip.radius, 0.0):  # noqa: B007 (read by `blocked`)
            for side, some in ordered:
                for lift in (*lifts, None):
                    yield from bench.places(side, some, approach, lift=lift)


def _floor(geometry: pin.GeometryModel) -> float:
    """Return the height [m] under what of the robot is fixed to the world, 0 at most."""
    lowest = 0.0
    for one in geometry.geometryObjects:
        one.geometry.computeLocalAABB()
        if not one.parentJoint:
            box = one.geometry.aabb_local
            corners = np.array(np.meshgrid(*zip(box.min_, box.max_, strict=True))).reshape(3, -1).T
            heights = corners @ one.placement.rotation[2] + one.placement.translation[2]
            lowest = min(lowest, float(heights.min()))
    return lowest


def stated_kinds(model: pin.Model, lock: Sequence[str]) -> list[str]:
    """Return what the model states of the joints that move, as `[robot] joints` lists it."""
    return list(JointComponents.from_model(model).without(lock).kinds())


def _first_working(
    section: RobotSection,
    plan: Plan,
    links: Links,
    draft: Draft,
    tried: Tried,
    request: Request,
) -> tuple[str, Built, Plan] | None:
    queue = [plan]
    while queue and tried.runs < _MOST_RUNS:
        one = queue.pop(0)
        if tried.without and not one.left_out:
            one = replace(one, left_out=tried.without, why=(*one.why, tried.note))
        text, built = draft(_without(section, one), one)
        fault = try_out(built, one, links)
        tried.runs += 1
        if fault is None:
            return text, built, one
        tried.faults.append(fault)
        if request.tell is not None:
            request.tell(f"tried, run {tried.runs}: {fault.text}")
        if one.repair == "" and len(tried.stays) < _MOST_STILL:
            tried.stays += [(section, other) for other in _still(one, fault, request)]
        control = one.control
        # Friction in the joints keeps the tip off the part, and against its motion.
        slides = control if isinstance(control, Press) and len(control.path) > 1 else None
        kept = fault.kind in ("links", "run") or (fault.excess and not slides)
        left = [] if kept else _without(section, one).joints
        if "friction" in left:
            tried.leave_out("friction", fault)
            queue = [plan]
        elif one.repair == "" and fault.kind == "force" and _pulled(control):
            loose = replace(control, posture_stiffness=())
            queue = [replace(one, control=loose, repair="loose")]
        elif not queue and "damping" in left:
            # The tip creeps to the surface, or drags behind.
            tried.leave_out("damping", fault)
            queue = [plan]
        elif not queue and slides and fault.kind == "force" and one.repair != "calmed":
            queue = [replace(one, control=slides.calmed(), repair="calmed")]
    return None


def _without(section: RobotSection, plan: Plan) -> RobotSection:
    """Return the robot's table without what the plan leaves out of the joints."""
    kinds = [kind for kind in section.joints if kind not in plan.left_out]
    return section.model_copy(update={"joints": kinds})


def _pulled(control: Press | Hold | None) -> TypeGuard[Press]:
    """Whether the posture pulls at the tip."""
    return isinstance(control, Press) and any(control.posture_stiffness)


def _still(plan: Plan, fault: Fault, request: Request) -> list[Plan]:
    """Return the plan that presses in one place, which a path may have failed, unless one is asked.

    It is tried if no path works anywhere.
    """
    control = plan.control
    early = fault.kind == "links" and isinstance(control, Press) and fault.t < control.lead_in
    if not isinstance(control, Press) or early or request.asked.slides:
        return []
    why = plan.why
    if len(control.path) > 1:
        why = tuple(one for one in why if not one.startswith("the tip slides"))
        why = (*why, f"the tip presses in one place and does not slide: with a path {fault.text}")
    stays = replace(control, path=control.path[:1], lead_in=_CALM_LEAD_IN)
    return [replace(plan, control=stays, duration=_CALM_LEAD_IN + 0.5, repair="stays", why=why)]


def _drop(
    section: RobotSection, built: Built, tips: Sequence[Tip], request: Request, draft: Draft
) -> tuple[str, Built, Plan]:
    model, q0 = built.assembly.model, built.assembly.q0
    (shell,) = built.shells.values()
    inside = request.word == "bowl"
    if request.press is not None or request.place is not None or not request.asked.is_default:
        said = "a robot that floats comes down on the surface by its weight: leave out --press, "
        hold = ", or hold it with --base fixed" if model.njoints > 2 else ""
        raise SphshellError(f"{said}--place, --at and --path{hold}")
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
    tried = Tried(postures=1)
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
        if not falls or end < _SHORTEST or tried.runs >= _MOST_DROPS:
            raise cannot_stand(tried)
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
