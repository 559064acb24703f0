"""Tangent joints between CAD faces: where two faces have the same normal, they get one."""

import numpy as np

from sphshell_pin import _core
from sphshell_pin.base.arrays import Array, Ints, Mask

TANGENT_ANGLE = np.deg2rad(1.0)
"""Faces whose normals differ by less at a common vertex are tangent there; CAD systems take
0.1 to 1 degree for that."""


def settle_joints(normals: Array, triangles: Ints, face: Ints, plane: Mask | None = None) -> Array:
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
    flat = np.zeros(len(settled), np.bool_) if plane is None else np.repeat(plane, 3)
    starts, count = starts[joint], (ends - starts)[joint]
    # Vertices with as many corners are settled together.
    for size in np.unique(count).tolist():
        corners = order[starts[count == size][:, None] + np.arange(size)]
        settled[corners] = _settled(settled[corners], flat[corners])
    return settled.reshape(normals.shape)


def _settled(normals: Array, flat: Mask) -> Array:
    """Mean normals (g, k, 3) of those that are linked by small angles; of planes, if any is one.

    g vertices with k corners each, of which those that are `flat` (g, k) lie on planes.
    """
    vertices, size = flat.shape
    cosine = normals @ normals.transpose(0, 2, 1)
    pairs = np.argwhere(cosine >= np.cos(TANGENT_ANGLE))
    near = pairs[:, 1:] + size * pairs[:, :1]
    group = _core.mend_components(vertices * size, np.ascontiguousarray(near, np.int32))
    # Each distinct normal counts once, however many triangles a face has here.
    given = normals.reshape(-1, 3)
    distinct = np.unique(np.column_stack([group, np.round(given, 9)]), axis=0)
    total = np.zeros((vertices * size, 3))
    np.add.at(total, distinct[:, 0].astype(np.int64), distinct[:, 1:])
    mean = total[group]
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    # The nearest plane's of those that are linked; each plane keeps its own.
    linked = group.reshape(vertices, size)
    seen = (linked[:, :, None] == linked[:, None, :]) & flat[:, None, :]
    nearest = np.where(seen, cosine, -np.inf).argmax(axis=2)
    of_plane = np.take_along_axis(normals, nearest[:, :, None], axis=1)
    out = np.where(seen.any(axis=2)[:, :, None], of_plane, mean.reshape(normals.shape))
    return np.asarray(np.where(flat[:, :, None], normals, out))
