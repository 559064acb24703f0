"""Draw the meshes of the robot gear_pair (python docs/site/gear_mesh.py)."""

from pathlib import Path

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.shell import Shell

MODULE = 0.005
"""Pitch diameter divided by the number of teeth [m]."""
PRESSURE_ANGLE = np.deg2rad(20.0)
BACKLASH = 1e-4
"""Play between the flanks of the two gears, along their common normal [m]."""
WIDTH = 0.02
"""Face width [m]."""


def gear_outline(teeth: int, points: int = 5) -> Array:
    """Return the outline (n,2) [m] of an involute gear, counter-clockwise, a tooth on +x.

    Addendum 1 module, dedendum 1.25 modules; half the backlash is taken from each gear. Each flank
    has `points` points.
    """
    pitch = MODULE * teeth / 2
    base, tip, root = pitch * np.cos(PRESSURE_ANGLE), pitch + MODULE, pitch - 1.25 * MODULE
    # Half the tooth's angle at the base circle, where the involutes start.
    half = np.pi / (2 * teeth) + np.tan(PRESSURE_ANGLE) - PRESSURE_ANGLE - BACKLASH / (4 * base)
    radius = np.linspace(max(base, root), tip, points)
    angle = np.arccos(np.clip(base / radius, -1, 1))
    flank = half - (np.tan(angle) - angle)
    radii = np.concatenate(([root], radius, radius[::-1], [root]))
    angles = np.concatenate(([-flank[0]], -flank, flank[::-1], [flank[0]]))
    turns = 2 * np.pi * np.arange(teeth) / teeth
    theta = (turns[:, None] + angles).ravel()
    rho = np.tile(radii, teeth)
    return np.column_stack((rho * np.cos(theta), rho * np.sin(theta)))


def gear_triangles(teeth: int, bore: float = 0.012) -> Array:
    """Return the triangles (t,3,3) [m] of a gear about z; `bore` is its bore's radius [m]."""
    outer = gear_outline(teeth)
    # Each point of the outline has its partner on the bore, at the same angle.
    inner = bore * np.round(outer / np.linalg.norm(outer, axis=1, keepdims=True), 9)
    z = np.full((len(outer), 1), WIDTH / 2)
    low_out, high_out = np.hstack((outer, -z)), np.hstack((outer, z))
    low_in, high_in = np.hstack((inner, -z)), np.hstack((inner, z))
    bands = ((low_out, high_out), (high_out, high_in), (high_in, low_in), (low_in, low_out))
    triangles = []
    for first, second in bands:
        a, b = first, np.roll(first, -1, axis=0)
        c, d = second, np.roll(second, -1, axis=0)
        triangles += [np.stack((a, b, d), axis=1), np.stack((a, d, c), axis=1)]
    soup = np.concatenate(triangles)
    # The radial foot of a tooth has both ends at one angle: there the bore's triangles vanish.
    doubled = np.cross(soup[:, 1] - soup[:, 0], soup[:, 2] - soup[:, 0])
    return np.asarray(soup[np.linalg.norm(doubled, axis=1) > 1e-15])


if __name__ == "__main__":
    folder = Path(__file__).parents[2] / "robots" / "meshes"
    for number in (20, 40):
        corners = gear_triangles(number).reshape(-1, 3)
        gear = Shell(corners, np.arange(len(corners)).reshape(-1, 3), clean=False)
        gear.to_file(folder / f"gear_{number}.stl")
