"""Tangent joints between CAD faces: where two faces have the same normal, they get one."""

from __future__ import annotations

import numpy as np

from sphshell_pin import _core
from sphshell_pin.shell.raw import Floats, Ints

TANGENT_ANGLE = np.deg2rad(1.0)
"""Faces whose normals differ by less at a common vertex are tangent there; CAD systems take
0.1 to 1 degree for that."""


def settle_joints(normals: Floats, triangles: Ints, face: Ints) -> Floats:
    """Return corner normals (t, 3, 3) that are equal wherever faces are tangent.

    Parameters
    ----------
    normals : (t, 3, 3) unit, one per triangle corner
    triangles : (t, 3) vertex indices
    face : (t,) CAD face of each triangle

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
        settled[corners] = _settled(settled[corners])
    return settled.reshape(normals.shape)


def _settled(normals: Floats) -> Floats:
    """Mean normals (k, 3) of those that are linked by small angles."""
    near = np.argwhere(normals @ normals.T >= np.cos(TANGENT_ANGLE))
    group = _core.mend_components(len(normals), np.ascontiguousarray(near, np.int32))
    out = np.empty_like(normals)
    for one in np.unique(group):
        # Each distinct normal counts once, however many triangles a face has here.
        mean = np.unique(np.round(normals[group == one], 9), axis=0).sum(axis=0)
        out[group == one] = mean / np.linalg.norm(mean)
    return out
