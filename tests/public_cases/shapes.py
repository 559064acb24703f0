"""Meshes and files of the public cases."""

import struct
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import sphshell_pin as sp
from tests import urdf
from tests.meshes import grid_plate

INERTIAL = urdf.inertial()


def terrain(cells, half, height):
    """Return a height field on a square of side 2 half [m]."""
    vertices, triangles = grid_plate(cells, cells, 2 * half)
    vertices[:, 2] = height(vertices[:, 0], vertices[:, 1])
    return sp.Shell(vertices, triangles)


@contextmanager
def folder() -> Iterator[Path]:
    """An empty folder that does not last."""
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


TETRAHEDRON = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.3]], np.float32)
SIDES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))


def binary_stl(header: bytes, after: bytes = b"") -> bytes:
    """Return a binary STL file of a tetrahedron."""
    facets = (struct.pack("<12fH", 0, 0, 0, *TETRAHEDRON[list(side)].ravel(), 0) for side in SIDES)
    return header.ljust(80) + struct.pack("<I", len(SIDES)) + b"".join(facets) + after


def elements_read(header: bytes, after: bytes = b"") -> int:
    """Return how many elements are read from such a file."""
    with folder() as home:
        (home / "part.stl").write_bytes(binary_stl(header, after))
        return sp.Shell.from_file(home / "part.stl", unit="m").num_elements
