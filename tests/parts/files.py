"""What exporters make of a mesh: files of few digits, rounded, decimated, with averaged normals.

Each function writes a file [mm] and returns its path and the triangles of it, as rows of those of
the mesh, or -1 where it has others.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh

from sphshell_pin.base.arrays import Array
from sphshell_pin.shell.raw import area_vectors
from tests.parts.cad_mesh import CadMesh, Ints
from tests.parts.occ import Rng

Written = tuple[Path, Ints]

GRID = 2e-5
"""Step to which coordinates are rounded, over the size."""

DECIMATED, PATIENCE = (0.3, 0.5), 5.0
"""Share of the triangles that is left, and how large an error is taken for it: more triangles are
left where the mesh has few that can go."""


def binary_stl(folder: Path, mesh: CadMesh, rng: Rng) -> Written:
    """Single precision."""
    return _exported(folder / "part.stl", mesh.vertices, mesh.triangles), _all(mesh)


def text_stl(folder: Path, mesh: CadMesh, rng: Rng) -> Written:
    """Six significant digits."""
    return _text(folder / "part.stl", mesh.vertices, mesh.triangles, "%.6g"), _all(mesh)


def rounded_stl(folder: Path, mesh: CadMesh, rng: Rng) -> Written:
    """Coordinates rounded to a grid."""
    step = GRID * mesh.size
    rounded = np.round(mesh.vertices / step) * step
    return _text(folder / "part.stl", rounded, mesh.triangles, "%.9g"), _all(mesh)


def decimated_stl(folder: Path, mesh: CadMesh, rng: Rng) -> Written:
    """Half to two thirds of the triangles removed, by quadric errors."""
    from fast_simplification import simplify  # need not be installed

    left = rng.uniform(*DECIMATED)
    vertices, triangles = simplify(
        mesh.vertices, mesh.triangles.astype(np.int32), 1.0 - left, agg=PATIENCE
    )
    return _exported(folder / "part.stl", vertices, triangles), np.full(len(triangles), -1)


def averaged_ply(folder: Path, mesh: CadMesh, rng: Rng) -> Written:
    """Normals at the vertices, the mean of all triangles around by area, across sharp edges too."""
    normals = np.zeros_like(mesh.vertices)
    np.add.at(normals, mesh.triangles, area_vectors(mesh.vertices[mesh.triangles])[:, None])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    path = folder / "part.ply"
    return _exported(path, mesh.vertices, mesh.triangles, vertex_normals=normals), _all(mesh)


def exact_obj(folder: Path, mesh: CadMesh, rng: Rng) -> Written:
    """The exact normals of the CAD faces at all corners: what is possible with these triangles."""
    path = folder / "part.obj"
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"vn {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.normals.reshape(-1, 3).tolist()]
    for k, corners in enumerate(1 + mesh.triangles):
        lines.append("f " + " ".join(f"{v}//{3 * k + i}" for i, v in enumerate(corners, 1)))
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path, _all(mesh)


KINDS_OF_FILE: dict[str, Callable[[Path, CadMesh, Rng], Written]] = {
    "binary STL": binary_stl,
    "text STL, 6 digits": text_stl,
    "rounded to 2e-5": rounded_stl,
    "decimated": decimated_stl,
    "averaged normals": averaged_ply,
    "exact normals": exact_obj,
}


def _all(mesh: CadMesh) -> Ints:
    return np.arange(len(mesh.triangles))


def _exported(path: Path, vertices: Array, triangles: Ints, **normals: Array) -> Path:
    whole = trimesh.Trimesh(vertices, triangles, process=False, validate=False, **normals)
    whole.export(path, **({"vertex_normal": True} if normals else {}))
    return path


def _text(path: Path, vertices: Array, triangles: Ints, digits: str) -> Path:
    point = " ".join(["      vertex", *[digits] * 3]) + "\n"
    facet = f"  facet normal 0 0 0\n    outer loop\n{point * 3}    endloop\n  endfacet\n"
    body = "".join(facet % tuple(row) for row in vertices[triangles].reshape(-1, 9).tolist())
    path.write_text(f"solid part\n{body}endsolid part\n", encoding="ascii")
    return path
