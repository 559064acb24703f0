"""Whether links of a robot are in a part: their collision geometry against its surface, by Coal."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.models import find_frame, held_joints
from sphshell_pin.scenario.drafting.fingertips import AT_TIP
from sphshell_pin.scenario.drafting.limb_ends import Tip
from sphshell_pin.shell.shell import Shell

# Contacts of the tip's own link that are looked at.
_MOST_CONTACTS = 1000


@dataclass(frozen=True)
class Intrusion:
    """A link that is in the part, at `point` (3,) [m] in the world."""

    link: str
    point: Array


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
        if q is not None:
            self._collide(q, first=False)
        for k, result in enumerate(self._geometry_data.collisionResults):
            if result.isCollision():
                self._geometry_data.deactivateCollisionPair(k)
        self.shell, self._tips = shell, tuple(tips)
        self._surface = _tree(shell)
        self._box = shell.box
        frames = [model.frames[find_frame(model, tip.frame)] for tip in tips]
        held = set(held_joints(model, tuple(lock)))
        own = [_fixed_to(model, int(frame.parentJoint), held) for frame in frames]
        self._objects: list[tuple[int, tuple[int, ...]]] = []
        for i, one in enumerate(geometry.geometryObjects):
            at = [k for k, joints in enumerate(own) if int(one.parentJoint) in joints]
            if not any(_is_sphere(one, model, frames[k], tips[k]) for k in at):
                self._objects.append((i, tuple(at)))

    def _collide(self, q: Array, *, first: bool = True) -> bool:
        geometry = self._geometry, self._geometry_data
        return bool(pin.computeCollisions(self.model, self._data, *geometry, q, first))

    def crossed(self, q: Array) -> bool:
        """Whether links touch each other at q (nq,) that may not."""
        return self._collide(q)

    def within(self, q: Array, placement: pin.SE3, *, whole: bool = False) -> Intrusion | None:
        """Return a link that is in the part at `placement` with the robot at q (nq,).

        With `whole` a link that is inside as a whole, and touches nothing, counts too.
        """
        model, geometry = self.model, self._geometry
        pin.updateGeometryPlacements(model, self._data, geometry, self._geometry_data, q)
        pin.updateFramePlacements(model, self._data)
        centers = [
            self._data.oMf[find_frame(model, tip.frame)].act(tip.offset) for tip in self._tips
        ]
        part = coal.Transform3s(placement.rotation, placement.translation)
        for k, (i, at) in enumerate(self._objects):
            one, pose = geometry.geometryObjects[i], self._geometry_data.oMg[i]
            found = self._touch(one, pose, part, [(centers[k], self._tips[k].radius) for k in at])
            if found is None and whole and self._inside(one, pose, placement):
                found = pose.translation
            if found is not None:
                # What is in the way here will be so in the next place, too.
                self._objects.insert(0, self._objects.pop(k))
                return Intrusion(_link_of(model, one), np.array(found))
        return None

    def _touch(
        self,
        one: pin.GeometryObject,
        pose: pin.SE3,
        part: coal.Transform3s,
        spheres: Sequence[tuple[Array, float]],
    ) -> Array | None:
        """Return where a geometry touches the surface beside the spheres; None if it does not."""
        place = coal.Transform3s(pose.rotation, pose.translation)
        request = coal.CollisionRequest(coal.CollisionRequestFlag.CONTACT, 1)
        if spheres:
            request.num_max_contacts = _MOST_CONTACTS
        result = coal.CollisionResult()
        if not coal.collide(one.geometry, place, self._surface, part, request, result):
            return None
        for contact in result.getContacts():
            point = np.array(contact.pos)
            away = [float(np.linalg.norm(point - c)) / radius for c, radius in spheres]
            if not away or min(away) > AT_TIP:
                return point
        return None

    def _inside(self, one: pin.GeometryObject, pose: pin.SE3, placement: pin.SE3) -> bool:
        """Whether a point of a geometry is behind the surface, where that is closed."""
        if not self.shell.is_closed:
            return False
        mesh = isinstance(one.geometry, coal.BVHModelBase)
        point = np.array(one.geometry.vertices()[0]) if mesh else np.zeros(3)
        at = placement.actInv(pose.act(point))
        if (at < self._box[0]).any() or (at > self._box[1]).any():
            return False
        return bool(self.shell.closest_points(at[None], method="facets").distances[0] < 0)


def _tree(shell: Shell) -> coal.BVHModelOBBRSS:
    tree = coal.BVHModelOBBRSS()
    tree.beginModel(len(shell.triangles), len(shell.vertices))
    tree.addVertices(shell.vertices)
    tree.addTriangles(shell.triangles.astype(np.uint32))
    tree.endModel()
    return tree


def _fixed_to(model: pin.Model, joint: int, held: set[int]) -> set[int]:
    """Return the joints whose links do not move against that of `joint`; `held` ones are locked."""
    top = joint
    while top in held:
        top = int(model.parents[top])
    fixed = {top}
    for one in range(top + 1, model.njoints):
        if one in held and int(model.parents[one]) in fixed:
            fixed.add(one)
    return fixed


def _is_sphere(one: pin.GeometryObject, model: pin.Model, frame: pin.Frame, tip: Tip) -> bool:
    if not isinstance(one.geometry, coal.Sphere) or one.parentJoint != frame.parentJoint:
        return False
    away = one.placement.translation - frame.placement.act(tip.offset)
    return bool(np.linalg.norm(away) < 1e-3 * tip.radius)


def _link_of(model: pin.Model, one: pin.GeometryObject) -> str:
    name = str(model.frames[one.parentFrame].name)
    return name if name != "universe" else str(one.name)
