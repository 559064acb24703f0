"""How a robot presses: a posture that can move its tip, a direction, the effective mass."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from sphshell_pin.dynamics.scene.mimic import group_of
from sphshell_pin.dynamics.scene.models import find_frame, reduced_model
from sphshell_pin.scenario.drafting.fingertips import Tip
from sphshell_pin.scenario.format.bodies import restrict

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
# Other postures: seeds tried, steps to turn the limb along the approach, when it is so (cosine),
# how far from each other [rad or m] they have to be, and how many are taken.
_SEEDS, _TURNS, _ALONG, _APART, _MOST_STANCES = 24, 40, 0.99, 0.3, 5
# Cosine between limb and approach below which the limb is beside the tip or before it.
_BESIDE = 0.3
# Effort limits beyond this stand for none.
_NO_LIMIT = 1e9
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
    mobility: float = 1.0
    """Along the approach, and across it where the tip slides, as a part of the best one."""
    ahead: float = 1.0
    """Cosine between the approach and the limb that carries the tip; below 0 it is in the way."""

    @property
    def moves(self) -> bool:
        """Whether the tip can move along the approach."""
        return self.mobility >= _MOBILE


def stances(
    model: pin.Model,
    q: Array,
    tip: Tip,
    approach: Array | None,
    touching: Callable[[Array], bool],
) -> Iterator[Stance]:
    """Yield postures from which the tip can press, the one nearest to q (nq,) first.

    Where the limb would be between tip and surface, postures in which it points along the approach
    come first. They are found from q and from seeds within the joints' limits, always the same;
    `touching(q)` says whether links of the robot touch each other. `approach` as of `take_stance`.
    """
    first = take_stance(model, q, tip, approach)
    if first.moves and first.ahead > _BESIDE:
        yield first
    others = _turned(model, first, tip, touching)
    yield from (one for one in others if one.ahead > _BESIDE)
    if first.moves and first.ahead <= _BESIDE:
        yield first


def _turned(
    model: pin.Model, first: Stance, tip: Tip, touching: Callable[[Array], bool]
) -> list[Stance]:
    """Return some postures whose limb points along the approach of `first`, the nearest first."""
    rng = np.random.default_rng(0)
    moving = [j for j in range(1, model.njoints) if model.names[j] not in first.lock]
    found: list[tuple[float, Stance]] = []
    start = _into_limits(model, first.q)
    for k in range(_SEEDS):
        seed = start if k == 0 else _seed(model, start, moving, rng)
        q = _point_limb(model, seed, moving, tip, first.approach)
        stance, mobility = _stance(model, q, first.lock, tip, first.approach, best_way=False)
        if mobility < _MOBILE or stance.ahead <= _BESIDE or touching(q):
            continue
        away = float(np.linalg.norm(pin.difference(model, start, q)))
        if all(np.linalg.norm(pin.difference(model, one.q, q)) > _APART for _, one in found):
            found.append((away, replace(stance, bent=True)))
    found.sort(key=lambda one: (one[1].mobility < _EASY, one[0]))
    return [_with_room(one, tip) for _, one in found[:_MOST_STANCES]]


def _seed(model: pin.Model, q: Array, moving: Sequence[int], rng: np.random.Generator) -> Array:
    """Return q with the joints of one coordinate anywhere within their limits."""
    seed = q.copy()
    for j in moving:
        joint = model.joints[j]
        if joint.nq != 1:
            continue
        low, high = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
        low, high = max(low, q[joint.idx_q] - np.pi), min(high, q[joint.idx_q] + np.pi)
        if low < high:
            seed[joint.idx_q] = rng.uniform(low, high)
    return seed


def _point_limb(
    model: pin.Model, q: Array, moving: Sequence[int], tip: Tip, approach: Array
) -> Array:
    """Return a configuration near q in which the limb points along `approach`, as far as it can."""
    data, frame = model.createData(), find_frame(model, tip.frame)
    columns = np.concatenate(
        [
            np.arange(model.joints[j].idx_v, model.joints[j].idx_v + model.joints[j].nv)
            for j in moving
        ]
    )
    for _ in range(_TURNS):
        jacobian = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)
        jacobian = np.reshape(jacobian, (6, model.nv))  # of one velocity Pinocchio returns (6,)
        pin.framesForwardKinematics(model, data, q)
        limb = _limb(data, data.oMf[frame], tip)
        turn = np.cross(limb, approach)
        if limb @ approach < 0:  # the longer way round is no shorter turn
            turn = turn / max(float(np.linalg.norm(turn)), 1e-9)
            turn = turn if turn.any() else np.eye(3)[int(np.argmin(np.abs(approach)))]
        if limb @ approach > _ALONG:
            break
        angular = jacobian[3:, columns]
        square = angular @ angular.T + 1e-2 * np.eye(3)
        step = np.zeros(model.nv)
        step[columns] = np.clip(0.5 * angular.T @ np.linalg.solve(square, turn), -0.2, 0.2)
        q = _into_limits(model, pin.integrate(model, q, step))
    return q


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
    # A joint that is held holds those that mimic it, and what it mimics.
    moving = {
        one for j in list(model.supports[parent])[1:] for one in group_of(model, model.names[j])
    }
    return tuple(name for name in list(model.names)[1:] if name not in moving)


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
    local = np.reshape(local, (6, reduced.nv))  # of one velocity Pinocchio returns (6,)
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
    pushes = linear.T @ approach
    limits = np.array(reduced.upperEffortLimit)
    limited = (np.abs(pushes) > 1e-9) & (limits < _NO_LIMIT) & (limits > 0)
    # What the weight of the links leaves of the efforts.
    weight = pin.computeGeneralizedGravity(reduced, reduced.createData(), short)
    room = (limits - np.sign(pushes) * weight)[limited]
    joints = [np.asarray(one.translation) for one in list(data.oMi)[1:]]
    inertia = 0.0
    if reduced.nv >= 6:
        turning = local[3:] @ np.linalg.solve(mass_matrix, local[3:].T)
        inertia = 3.0 / float(np.trace(turning))
    limb = _limb(data, pose, tip)
    # Where the tip can slide, both ways count: a stretched arm slides sideways at best.
    usable = min(along, float(sideways[-1])) if reduced.nv > 1 else along
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
        force=float(np.clip(room / np.abs(pushes[limited]), 0, None).min(initial=np.inf)),
        reach=max((float(np.linalg.norm(center - one)) for one in joints), default=0.0),
        bent=False,
        mobility=usable / top,
        ahead=float(limb @ approach),
    )
    return stance, stance.mobility


def _forward(data: pin.Data, pose: pin.SE3, tip: Tip) -> Array:
    """Return where there is nothing of the robot before the tip: down, or as its limb points.

    A sphere before its frame is pressed as the frame points, else the frame would be dragged beside
    it; any other along the line to it from the last joint that is not inside it. On a surface
    beside that line or behind it the limb would pass through the surface.
    """
    limb, down = _limb(data, pose, tip), np.array([0.0, 0.0, -1.0])
    if tip.offset.any():
        return limb
    return down if limb @ down > _DOWNWARD else _upright(limb, free=False)


def _limb(data: pin.Data, pose: pin.SE3, tip: Tip) -> Array:
    """Return the unit vector (3,) along the limb to the tip: see `_forward`."""
    if tip.offset.any():
        ahead: Array = pose.rotation @ tip.offset
        return ahead / np.linalg.norm(ahead)
    for joint in reversed(list(data.oMi)[1:]):
        limb: Array = pose.translation - joint.translation
        length = float(np.linalg.norm(limb))
        if length > tip.radius:
            return limb / length
    return np.array([0.0, 0.0, -1.0])


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
        jacobian = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)
        jacobian = np.reshape(jacobian, (6, model.nv))[:rows]
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
    if not np.abs(rates).max() > 1e-12:  # nothing moves along it
        return axis
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
