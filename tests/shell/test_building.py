"""What building a large shell leaves: the same bits for any number of threads, little memory."""

import hashlib
import os
from pathlib import Path

import numpy as np
import pytest

from sphshell_pin import Shell
from tests import meshes
from tests.programs import python


def sheet(cells: int = 120):
    """Vertices (n, 3) and triangles (m, 3) of a wavy sheet."""
    vertices, triangles = meshes.grid_plate(cells, cells, size=2.0)
    x, y, _ = vertices.T
    return np.c_[x, y, 0.1 * np.sin(3 * x) * np.cos(4 * y)], triangles


def digest() -> str:
    """Of the curved elements of the sheet and of contacts all over it."""
    vertices, triangles = sheet()
    shell = Shell(vertices, triangles)
    found = hashlib.sha256(shell.core_for("smooth").control_point_offsets.tobytes())
    for at in vertices[::97]:
        for method in ("smooth", "facets"):
            contacts = shell.contacts(at + [0.003, 0.002, 0.045], 0.05, method=method)
            found.update(contacts.point.tobytes() + contacts.depth.tobytes())
    return found.hexdigest()


@pytest.mark.skipif(
    not hasattr(os, "sched_setaffinity") or len(os.sched_getaffinity(0)) < 2,
    reason="needs two cores, and a system that lends one of them alone",
)
def test_the_same_bits_on_one_core_and_on_all() -> None:
    one = f"import os; os.sched_setaffinity(0, {{{min(os.sched_getaffinity(0))}}})"
    script = f"{one}; from tests.shell.test_building import digest; print(digest())"
    alone = python(script, check=True)
    assert alone.stdout.strip() == digest()


RESIDENT = """
import os
from pathlib import Path
from sphshell_pin import Shell
from tests.shell.test_building import sheet

def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

vertices, triangles = sheet(300)
Shell(*sheet(8)).contacts(vertices[0], 0.05)
before = resident()
shell = Shell(vertices, triangles)
shell.contacts(vertices[0], 0.05)
print((resident() - before) / len(triangles))
"""


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs Linux's /proc")
def test_memory_of_a_triangle() -> None:
    """What the process keeps for a surface, curved elements and all that Python has included."""
    assert float(python(RESIDENT, check=True).stdout) <= 800


def test_arrays_outlive_their_shell() -> None:
    """They are views of the compiled surface."""
    vertices, triangles = sheet(8)
    shell = Shell(vertices, triangles)
    kept = shell.vertices, shell.triangles, shell.triangle_element
    assert not any(array.flags.writeable for array in kept)
    del shell
    again = [Shell(*sheet(8)) for _ in range(20)]  # would take the memory, were it free
    assert np.array_equal(kept[0], vertices)
    assert np.array_equal(kept[1], triangles)
    assert np.array_equal(kept[2], np.arange(len(triangles)))
    assert len(again) == 20
