"""Where a limb ends, by the geometry of its last link: the sphere to put there."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.joint_components import joint_slides
from sphshell_pin.dynamics.scene.mimic import mimics
from sphshell_pin.dynamics.scene.models import find_frame, model_reach
from sphshell_pin.robots import LoadedRobot
from sphshell_pin.scenario.drafting.vectors import moved, unit
from sphshell_pin.scenario.drafting.wording import rounded
from sphshell_pin.scenario.format.reach import Reach
from sphshell_pin.shell.shell import Shell

# How far a ball that covers an end may stand out before it, as a part of its radius: else the end
# is flat, and gets a ball of this part of that radius. Without geometry: as a part of the reach.
_STANDS_OUT, _BALL, _OF_REACH = 0.25, 1 / 3, 0.01
# Least radius of a ball on the underside of a body that floats, as a part of its size.
_OF_BODY = 0.05
# Points of the tip's own link: what is nearer to the sphere's center, in radii, is the sphere's
# place, as meshes of fingertips stand out of the spheres that stand for them.
AT_TIP = 1.5
# Steps of the search for the ball that covers an end, and of that for the smallest ball.
_DEPTHS, _STEPS = 40, 300
# Motion of a frame per joint's [m/rad] that is none.
_STILL = 1e-6
# Distance of what is at the axis of a joint from it, as a part of the link's size.
_AT_AXIS = 0.2


@dataclass(frozen=True)
class Tip:
    """A sphere on a robot: `radius` [m], center `offset` (3,) [m] in `frame`; how it is known."""

    frame: str
    radius: float
    offset: Array
    source: str
    ahead: Array | None = None
    """Out of a flat end (3,), against which a smaller one is drawn back; None: it has one size."""
    made: bool = False
    """Whether the ball was made for the end of its link."""

    def at_most(self, radius: float) -> "Tip":
        """Return it with a `radius` [m] that is no larger, where its size is free."""
        if self.ahead is None or self.radius <= radius:
            return self
        offset = self.offset - (self.radius - radius) * self.ahead
        return replace(
            self, radius=radius, offset=offset, source=f"{self.source}, sized to the part"
        )


def sphere_centers(model: pin.Model, q: Array, tips: Sequence[Tip]) -> Array:
    """Return the spheres' centers (k, 3) [m] in the world at q (nq,)."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return np.array([data.oMf[find_frame(model, tip.frame)].act(tip.offset) for tip in tips])


def gripper_joints(model: pin.Model) -> set[int]:
    """Return the joints of grippers: behind a joint, two ends or more that slide or are coupled.

    They have three coordinates at most, or are called grippers. A run holds them, where the tip is
    on what carries them.
    """
    rules, found = mimics(model), set[int]()
    coupled = {*rules, *(rule.of for rule in rules.values())}
    slide = {j for j in range(model.njoints) if joint_slides(model.joints[j])}
    for carrier in range(1, model.njoints):
        behind = set(map(int, model.subtrees[carrier])) - {carrier}
        ends = behind - {int(model.parents[one]) for one in behind}
        jaws = {one for one in behind if model.names[one] in coupled} | (behind & slide)
        few = len({model.joints[one].idx_v for one in behind}) <= 3
        sliding = few and len(ends & jaws) > 1 and behind == ends | jaws
        named = all("gripper" in model.names[one].lower() for one in behind)
        if len(ends) > 1 and (named or sliding):
            found |= behind
    return found


class LinkGeometry:
    """The corners of the geometry that moves with a frame of a robot, in that frame.

    A gripper that it carries is part of it, as the start has it; of a free body all that it
    carries. They are those of its collision geometry; where it has none, of its visual one.
    """

    def __init__(self, robot: LoadedRobot, frame: str) -> None:
        model = robot.model
        self._robot, self._model = robot, model
        self._frame = model.frames[find_frame(model, frame)]
        self._joint = int(self._frame.parentJoint)
        behind = set(model.subtrees[self._joint]) - {self._joint}
        # All that a free body carries is held.
        self._free = model.joints[self._joint].nv == 6
        self._on_rim, jaws = False, behind & gripper_joints(model)
        self._jaws = behind if self._free else jaws
        both = [*robot.collision_model.geometryObjects, *robot.visual_model.geometryObjects]
        shown = [int(one.parentFrame) for one in both if one.parentJoint == self._joint]
        self.link = model.frames[min(shown)].name if shown else frame
        self.corners, self._solid = (
            moved(self._frame.placement.inverse(), self._corners(self._joint, {self._joint, *held}))
            for held in (self._jaws, jaws)
        )

    def depth(self, center: Array) -> float:
        """Return how far `center` (3,) [m] is in the link's convex hull [m]; negative outside."""
        from scipy.spatial import ConvexHull, QhullError

        try:
            hull = ConvexHull(self._solid)
        except (QhullError, ValueError):  # flat, or nothing
            return -math.inf
        return float(-(hull.equations[:, :3] @ center + hull.equations[:, 3]).max())

    def end(self, radius: float | None = None) -> Tip:
        """Return a ball at the end, of `radius` [m] if that is given.

        It is the smallest one that covers the end as deep as it is large, if the end is round: a
        fingertip's own sphere. On a flat end it is a smaller ball in the middle of it.
        """
        name = str(self._frame.name)
        if not len(self.corners):
            ball = radius or rounded(_OF_REACH * model_reach(self._model))
            return Tip(name, ball, np.zeros(3), "a ball on its origin, as its link has no geometry")
        ahead = self._ahead()
        along = self.corners @ ahead
        depth = along.max() - along
        size = float(np.linalg.norm(np.ptp(self.corners, axis=0)))
        for reach in size * np.geomspace(0.02, 1.0, _DEPTHS):
            center, covers = _smallest_ball(self.corners[depth <= reach])
            if 0 < covers <= reach:  # not on a corner alone
                break
        before = float(along.max() - center @ ahead)
        # Open jaws may lie in a ball, but are no round end; a ball about its axis would not move.
        fits = covers - before < _STANDS_OUT * covers and not self._on_rim
        if radius is None and fits and (self._free or not self._jaws):
            covering = f"it covers the end of link '{self.link}'"
            return Tip(name, rounded(covers), center, covering, made=True)
        least = _OF_BODY * size if self._free else 0.0
        ball = rounded(max(_BALL * covers, least)) if radius is None else radius
        front, still = center + (before + ball) * ahead, ahead if radius is None else None
        return Tip(name, ball, front, f"a ball on the end of link '{self.link}'", still, True)

    def _ahead(self) -> Array:
        """Return the unit vector (3,) towards the end, in the frame.

        To the jaws of a gripper; of a body that floats down. Else away from the joint's axis;
        along it where the link is about it, away from the link before; if the frame cannot move
        along it, to the rim.
        """
        model, place = self._model, self._frame.placement.inverse()
        here = _middle(self.corners)
        if self._free:
            return np.asarray(-place.rotation[:, 2])
        if self._jaws:
            jaws, wrist = (self._corners(self._joint, one) for one in (self._jaws, {self._joint}))
            return unit(place.rotation @ (_middle(jaws) - _middle(wrist)))
        joint = model.joints[self._joint]
        parent = int(model.parents[self._joint])
        before = self._corners(parent, {parent})
        behind = place.act(model.jointPlacements[self._joint].actInv(_middle(before)))
        origin, away = place.translation, here - behind
        if joint.nv == 1:
            motion = np.ravel(joint.createData().S)
            axis = place.rotation @ (motion[:3] + motion[3:])
            aside = (here - origin) - axis * (axis @ (here - origin))
            size = float(np.linalg.norm(np.ptp(self.corners, axis=0)))
            if not joint_slides(joint) and np.linalg.norm(aside) >= _AT_AXIS * size:
                away = aside
            elif self._moves_along(axis):
                away = axis * np.sign(axis @ away or 1.0)
            else:
                away = away - axis * (axis @ away)
                if np.linalg.norm(away) < _AT_AXIS * size:  # a disc ends anywhere on its rim
                    rim = self.corners - origin - np.outer((self.corners - origin) @ axis, axis)
                    away, self._on_rim = rim[int(np.argmax(np.linalg.norm(rim, axis=1)))], True
        return unit(away)

    def _moves_along(self, axis: Array) -> bool:
        """Whether the frame can move along an `axis` (3,): a mechanism in a plane does not."""
        reach = Reach(self._model, self._frame.name, np.zeros(3))
        q = pin.integrate(self._model, self._robot.q0, np.full(self._model.nv, 0.3))
        moves = reach.jacobian(q)[:3].T @ reach.data.oMf[reach.frame].rotation @ axis
        return bool(np.abs(moves).max(initial=0.0) > _STILL)

    def _corners(self, joint: int, joints: Collection[int]) -> Array:
        """Return the corners (k, 3) [m] of the geometry of `joints`, in the frame of `joint`."""
        data = self._model.createData()
        pin.forwardKinematics(self._model, data, self._robot.q0)
        for geometry in (self._robot.collision_model, self._robot.visual_model):
            found = [
                moved(
                    data.oMi[joint].actInv(data.oMi[one.parentJoint] * one.placement),
                    np.asarray(Shell.from_geometry(one).vertices),
                )
                for one in geometry.geometryObjects
                if int(one.parentJoint) in joints
            ]
            if found:
                return np.concatenate(found)
        return np.zeros((0, 3))


def _middle(points: Array) -> Array:
    return 0.5 * (points.min(axis=0) + points.max(axis=0)) if len(points) else np.zeros(3)


def _smallest_ball(points: Array) -> tuple[Array, float]:
    """Return center (3,) and radius of nearly the smallest ball around `points` (k, 3).

    Each step goes towards the farthest point (Badoiu and Clarkson, SODA 2003).
    """
    center = _middle(points)
    for k in range(_STEPS):
        farthest = points[int(np.argmax(((points - center) ** 2).sum(axis=1)))]
        center = center + (farthest - center) / (k + 2)
    return center, float(np.linalg.norm(points - center, axis=1).max())
