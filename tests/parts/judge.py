"""What one file of a part costs: errors of distances, and of forces on planes.

It is judged at places beside the solid, and by spheres that touch one plane of it.
"""

import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from sphshell_pin import ImpactLaw, Shell
from sphshell_pin.base.arrays import Array
from sphshell_pin.shell.raw import area_vectors
from tests.oracle.cad import ExactShape
from tests.parts.cad_mesh import KINDS, MM, CadMesh, Ints, coarse_enough, joined, meshed_faces
from tests.parts.files import KINDS_OF_FILE
from tests.parts.occ import Rng, Solid
from tests.parts.solids import random_solid

METHODS = ("smooth", "facets")
LAW = ImpactLaw(1.0, exponent=1.5)

DEFLECTIONS = tuple(np.geomspace(1e-4, 1e-2, 5).tolist())
"""Of meshes over the size: a part has one of them."""

ANGLES = 0.1, 0.6
"""Largest angles between neighboring triangles [rad]: a part has one between these."""

FINE, FINE_ANGLE = 2e-4, 0.2
"""Deflection of the finer mesh, over the size; its angle [rad]."""

PLACES, TOUCHES = 200, 24

FLOOR = 2e-7
"""Mean errors over the size below that of single precision count as that."""

FACTOR, MARGIN = 1.5, 1e-4
"""A file is worse where the largest curved error exceeds the factor times the flat one, and the
margin over the size."""

PLANE_MARGIN = 0.01
"""The same for forces on planes, over the exact ones."""

SPOILED = 0.02
"""A file whose flat elements are farther from the solid, over the size, is left out."""

OFFSETS = 5e-4, 1e-2
"""Of places from the surface, over the size, outside and inside."""

SPHERES = 0.05, 0.02, 0.01, 0.005
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
    far = size * np.exp(rng.uniform(*np.log(OFFSETS), (len(on), 1)))
    away *= far / np.linalg.norm(away, axis=1, keepdims=True)
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
        corners = mesh.vertices[mesh.triangles[row]]
        at = rng.dirichlet((1.0, 1.0, 1.0)) @ corners
        (normal,) = area_vectors(corners[None]) / (2 * mesh.areas[row])
        depth = mesh.size * np.exp(rng.uniform(*np.log(DEPTHS)))
        for radius in mesh.size * np.array(SPHERES):
            center = at + (radius - depth) * normal
            near = shell.contacts(center, radius + clear, "elements").element
            if (mesh.face[shell.source_element[near]] == k).all():
                rows.append((center, radius, depth))
                break
    columns = zip(*rows, strict=True) if rows else (np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    return Touches(*(np.array(column) for column in columns))


@dataclass(frozen=True)
class Part:
    """A random part: its mesh, a finer one, and what is exactly known of the solid [mm]."""

    number: int
    mesh: CadMesh
    fine: CadMesh
    places: Places
    touches: Touches


@dataclass(frozen=True)
class Verdict:
    """One file. Lengths are over the size, by method in METHODS; forces over the exact ones.

    Attributes
    ----------
    file, triangles, touches : of the part and its file
    largest, mean : errors of distances
    off_plane : touches of planes whose curved force is off by more than the flat one's
    forces : smallest and largest on planes
    lost : touches of planes that are not found
    ok : what `health` says; seconds : of processor time to load and curve it
    recognized : share of the triangles in faces that were found
    """

    file: str
    triangles: int
    largest: dict[str, float]
    mean: dict[str, float]
    touches: int
    off_plane: int
    forces: dict[str, tuple[float, float]]
    lost: dict[str, int]
    ok: bool
    seconds: float
    recognized: float

    @property
    def worse(self) -> bool:
        """Whether the largest curved error is beyond the flat one's."""
        return self.largest["smooth"] > FACTOR * self.largest["facets"] + MARGIN

    @property
    def ratio(self) -> float:
        """Mean error, curved over flat."""
        return max(self.mean["smooth"], FLOOR) / max(self.mean["facets"], FLOOR)

    @property
    def spoiled(self) -> bool:
        """Whether the file is another part: its flat elements are far off."""
        return self.largest["facets"] > SPOILED


def random_part(number: int, seed: int = 1) -> Part:
    """Return the part of a number; raises where OpenCASCADE fails on it."""
    solid = random_solid(number, seed)
    rng = np.random.default_rng([seed, number, 1])
    size = joined(meshed_faces(solid, 1.0, 0.5)).size
    fine = joined(meshed_faces(solid, FINE * size, FINE_ANGLE))
    share, angle = float(rng.choice(DEFLECTIONS)), float(rng.uniform(*ANGLES))
    faces, deflection = coarse_enough(solid, share * size, angle)
    return Part(
        number=number,
        mesh=joined(faces),
        fine=fine,
        places=places_beside(solid, size, PLACES, rng),
        # A sphere that touches a plane alone has the facets of its neighbors out of reach, too.
        touches=touches_of(fine, TOUCHES, rng, 2.0 * deflection + FINE * size),
    )


def judged(part: Part, kind: str) -> Verdict:
    """Write the file of that kind, load and measure it."""
    shell, rows, seconds = loaded(part, kind)
    errors = {method: distance_errors(shell, part, method) for method in METHODS}
    forces = {method: forces_on_planes(shell, part.touches, method) for method in METHODS}
    off = {method: np.abs(forces[method] - 1.0) for method in METHODS}
    return Verdict(
        file=kind,
        triangles=len(rows),
        largest={method: float(error.max()) for method, error in errors.items()},
        mean={method: float(error.mean()) for method, error in errors.items()},
        touches=len(part.touches.depths),
        off_plane=int((off["smooth"] > FACTOR * off["facets"] + PLANE_MARGIN).sum()),
        forces={m: (float(f.min(initial=1)), float(f.max(initial=1))) for m, f in forces.items()},
        lost={method: int((force == 0.0).sum()) for method, force in forces.items()},
        ok=shell.health.ok,
        seconds=seconds,
        recognized=share_recognized(shell),
    )


def share_recognized(shell: Shell) -> float:
    """Share of the triangles in faces that were found."""
    recognized = [row for face in shell.faces for row in face.elements]
    return float(np.isin(shell.triangle_element, recognized).mean())


def loaded(part: Part, kind: str) -> tuple[Shell, Ints, float]:
    """Write a file and load it: the shell, its triangles as rows of the mesh, the time [s]."""
    # Few would decimate a coarse mesh.
    mesh = part.fine if kind == "decimated" else part.mesh
    with TemporaryDirectory() as folder:
        rng = np.random.default_rng([part.number, 2])
        path, rows = KINDS_OF_FILE[kind](Path(folder), mesh, rng)
        begin = time.process_time()
        shell = Shell.from_file(path, unit="mm")
        shell.core_for("smooth")
        return shell, rows, time.process_time() - begin


def distance_errors(shell: Shell, part: Part, method: str) -> Array:
    """Errors (n,) of the distances of a part's places over the size."""
    found = shell.closest_points(part.places.points * MM, method=method).distances / MM
    return np.abs(np.abs(found) - part.places.distances) / part.mesh.size


def forces_on_planes(shell: Shell, touches: Touches, method: str) -> Array:
    """Forces (n,) over the exact ones; 0 where no touch is found."""
    found = np.zeros(len(touches.depths))
    columns = zip(touches.centers * MM, touches.radii * MM, touches.depths * MM, strict=True)
    for k, (center, radius, depth) in enumerate(columns):
        contacts = shell.contacts(center, radius, method=method)
        if len(contacts):
            found[k] = np.linalg.norm(contacts.force(LAW)) / depth**1.5
    return found
