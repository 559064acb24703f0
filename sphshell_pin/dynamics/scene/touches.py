"""Where pairs touch at a state, or would, and how they can move there: all pairs at once."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array
from sphshell_pin.dynamics.scene.models import mass_matrix
from sphshell_pin.dynamics.scene.sides import SourceSide, SphereSide
from sphshell_pin.dynamics.scene.sources import checked_source

if TYPE_CHECKING:
    from sphshell_pin.dynamics.scene.pairs import ContactPair


_IDENTITY = np.eye(3)


class Touch(NamedTuple):
    """Gap [m], effective masses [kg] along and across the normal, speed along it [m/s].

    A mass is nan where the pair cannot move.
    """

    gap: float
    mass: float
    slip_mass: float
    speed: float


def touches_at(
    model: pin.Model, pairs: tuple[ContactPair, ...], q: Array, v: Array
) -> list[Touch | None]:
    """Work out the touch of each of `pairs` at q (nq,), v (nv,); None where a source finds none."""
    data = model.createData()
    pin.forwardKinematics(model, data, q, v)
    pin.computeJointJacobians(model, data, q)
    places = _places(pairs, data)
    known = [k for k, place in enumerate(places) if place is not None]
    found = [place for place in places if place is not None]
    touches: list[Touch | None] = [None] * len(pairs)
    if found:
        ends = [(pairs[k].joint_i, pairs[k].joint_j) for k in known]
        for k, touch in zip(known, _touches(model, data, ends, found, q, v), strict=True):
            touches[k] = touch
    return touches


class _Place(NamedTuple):
    """Where a pair touches, or would: in the world."""

    gap: float
    point: Array
    normal: Array


def _places(pairs: tuple[ContactPair, ...], data: pin.Data) -> list[_Place | None]:
    """Find where each of `pairs` touches; the spheres of one shell are asked for at once."""
    places: list[_Place | None] = [None] * len(pairs)
    on_shells: dict[tuple[int, str], list[tuple[int, Array, pin.SE3, Array]]] = {}
    for k, pair in enumerate(pairs):
        pose_j = data.oMi[pair.joint_j] * pair.placement_j
        if not pair.sphere_on_shell:
            places[k] = _other_place(pair, data.oMi[pair.joint_i] * pair.placement_i, pose_j)
        for _, on_shell in pair.sphere_on_shell:
            center = data.oMi[pair.joint_i].act(pair.placement_i.translation)
            found = k, center, pose_j, pose_j.actInv(center)
            on_shells.setdefault((id(on_shell.shell), on_shell.method), []).append(found)
    for spheres in on_shells.values():
        on_shell = pairs[spheres[0][0]].shells[0]
        shell, centers = on_shell.shell, np.array([local for *_, local in spheres])
        at = shell.closest_points(centers, method=on_shell.method)
        sides = {"both": np.abs, "outside": np.positive, "inside": np.negative}
        signed = sides[shell.side](at.distances)
        for row, (k, center, pose_j, _) in enumerate(spheres):
            point = pose_j.act(at.points[row])
            away, length = _apart(center, point)
            normal = away / length if length > 0 else pose_j.rotation @ at.normals[row]
            places[k] = _Place(float(signed[row]) - pairs[k].least_radius, point, normal)
    return places


def _other_place(pair: ContactPair, pose_i: pin.SE3, pose_j: pin.SE3) -> _Place | None:
    """Find where a pair touches that is no sphere on a shell."""
    side_i, side_j = pair.side_i, pair.side_j
    if isinstance(side_i, SourceSide):
        points, normals, depths = checked_source(side_i.find, pair.name)(pose_i, pose_j)
        if not len(depths):
            return None
        deepest = int(np.argmax(depths))
        return _Place(-float(depths[deepest]), points[deepest], normals[deepest])
    if isinstance(side_i, SphereSide) and isinstance(side_j, SphereSide):
        away, length = _apart(pose_i.translation, pose_j.translation)
        normal = away / length if length > 0 else np.array([0.0, 0.0, 1.0])
        point = pose_j.translation + side_j.radius * normal
        return _Place(length - side_j.radius - side_i.radius, point, normal)
    (on_shell,) = pair.shells  # beside a plane
    vertices = on_shell.shell.vertices
    over = pose_i.actInv(pose_j)  # the shell from the plane
    heights = vertices @ over.rotation[2] + over.translation[2]
    lowest = int(np.argmin(heights))
    return _Place(float(heights[lowest]), pose_j.act(vertices[lowest]), -pose_i.rotation[:, 2])


def _apart(a: Array, b: Array) -> tuple[Array, float]:
    """Return a - b (3,) and its length."""
    away = a - b
    return away, math.sqrt(away.dot(away))


def _touches(
    model: pin.Model,
    data: pin.Data,
    ends: list[tuple[int, int]],
    places: list[_Place],
    q: Array,
    v: Array,
) -> list[Touch]:
    """Work out how pairs, with joints i and j in `ends`, move where they touch."""
    # The Jacobian (6, nv) of each joint, at the origin of the world.
    of_joint = {
        joint: pin.getJointJacobian(model, data, joint, pin.WORLD).reshape(6, -1)
        if joint
        else np.zeros((6, model.nv))
        for joint in {joint for both in ends for joint in both}
    }
    points, normals = (np.array([place[column] for place in places]) for column in (1, 2))
    skews = np.zeros((len(places), 3, 3))
    skews[:, (2, 0, 1), (1, 2, 0)] = points
    skews[:, (1, 2, 0), (2, 0, 1)] = -points
    of_i, of_j = (np.array([of_joint[both[end]] for both in ends]) for end in (0, 1))
    jacobians = (of_i[:, :3] - skews @ of_i[:, 3:]) - (of_j[:, :3] - skews @ of_j[:, 3:])
    mobilities = np.zeros((len(places), 3, 3))
    if v.size:
        mobilities = jacobians @ np.linalg.solve(mass_matrix(model, q), jacobians.swapaxes(1, 2))
    tangents = _IDENTITY - normals[:, :, None] * normals[:, None, :]
    slips = np.linalg.eigvalsh(tangents @ mobilities @ tangents).max(axis=1)
    return [
        Touch(
            place.gap,
            _mass(float(place.normal @ mobility @ place.normal)),
            _mass(float(slip)),
            abs(float(place.normal @ jacobian @ v)),
        )
        for place, jacobian, mobility, slip in zip(
            places, jacobians, mobilities, slips, strict=True
        )
    ]


def _mass(mobility: float) -> float:
    return 1 / mobility if mobility > 1e-12 else math.nan
