"""Meshes of the public cases."""

import struct

import numpy as np

import sphshell_pin as sp
from tests.meshes import grid_plate


def terrain(cells, half, height):
    """Return a height field on a square of side 2 half [m]."""
    vertices, triangles = grid_plate(cells, cells, 2 * half)
    vertices[:, 2] = height(vertices[:, 0], vertices[:, 1])
    return sp.Shell(vertices, triangles)


TETRAHEDRON = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.3]], np.float32)
SIDES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))


def binary_stl(header: bytes, after: bytes = b"") -> bytes:
    """Return a binary STL file of a tetrahedron."""
    facets = (struct.pack("<12fH", 0, 0, 0, *TETRAHEDRON[list(side)].ravel(), 0) for side in SIDES)
    return header.ljust(80) + struct.pack("<I", len(SIDES)) + b"".join(facets) + after
