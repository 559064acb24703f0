"""Turned and extruded parts as CAD exports them, with their exact distances.

Few long triangles along every straight stretch, quads split along random diagonals; every third
part is rotated, every third rounded to single precision, as an STL file has it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
from sphshell_pin.shell.raw import area_vectors
from tests import meshes

Ints = NDArray[np.int32]
PLACES = 500


@dataclass(frozen=True)
class Part:
    """A tessellated part, and places beside it whose exact distances are known."""

    vertices: Array
    elements: Ints
    places: Array
    distances: Array

    def errors(self, normals: Array | None = None) -> tuple[float, float]:
        """Largest error of the closest distance on the curved and on the flat elements."""
        shell = Shell(self.vertices, self.elements, normals=normals)
        found = (shell.closest_points(self.places, method=m) for m in ("smooth", "facets"))
        curved, flat = (np.abs(np.abs(one.distances) - self.distances) for one in found)
        return float(curved.max()), float(flat.max())

    def is_worse_than_flat(self, normals: Array | None = None, tolerance: float = 1e-3) -> bool:
        curved, flat = self.errors(normals)
        return curved > 1.5 * flat + tolerance

    def as_a_file_has_it(self, seed: int) -> Part:
        """Rotated, or rounded to single precision, or as it is."""
        if seed % 3 == 0:
            return self
        if seed % 3 == 1:
            turn = meshes.random_rotation(seed)
            return Part(self.vertices @ turn.T, self.elements, self.places @ turn.T, self.distances)
        vertices = self.vertices.astype(np.float32).astype(float)
        return Part(vertices, self.elements, self.places, self.distances)


def distance_to_polyline(points: Array, corners: Array) -> Array:
    """Distances (n,) of points (n, 2) from the polyline through corners (k, 2)."""
    start, along = corners[:-1], np.diff(corners, axis=0)
    share = np.einsum("nkx,kx->nk", points[:, None] - start, along) / (along**2).sum(axis=1)
    nearest = start + np.clip(share, 0, 1)[..., None] * along
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)


def swept(sweep, stations: Array, section: Array, rng: np.random.Generator, closed: bool) -> Part:
    """The polyline `section` (k, 2) at each of the stations, the last joined to the first if
    `closed`; `sweep` takes points (n, 2) to their places at stations (n,)."""
    vertices = np.concatenate([sweep(section, np.full(len(section), s)) for s in stations])
    quads = meshes._cells(len(stations) - (not closed), len(section) - 1)[:, ::-1] % len(vertices)
    which = rng.integers(len(section) - 1, size=PLACES)
    along = np.diff(section, axis=0)[which]
    aside = np.stack([-along[:, 1], along[:, 0]], 1) / np.linalg.norm(along, axis=1)[:, None]
    flat = section[which] + rng.uniform(0.02, 0.98, PLACES)[:, None] * along
    flat += rng.choice([0.5, 0.25, 0.1, -0.1, -0.25], PLACES)[:, None] * aside
    centers = sweep(flat, rng.uniform(0.05, 0.95, PLACES) * stations[-1])
    elements = meshes._split(quads, rng.random(len(quads)) < 0.5)
    return Part(vertices, elements, centers, distance_to_polyline(flat, section))


def turned(profile: Array, sides: int, rng: np.random.Generator) -> Part:
    """The profile (k, 2) of radii and heights turned about z, open below and above."""

    def turn(flat: Array, angle: Array) -> Array:
        radius, height = flat.T
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], 1)

    return swept(turn, 2 * np.pi * np.arange(sides) / sides, profile, rng, closed=True)


def extruded(section: Array, height: float, rows: int, rng: np.random.Generator) -> Part:
    """A strip over the polyline `section` (k, 2), open above and below."""
    stations = np.linspace(0, height, rows + 1)
    return swept(lambda flat, z: np.c_[flat, z], stations, section, rng, closed=False)


def polyline(lengths: Array, turns: Array, first: float = 0.0) -> Array:
    """Corners (k + 1, 2) of k stretches; each leaves the one before it by a turn [rad]."""
    angle = first + np.concatenate([[0.0], np.cumsum(turns)])
    steps = lengths[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
    return np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])


def kinks(rng: np.random.Generator, count: int) -> Array:
    """Turns of 3 to 29 degrees: of either sign, S-shaped, or all to one side."""
    signs = [rng.choice([-1, 1], count), np.where(np.arange(count) % 2, 1, -1), np.ones(count)]
    return np.radians(rng.uniform(3, 29, count)) * signs[rng.integers(3)] * rng.choice([-1, 1])


def lengths(rng: np.random.Generator, count: int) -> Array:
    """From 0.2 to 20 radii."""
    return np.exp(rng.uniform(np.log(0.2), np.log(20), count))


def random_turned(seed: int) -> Part:
    """Two to six stretches of a radius that begins at one."""
    rng = np.random.default_rng(seed)
    while True:
        count = int(rng.integers(2, 7))
        line = polyline(
            lengths(rng, count), kinks(rng, count - 1), rng.choice([0, rng.uniform(-0.26, 0.26)])
        )
        profile = np.stack([1 + line[:, 1], line[:, 0]], 1)
        chords = np.diff(profile, axis=0)
        rising = (chords[:, 1] > 0.5 * np.linalg.norm(chords, axis=1)).all()
        if rising and profile[:, 0].min() > 0.3 and profile[:, 0].max() < 8:
            return turned(profile, int(rng.integers(12, 65)), rng).as_a_file_has_it(seed)


def random_extruded(seed: int) -> Part:
    """Three to eleven stretches, short of a full turn."""
    rng = np.random.default_rng(seed)
    while True:
        count = int(rng.integers(3, 12))
        turns = kinks(rng, count - 1)
        if np.abs(np.cumsum(turns)).max() < np.radians(330):
            break
    section = polyline(lengths(rng, count), turns)
    part = extruded(section, float(lengths(rng, 1)[0]), int(rng.choice([1, 1, 2, 4])), rng)
    return part.as_a_file_has_it(seed)


def fillet(chords: int, turn: float, wall: float) -> Array:
    """Section (k, 2): a wall along x to the origin, an arc of radius one, a wall on."""
    angle = np.linspace(0, turn, chords + 1)
    arc = np.stack([np.sin(angle), 1 - np.cos(angle)], 1)
    end = arc[-1] + wall * np.array([np.cos(turn), np.sin(turn)])
    return np.concatenate([[[-wall, 0.0]], arc, [end]])


def distance_to_fillet(points: Array, turn: float, wall: float) -> Array:
    """Distances (n,) of points (n, 2) from the exact arc with its walls."""
    arc = fillet(1, turn, wall)
    walls = np.minimum(distance_to_polyline(points, arc[:2]), distance_to_polyline(points, arc[2:]))
    from_middle = points - [0.0, 1.0]
    angle = np.arctan2(from_middle[:, 0], -from_middle[:, 1])
    off = np.abs(np.linalg.norm(from_middle, axis=1) - 1)
    round_ = np.where((angle > 0) & (angle < turn), off, np.inf)
    return np.minimum(walls, round_)


def averaged_normals(vertices: Array, elements: Ints) -> Array:
    """Per vertex, weighted by area: what an exporter writes for "smooth shading"."""
    out = np.zeros_like(vertices)
    np.add.at(out, elements, area_vectors(vertices[elements])[:, None])
    return out / np.linalg.norm(out, axis=1)[:, None]
