"""The normals of a shell, and the faces that it finds in a mesh, against those of the CAD."""

import numpy as np

from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
from tests.parts.cad_mesh import KINDS, MM, CadMesh, Ints

OFF, EXACT = np.cos(np.radians([1.0, 0.05]))

LEAST_SINE = 0.5
"""Of the angle at a corner whose normal is compared."""


COUNTS = ("triangles", "recognized", "same", "off", "recognized off", "recognized exact")
COUNTS += ("faces", "pieces")
"""Rows of what is found, columns the kinds in KINDS of the CAD faces: triangles; those of them in a
face that was found; of the right kind; with a corner normal off by more than a degree; both; in one
with all normals within 0.05 degrees; CAD faces of which a triangle is recognized; faces found on
them, counted again on each CAD face."""


def recognized_faces(shell: Shell) -> Ints:
    """Row in `shell.faces` (t,) of the face found at each triangle, -1 where none is."""
    row = np.full(shell.num_elements, -1)
    for k, face in enumerate(shell.faces):
        row[face.elements] = k
    return row[shell.triangle_element]


def share_recognized(shell: Shell) -> float:
    """Share of the triangles in faces that were found."""
    return float((recognized_faces(shell) >= 0).mean())


def faces_found(shell: Shell, mesh: CadMesh, rows: Ints) -> Ints:
    """Compare normals, and faces if there are any, with the CAD's: COUNTS by KINDS."""
    source = rows[shell.source_element[shell.triangle_element]]
    cad = mesh.kind[source]
    face = recognized_faces(shell)
    there = face >= 0
    kinds = np.array([*(KINDS.index(one.kind) for one in shell.faces), -1])
    cosine = turns(shell, mesh, source).min(axis=1)
    pieces = np.unique(np.stack([mesh.face[source], face, cad])[:, there], axis=1)
    _, first = np.unique(pieces[0], return_index=True)

    def count(which: np.ndarray) -> Ints:
        return np.bincount(cad[which], minlength=len(KINDS))

    of_faces = [np.bincount(one, minlength=len(KINDS)) for one in (pieces[2, first], pieces[2])]
    which = (cad >= 0, there, kinds[face] == cad, cosine < OFF)
    which += (there & (cosine < OFF), there & (cosine >= EXACT))
    return np.array([*map(count, which), *of_faces])


def turns(shell: Shell, mesh: CadMesh, source: Ints) -> Array:
    """Cosine (t, 3) between the normals of a shell and the exact ones, at the corners.

    Where the sides of a triangle are nearly parallel it is 1: two sides along the round rim of a
    plane have one tangent, and the curved element has no normal there.
    """
    normals = np.asarray(shell.core_for("smooth").corner_normals)
    # Cleaning may begin a triangle with another corner.
    here, there = shell.vertices[shell.triangles] / MM, mesh.vertices[mesh.triangles[source]]
    away = np.linalg.norm(here[:, :, None] - there[:, None], axis=3)
    exact = np.take_along_axis(mesh.normals[source], away.argmin(axis=2)[:, :, None], axis=1)
    ahead = np.roll(here, -1, axis=1) - here
    sine = np.linalg.norm(np.cross(ahead, np.roll(ahead, 1, axis=1)), axis=2)
    lengths = np.linalg.norm(ahead, axis=2)
    open_corner = sine > LEAST_SINE * lengths * np.roll(lengths, 1, axis=1)
    return np.asarray(np.where(open_corner, (normals * exact).sum(axis=2), 1.0))
