"""Tactile sensors: what each cell of a grid on a sphere, or of a shell, feels of the patches."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
import pinocchio as pin

from sphshell_pin.base.arrays import Array, Longs, Mask
from sphshell_pin.base.atomic import atomic_file
from sphshell_pin.base.checks import check_name, check_positive, check_vector, read_only
from sphshell_pin.base.regular_file import StrPath
from sphshell_pin.base.summary import Summarized
from sphshell_pin.dynamics.result.result import Result
from sphshell_pin.dynamics.result.result_scene import scene_of
from sphshell_pin.dynamics.scene.scene import Scene
from sphshell_pin.errors import InvalidParameter, ResultError
from sphshell_pin.patches.foundation import foundation_loads, has_foundation
from sphshell_pin.patches.placed import PlacedPatches, load_in_polygons, patches_on

# Parallels are no straight lines in a patch: they are cut so that a chord leaves them by this
# share of the larger half axis of the smallest of the larger patches.
_CHORD = 1e-3
_MOST_CUTS = 32
_PER_TAXEL = 8  # pieces of an overlap along the side of a taxel
_FACING = 0.5  # cosine between a contact's normal and that of an element that shares its load


@dataclass(frozen=True, repr=False)
class TaxelImages(Summarized):
    """Normal forces that taxels felt over time.

    Attributes
    ----------
    t : (rows,) [s]
    forces : (rows, n, m) of a grid, (rows, m) of a shell's elements or faces [N]
    outside : (rows,) of what fell beside the taxels [N]: with it, each row sums up to the normal
        forces of its contacts
    """

    t: Array
    forces: Array
    outside: Array

    def save(self, path: StrPath) -> Path:
        """Write the arrays to a compressed .npz file, and return its path."""
        with atomic_file(Path(path)) as stream:
            np.savez_compressed(stream, t=self.t, forces=self.forces, outside=self.outside)
        return Path(path)


@dataclass(frozen=True)
class TaxelGrid:
    """n x m sensors on a sphere: equal steps of latitude (n rows) and longitude (m columns).

    Parameters
    ----------
    pair : name of the contact whose sphere it is; of the scene's other pairs those with the same
        sphere count, too
    shape : (n, m)
    axis : (3,) from the sphere's center to the middle of the grid, in the sphere's frame
    up : (3,) the direction in which latitude grows there, in the same frame; need not be
        perpendicular to `axis`
    extent : (height, width), angles over which the grid reaches [rad]: (pi, 2 pi) is the whole
        sphere
    """

    pair: str
    shape: tuple[int, int]
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    up: tuple[float, float, float] | None = None
    extent: tuple[float, float] = (np.pi / 2, np.pi / 2)
    _basis: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Check the values."""
        check_name("pair", self.pair)
        n = np.asarray(self.shape)
        if n.shape != (2,) or n.dtype.kind not in "iu" or (n < 1).any():
            raise InvalidParameter("shape", self.shape, "must be two numbers of taxels, (n, m)")
        height, width = check_vector("extent", self.extent, 2, " [rad]")
        if not 0.0 < height <= np.pi * (1 + 1e-12) or not 0.0 < width <= 2 * np.pi * (1 + 1e-12):
            raise InvalidParameter(
                "extent", self.extent, "must be (height, width) up to (pi, 2 pi) [rad]"
            )
        axis = check_vector("axis", self.axis, 3)
        if self.up is None:
            up = np.eye(3)[int(np.argmin(np.abs(axis)))]
        else:
            up = check_vector("up", self.up, 3)
        check_positive("the length of axis", float(np.linalg.norm(axis)), "")
        axis = axis / np.linalg.norm(axis)
        up = up - axis * (axis @ up)
        if np.linalg.norm(up) < 1e-9:
            raise InvalidParameter("up", self.up, "must not be parallel to axis")
        up = up / np.linalg.norm(up)
        basis = read_only(np.stack([axis, np.cross(up, axis), up], axis=1))
        object.__setattr__(self, "_basis", basis)

    def corners(self, cuts: int = 1) -> Array:
        """Return unit vectors (n cuts + 1, m cuts + 1, 3) to the corners, in the sphere's frame."""
        (n, m), (height, width) = self.shape, self.extent
        latitude = np.linspace(-0.5 * height, 0.5 * height, n * cuts + 1)[:, None]
        longitude = np.linspace(-0.5 * width, 0.5 * width, m * cuts + 1)[None, :]
        out = np.stack(
            np.broadcast_arrays(
                np.cos(latitude) * np.cos(longitude),
                np.cos(latitude) * np.sin(longitude),
                np.sin(latitude),
            ),
            axis=-1,
        )
        return np.asarray(out @ self._basis.T)

    def images(self, result: Result, scene: Scene | None = None) -> TaxelImages:
        """Return what the taxels felt at the recorded rows of `result`.

        The patch of each contact lies on the sphere about its contact point: distances from that
        are lengths of arc. Its pressure is that of Hertz on the ellipse; its loads on the taxels
        are exact integrals, up to their curved sides (1e-3 of a half axis).

        Raises ResultError without patches or a scene, NameNotFound for an unknown pair.
        """
        scene = scene_of(result, scene)
        pair = scene.pair(self.pair)
        if not pair.spheres:
            raise InvalidParameter("pair", self.pair, "must have a sphere for taxels to be on")
        own = pair.spheres[0]
        alike = [
            (k, number == 1)
            for k, other in enumerate(scene.pairs)
            for number, one in enumerate(other.spheres)
            if (one.joint, one.radius) == (own.joint, own.radius)
            and np.array_equal(one.in_joint.homogeneous, own.in_joint.homogeneous)
        ]
        on_j = {k for k, second in alike if second}
        pairs = [k for k, _ in alike if not has_foundation(scene.pairs[k])]
        patches = patches_on(result, scene, pairs, own.joint, own.in_joint)
        forces, outside = np.zeros((len(result.t), *self.shape)), np.zeros(len(result.t))
        if len(patches.row):
            # From the sphere's center to the contact: of the second of two spheres the normal leads
            # out of it.
            sides = np.where(np.isin(patches.pair, sorted(on_j)), 1.0, -1.0)
            places = sides[:, None] * patches.normals
            self._add_ellipses(forces, outside, patches, places, own.radius)
        model, data = scene.model, scene.model.createData()
        fine = own.radius * min(np.array(self.extent) / self.shape) / _PER_TAXEL
        for k in sorted({k for k, _ in alike} - set(pairs)):
            shell = scene.pairs[k]
            for row, force, points, _, loads in foundation_loads(result, scene, k, fine):
                pin.forwardKinematics(model, data, np.asarray(result.q[row], dtype=float))
                ball = data.oMi[own.joint] * own.in_joint
                move = ball.actInv(data.oMi[shell.joint_j] * shell.placement_j)
                i, j, on_grid = self._cells(points @ move.rotation.T + move.translation)
                np.add.at(forces[row], (i[on_grid], j[on_grid]), loads[on_grid])
                outside[row] += force - loads[on_grid].sum()
        return TaxelImages(result.t, read_only(forces), read_only(outside))

    def _cells(self, points: Array) -> tuple[Longs, Longs, Mask]:
        """Return row and column (k,) of the taxels at `points` (k, 3), and which are there."""
        along, right, up = (points / np.linalg.norm(points, axis=1)[:, None] @ self._basis).T
        angles = np.stack([np.arcsin(np.clip(up, -1.0, 1.0)), np.arctan2(right, along)], axis=1)
        cells = np.floor((angles / self.extent + 0.5) * self.shape).astype(np.int64)
        on_grid = np.asarray(((cells >= 0) & (cells < self.shape)).all(axis=1))
        return cells[:, 0], cells[:, 1], on_grid

    def _add_ellipses(
        self, forces: Array, outside: Array, patches: PlacedPatches, places: Array, radius: float
    ) -> None:
        n, m = self.shape
        cuts = self._cuts(float(np.median(patches.half_axes[:, 0])) / radius)
        corners = self.corners(cuts).reshape(-1, 3)
        step = max(self.extent[0] / n, self.extent[1] / m) / cuts
        shape = (n * cuts + 1, m * cuts + 1)
        for k, row in enumerate(patches.row):
            along = patches.axes[k] - places[k] * (places[k] @ patches.axes[k])
            along /= np.linalg.norm(along)
            across = np.cross(places[k], along)
            cosine = corners @ places[k]
            sine = np.linalg.norm(np.cross(corners, places[k]), axis=1)
            arc = np.arctan2(sine, cosine)
            flat = corners @ np.stack([along, across], axis=1)
            half = patches.half_axes[k] / radius
            u = (flat * (arc / np.where(sine > 0.0, sine, 1.0))[:, None] / half).reshape(*shape, 2)
            # Only cells that a patch can reach; those about the far pole are none.
            reach = (arc - half[0] <= 1.5 * step).reshape(shape)
            i, j = np.nonzero(reach[:-1, :-1] | reach[1:, :-1] | reach[:-1, 1:] | reach[1:, 1:])
            cells = np.stack([u[i, j], u[i, j + 1], u[i + 1, j + 1], u[i + 1, j]], axis=1)
            loads = patches.force[k] * load_in_polygons(cells)
            np.add.at(forces[row], (i // cuts, j // cuts), loads)
            outside[row] += patches.force[k] - loads.sum()

    def _cuts(self, half: float) -> int:
        """Return into how many pieces the sides of taxels are cut, for half axes of `half` [rad].

        A chord of a parallel over the angle s leaves it by s^2 / 8.
        """
        step = max(self.extent[0] / self.shape[0], self.extent[1] / self.shape[1])
        return int(np.clip(np.ceil(step / np.sqrt(8.0 * _CHORD * half)), 1, _MOST_CUTS))


@dataclass(frozen=True)
class ShellTaxels:
    """The elements of a shell, or its CAD faces, as sensors.

    Parameters
    ----------
    pair : name of the contact whose shell it is; other pairs of the scene with the same shell in
        the same place count, too
    of : "elements" or "faces"
    """

    pair: str
    of: Literal["elements", "faces"] = "elements"

    def __post_init__(self) -> None:
        """Check the values."""
        check_name("pair", self.pair)
        check_name("of", self.of)
        if self.of not in ("elements", "faces"):
            raise InvalidParameter("of", self.of, "must be 'elements' or 'faces'")

    def images(self, result: Result, scene: Scene | None = None) -> TaxelImages:
        """Return what the elements, or faces in the order of shell.face_names, felt at each row.

        A patch lies in the tangent plane of its contact, onto which the elements are projected that
        face it within 60 degrees. What lies beyond a border is in `outside`.

        Raises ResultError without patches or a scene, NameNotFound for an unknown pair.
        """
        scene = scene_of(result, scene)
        pair = scene.pair(self.pair)
        if not pair.shells:
            raise InvalidParameter("pair", self.pair, "must have a shell for taxels to be on")
        shell = pair.shells[0].shell
        owner = np.asarray(shell.triangle_element, dtype=np.int64)
        count = len(shell.elements)
        if self.of == "faces":
            if shell.element_face is None:
                raise ResultError(f"shell '{shell.name}'", "has no CAD faces: take its elements")
            owner = np.asarray(shell.element_face, dtype=np.int64)[owner]
            count = len(shell.face_names)
        # All pairs that have the shell in the same place.
        keys = [one.key for one in pair.shells]
        alike = [k for k, one in enumerate(scene.pairs) if [s.key for s in one.shells] == keys]
        pairs = [k for k in alike if not has_foundation(scene.pairs[k])]
        patches = patches_on(result, scene, pairs, pair.joint_j, pair.placement_j)
        corners = np.asarray(shell.vertices, dtype=float)[np.asarray(shell.triangles)]
        normals = shell.triangle_normals
        low, high = corners.min(axis=1), corners.max(axis=1)
        forces, outside = np.zeros((len(result.t), count)), np.zeros(len(result.t))
        for k, row in enumerate(patches.row):
            point, normal = patches.points[k], patches.normals[k]
            a = patches.half_axes[k, 0]
            near = np.flatnonzero(((low <= point + 2 * a) & (high >= point - 2 * a)).all(axis=1))
            facing = normals[near] @ normal
            near = near[(facing if shell.is_closed else np.abs(facing)) > _FACING]
            axes = np.stack([patches.axes[k], np.cross(normal, patches.axes[k])], axis=1)
            u = (corners[near] - point) @ axes / patches.half_axes[k]
            loads = patches.force[k] * np.abs(load_in_polygons(u))
            np.add.at(forces[row], owner[near], loads)
            outside[row] += patches.force[k] - loads.sum()
        for k in sorted(set(alike) - set(pairs)):
            for row, force, _, triangles, loads in foundation_loads(result, scene, k, np.inf):
                np.add.at(forces[row], owner[triangles], loads)
                outside[row] += force - loads.sum()
        return TaxelImages(result.t, read_only(forces), read_only(outside))
