"""The normals of a shell, and the faces that it finds in a mesh, against those of the CAD."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
from tests.parts.cad_mesh import KINDS, MM, CadMesh, Ints

OFF, EXACT = np.cos(np.radians([1.0, 0.05]))

LEAST_SINE = 0.5
"""Of the angle at a corner whose normal is compared."""


@dataclass(frozen=True)
class Found:
    """Triangles of each kind in KINDS (6,), by the CAD face they lie on.

    Attributes
    ----------
    triangles : how many
    recognized : of these in a face that was found; same : of the right kind
    off : with a corner normal off by more than one degree; recognized_off : of the recognized
    recognized_exact : of the recognized, with all corner normals within 0.05 degrees
    faces : CAD faces of which a triangle is recognized; pieces : faces found on them, counted again
        on each CAD face
    """

    triangles: Ints
    recognized: Ints
    same: Ints
    off: Ints
    recognized_off: Ints
    recognized_exact: Ints
    faces: Ints
    pieces: Ints

    def __add__(self, other: Found) -> Found:
        return Found(
            *(a + b for a, b in zip(vars(self).values(), vars(other).values(), strict=True))
        )


def recognized_faces(shell: Shell) -> Ints:
    """Row in `shell.faces` (t,) of the face found at each triangle, -1 where none is."""
    row = np.full(shell.num_elements, -1)
    for k, face in enumerate(shell.faces):
        row[face.elements] = k
    return row[shell.triangle_element]


def share_recognized(shell: Shell) -> float:
    """Share of the triangles in faces that were found."""
    return float((recognized_faces(shell) >= 0).mean())


def faces_found(shell: Shell, mesh: CadMesh, rows: Ints) -> Found:
    """Compare normals, and faces if there are any, with the CAD's."""
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

    return Found(
        triangles=count(cad >= 0),
        recognized=count(there),
        same=count(kinds[face] == cad),
        off=count(cosine < OFF),
        recognized_off=count(there & (cosine < OFF)),
        recognized_exact=count(there & (cosine >= EXACT)),
        faces=np.bincount(pieces[2, first], minlength=len(KINDS)),
        pieces=np.bincount(pieces[2], minlength=len(KINDS)),
    )


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
