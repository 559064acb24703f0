"""Directions in space: of unit length, along the nearest axis, across and turned to each other."""

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array


def unit(vector: Array) -> Array:
    """Return vectors (..., 3) with the length 1; shorter ones than 1e-9 stay short."""
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    return np.asarray(vector / np.maximum(length, 1e-9))


def nearest_axis(direction: Array) -> Array:
    """Return the unit vector (3,) along the coordinate axis nearest to `direction` (3,)."""
    k = int(np.argmax(np.abs(direction)))
    return np.asarray(np.sign(direction[k]) * np.eye(3)[k] + 0.0)


def tangents(normal: Array, direction: Array) -> tuple[Array, Array]:
    """Return unit vectors (3,) across `normal` and each other, the first along `direction`."""
    first = direction - normal * (normal @ direction)
    if np.linalg.norm(first) < 1e-6:
        first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first = unit(first)
    return first, np.cross(normal, first)


def turned_to(side: Array, target: Array) -> Array:
    """Return the rotation (3, 3) that turns `side` to `target` by the shortest way, upright ones.

    Those that are opposite to each other are turned about a horizontal axis across them, or z.
    """
    if side @ target < -0.999:
        about = np.eye(3)[2 if abs(side[2]) < 0.5 else 0]
        return np.asarray(2.0 * np.outer(about, about) - np.eye(3))
    rotation = pin.Quaternion.FromTwoVectors(side, target).toRotationMatrix()
    rounded = np.round(rotation) + 0.0
    return np.asarray(rounded if np.abs(rotation - rounded).max() < 1e-9 else rotation)


def moved(place: pin.SE3, points: Array) -> Array:
    """Return points (k, 3) of a body at `place`."""
    return np.asarray(points @ place.rotation.T + place.translation)
