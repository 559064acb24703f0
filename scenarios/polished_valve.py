"""What the polishing of polished_valve is judged by: what Preston's law removes in the raster."""

import numpy as np

from sphshell_pin import Result, Scene

COEFFICIENT = 1e-12  # Preston's [1/Pa]
RADIUS = 0.029  # of the barrel [m]
# The raster less 5 mm at each border, where strokes turn: along the barrel [m], about it [rad].
LOW, HIGH = np.array([0.035, np.deg2rad(-20.0)]), np.array([0.109, np.deg2rad(20.0)])


def mean_depth(result: Result, scene: Scene) -> float:
    """Return the mean removed depth in the raster [nm], by the work of slip over the area."""
    log, (pair,) = result.contacts, scene.pairs
    local = (log.point_world - pair.placement_j.translation) @ pair.placement_j.rotation
    x, y, z = local.T
    inside = np.stack([z, np.arctan2(y, x)], axis=1)
    half = 0.5 * np.diff(result.t)
    time = (np.append(half, 0.0) + np.append(0.0, half))[log.row]
    slip = np.linalg.norm(log.slip_velocity_world, axis=1)
    chosen = ((inside > LOW) & (inside < HIGH)).all(axis=1)
    work = (log.normal_force * slip * time)[chosen].sum()
    length, angle = HIGH - LOW
    return float(1e9 * COEFFICIENT * work / (length * angle * RADIUS))
