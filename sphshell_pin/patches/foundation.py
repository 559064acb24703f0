"""Pressure of an elastic foundation: where the patch is no ellipse, but the overlap."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sphshell_pin.base.arrays import Array, Longs
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.scene.pairs import ContactPair
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import InvalidParameter
from sphshell_pin.patches.placed import patches_on, poses_along
from sphshell_pin.shell.shell import Shell

_MOST_SAMPLES = 3_000_000


@dataclass(frozen=True)
class Samples:
    """Small pieces of a shell, on the surface that spheres touch.

    `triangle` (k,) is the shell's triangle of each; `points` (k, 3) [m] are their centers, `areas`
    (k,) [m^2].
    """

    triangle: Longs
    points: Array
    areas: Array

    @classmethod
    def of(cls, corners: Array, triangle: Longs) -> Samples:
        """Return the pieces with these corners (k, 4, 3) [m]; three-sided ones have one twice."""
        halves = np.stack([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]], axis=1)
        areas = 0.5 * np.linalg.norm(
            np.cross(halves[:, :, 1] - halves[:, :, 0], halves[:, :, 2] - halves[:, :, 0]), axis=2
        )
        whole = np.maximum(areas.sum(axis=1), 1e-300)
        points = np.einsum("kt,ktx->kx", areas / whole[:, None], halves.mean(axis=2))
        return cls(triangle, points, areas.sum(axis=1))


def divide(shell: Shell, places: Array, reach: float, resolution: float, curved: bool) -> Samples:
    """Divide the triangles of `shell` that are within `reach` [m] of `places` (n, 3) [m].

    Each is halved across its longer pair of opposite sides until no side is longer than
    `resolution` [m], a triangle as a piece of which one side is a point; so long slivers become
    short ones. `curved`: on the elements of the method "smooth".

    Raises InvalidParameter for a resolution that needs too many pieces.
    """
    # Imported where it is used: it takes as long as all else of a short run.
    from scipy.spatial import cKDTree

    surface, near_places = _Surface(shell, curved), cKDTree(places)
    owner = np.arange(len(shell.triangles))
    weights = np.eye(3)[surface.as_pieces()]
    done_owner, done_corners = [owner[:0]], [np.zeros((0, 4, 3))]
    while len(owner):
        corners = surface.at(owner, weights)
        # A curved triangle may leave the box of its corners by as much as its parent does the flat.
        middle = corners.mean(axis=1)
        around = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1) + surface.bulge
        near = near_places.query(middle)[0] <= around + reach
        owner, weights, corners = owner[near], weights[near], corners[near]
        sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        pairs = np.maximum(sides[:, :2], sides[:, 2:])
        fine = pairs.max(axis=1) <= resolution
        done_owner.append(owner[fine])
        done_corners.append(corners[fine])
        owner, weights = _halved(owner[~fine], weights[~fine], np.argmax(pairs[~fine], axis=1))
        if len(owner) + sum(map(len, done_owner)) > _MOST_SAMPLES:
            raise InvalidParameter(
                "resolution",
                resolution,
                f"needs more than {_MOST_SAMPLES} pieces of shell '{shell.name}': take a "
                "larger one [m]",
            )
    return Samples.of(np.concatenate(done_corners), np.concatenate(done_owner))


def _halved(owner: Longs, weights: Array, longer: Longs) -> tuple[Longs, Array]:
    """Halve pieces across their sides `longer` (k,) and `longer` + 2; side s follows corner s."""
    turn = (longer[:, None] + np.arange(4)) % 4
    a, b, c, d = np.moveaxis(np.take_along_axis(weights, turn[:, :, None], axis=1), 1, 0)
    m, n = 0.5 * (a + b), 0.5 * (c + d)
    both = np.concatenate((np.stack((a, m, n, d), axis=1), np.stack((m, b, c, n), axis=1)))
    return np.concatenate((owner, owner)), both


class _Surface:
    """Points of a shell's triangles at barycentric weights, flat or curved."""

    def __init__(self, shell: Shell, curved: bool) -> None:
        core = shell.core_for("smooth" if curved else "facets")
        self._corners = np.asarray(core.vertices, dtype=float)[np.asarray(core.triangles)]
        self._offsets: Array | None = None
        self.bulge = 0.0
        if curved:
            offsets = np.asarray(core.control_point_offsets)
            if offsets.any():
                self._offsets = offsets
                self.bulge = float(np.linalg.norm(offsets, axis=2).max())

    def as_pieces(self) -> Longs:
        """Return the corners (t, 4) of the triangles as pieces.

        The one opposite the shortest side is there twice: so needles are cut across.
        """
        sides = np.linalg.norm(self._corners - np.roll(self._corners, -1, axis=1), axis=2)
        first = (np.argmin(sides, axis=1) + 2) % 3
        return np.asarray((first[:, None] + np.array([0, 0, 1, 2])) % 3, dtype=np.int64)

    def at(self, owner: Longs, weights: Array) -> Array:
        """Return the corners (k, 4, 3) at `weights` (k, 4, 3) of the triangles `owner` (k,)."""
        points = np.einsum("kpc,kcx->kpx", weights, self._corners[owner])
        if self._offsets is not None:
            w, u, v = np.moveaxis(weights, 2, 0)
            sides = [3 * a * b * c for a, b in ((w, u), (u, v), (v, w)) for c in (a, b)]
            inner = np.stack([*sides, 6 * u * v * w], axis=2)
            points = points + np.einsum("kpb,kbx->kpx", inner, self._offsets[owner])
        return np.asarray(points)


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
