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
from sphshell_pin.scenario.drafting.poses import joints_aside
from sphshell_pin.scenario.drafting.vectors import moved, unit
from sphshell_pin.scenario.format.reach import Reach
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
        return np.asarray(-np.einsum("ki,ki->k", self.forces, self.normals))


class Hand:
    """The fingertips of a robot, as functions of its configuration."""

    def __init__(self, model: pin.Model, tips: Sequence[Tip]) -> None:
        self.model, self.tips = model, tuple(tips)
        self.radii = np.array([tip.radius for tip in tips])
        ends = [int(model.frames[find_frame(model, tip.frame)].parentJoint) for tip in tips]
        rules = mimics(model)
        chains = [{model.names[j] for j in list(model.supports[end])[1:]} for end in ends]
        moving = {leader_of(rules, name) for name in set.union(*chains)}
        self.joints = tuple(sorted(int(model.getJointId(name)) for name in moving))
        """Joints that move a tip, without those that mimic them."""
        self.lock = joints_aside(model, tips)
        self.reaches = [Reach(model, tip.frame, tip.offset, self.lock) for tip in tips]
        self.ranks = []
        """The coordinates that move each tip alone, from the tip on."""
        for chain in chains:
            own = (chain & moving) - set().union(*(one for one in chains if one is not chain))
            at = sorted((int(model.getJointId(name)) for name in own), reverse=True)
            self.ranks.append([model.joints[j].idx_q for j in at])

    def centers(self, q: Array) -> Array:
        """Return the centers (k, 3) [m] of the tips' spheres."""
        return np.array([reach.center(q) for reach in self.reaches])

    def limbs(self) -> Array:
        """Return unit vectors (k, 3) from the last joints to the `centers` that were asked last."""
        out = np.array(
            [
                reach.data.oMf[reach.frame].act(reach.offset)
                - reach.data.oMi[self.model.frames[reach.frame].parentJoint].translation
                for reach in self.reaches
            ]
        )
        return unit(out)

    def jacobians(self, q: Array, beside: Array | float = 0.0) -> Array:
        """Return (k, 3, nv): velocities of the centers from those of the joints.

        With `beside` (k, 3) [m], in the world, those of points beside them that move with the tips.
        """
        out = np.zeros((len(self.tips), 3, self.model.nv))
        for k, reach in enumerate(self.reaches):
            moves = reach.jacobian(q)
            offset = np.broadcast_to(beside, (len(self.tips), 3))[k]
            out[k][:, reach.columns] = moves[:3] - pin.skew(offset) @ moves[3:]
        return out

    def torques(self, grasp: Grasp) -> Array:
        """Return the joint torques (nv,) [N m], beside those against gravity, of its forces."""
        touching = self.jacobians(grasp.q, -self.radii[:, None] * grasp.normals)
        return np.asarray(np.einsum("kij,ki->j", touching, grasp.forces))

    def close_on(
        self, q: Array, shell: Shell, placement: pin.SE3, gap: float | Array
    ) -> tuple[Array, Array, Array] | None:
        """Return q near the given one at which each tip has the `gap` [m] to the shell, or its own.

        With the points on it (k, 3) [m] and its outward normals (k, 3), in the world. None where
        the tips do not get there.
        """
        for _ in range(_STEPS):
            centers = self.centers(q)
            local = (centers - placement.translation) @ placement.rotation
            near = shell.closest_points(local)
            normals = near.normals @ placement.rotation.T
            error = near.distances - (self.radii + gap)
            if np.abs(error).max() < _CLOSE:
                return q, moved(placement, near.points), normals
            rows = np.einsum("ki,kij->kj", normals, self.jacobians(q))
            square = rows @ rows.T + _DAMPING * np.eye(len(rows))
            step = -rows.T @ np.linalg.solve(square, error)
            step *= min(1.0, _LONGEST / max(float(np.abs(step).max()), 1e-12))
            q = self.reaches[0].into_limits(pin.integrate(self.model, q, step))
        return None


def grasps(
    hand: Hand,
    q0: Array,
    shell: Shell,
    wrench: Callable[[pin.SE3], Array],
    total: float,
    mu: float,
    gap: float,
    free: Callable[..., bool],
) -> list[Grasp]:
    """Return grasps of the part, those that use less friction first.

    The hand's other joints are as in q0 (nq,). `wrench(placement)` (6,) is what acts on the part
    beside the tips, about the world's origin; `total` [N] all their normal forces; `mu` the
    friction there is; `gap` [m] that of each tip. `free(q)` and `free(q, placement)`
    say whether no link is in another one, or in the part. The same call returns the same.
    """
    found: list[Grasp] = []
    places = itertools.islice(_places(hand, q0, shell, free), _MOST_PLACES)
    for q_open, placement in places:
        closed = hand.close_on(q_open, shell, placement, gap)
        if closed is None:
            continue
        q, points, normals = closed
        # The quickest first.
        if not (free(q) and free(q, placement)):
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
    hand: Hand, q0: Array, shell: Shell, free: Callable[..., bool]
) -> Iterator[tuple[Array, pin.SE3]]:
    """Yield postures of the hand with the part between its tips, the best fitting first.

    The part's box is turned in all 24 ways: one side across, between thumb and fingers.
    """
    from scipy.spatial.transform import Rotation

    extent, middle = shell.box[1] - shell.box[0], shell.box.mean(axis=0)
    root = _root(hand, q0)
    turns = np.round(Rotation.create_group("O").as_matrix())
    found: list[tuple[int, float, int, Array, pin.SE3]] = []
    for _, q, thumb in itertools.islice(_postures(hand, q0, free), _BEST):
        centers = hand.centers(q)
        others = np.delete(centers, thumb, axis=0)
        across = others.mean(axis=0) - centers[thumb]
        width = float(np.linalg.norm(across))
        across = across / width
        ahead = centers.mean(axis=0) - root
        ahead = unit(ahead - (ahead @ across) * across)
        frame = np.column_stack([across, ahead, np.cross(across, ahead)])
        center = 0.5 * (others.mean(axis=0) + centers[thumb])
        room = width - 2 * float(hand.radii.mean())
        own: list[tuple[float, pin.SE3]] = []
        for turn in turns:
            sizes = np.abs(turn) @ extent  # along across, ahead and the third
            misfit = abs(room - sizes[0]) / width
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
    hand: Hand, q0: Array, free: Callable[..., bool]
) -> Iterator[tuple[float, Array, int]]:
    """Yield postures in which one tip, the thumb, stands against all others; how well they do."""
    rng = np.random.default_rng(0)
    found: list[tuple[float, Array, int]] = []
    bounded, (low, high) = hand.reaches[0].bounded, (hand.reaches[0].low, hand.reaches[0].high)
    for k in range(_POSTURES):
        thumb = k % len(hand.tips)
        # Fingers close alike, the thumb by itself.
        parts, alike = rng.uniform(size=(2, hand.model.nq))
        for one, chain in enumerate(hand.ranks):
            if one != thumb:
                parts[chain] = alike[: len(chain)] + rng.normal(0, _ALIKE, len(chain))
        q = q0.copy()
        q[bounded] = low + np.clip(parts[bounded], _MARGIN, 1 - _MARGIN) * (high - low)
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
    yield from (one for one in found if free(one[1]))


def _root(hand: Hand, q0: Array) -> Array:
    """Return where the fingers begin (3,) [m]: the mean of the joints that move single tips."""
    data = hand.model.createData()
    pin.forwardKinematics(hand.model, data, q0)
    return np.asarray(np.mean([data.oMi[j].translation for j in hand.joints], axis=0))
