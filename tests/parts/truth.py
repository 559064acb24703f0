"""Places beside a solid with their distances, and spheres that touch one plane of it."""

from dataclasses import dataclass

import numpy as np

from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
from tests.oracle.cad import ExactShape
from tests.parts.cad_mesh import KINDS, CadMesh, area_vectors
from tests.parts.occ import Rng, Solid

OFFSETS = 5e-4, 1e-2
"""Of places from the surface, over the size, outside and inside."""

RADII = 0.05, 0.02, 0.01, 0.005
"""Of spheres, over the size; the largest that touches nothing but its plane is taken."""

DEPTHS = 2e-5, 1e-4
"""Of spheres in planes, over the size."""


@dataclass(frozen=True)
class Places:
    """Points (n, 3) beside the surface and their distances (n,) from it [mm]."""

    points: Array
    distances: Array


@dataclass(frozen=True)
class Touches:
    """Spheres that touch one planar face: centers (n, 3), radii (n,), exact depths (n,) [mm]."""

    centers: Array
    radii: Array
    depths: Array


def places_beside(solid: Solid, size: float, count: int, rng: Rng) -> Places:
    """Return up to `count` places in random directions from random points of the faces."""
    exact = ExactShape(solid, meters=1.0)
    on = exact.samples(count, rng)
    away = rng.normal(size=on.shape)
    away *= (
        size
        * np.exp(rng.uniform(*np.log(OFFSETS), (len(on), 1)))
        / np.linalg.norm(away, axis=1, keepdims=True)
    )
    return Places(on + away, exact.distances(on + away))


def touches_of(mesh: CadMesh, count: int, rng: Rng, clear: float) -> Touches:
    """Return up to `count` spheres that touch a plane, each by more than `clear` nothing else.

    mesh : a fine one; clear : largest distance of a mesh from the faces [mm]
    """
    # In meters for the shell, which only has to find what is near.
    shell = Shell(mesh.vertices, mesh.triangles, crease_angle=0.0, side="both", faces=False)
    planes = np.unique(mesh.face[mesh.kind == KINDS.index("plane")])
    rows = []
    for k in rng.permutation(np.resize(planes, count)).tolist() if len(planes) else []:
        own = np.flatnonzero(mesh.face == k)
        row = rng.choice(own, p=mesh.areas[own] / mesh.areas[own].sum())
        at = rng.dirichlet((1.0, 1.0, 1.0)) @ mesh.vertices[mesh.triangles[row]]
        (normal,) = area_vectors(mesh.vertices, mesh.triangles[[row]]) / mesh.areas[row]
        depth = mesh.size * np.exp(rng.uniform(*np.log(DEPTHS)))
        for radius in mesh.size * np.array(RADII):
            center = at + (radius - depth) * normal
            near = shell.contacts(center, radius + clear, "elements").element
            if (mesh.face[shell.source_element[near]] == k).all():
                rows.append((center, radius, depth))
                break
    columns = zip(*rows, strict=True) if rows else (np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    return Touches(*(np.array(column) for column in columns))
