"""Tangent joints between CAD faces: where two faces have the same normal, they get one."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sphshell_pin import _core
from sphshell_pin.shell.raw import Floats, Ints

Bools = npt.NDArray[np.bool_]

TANGENT_ANGLE = np.deg2rad(1.0)
"""Faces whose normals differ by less at a common vertex are tangent there; CAD systems take
0.1 to 1 degree for that."""


def settle_joints(
    normals: Floats, triangles: Ints, face: Ints, plane: Bools | None = None
) -> Floats:
    """Return corner normals (t, 3, 3) that are equal wherever faces are tangent.

    Parameters
    ----------
    normals : (t, 3, 3) unit, one per triangle corner
    triangles : (t, 3) vertex indices
    face : (t,) CAD face of each triangle
    plane : (t,) whether that is a plane: planes keep their normals, and what is beside them leans

    What a file's tolerance leaves between two faces would else be taken for a crease.
    """
    vertex = triangles.ravel()
    owner = np.repeat(face, 3)
    order = np.lexsort((owner, vertex))
    vertex, owner = vertex[order], owner[order]
    starts = np.flatnonzero(np.append(True, vertex[1:] != vertex[:-1]))
    ends = np.append(starts[1:], len(vertex))
    # Sorted by face within each vertex: the first and the last tell whether there are several.
    joint = owner[starts] != owner[ends - 1]
    settled = normals.reshape(-1, 3).copy()
    for start, end in zip(starts[joint].tolist(), ends[joint].tolist(), strict=True):
        corners = order[start:end]
        fixed = None if plane is None else plane[corners // 3]
        settled[corners] = _settled(settled[corners], fixed)
    return settled.reshape(normals.shape)


def _settled(normals: Floats, fixed: Bools | None) -> Floats:
    """Mean normals (k, 3) of those that are linked by small angles; of planes, if any is one."""
    near = np.argwhere(normals @ normals.T >= np.cos(TANGENT_ANGLE))
    group = _core.mend_components(len(normals), np.ascontiguousarray(near, np.int32))
    out = np.empty_like(normals)
    for one in np.unique(group):
        its = np.flatnonzero(group == one)
        flat = its[fixed[its]] if fixed is not None else its[:0]
        if len(flat):
            # The nearest plane's; each plane keeps its own.
            out[its] = normals[flat[np.argmax(normals[its] @ normals[flat].T, axis=1)]]
            out[flat] = normals[flat]
            continue
        # Each distinct normal counts once, however many triangles a face has here.
        mean = np.unique(np.round(normals[its], 9), axis=0).sum(axis=0)
        out[its] = mean / np.linalg.norm(mean)
    return out
