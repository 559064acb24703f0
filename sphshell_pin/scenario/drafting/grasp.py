"""How a hand holds a part: a place and joint angles at which every fingertip touches it."""

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.mimic import leader_of, mimics
from sphshell_pin.dynamics.scene.models import joint_of
from sphshell_pin.scenario.drafting.clearance import Links
from sphshell_pin.scenario.drafting.force_balance import least_friction
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.part import Part
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
    """A hand about a part, all in the world.

    q (nq,) is the configuration of the hand, in which all gaps are as asked, `placement` that of
    the part. The `points` (k, 3) [m] on it are nearest to the tips, `normals` (k, 3) point out of
    it. The `forces` (k, 3) [N] on the part balance its weight, with the coefficient `friction`.
    """

    q: Array
    placement: pin.SE3
    points: Array
    normals: Array
    forces: Array
    friction: float

    def normal_forces(self) -> Array:
        """Return the normal force (k,) [N] of each tip."""
        return np.asarray(-(self.forces * self.normals).sum(axis=1))


class Hand:
    """The fingertips of a robot, as functions of its configuration."""

    def __init__(self, model: pin.Model, tips: Sequence[Tip]) -> None:
        self.model, self.tips = model, tuple(tips)
        self.radii = np.array([tip.radius for tip in tips])
        ends = [joint_of(model, tip.frame) for tip in tips]
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

    def against(self, q: Array, thumb: int) -> tuple[Array, Array, float]:
        """Return the centers (k, 3) [m], way (3,) and distance [m] from a thumb to the others."""
        centers = self.centers(q)
        across = np.delete(centers, thumb, axis=0).mean(axis=0) - centers[thumb]
        return centers, unit(across), float(np.linalg.norm(across))

    def limbs(self) -> Array:
        """Return unit vectors (k, 3) from the last joints to the `centers` that were asked last."""
        out = []
        for reach in self.reaches:
            frame = self.model.frames[reach.frame]
            joint = reach.data.oMi[frame.parentJoint].translation
            out.append(reach.data.oMf[reach.frame].act(reach.offset) - joint)
        return unit(np.array(out))

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
    hand: Hand, links: Links, q0: Array, part: Part, total: float, mu: float, gap: float
) -> tuple[list[Grasp], Counter[str]]:
    """Return grasps of the part, those that use less friction first, and links in the way.

    The hand's other joints are as in q0 (nq,). `total` [N] is the sum of all normal forces, which
    balance the weight of the `part` with the friction `mu`; `gap` [m] is that of each tip. No link
    is in another one, or in the part. The same call returns the same.
    """
    found, blocked, shell = list[Grasp](), Counter[str](), links.shell
    for q_open, placement in itertools.islice(_places(hand, links, q0), _MOST_PLACES):
        closed = hand.close_on(q_open, shell, placement, gap)
        # The quickest first.
        if closed is None or links.crossed(closed[0]):
            continue
        q, points, normals = closed
        if link := links.within(q, placement, whole=True):
            blocked[link] += 1
        elif balance := least_friction(points, normals, part.weight(placement), total, _USED * mu):
            friction, forces = balance
            found.append(Grasp(q, placement, points, normals, forces, friction))
        if len(found) == _ENOUGH:
            break
    return sorted(found, key=lambda one: one.friction), blocked


def _places(hand: Hand, links: Links, q0: Array) -> Iterator[tuple[Array, pin.SE3]]:
    """Yield postures of the hand with the part between its tips, the best fitting first.

    The part's box is turned in all 24 ways: one side across, between thumb and fingers.
    """
    from scipy.spatial.transform import Rotation

    extent, middle = np.ptp(links.shell.box, axis=0), links.shell.box.mean(axis=0)
    data = hand.model.createData()
    pin.forwardKinematics(hand.model, data, q0)
    # Where the fingers begin.
    root = np.mean([data.oMi[j].translation for j in hand.joints], axis=0)
    turns = np.round(Rotation.create_group("O").as_matrix())
    found: list[tuple[int, float, int, Array, pin.SE3]] = []
    free = (one for one in _postures(hand, q0) if not links.crossed(one[1]))
    for _, q, thumb in itertools.islice(free, _BEST):
        centers, across, width = hand.against(q, thumb)
        ahead = centers.mean(axis=0) - root
        ahead = unit(ahead - (ahead @ across) * across)
        frame = np.column_stack([across, ahead, np.cross(across, ahead)])
        center = centers[thumb] + 0.5 * width * across
        own: list[tuple[float, pin.SE3]] = []
        for turn, offset in itertools.product(turns, _OFFSETS):
            sizes = np.abs(turn) @ extent  # along across, ahead and the third
            misfit = abs(width - 2 * float(hand.radii.mean()) - sizes[0]) / width
            at = center + offset * sizes[1] * ahead - frame @ turn @ middle
            if misfit <= _WIDER:
                own.append((misfit, pin.SE3(frame @ turn, at)))
        own.sort(key=lambda one: one[0])
        ranked = enumerate(own)
        found += [(rank // _TURN, misfit, len(found), q, place) for rank, (misfit, place) in ranked]
    # A few places of each posture, then the next few.
    found.sort(key=lambda one: one[:3])
    yield from (one[3:] for one in found)


def _postures(hand: Hand, q0: Array) -> list[tuple[float, Array, int]]:
    """Return postures in which one tip, the thumb, stands against all others; how well they do."""
    rng, found = np.random.default_rng(0), list[tuple[float, Array, int]]()
    reach, widest = hand.reaches[0], float(hand.radii.max())
    for k in range(_POSTURES):
        thumb = k % len(hand.tips)
        # Fingers close alike, the thumb by itself.
        parts, alike = rng.uniform(size=(2, hand.model.nq))
        for one, chain in enumerate(hand.ranks):
            if one != thumb:
                parts[chain] = alike[: len(chain)] + rng.normal(0, _ALIKE, len(chain))
        q, at = q0.copy(), np.clip(parts[reach.bounded], _MARGIN, 1 - _MARGIN)
        q[reach.bounded] = reach.low + at * (reach.high - reach.low)
        centers, across, width = hand.against(q, thumb)
        if width < 4 * widest:
            continue
        others = np.delete(centers, thumb, axis=0)
        uneven = float(np.ptp(others @ across)) / width
        inward = -hand.limbs() @ across
        inward[thumb] *= -1
        beside = np.linalg.norm(np.diff(others, axis=0), axis=1).min(initial=np.inf)
        if uneven < _UNEVEN and inward.min() > _INWARD and beside > 2 * widest:
            found.append((uneven, q, thumb))
    return sorted(found, key=lambda one: one[0])
