"""How a robot presses: postures with bent joints that can move its tip, and its effective mass."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.mimic import group_of
from sphshell_pin.dynamics.scene.models import joint_of, mass_matrix
from sphshell_pin.robots import joints_without_mass
from sphshell_pin.scenario.drafting.asked import PLACES
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.scenario.drafting.vectors import nearest_axis, unit
from sphshell_pin.scenario.format.reach import Reach, turn_between

# Mobility along the approach and across it, as a part of the best one: below the first a posture is
# singular; the posture that a robot is known to work in is taken from the second on.
# A heavy arm with a light wrist has 0.01 in its best posture.
_MOBILE, _EASY = 2e-3, 0.1
# Postures: seeds tried, how far from each other [rad or m] they have to be, and how many are taken.
_SEEDS, _APART, _MOST = 32, 0.3, 4
# Postures in which the tip's motion is looked at, whether it is along one line.
_LOOKED = 3
# Cosine between limb and approach below which the limb is beside the tip or before it.
_BESIDE = 0.3
# How far between its motion and its limb a tip may press that moves along a line.
_BETWEEN = (0.0, 1.0, 2.0)
NO_LIMIT = 1e9
"""Efforts [N m] and forces [N] beyond this stand for none."""
# Distance of a joint at ease from its nearer limit, as a part of its range.
_AT_EASE = 0.2
# Tolerances: of a height that is asked for, as a part of the reach; of a path that is followed, as
# a part of its step, and the tip's turn on it [rad]; the turn of a joint [rad] that would move the
# tip by its reach, beyond which a posture is near a singular one.
_HEIGHT, _ASTRAY, _TURNED, _FASTEST = 1e-4, 0.1, 0.02, 6.0


def joints_aside(model: pin.Model, tips: Sequence[Tip]) -> tuple[str, ...]:
    """Return the joints that move none of the `tips`, and those that move no mass.

    If none of them moved a mass, they would be held without one that could move: none is.
    """
    # A joint that is held holds those that mimic it, and what it mimics.
    chains = [list(model.supports[joint_of(model, tip.frame)])[1:] for tip in tips]
    on_way = {model.names[j] for chain in chains for j in chain}
    on_way = on_way.difference(joints_without_mass(model, pin.neutral(model))) or on_way
    moving = {one for name in on_way for one in group_of(model, name)}
    return tuple(name for name in list(model.names)[1:] if name not in moving)


class Limb(Reach):
    """The joints that move a `tip`: the `chain` of them from the root, `lock` are all others."""

    def __init__(self, model: pin.Model, tip: Tip) -> None:
        self.tip, self.lock = tip, joints_aside(model, [tip])
        super().__init__(model, tip.frame, tip.offset, self.lock)
        self.chain = list(model.supports[model.frames[self.frame].parentJoint])[1:]
        rng, neutral = np.random.default_rng(0), pin.neutral(model)
        moves = [self.jacobian(self.seed(neutral, rng))[:3] for _ in range(_LOOKED)]
        self.on_line = max(_rank(one) for one in moves) == 1
        """Whether all joints move the tip along one line, in any posture."""
        every = np.hstack(moves)
        ways = np.linalg.svd(every)[0][:, :2]
        in_plane = not self.on_line and _rank(every) == 2
        self.onto_ways = ways @ ways.T if in_plane else np.eye(3)
        """Projects (3,) on where the tip moves, in some posture at least."""

    def direction(self) -> Array:
        """Return the unit vector (3,) along the limb to the tip, from what is in `data`.

        To a sphere before its frame as the frame points, else the frame would be dragged beside it;
        to any other along the line from the last joint that is not inside it.
        """
        pose = self.data.oMf[self.frame]
        # A small ball on a flat end may be far beside the frame.
        way = self.tip.offset if self.tip.ahead is None else self.tip.ahead
        # A wheel's place on its axle is not where its leg points.
        ahead = self.onto_ways @ pose.rotation @ way
        if np.linalg.norm(ahead) > _BESIDE * np.linalg.norm(way):
            return unit(ahead)
        for joint in reversed(self.chain):
            away = self.onto_ways @ (pose.translation - self.data.oMi[joint].translation)
            if np.linalg.norm(away) > self.tip.radius:
                return unit(away)
        return np.array([0.0, 0.0, -1.0])

    def pushes(self, approach: Array) -> list[Array]:
        """Return where the tip presses near an `approach` (3,), in the posture asked for last.

        One that moves along a line presses along it, or between it and the limb: a fingertip.
        """
        if not self.on_line:
            return [approach]
        line = unit(self.moves[:3][:, np.argmax(np.abs(self.moves[:3]).max(axis=0))])
        line = line if line @ approach >= 0 else -line
        forward = self.direction()
        aside = unit(forward - line * (line @ forward))
        return [unit(line + k * aside) for k in _BETWEEN if line @ approach > _BESIDE]


class Stance:
    """A robot at the start, seen from its tip; vectors and points in the world.

    Attributes
    ----------
    limb, tip
        The joints that move the tip.
    q
        Configuration of the whole robot (nq,).
    center
        Center of the tip's sphere (3,) [m].
    approach
        Unit (3,): where the tip presses.
    aside
        Motion (3,) across the approach that comes with one along it: 0 of a tip that moves freely.
    slide
        Unit (3,) across the approach: where the tip moves best; None where it cannot.
    mass, slide_mass
        Effective masses along the approach and the slide [kg]; both that along the approach where
        there is no slide.
    inertia
        Mean effective inertia about the tip [kg m^2]; 0 where no joint is left to turn it.
    joint_inertia
        Diagonal of the mass matrix (k,), of the joints that move.
    force
        Largest push along the approach that the joints' effort limits allow [N]: 0 where they do
        not carry the robot's own weight, NO_LIMIT where none is stated.
    fastest
        Speed along the slide [m/s] at which damping takes half of some motor's effort.
    reach
        From the tip to the farthest joint that moves it [m].
    mobility
        Along the approach, and across it where the tip slides, as a part of the best one.
    dexterity
        The least motion that joints make, turns of the tip included, as a part of the largest.
    ahead
        Cosine between the approach and the limb that carries the tip; below 0 it is in the way.
        1 of a tip that moves along one line, unless its limb is behind that.
    """

    def __init__(self, limb: Limb, q: Array, approach: Array) -> None:
        self.limb, self.tip, self.q, self.approach = limb, limb.tip, q, approach
        model, columns, jacobian = limb.model, limb.columns, limb.jacobian(q)
        linear, angular = jacobian[:3], jacobian[3:]
        self.center = limb.data.oMf[limb.frame].act(limb.offset)
        joints = np.reshape([limb.data.oMi[j].translation for j in limb.chain], (-1, 3))
        self.reach = float(np.linalg.norm(self.center - joints, axis=1).max(initial=0.0))
        scaled = jacobian / np.repeat([max(self.reach, 1e-9), 1.0], 3)[:, None]
        values = np.linalg.svd(scaled, compute_uv=False)
        self.dexterity = float(values[-1] / values[0]) if values[0] > 0 else 0.0
        ahead = float(limb.direction() @ approach)
        self.ahead = 1.0 if limb.on_line and ahead > -0.5 else ahead
        # Where joints can move the tip, as near as they can along the approach.
        ways = np.linalg.svd(linear, full_matrices=False)[0][:, : _rank(linear)]
        near = ways @ (ways.T @ approach)
        self.aside = near / max(float(near @ approach), 1e-3) - approach
        mass = mass_matrix(model, q)[np.ix_(columns, columns)]
        self.joint_inertia = np.diag(mass).copy()
        response = np.linalg.solve(mass, jacobian.T)
        mobility = linear @ response[:, :3]
        top = max(float(np.linalg.eigvalsh(mobility)[-1]), 1e-300)
        along = float(approach @ mobility @ approach)
        across = np.eye(3) - np.outer(approach, approach)
        sideways, slides = np.linalg.eigh(across @ mobility @ across)
        easiest = float(sideways[-1])
        slides_there = not limb.on_line and easiest > _MOBILE * top
        self.slide = _upright(slides[:, -1]) if slides_there else None
        self.mass = 1 / max(along, 1e-9)
        self.slide_mass = self.mass if self.slide is None else 1 / max(easiest, 1e-9)
        # Where the tip can slide, both ways count: a stretched arm slides sideways at best.
        self.mobility = (along if limb.on_line else min(along, easiest)) / top
        turning = float(np.trace(angular @ response[:, 3:]))
        turns = int(np.linalg.matrix_rank(angular, tol=1e-6))
        self.inertia = turns / turning if len(columns) > _rank(linear) and turning > 1e-9 else 0.0
        efforts, dry = model.upperEffortLimit[columns], model.upperDryFrictionLimit[columns]
        stated = (efforts < NO_LIMIT) & (efforts > 0)
        # Motors bear the friction of their joints, too, and the weight of the links.
        limits = efforts - np.where(dry < NO_LIMIT, dry, 0.0)
        weight = pin.computeGeneralizedGravity(model, model.createData(), q)[columns]
        pushes = linear.T @ approach
        limited = stated & (np.abs(pushes) > 1e-9)
        room = (limits - np.sign(pushes) * weight)[limited] / np.abs(pushes[limited])
        carried = bool((np.abs(weight) <= limits)[stated].all())
        self.force = carried * float(np.clip(room, 0, NO_LIMIT).min(initial=NO_LIMIT))
        # Joint speeds by that of the tip along the slide, with the least kinetic energy.
        along_slide = np.zeros(3) if self.slide is None else self.slide
        rates = np.abs(response[:, :3] @ along_slide) / max(easiest, 1e-300)
        taken = np.where(stated, model.damping[columns] * rates / np.maximum(limits, 1e-9), 0.0)
        self.fastest = 0.5 / max(float(taken.max(initial=0.0)), 1e-9)

    def at(self, center: Array) -> Stance | None:
        """Return the stance nearby with the sphere's center at `center` (3,); None if it cannot."""
        if abs(center - self.center).max() < 1e-12:
            return self
        held = self._held_rotation()
        q, off = self.limb.solve(self.q, center, turn=held if len(self.limb.columns) >= 6 else None)
        found = Stance(self.limb, q, self.approach)
        return None if off > _HEIGHT * self.reach or found.mobility < _MOBILE else found

    def can_yield(self) -> bool:
        """Whether the tip can come into a part by a tenth of its radius within the joints' limits.

        At a limit the stop would bear the force, and not the part.
        """
        limb, step = self.limb, np.zeros(self.limb.model.nv)
        inverse = np.linalg.pinv(limb.jacobian(self.q)[:3], rcond=_MOBILE)
        step[limb.columns] = inverse @ (0.1 * self.tip.radius * self.approach)
        pressed = pin.integrate(limb.model, self.q, step)
        return bool(np.abs(limb.into_limits(pressed) - pressed).max() < 1e-9)

    def follows(self, centers: Array, free: Callable[[Array], bool]) -> tuple[int, str]:
        """Return how many of the `centers` (k, 3) the tip reaches one after the other, and why.

        It ends before a limit of a joint, a singular posture, one that is not `free`, and, unless
        the tip's orientation follows from its place, before that changes.
        """
        limb, q = self.limb, self.q
        held = self._held_rotation() if self.inertia else None
        for k in range(1, len(centers)):
            step = float(np.linalg.norm(centers[k] - centers[k - 1]))
            to, off = limb.solve(q, centers[k], turn=held)
            turn = float(np.abs(pin.difference(limb.model, q, to)).max())
            if held is not None and float(np.linalg.norm(held())) > _TURNED:
                return k, "its joints cannot keep the tip from turning there"
            if off > _ASTRAY * step or turn > _FASTEST * step / self.reach + 1e-9:
                return k, "its joints do not reach farther there"
            if (k % 4 == 0 or k == len(centers) - 1) and not free(to):
                return max(k - 3, 1), "a link would come into the part"
            q = to
        return len(centers), ""

    def _held_rotation(self) -> Callable[[], Array]:
        self.limb.center(self.q)
        pose = self.limb.data.oMf[self.limb.frame]
        start = pose.rotation.copy()
        return lambda: np.asarray(pin.log3(start @ pose.rotation.T))


def approaches(limb: Limb, q: Array) -> list[Array]:
    """Return where the tip may press, unit vectors (3,) along axes of the world.

    Down first, then as the limb that carries the tip points at q.
    """
    limb.jacobian(q)
    first, *others = PLACES.values()
    home = tuple(nearest_axis(limb.direction()))
    return [np.array(one) for one in dict.fromkeys([first, home, *others])]


def stances(
    limb: Limb, q: Array, approach: Array, height: float | None, usable: Callable[[Array], bool]
) -> list[Stance]:
    """Return postures from which the tip can press along `approach` (3,), the best one first.

    They are found from q (nq,) and from seeds within the joints' limits, always the same, with the
    limb along the approach and, where it is given, the sphere's center at `height` [m]. `usable(q)`
    says whether links of the robot are free. The best is the one near q if it moves easily, else
    the one whose tip moves best with its joints away from their limits.
    """
    rng = np.random.default_rng(0)
    rows = np.eye(3)[2:] if height is not None else np.zeros((0, 3))
    place = np.array([0.0, 0.0, height or 0.0])
    turn = None if limb.on_line else lambda: turn_between(limb.direction(), approach)
    found: list[tuple[float, Stance]] = []
    start = limb.into_limits(q)
    for k in range(_SEEDS):
        at, off = limb.solve(limb.seed(start, rng) if k else start, place, rows=rows, turn=turn)
        away = [np.abs(pin.difference(limb.model, other.q, at)).max() for _, other in found]
        limb.jacobian(at)
        for one in [Stance(limb, at, way) for way in limb.pushes(approach)]:
            if off > _HEIGHT * one.reach or one.mobility < _MOBILE or one.ahead <= _BESIDE:
                continue
            if min(away, default=np.inf) < _APART or not (one.can_yield() and usable(at)):
                continue
            # 1 where all joints are away from their limits, less and less towards one.
            room = np.minimum(at[limb.bounded] - limb.low, limb.high - at[limb.bounded])
            ease = room / (limb.high - limb.low) / _AT_EASE
            ease = float(np.clip(ease, 0.0, 1.0).min(initial=1.0))
            rank = one.mobility * one.ahead * ease * one.dexterity
            rank += k == 0 and min(one.mobility, one.dexterity, ease) > _EASY
            found.append((rank * (one.force > 0), one))
    found.sort(key=lambda one: -one[0])
    return [one for _, one in found[: _MOST * (len(_BETWEEN) if limb.on_line else 1)]]


def _rank(linear: Array) -> int:
    """Return in how many directions joints move the tip, by its Jacobian (3, k)."""
    return int(np.linalg.matrix_rank(linear, tol=1e-3 * np.abs(linear).max(initial=1e-9)))


def _upright(axis: Array) -> Array:
    """Return `axis` along the nearest coordinate axis, where it nearly is one, in its +."""
    nearest = nearest_axis(axis)
    return np.abs(nearest) if nearest @ axis > 0.97 else axis * nearest.sum()
