"""Ellipses of contact on the pictures of shells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sphshell_pin.base.arrays import Array
from sphshell_pin.plot.figure import INK

if TYPE_CHECKING:
    from matplotlib.cm import ScalarMappable

    from sphshell_pin.dynamics.result.result import Result
    from sphshell_pin.dynamics.scene.scene import Scene
    from sphshell_pin.patches.placed import PlacedPatches
    from sphshell_pin.plot.on_shell import PathGroup, Picture

COLORS = "viridis"
MOST = 40  # ellipses in one picture
_CIRCLE = np.linspace(0.0, 2.0 * np.pi, 33)


def patches_of(result: Result, scene: Scene, group: PathGroup) -> PlacedPatches | None:
    """Return the patches on the shell of `group` in its frame, those that press."""
    from sphshell_pin.patches.placed import patches_on

    if result.patch_rows is None:
        return None
    pairs = [path.pair for path in group.paths]
    pair = scene.pairs[pairs[0]]
    patches = patches_on(result, scene, pairs, pair.joint_j, pair.placement_j)
    return patches.select(patches.force > 0.0)


def peak_pressure(patches: PlacedPatches) -> Array:
    """Return the peak of Hertz's pressure of each patch (k,) [Pa]."""
    return np.asarray(1.5 * patches.force / (np.pi * patches.half_axes.prod(axis=1)))


def draw_patches(
    picture: Picture, patches: PlacedPatches, normal: Array, scale: ScalarMappable
) -> None:
    """Draw some ellipses on the side that `normal` (3,) shows, apart from each other, true to size.

    `scale` has the colors of the peak pressures [MPa].
    """
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    seen = np.flatnonzero(patches.normals @ normal > 0.0)
    if not len(seen):
        return
    peak = peak_pressure(patches)
    kept: list[int] = []
    extent = float(np.ptp(patches.points[seen], axis=0).max())
    for k in seen.tolist():
        near = patches.points[kept] - patches.points[k]
        apart = max(1.5 * float(patches.half_axes[k, 0]), extent / MOST)
        if not kept or float((near**2).sum(axis=1).min()) > apart**2:
            kept.append(k)
    kept = [kept[k] for k in np.unique(np.linspace(0, len(kept) - 1, MOST).astype(int))]
    ellipses = []
    for k in kept:
        axis = patches.axes[k]
        across = np.cross(patches.normals[k], axis)
        a, b = patches.half_axes[k]
        ring = a * np.cos(_CIRCLE)[:, None] * axis + b * np.sin(_CIRCLE)[:, None] * across
        ellipses.append((patches.points[k] + ring) * picture.factor)
    colors = scale.to_rgba(peak[kept] * 1e-6)
    shown = Poly3DCollection(ellipses, facecolors=colors, edgecolors=INK, linewidths=0.6, zorder=5)
    picture.axis.add_collection3d(shown, autolim=False)
