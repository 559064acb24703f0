"""Planes of files that others made: the force on them, curved over exact.

Nothing but the mesh is known. A plane is a connected set of triangles in one plane to rounding,
with at least 4 % of the area; the spheres that press on it are clear of all other triangles.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from sphshell_pin import Shell
from sphshell_pin.errors import SphshellError
from tests.parts.cad_mesh import Array, Ints
from tests.parts.found import share_recognized
from tests.parts.judge import LAW
from tests.parts.occ import Rng
from tests.parts.tables import table

LEAST_AREA = 0.04
"""Of a plane, over the area of the file."""

TURN = np.radians(0.05)
"""Of sides within a plane, at most."""

FLAT = 3e-6
"""Of vertices from their plane over the size, at most: a few times single precision."""

RADII, DEPTH = (0.03, 0.01, 0.003), 5e-5
"""Of the spheres, over the size."""

TOUCHES = 60
"""Tried on each plane."""

SUFFIXES = (".stl", ".obj", ".ply", ".off")

COLUMNS = (
    "file",
    "triangles",
    "planes",
    "touches",
    "force on them",
    "lost",
    "flat",
    "recognized",
    "faces",
    "health",
    "ms",
)


@dataclass(frozen=True)
class FileVerdict:
    """One file: forces (n,) on its planes over the exact ones, 0 where no touch is found."""

    name: str
    triangles: int
    planes: int
    forces: Array
    flat: Array
    recognized: float | None
    kinds: dict[str, int]
    ok: bool
    seconds: float

    @property
    def off(self) -> float:
        """Largest relative error of a force, beyond that of the flat elements."""
        beyond = np.abs(self.forces - 1.0) - 1.5 * np.abs(self.flat - 1.0)
        return float(np.maximum(beyond, 0.0).max(initial=0.0))


def files_in(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)


def judged_file(path: Path, seed: int = 1) -> FileVerdict:
    """Load a file without its normals, find its planes and press on them."""
    begin = time.process_time()
    shell = Shell.from_file(path, unit="mm")
    if shell.normals is not None:
        shell = Shell(shell.vertices, shell.triangles)
    shell.core_for("smooth")
    seconds = time.process_time() - begin
    rng = np.random.default_rng(seed)
    region = planes_of(shell)
    found = [touches_on(shell, region, one, rng) for one in range(region.max(initial=-1) + 1)]
    forces = np.concatenate([np.zeros((0, 2)), *found])
    kinds: dict[str, int] = {}
    for face in getattr(shell, "faces", ()):
        kinds[face.kind] = kinds.get(face.kind, 0) + 1
    return FileVerdict(
        name=path.name,
        triangles=len(shell.triangles),
        planes=len(found),
        forces=forces[:, 0],
        flat=forces[:, 1],
        recognized=share_recognized(shell),
        kinds=kinds,
        ok=shell.health.ok,
        seconds=seconds,
    )


def planes_of(shell: Shell) -> Ints:
    """Plane (t,) of each triangle, -1 where there is none."""
    mesh = trimesh.Trimesh(shell.vertices, shell.triangles, process=False, validate=False)
    pairs = mesh.face_adjacency[mesh.face_adjacency_angles < TURN]
    count = len(shell.triangles)
    links = coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), shape=(count, count))
    _, label = connected_components(links, directed=False)
    area = np.bincount(label, mesh.area_faces)
    region, plane = np.full(count, -1), 0
    for one in np.flatnonzero(area >= LEAST_AREA * area.sum()).tolist():
        own = label == one
        normal = (mesh.area_faces[own, None] * shell.triangle_normals[own]).sum(axis=0)
        normal /= np.linalg.norm(normal)
        heights = shell.vertices[np.unique(shell.triangles[own])] @ normal
        if np.ptp(heights) <= FLAT * shell.size:
            region[own] = plane
            plane += 1
    return region


def touches_on(shell: Shell, region: Ints, plane: int, rng: Rng) -> Array:
    """Forces (n, 2) on a plane, curved and flat, of spheres that touch nothing else."""
    own = np.flatnonzero(region == plane)
    corners = shell.vertices[shell.triangles[own]]
    vectors = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(vectors, axis=1)
    normal = vectors.sum(axis=0) / np.linalg.norm(vectors.sum(axis=0))
    depth, found = DEPTH * shell.size, []
    elements = set(shell.triangle_element[own].tolist())
    for row in rng.choice(len(own), TOUCHES, p=area / area.sum()).tolist():
        at = rng.dirichlet((1.0, 1.0, 1.0)) @ corners[row]
        for radius in shell.size * np.array(RADII):
            center = at + (radius - depth) * normal
            # Twice as deep: the rim of the touch is clear of the border, too.
            near = shell.contacts(center, radius + depth, method="elements")
            if len(near) and set(near.element.tolist()) <= elements:
                found.append([_force(shell, center, radius, m) for m in ("smooth", "facets")])
                break
    return np.array(found).reshape(-1, 2) / depth**1.5


def _force(shell: Shell, center: Array, radius: float, method: str) -> float:
    contacts = shell.contacts(center, radius, method=method)
    return float(np.linalg.norm(contacts.force(LAW))) if len(contacts) else 0.0


def press_on_files(folder: Path) -> str:
    """Return a table of the files of a folder, and those with a force off by more than 1 %."""
    found, remarks = [], []
    for path in files_in(folder):
        try:
            found.append(judged_file(path))
        except SphshellError as error:
            remarks.append(f"{path.name}: refused: {error}")
    pressed = [one for one in found if len(one.forces)]
    off = sorted((one for one in pressed if one.off > 0.01), key=lambda one: -one.off)
    lost = sum(int((one.forces == 0.0).sum()) for one in pressed)
    remarks += [
        f"{len(found)} files, {len(pressed)} with planes to press on",
        f"with a force on a plane off by more than 1 %: {len(off)}, by more than 10 %: "
        f"{sum(one.off > 0.1 for one in off)}; touches lost: {lost} of "
        f"{sum(len(one.forces) for one in pressed)}",
    ]
    shares = [one.recognized for one in found if one.recognized is not None]
    if shares:
        nothing = sum(share == 0.0 for share in shares)
        remarks.append(f"recognized: {np.mean(shares):.2f} on average, nothing in {nothing}")
    remarks += [f"  {v.name}: {v.forces.min():.3f} to {v.forces.max():.4g}" for v in off]
    return "\n".join([table(COLUMNS, map(file_row, found)), "", *remarks])


def file_row(one: FileVerdict) -> list[str]:
    there = len(one.forces) > 0
    return [
        one.name,
        str(one.triangles),
        str(one.planes),
        str(len(one.forces)),
        f"{one.forces.min():.3f} to {one.forces.max():.4g}" if there else "-",
        str(int((one.forces == 0.0).sum())),
        f"{one.flat.min():.3f} to {one.flat.max():.4g}" if there else "-",
        "-" if one.recognized is None else f"{one.recognized:.2f}",
        ", ".join(f"{count} {kind}" for kind, count in one.kinds.items()) or "-",
        "ok" if one.ok else "not ok",
        f"{1e3 * one.seconds:.0f}",
    ]
