"""Pressure of an elastic foundation: where the patch is no ellipse, but the overlap."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from sphshell_pin.patches.placed import Array, PlacedPatches

if TYPE_CHECKING:
    from sphshell_pin.dynamics.pairs import ContactPair
    from sphshell_pin.dynamics.result import Result
    from sphshell_pin.dynamics.scene import Scene

_STEP = 0.2  # of a stroke: between two places at which the pressure is taken, over a half axis


def has_foundation(pair: ContactPair) -> bool:
    """Whether the pressure is that of an elastic foundation on a shell."""
    return pair.law.kind == "foundation" and pair.shell is not None and pair.sphere is not None


def foundation_loads(
    result: Result, scene: Scene, index: int, joint: int, placement: pin.SE3
) -> Iterator[tuple[int, Array, Array]]:
    """Yield of each row in which pair `index` touches where it presses, and how hard.

    They are the row's number, points (n, 3) in the frame at `placement` in a joint, and loads (n,)
    [N] that add up to the recorded normal forces: damping is shared out as the elastic pressure is.
    """
    foundation_pressure = import_module("sphshell_pin.contact.foundation").foundation_pressure
    pair = scene.pairs[index]
    assert pair.shell is not None
    assert pair.sphere is not None
    log = result.contacts
    own = np.asarray(log.pair) == index
    forces = np.bincount(log.row[own], log.normal_force[own], len(result.t))
    model, data = scene.model, scene.model.createData()
    for row in np.unique(log.row[own]):
        pin.forwardKinematics(model, data, np.asarray(result.q[row], dtype=float))
        shell = data.oMi[pair.joint_j] * pair.placement_j
        center = shell.actInv((data.oMi[pair.joint_i] * pair.placement_i).translation)
        points, _, pressures, areas = foundation_pressure(
            pair.shell, center, pair.sphere.radius, pair.law, pair.method
        )
        loads = pressures * areas
        if not loads.sum() > 0.0:
            continue
        move = (data.oMi[joint] * placement).actInv(shell)
        seen = points @ move.rotation.T + move.translation
        yield int(row), seen, loads * (forces[row] / loads.sum())


@dataclass(frozen=True)
class Overlap:
    """Spheres that overlap a shell: `centers` (k, 3) in its frame and `radii` (k,) [m].

    `holds` (k,): whether the patch is one of an elastic foundation; the others are nan.
    """

    centers: Array
    radii: Array
    holds: NDArray[np.bool_]

    def stroke(
        self, points: Array, i: int, j: int, half: float, first: float, last: float
    ) -> Array:
        """Pressure (n,) over some scale at `points` (n, 3), averaged over a stroke from i to j.

        The power of slip changes from `first` to `last` meanwhile. At a distance rho from the
        center the pressure is that of (R^2 - rho^2) / (2 rho). `half` is a half axis [m].
        """
        begin, end, radius = self.centers[i], self.centers[j], self.radii[i]
        steps = 1 + int(np.ceil(np.linalg.norm(end - begin) / (_STEP * half)))
        out = np.zeros(len(points))
        for share in (np.arange(steps) + 0.5) / steps:
            rho = np.linalg.norm(points - (begin + share * (end - begin)), axis=1)
            rho = np.maximum(rho, 1e-6 * radius)
            overlap = np.maximum(0.0, (radius * radius - rho * rho) / (2.0 * rho))
            out += (first + share * (last - first)) * overlap
        return out / steps


def overlap_of(result: Result, scene: Scene, patches: PlacedPatches) -> Overlap | None:
    """Return the spheres of `patches`, None where none of them is of an elastic foundation."""
    foundations = [k for k in np.unique(patches.pair).tolist() if has_foundation(scene.pairs[k])]
    if not foundations:
        return None
    centers, radii = np.full((len(patches.row), 3), np.nan), np.zeros(len(patches.row))
    model, data = scene.model, scene.model.createData()
    for k in foundations:
        pair = scene.pairs[k]
        for at in np.flatnonzero(patches.pair == k):
            q = np.asarray(result.q[patches.row[at]], dtype=float)
            pin.forwardKinematics(model, data, q)
            shell = data.oMi[pair.joint_j] * pair.placement_j
            centers[at] = shell.actInv((data.oMi[pair.joint_i] * pair.placement_i).translation)
            radii[at] = pair.least_radius
    return Overlap(centers, radii, np.isin(patches.pair, foundations))
