"""How a hand holds a part: a place and joint angles at which every fingertip touches it."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.mimic import leader_of, mimics
from sphshell_pin.dynamics.scene.models import find_frame
from sphshell_pin.scenario.drafting.force_balance import least_friction
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.shell.shell import Shell

# Hands that are tried: random postures, and how many of them, the best, get a part.
_POSTURES, _BEST = 8000, 60
# Unevenness of a posture: the tips stand in front of the thumb within this part of their distance
# to it.
_UNEVEN = 0.35
# Least part of a finger's last link that points to the part between the tips.
_INWARD = 0.1
# How much fingers differ from each other, as a part of the joints' ranges.
_ALIKE = 0.1
# Part of a joint's range that is left free at its ends.
_MARGIN = 0.05
# Inverse kinematics: steps, damping [m^2], longest step [rad], gap's tolerance [m].
_STEPS, _DAMPING, _LONGEST, _CLOSE = 30, 1e-6, 0.15, 1e-7
# How much the part may be wider or narrower than the open hand, as a part of it, how many places
# with a part are looked at, and how many grasps are enough.
_WIDER, _MOST_PLACES, _ENOUGH = 0.5, 600, 30
# Farther along the fingers, as parts of the part's size there.
_OFFSETS = (0.0, 0.2, 0.4)
# Places of one posture that are looked at before it is another one's turn.
_TURN = 6
# Share of the friction that a grasp may use.
_USED = 0.6


@dataclass(frozen=True)
class Grasp:
    """A hand about a part, all in the world."""

    q: Array
    """Configuration of the hand (nq,): all gaps are as asked."""
    placement: pin.SE3
    """Placement of the part."""
    points: Array
    """On the part (k, 3) [m], nearest to the tips."""
    normals: Array
    """Unit (k, 3), out of the part."""
    forces: Array
    """On the part (k, 3) [N]: they balance its weight."""
    friction: float
    """Coefficient of friction that they need."""

    def normal_forces(self) -> Array:
        """Return the normal force (k,) [N] of each tip."""
        forces: Array = -np.einsum("ki,ki->k", self.forces, self.normals)
        return forces


class Hand:
    """The fingertips of a robot, as functions of its configuration."""

    def __init__(self, model: pin.Model, tips: Sequence[Tip]) -> None:
        self.model, self.tips = model, tuple(tips)
        self.radii = np.array([tip.radius for tip in tips])
        self._data = model.createData()
        self._frames = [find_frame(model, tip.frame) for tip in tips]
        self._ends = parents = [int(model.frames[one].parentJoint) for one in self._frames]
        chain = {int(j) for parent in parents for j in model.supports[parent]} - {0}
        rules = mimics(model)
        leaders = {int(model.getJointId(leader_of(rules, model.names[j]))) for j in chain}
        self.joints = tuple(sorted(leaders))
        """Joints that move a tip, without those that mimic them."""
        self.low, self.high = np.full(model.nq, -np.inf), np.full(model.nq, np.inf)
        for j in self.joints:
            joint = model.joints[j]
            if joint.nq == 1:
                low = model.lowerPositionLimit[joint.idx_q]
                high = model.upperPositionLimit[joint.idx_q]
                if np.isfinite(low) and np.isfinite(high) and low < high:
                    room = _MARGIN * (high - low)
                    self.low[joint.idx_q], self.high[joint.idx_q] = low + room, high - room

    def ranks(self) -> list[list[int]]:
        """Return the coordinates that move each tip alone, from the tip on."""
        chains = [set(map(int, self.model.supports[one])) & set(self.joints) for one in self._ends]
        own = [chain - set().union(*(c for c in chains if c is not chain)) for chain in chains]
        joints = self.model.joints
        return [[joints[j].idx_q for j in sorted(one, reverse=True)] for one in own]

    def centers(self, q: Array) -> Array:
        """Return the centers (k, 3) [m] of the tips' spheres."""
        pin.framesForwardKinematics(self.model, self._data, q)
        return self._placed()

    def _placed(self) -> Array:
        poses = [self._data.oMf[frame] for frame in self._frames]
        return np.array([pose.act(tip.offset) for pose, tip in zip(poses, self.tips, strict=True)])

    def limbs(self) -> Array:
        """Return unit vectors (k, 3) from the last joints to the `centers` that were asked last."""
        out = self._placed() - [self._data.oMi[joint].translation for joint in self._ends]
        unit: Array = out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
        return unit

    def jacobians(self, q: Array, beside: Array | float = 0.0) -> Array:
        """Return (k, 3, nv): velocities of the centers from those of the joints.

        With `beside` (k, 3) [m], in the world, those of points beside them that move with the tips.
        """
        pin.computeJointJacobians(self.model, self._data, q)
        pin.updateFramePlacements(self.model, self._data)
        out = np.empty((len(self.tips), 3, self.model.nv))
        offsets = np.broadcast_to(beside, (len(self.tips), 3))
        for k, (frame, tip) in enumerate(zip(self._frames, self.tips, strict=True)):
            local = pin.getFrameJacobian(self.model, self._data, frame, pin.LOCAL_WORLD_ALIGNED)
            arm = self._data.oMf[frame].rotation @ tip.offset + offsets[k]
            out[k] = local[:3] - pin.skew(arm) @ local[3:]
        return out

    def torques(self, grasp: Grasp) -> Array:
        """Return the joint torques (nv,) [N m], beside those against gravity, of its forces."""
        touching = self.jacobians(grasp.q, -self.radii[:, None] * grasp.normals)
        torques: Array = np.einsum("kij,ki->j", touching, grasp.forces)
        return torques

    def close_on(
        self, q: Array, shell: Shell, placement: pin.SE3, gap: float | Array
    ) -> tuple[Array, Array, Array] | None:
        """Return q near the given one at which each tip has the `gap` [m] to the shell, or its own.

        With the points on it (k, 3) [m] and its outward normals (k, 3), in the world. None where
        the tips do not get there.
        """
        model = self.model
        for _ in range(_STEPS):
            centers = self.centers(q)
            local = (centers - placement.translation) @ placement.rotation
            near = shell.closest_points(local)
            normals = near.normals @ placement.rotation.T
            error = near.distances - (self.radii + gap)
            if np.abs(error).max() < _CLOSE:
                return q, placement.translation + near.points @ placement.rotation.T, normals
            rows = np.einsum("ki,kij->kj", normals, self.jacobians(q))
            square = rows @ rows.T + _DAMPING * np.eye(len(rows))
            step = -rows.T @ np.linalg.solve(square, error)
            step *= min(1.0, _LONGEST / max(float(np.abs(step).max()), 1e-12))
            q = np.clip(pin.integrate(model, q, step), self.low, self.high)
        return None


def grasps(
    hand: Hand,
    q0: Array,
    shell: Shell,
    wrench: Callable[[pin.SE3], Array],
    total: float,
    mu: float,
    gap: float,
    free_of_itself: Callable[[Array], bool],
    free_of_part: Callable[[Array, pin.SE3], bool],
) -> list[Grasp]:
    """Return grasps of the part, those that use less friction first.

    The hand's other joints are as in q0 (nq,). `wrench(placement)` (6,) is what acts on the part
    beside the tips, about the world's origin; `total` [N] all their normal forces; `mu` the
    friction there is; `gap` [m] that of each tip. `free_of_itself(q)` and
    `free_of_part(q, placement)` say whether no link is in another one, or in the part. The same
    call returns the same.
    """
    found: list[Grasp] = []
    places = itertools.islice(_places(hand, q0, shell, free_of_itself), _MOST_PLACES)
    for q_open, placement in places:
        closed = hand.close_on(q_open, shell, placement, gap)
        if closed is None:
            continue
        q, points, normals = closed
        # The quickest first.
        if not (free_of_itself(q) and free_of_part(q, placement)):
            continue
        balance = least_friction(points, normals, wrench(placement), total, _USED * mu)
        if balance is None:
            continue
        friction, forces = balance
        found.append(Grasp(q, placement, points, normals, forces, friction))
        if len(found) == _ENOUGH:
            break
    return sorted(found, key=lambda one: one.friction)


def _places(
    hand: Hand, q0: Array, shell: Shell, free_of_itself: Callable[[Array], bool]
) -> Iterator[tuple[Array, pin.SE3]]:
    """Yield postures of the hand with the part between its tips, the best fitting first.

    The part's box is turned in all 24 ways: one side across, between thumb and fingers.
    """
    from scipy.spatial.transform import Rotation

    extent, middle = shell.box[1] - shell.box[0], shell.box.mean(axis=0)
    root = _root(hand, q0)
    turns = np.round(Rotation.create_group("O").as_matrix())
    found: list[tuple[int, float, int, Array, pin.SE3]] = []
    for _, q, thumb in itertools.islice(_postures(hand, q0, free_of_itself), _BEST):
        centers = hand.centers(q)
        others = np.delete(centers, thumb, axis=0)
        across = others.mean(axis=0) - centers[thumb]
        width = float(np.linalg.norm(across))
        across = across / width
        ahead = centers.mean(axis=0) - root
        ahead = ahead - (ahead @ across) * across
        ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-9)
        frame = np.column_stack([across, ahead, np.cross(across, ahead)])
        center = 0.5 * (others.mean(axis=0) + centers[thumb])
        free = width - 2 * float(hand.radii.mean())
        own: list[tuple[float, pin.SE3]] = []
        for turn in turns:
            sizes = np.abs(turn) @ extent  # along across, ahead and the third
            misfit = abs(free - sizes[0]) / width
            if misfit > _WIDER:
                continue
            rotation = frame @ turn
            for offset in _OFFSETS:
                at = center + offset * sizes[1] * ahead - rotation @ middle
                own.append((misfit, pin.SE3(rotation, at)))
        own.sort(key=lambda one: one[0])
        ranked = enumerate(own)
        found += [(rank // _TURN, misfit, len(found), q, place) for rank, (misfit, place) in ranked]
    # A few places of each posture, then the next few.
    found.sort(key=lambda one: one[:3])
    for *_, q, placement in found:
        yield q, placement


def _postures(
    hand: Hand, q0: Array, free_of_itself: Callable[[Array], bool]
) -> Iterator[tuple[float, Array, int]]:
    """Yield postures in which one tip, the thumb, stands against all others; how well they do."""
    rng = np.random.default_rng(0)
    found: list[tuple[float, Array, int]] = []
    bounded = np.isfinite(hand.low) & np.isfinite(hand.high)
    low, high = hand.low[bounded], hand.high[bounded]
    ranks = hand.ranks()
    for k in range(_POSTURES):
        thumb = k % len(hand.tips)
        # Fingers close alike, the thumb by itself.
        parts, alike = rng.uniform(size=(2, hand.model.nq))
        for one, chain in enumerate(ranks):
            if one != thumb:
                parts[chain] = alike[: len(chain)] + rng.normal(0, _ALIKE, len(chain))
        q = q0.copy()
        q[bounded] = low + np.clip(parts[bounded], 0, 1) * (high - low)
        centers, limbs = hand.centers(q), hand.limbs()
        others = np.delete(centers, thumb, axis=0)
        across = others.mean(axis=0) - centers[thumb]
        width = float(np.linalg.norm(across))
        if width < 4 * hand.radii.max():
            continue
        depth = (others - centers[thumb]) @ across / width
        uneven = float(np.ptp(depth)) / width
        inward = -limbs @ across / width
        inward[thumb] *= -1
        beside = np.linalg.norm(np.diff(others, axis=0), axis=1).min(initial=np.inf)
        apart = beside > 2 * hand.radii.max()
        if uneven < _UNEVEN and inward.min() > _INWARD and apart:
            found.append((uneven, q, thumb))
    found.sort(key=lambda one: one[0])
    yield from (one for one in found if free_of_itself(one[1]))


def _root(hand: Hand, q0: Array) -> Array:
    """Return where the fingers begin (3,) [m]: the mean of the joints that move single tips."""
    data = hand.model.createData()
    pin.forwardKinematics(hand.model, data, q0)
    root: Array = np.mean([data.oMi[j].translation for j in hand.joints], axis=0)
    return root
