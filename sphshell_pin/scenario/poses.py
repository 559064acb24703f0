"""How a robot presses: a posture that can move its tip, a direction, the effective mass."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.dynamics.models import find_frame, reduced_model
from sphshell_pin.scenario.bodies import restrict
from sphshell_pin.scenario.tips import Tip

Array = npt.NDArray[np.float64]

# How far a tip may slide, as a part of its reach.
SLIDE = 0.15
# Mobility along the approach, as a part of the best one, below which a posture is singular.
_MOBILE = 0.02
# The same, which a posture that has to be bent shall reach.
_EASY = 0.1
# Of a slide: in how many steps it is tried, and the turn of a joint [rad] that would move the tip
# by its reach, beyond which a posture is near a singular one.
_SLIDE_STEPS = 20
_FASTEST = 6.0
# Cosine between a limb and straight down up to which it presses down.
_DOWNWARD = 0.5
# How far joints are bent out of a singular posture [rad or m], in turn, and how often it is tried.
_BENDS = (0.3, 0.6, 0.9)
_TRIES = 40
# Of the smallest joint coordinate to the limit that it leaves, as a part of its range.
_MARGIN = 0.02


@dataclass(frozen=True)
class Stance:
    """A robot at the start, seen from its tip; vectors and points in the world."""

    model: pin.Model
    """Without the joints that do not move the tip."""
    q: Array
    """Configuration of the whole robot (nq,)."""
    coordinates: Array
    """Configuration of `model`."""
    lock: tuple[str, ...]
    """Joints that do not move the tip."""
    origin: Array
    """Of the tip's frame (3,) [m]."""
    center: Array
    """Of the tip's sphere (3,) [m]."""
    approach: Array
    """Unit (3,): where the tip presses."""
    slide: Array | None
    """Unit (3,) across the approach: where the tip moves best; None where it cannot."""
    room: float
    """How far the tip can slide without turning [m]; no farther is tried than `SLIDE` reaches."""
    mass: float
    """Effective mass along the approach [kg]."""
    slide_mass: float
    """Effective mass along the slide [kg]; that along the approach where there is none."""
    inertia: float
    """Mean effective inertia about the tip [kg m^2]; 0 with fewer than six joints."""
    joint_inertia: Array
    """Diagonal of the mass matrix (nv,), of the joints that move."""
    force: float
    """Largest push along the approach that the joints' effort limits allow [N]; inf if unknown."""
    reach: float
    """From the tip to the farthest joint that moves it [m]."""
    bent: bool
    """Whether the posture had to be bent out of a singular one, or into its limits."""


def take_stance(model: pin.Model, q: Array, tip: Tip, approach: Array | None) -> Stance:
    """Return how the robot stands with its tip near the configuration q (nq,).

    `approach` (3,) is where the tip shall press; by default down if its limb points down, else as
    it points, or where it moves best if it cannot move there. A posture in which it cannot move is
    bent a little, always in the same direction.
    """
    lock = _joints_aside(model, tip)
    inside = _into_limits(model, q)
    best, best_score = _bend(model, inside, lock, tip, approach, best_way=False)
    if best_score < _MOBILE and approach is None:
        best, _ = _bend(model, inside, lock, tip, approach, best_way=True)
    return _with_room(replace(best, bent=not np.array_equal(best.q, q)), tip)


def _bend(
    model: pin.Model,
    inside: Array,
    lock: tuple[str, ...],
    tip: Tip,
    approach: Array | None,
    *,
    best_way: bool,
) -> tuple[Stance, float]:
    """Return the stance at `inside`, or a bent one where that cannot move, and its mobility."""
    rng = np.random.default_rng(0)
    moving = [j for j in range(1, model.njoints) if model.names[j] not in lock]
    best, best_score = _stance(model, inside, lock, tip, approach, best_way=best_way)
    bends = _BENDS if best_score < _MOBILE else ()
    for bend in bends:
        if best_score >= _EASY:
            break
        for _ in range(_TRIES):
            step = np.zeros(model.nv)
            for j in moving:
                joint = model.joints[j]
                step[joint.idx_v : joint.idx_v + joint.nv] = rng.uniform(-bend, bend, joint.nv)
            bent = _into_limits(model, pin.integrate(model, inside, step))
            one, score = _stance(model, bent, lock, tip, approach, best_way=best_way)
            if score > best_score:
                best, best_score = one, score
    return best, best_score


def _joints_aside(model: pin.Model, tip: Tip) -> tuple[str, ...]:
    """Return the joints that do not move the tip; none are left aside of a robot that floats."""
    parent = int(model.frames[find_frame(model, tip.frame)].parentJoint)
    chain = set(model.supports[parent])
    return tuple(model.names[j] for j in range(1, model.njoints) if j not in chain)


def _into_limits(model: pin.Model, q: Array) -> Array:
    """Return q with every joint of one coordinate inside its limits."""
    inside = np.array(q, dtype=float)
    for j in range(1, model.njoints):
        joint = model.joints[j]
        if joint.nq != 1:
            continue
        low = model.lowerPositionLimit[joint.idx_q]
        high = model.upperPositionLimit[joint.idx_q]
        if np.isfinite(low) and np.isfinite(high) and low < high:
            room = _MARGIN * (high - low)
            if not low <= inside[joint.idx_q] <= high:
                inside[joint.idx_q] = np.clip(inside[joint.idx_q], low + room, high - room)
    return inside


def _stance(
    model: pin.Model,
    q: Array,
    lock: tuple[str, ...],
    tip: Tip,
    approach: Array | None,
    *,
    best_way: bool,
) -> tuple[Stance, float]:
    """Return the stance at q, and its mobility along the approach as a part of the best one.

    Without an `approach` it is forward; with `best_way`, where the tip moves best if not forward.
    """
    reduced = reduced_model(model, lock, q) if lock else model
    short, _ = restrict(model, reduced, q, np.zeros(model.nv))
    data = reduced.createData()
    pin.computeJointJacobians(reduced, data, short)
    pin.updateFramePlacements(reduced, data)
    pin.crba(reduced, data, short)
    mass_matrix = np.triu(data.M) + np.triu(data.M, 1).T
    frame = find_frame(reduced, tip.frame)
    pose = data.oMf[frame]
    center = pose.act(tip.offset)
    local = pin.getFrameJacobian(reduced, data, frame, pin.LOCAL_WORLD_ALIGNED)
    linear = local[:3] - pin.skew(center - pose.translation) @ local[3:]
    mobility = linear @ np.linalg.solve(mass_matrix, linear.T)
    values, axes = np.linalg.eigh(mobility)
    top = max(float(values[-1]), 1e-300)
    if approach is None:
        approach = _forward(data, pose, tip)
        if best_way and approach @ mobility @ approach < _MOBILE * top:
            approach = _roomier(reduced, short, linear, mass_matrix, _upright(axes[:, -1]))
    along = float(approach @ mobility @ approach)
    across = np.eye(3) - np.outer(approach, approach)
    sideways, slides = np.linalg.eigh(across @ mobility @ across)
    slide = None
    if sideways[-1] > _MOBILE * top:
        slide = _upright(slides[:, -1])
    pushes = np.abs(linear.T @ approach)
    limits = np.array(reduced.upperEffortLimit)
    limited = (pushes > 1e-9) & np.isfinite(limits) & (limits > 0)
    joints = [np.asarray(one.translation) for one in list(data.oMi)[1:]]
    inertia = 0.0
    if reduced.nv >= 6:
        turning = local[3:] @ np.linalg.solve(mass_matrix, local[3:].T)
        inertia = 3.0 / float(np.trace(turning))
    stance = Stance(
        model=reduced,
        q=q,
        coordinates=short,
        lock=lock,
        origin=np.array(pose.translation),
        center=center,
        approach=approach,
        slide=slide,
        room=0.0,
        mass=1 / max(along, 1e-9),
        slide_mass=1 / max(float(sideways[-1]) if slide is not None else along, 1e-9),
        inertia=inertia,
        joint_inertia=np.diag(mass_matrix).copy(),
        force=float(np.min(limits[limited] / pushes[limited])) if limited.any() else np.inf,
        reach=max((float(np.linalg.norm(center - one)) for one in joints), default=0.0),
        bent=False,
    )
    # Where the tip can slide, both ways count: a stretched arm slides sideways at best.
    usable = min(along, float(sideways[-1])) if reduced.nv > 1 else along
    return stance, usable / top


def _forward(data: pin.Data, pose: pin.SE3, tip: Tip) -> Array:
    """Return where there is nothing of the robot before the tip: down, or as its limb points.

    A sphere before its frame is pressed as the frame points, else the frame would be dragged beside
    it; any other along the line to it from the last joint that is not inside it. On a surface
    beside that line or behind it the limb would pass through the surface.
    """
    if tip.offset.any():
        ahead: Array = pose.rotation @ tip.offset
        return ahead / np.linalg.norm(ahead)
    down = np.array([0.0, 0.0, -1.0])
    for joint in reversed(list(data.oMi)[1:]):
        limb = pose.translation - joint.translation
        length = float(np.linalg.norm(limb))
        if length > tip.radius:
            return down if limb @ down > _DOWNWARD * length else _upright(limb / length, free=False)
    return down


def _with_room(stance: Stance, tip: Tip) -> Stance:
    """Return the stance with its slide turned to where there is more room, and how much."""
    if stance.slide is None:
        return stance
    ways = [(_slide_room(stance, tip, sign * stance.slide), sign) for sign in (1.0, -1.0)]
    room, sign = max(ways)
    return replace(stance, slide=sign * stance.slide, room=room)


def _slide_room(stance: Stance, tip: Tip, direction: Array) -> float:
    """Return how far [m] the tip moves along `direction` before a limit or a singular posture."""
    model = stance.model
    data, frame = model.createData(), find_frame(model, tip.frame)
    q = stance.coordinates
    step = SLIDE * stance.reach / _SLIDE_STEPS
    rows = 6 if model.nv >= 6 else 3
    goal = np.concatenate([step * direction, np.zeros(3)])[:rows]
    for k in range(_SLIDE_STEPS):
        jacobian = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)[:rows]
        turn, *_ = np.linalg.lstsq(jacobian, goal, rcond=1e-3)
        q = pin.integrate(model, q, turn)
        fast = np.abs(turn).max() > _FASTEST * step / stance.reach
        astray = np.linalg.norm(jacobian @ turn - goal) > 0.1 * step
        if fast or astray or not np.array_equal(_into_limits(model, q), q):
            return k * step
    return _SLIDE_STEPS * step


def _upright(axis: Array, *, free: bool = True) -> Array:
    """Return `axis` along the nearest coordinate axis, where it nearly is one; `free`: in its +."""
    k = int(np.argmax(np.abs(axis)))
    sign = np.sign(axis[k])
    upright: Array = axis * sign
    if abs(axis[k]) > 0.97:
        upright = np.eye(3)[k]
    return upright if free else sign * upright


def _roomier(model: pin.Model, q: Array, linear: Array, mass_matrix: Array, axis: Array) -> Array:
    """Return `axis` or its opposite: the direction in which the joints are farther from limits."""
    rates = np.linalg.solve(mass_matrix, linear.T @ axis)
    rooms = []
    for sign in (1.0, -1.0):
        room = np.inf
        for j in range(1, model.njoints):
            joint = model.joints[j]
            rate = sign * rates[joint.idx_v]
            if joint.nq != 1 or abs(rate) < 1e-9 * np.abs(rates).max():
                continue
            limit = (model.upperPositionLimit if rate > 0 else model.lowerPositionLimit)[
                joint.idx_q
            ]
            if np.isfinite(limit):
                room = min(room, abs(limit - q[joint.idx_q]) / abs(rate))
        rooms.append(room)
    return axis if rooms[0] >= rooms[1] else -axis
