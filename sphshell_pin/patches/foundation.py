"""Pressure of an elastic foundation: where the patch is no ellipse, but the overlap."""

from collections.abc import Iterator

import numpy as np

from sphshell_pin.base.arrays import Array, Longs
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.scene.pairs import ContactPair
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.patches.placed import patches_on, poses_along
from sphshell_pin.patches.sampling import divide


def has_foundation(pair: ContactPair) -> bool:
    """Whether the pressure is that of an elastic foundation on a shell."""
    return pair.law.kind == "foundation" and bool(pair.sphere_on_shell)


def foundation_loads(
    result: Result, scene: Scene, index: int, resolution: float
) -> Iterator[tuple[int, float, Array, Longs, Array]]:
    """Yield of each contact of pair `index` where it presses on the shell, and how hard.

    They are its row, its normal force [N], points (n, 3) in the shell's frame, the shell's triangle
    (n,) of each, and loads (n,) [N] that add up to the force: those on pieces of the shell no
    longer than `resolution` [m], or than an eighth of a half axis. There are none where the overlap
    is smaller than a piece. Damping is shared out as the elastic pressure is.
    """
    pair = scene.pairs[index]
    (on_shell,) = pair.shells
    shell = on_shell.shell
    patches = patches_on(result, scene, [index], pair.joint_j, pair.placement_j)
    if not len(patches.row):
        return
    turns, origins = poses_along(result, scene, patches.row, pair.joint_j, pair.placement_j)
    places = poses_along(result, scene, patches.row, pair.joint_i, pair.placement_i)[1]
    centers, radius = np.einsum("kij,ki->kj", turns, places - origins), pair.least_radius
    reach = 2.0 * float(patches.half_axes.max())
    fine = min(resolution, float(np.median(patches.half_axes[:, 1])) / 8.0)
    samples = divide(shell, patches.points, reach + fine, fine, curved=on_shell.is_smooth)
    if not len(samples.areas):
        return
    # Imported where it is used: it takes as long as all else of a short run.
    from scipy.spatial import cKDTree

    tree = cKDTree(samples.points)
    part = np.asarray(shell.element_patch)[np.asarray(shell.triangle_element)[samples.triangle]]
    for k, point in enumerate(patches.points):
        near = np.array(tree.query_ball_point(point, reach), dtype=np.int64)
        near = near[part[near] == shell.element_patch[patches.element[k]]]
        # At a distance rho from the center the pressure is as (R^2 - rho^2) / (2 rho).
        rho = np.linalg.norm(samples.points[near] - centers[k], axis=1)
        rho = np.maximum(rho, 1e-6 * radius)
        loads = np.maximum(0.0, radius**2 - rho**2) / (2.0 * rho) * samples.areas[near]
        pressed = loads > 0.0
        near, loads = near[pressed], loads[pressed]
        force = float(patches.force[k])
        if len(loads):
            loads *= force / loads.sum()
        yield int(patches.row[k]), force, samples.points[near], samples.triangle[near], loads
