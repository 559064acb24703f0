"""Whether links of a robot are in a part: their collision geometry against its surface, by Coal."""

import itertools
from collections.abc import Sequence
from functools import cached_property

import coal
import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.models import find_frame, held_joints
from sphshell_pin.scenario.drafting.limb_ends import AT_TIP, Tip
from sphshell_pin.shell.primitives import coal_tree
from sphshell_pin.shell.shell import Shell

# Contacts of the tip's own link that are looked at.
_MOST_CONTACTS = 1000


class Links:
    """The collision geometry of a robot, to be held against the surface of a part.

    `model` is the whole robot, `lock` names the joints that do not move. With q (nq,), a posture,
    links that do not touch each other there may not do so elsewhere. What a sphere of `tips`
    stands for is left out: a sphere with the same center, whatever its radius, and of the tip's own
    link (with all that is fixed to it) what is near the sphere.
    """

    def __init__(
        self,
        model: pin.Model,
        geometry: pin.GeometryModel,
        shell: Shell,
        tips: Sequence[Tip],
        lock: Sequence[str],
        q: Array | None = None,
    ) -> None:
        self.model, self._data, self._geometry = model, model.createData(), geometry.copy()
        self._geometry.removeAllCollisionPairs()
        joints, parents = [int(one.parentJoint) for one in geometry.geometryObjects], model.parents
        for (i, one), (j, other) in itertools.combinations(enumerate(joints), 2):
            if q is not None and one != other and other != parents[one] and one != parents[other]:
                self._geometry.addCollisionPair(pin.CollisionPair(i, j))
        self._geometry_data = pin.GeometryData(self._geometry)
        for one in self._geometry.geometryObjects:
            one.geometry.computeLocalAABB()
        if q is not None:
            self.crossed(q, stop=False)
        for k, result in enumerate(self._geometry_data.collisionResults):
            if result.isCollision():
                self._geometry_data.deactivateCollisionPair(k)
        self.shell, self._tips = shell, [(find_frame(model, tip.frame), tip) for tip in tips]
        triangles = shell.triangles
        if shell.side == "inside":
            # Of a hollow links may not touch the lower half, as a bowl's.
            heights = shell.vertices[triangles, 2].max(axis=1)
            triangles = triangles[heights <= shell.box[:, 2].mean() + 1e-9 * shell.size]
        self._surface = coal_tree(shell.vertices, triangles)
        frames = [model.frames[k] for k, _ in self._tips]
        held = set(held_joints(model, tuple(lock)))
        movers = [set(map(int, chain)) - held for chain in model.supports]
        self._objects: list[tuple[int, list[int]]] = []
        for i, one in enumerate(geometry.geometryObjects):
            # It does not move against the tips at these places.
            same = movers[one.parentJoint]
            at = [k for k, frame in enumerate(frames) if movers[frame.parentJoint] == same]
            if not any(_is_sphere(one, frames[k], tips[k]) for k in at):
                self._objects.append((i, at))

    def crossed(self, q: Array, *, stop: bool = True) -> bool:
        """Whether links touch each other at q (nq,) that may not; `stop` at the first ones."""
        geometry = self._geometry, self._geometry_data
        return bool(pin.computeCollisions(self.model, self._data, *geometry, q, stop))

    @cached_property
    def floor(self) -> float:
        """Height [m] under what of the robot is fixed to the world, 0 at most."""
        lowest = [0.0]
        for one in self._geometry.geometryObjects:
            if not one.parentJoint:
                box, turn = one.geometry.aabb_local, np.abs(one.placement.rotation)
                middle = one.placement.act(one.geometry.aabb_center)
                lowest.append((middle - 0.5 * turn @ (box.max_ - box.min_))[2])
        return float(min(lowest))

    def lowest(self, q: Array) -> float:
        """Return the height [m] of the lowest joint or middle of a link that moves, at q (nq,)."""
        self._place(q)
        objects = zip(self._geometry.geometryObjects, self._geometry_data.oMg, strict=True)
        middles = [pose.act(a.geometry.aabb_center) for a, pose in objects if a.parentJoint]
        joints = [joint.translation for joint in list(self._data.oMi)[1:]]
        return float(np.array([*middles, *joints])[:, 2].min())

    def _place(self, q: Array) -> None:
        pin.updateGeometryPlacements(self.model, self._data, self._geometry, self._geometry_data, q)

    def within(self, q: Array, placement: pin.SE3, *, whole: bool = False) -> str | None:
        """Return a link that is in the part at `placement` with the robot at q (nq,).

        With `whole` a link that is inside as a whole, and touches nothing, counts too.
        """
        self._place(q)
        pin.updateFramePlacements(self.model, self._data)
        frames = self._data.oMf
        balls = [(placement.actInv(frames[k].act(tip.offset)), tip) for k, tip in self._tips]
        for k, (i, at) in enumerate(self._objects):
            one = self._geometry.geometryObjects[i]
            pose = placement.actInv(self._geometry_data.oMg[i])
            if self._touches(one, pose, [balls[k] for k in at]) or (
                whole and self._inside(one, pose)
            ):
                # What is in the way here will be so in the next place, too.
                self._objects.insert(0, self._objects.pop(k))
                name = str(self.model.frames[one.parentFrame].name)
                return name if name != "universe" else str(one.name)
        return None

    def _touches(
        self, one: pin.GeometryObject, pose: pin.SE3, balls: Sequence[tuple[Array, Tip]]
    ) -> bool:
        """Whether a geometry touches the surface, in whose frame all is, beside the tips."""
        link, part = coal.Transform3s(pose.rotation, pose.translation), coal.Transform3s()
        flag, most = coal.CollisionRequestFlag.CONTACT, _MOST_CONTACTS if balls else 1
        request, result = coal.CollisionRequest(flag, most), coal.CollisionResult()
        coal.collide(one.geometry, link, self._surface, part, request, result)
        return any(
            all(np.linalg.norm(at.pos - center) > AT_TIP * tip.radius for center, tip in balls)
            for at in result.getContacts()
        )

    def _inside(self, one: pin.GeometryObject, pose: pin.SE3) -> bool:
        """Whether a point of a geometry is behind the surface, where that is closed."""
        if not self.shell.is_closed or self.shell.side == "inside":
            return False
        mesh = isinstance(one.geometry, coal.BVHModelBase)
        at = pose.act(np.array(one.geometry.vertices()[0]) if mesh else np.zeros(3))
        if (at < self.shell.box[0]).any() or (at > self.shell.box[1]).any():
            return False
        return bool(self.shell.closest_points(at[None], method="facets").distances[0] < 0)


def _is_sphere(one: pin.GeometryObject, frame: pin.Frame, tip: Tip) -> bool:
    away = one.placement.translation - frame.placement.act(tip.offset)
    near = np.linalg.norm(away) < 1e-3 * tip.radius and one.parentJoint == frame.parentJoint
    return bool(near and isinstance(one.geometry, coal.Sphere))
