"""What the polishing of polished_valve is judged by: the map of what was removed."""

from __future__ import annotations

import numpy as np

from sphshell_pin import Result, Scene
from sphshell_pin.arrays import Array
from sphshell_pin.patches import WearMap, wear_maps

COEFFICIENT = 1e-12  # run.wear [1/Pa]
# The raster less 5 mm at each border, where strokes turn: along the barrel [m], about it [rad].
LOW, HIGH = np.array([0.035, np.deg2rad(-20.0)]), np.array([0.109, np.deg2rad(20.0)])

_maps: dict[int, WearMap] = {}


def raster(result: Result, scene: Scene) -> tuple[Array, Array, WearMap]:
    """Return depths and areas of the map inside the raster, and the map."""
    key = id(result)
    if key not in _maps:
        _maps.clear()
        _maps[key] = wear_maps(result, COEFFICIENT, scene)[0]
    worn = _maps[key]
    x, y, z = worn.points.T
    inside = np.stack([z, np.arctan2(y, x)], axis=1)
    chosen = ((inside > LOW) & (inside < HIGH)).all(axis=1) & (np.hypot(x, y) > 0.028)  # no bore
    return worn.depth[chosen], worn.areas[chosen], worn


def mean_depth(result: Result, scene: Scene) -> float:
    """Return the mean removed depth in the raster [nm]."""
    depth, area, _ = raster(result, scene)
    return float(1e9 * (depth @ area) / area.sum())


def uniformity(result: Result, scene: Scene) -> float:
    """Return the standard deviation of the depth in the raster over its mean."""
    depth, area, _ = raster(result, scene)
    mean = (depth @ area) / area.sum()
    return float(np.sqrt(((depth - mean) ** 2 @ area) / area.sum()) / mean)


def coverage(result: Result, scene: Scene) -> float:
    """Return the share of the raster's area that lost at least half of the mean depth."""
    depth, area, _ = raster(result, scene)
    mean = (depth @ area) / area.sum()
    return float(area[depth >= 0.5 * mean].sum() / area.sum())


def volume_by_preston(result: Result, scene: Scene) -> float:
    """Return the removed volume over coefficient x sum of force, slip and time."""
    log = result.contacts
    half = 0.5 * np.diff(result.t)
    share = np.append(half, 0.0) + np.append(0.0, half)
    slip = np.linalg.norm(log.slip_velocity_world, axis=1)
    work = (log.normal_force * slip * share[log.row]).sum()
    return float(raster(result, scene)[2].volume / (COEFFICIENT * work))
