"""Small files must not cost much: polygons of many corners, sizes that a header only claims."""

import struct
import time
import tracemalloc

import numpy as np
import pytest
import trimesh  # noqa: F401  its import would be measured otherwise

from sphshell_pin import Shell, _core
from sphshell_pin.errors import InvalidShell, ShellFileError
from sphshell_pin.shell import clean

from ..oracle.ear_clipping import clip_ears
from .surfaces import TRIANGLE
from .surfaces import star as star_of


def star(count):
    return star_of(count, np.random.default_rng(count))


def gear(count):
    angle = 2 * np.pi * np.arange(count) / count
    radius = 1 + 0.3 * np.cos(angle * count / 4)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def comb(count):
    x = np.arange(count - 2.0)
    teeth = np.column_stack([x, np.where(x % 2, 1.0, 1e-3 * x)])
    return np.concatenate([teeth, [[count, -1.0], [0.0, -1.0]]])[::-1]


def noisy_square(count):
    """Return a square with corners on its sides, off by less than the tolerance."""
    t = np.arange(count // 4) * 4 / count
    sides = [(t, 0 * t), (0 * t + 1, t), (1 - t, 0 * t + 1), (0 * t, 1 - t)]
    points = np.concatenate([np.column_stack(side) for side in sides])
    return points + np.random.default_rng(1).normal(0, 1e-8, points.shape)


def tangle(count):
    """Return a polygon that crosses itself everywhere, counter-clockwise all the same."""
    points = np.random.default_rng(count).random((count, 2))
    following = np.roll(points, -1, axis=0)
    turn = (points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0]).sum()
    return points if turn > 0 else points[::-1]


def check_against_oracle(flat, corners, tolerance=2e-7):
    expected, proper = clip_ears(flat, np.asarray(corners), tolerance)
    slots, _, tangled = _core.mend_clip_ears(
        np.array([0, len(corners)]),
        np.asarray(corners, np.int32),
        np.column_stack([flat, np.zeros(len(flat))]),
        tolerance,
    )
    assert np.sort(slots, axis=1).tolist() == expected
    assert bool(tangled[0]) is not bool(proper)


@pytest.mark.parametrize("shape", [star, gear, comb, noisy_square, tangle])
@pytest.mark.parametrize("count", [12, 60])
def test_the_best_ear_goes_first(shape, count):
    check_against_oracle(shape(count), range(count))


def test_the_best_ear_goes_first_where_there_are_many():
    # Beyond 512 corners other code finds it. With a hole, whose bridge has two banks.
    hole = np.array([0.1, 0.07]) + 0.2 * star(40)[::-1]
    flat = np.concatenate([gear(500), hole])
    check_against_oracle(flat, [*range(500), 0, *range(500, 540), 500])


@pytest.mark.parametrize("shape", [star, comb, tangle, None])
def test_a_polygon_costs_little_more_than_its_corners(shape):
    def cost(count):
        times = []
        for _ in range(2):
            corners = np.arange(count) if shape else np.resize([0, 1, 2], count)
            flat = shape(count) if shape else np.array([[0.0, 0], [1, 0], [0, 1]])
            points = np.column_stack([flat, np.zeros(len(flat))])
            start = time.thread_time()
            surface = clean(points, [corners])
            times.append(time.thread_time() - start)
        assert surface.health.largest_polygon == count
        return min(times)

    # Six times as many: a square would take 36 times as long, n log n eight times.
    assert cost(12_000) < 18 * cost(2_000)


def test_elements_that_lie_on_one_another_are_refused():
    # Each edge on the line holds ends of a third of the others: together 1.5 million.
    rng = np.random.default_rng(0)
    ends = np.sort(rng.random((1500, 2)), axis=1)
    first, last = np.zeros((2, 1500, 3))
    first[:, 0], last[:, 0] = ends.T
    tips = np.column_stack([ends.mean(axis=1), rng.uniform(0.1, 1.0, 1500), rng.random(1500)])
    points = np.stack([first, last, tips], axis=1).reshape(-1, 3)
    with pytest.raises(InvalidShell, match="at more than 1000000 places"):
        clean(points, np.arange(4500).reshape(-1, 3))


SOLID = (
    "solid x\nfacet normal 0 0 1\nouter loop\nvertex {0} 0 0\nvertex {0} 1 0\nvertex {0} 0 1\n"
    "endloop\nendfacet\nendsolid x\n"
)

LONG = {  # a file of n repeated pieces
    "digits.shl": lambda n: "1" * n + "x\n3 1 1.0\n0 0 0\n1 0 0\n0 1 0\n3 1 2 3\n",
    "blanks.shl": lambda n: f"version{' ' * n}x\n3 1 1.0\n0 0 0\n1 0 0\n0 1 0\n3 1 2 3\n",
}


@pytest.mark.parametrize("name", LONG)
def test_a_long_file_costs_little_more_than_its_length(tmp_path, name):
    path = tmp_path / name

    def cost(count):
        path.write_text(LONG[name](count))
        start = time.thread_time()
        Shell.from_file(path, None)
        return time.thread_time() - start

    assert cost(80_000) < 18 * cost(10_000) + 1.0


@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_many_solids_cost_little_more_than_one(tmp_path, ends):
    path = tmp_path / "solids.stl"

    def cost(text):
        path.write_text(text, newline=ends)
        start = time.thread_time()
        shell = Shell.from_file(path, "m")
        assert (len(shell.elements), shell.health.components) == (3000, 3000)
        assert sorted(shell.vertices[:, 0].tolist()) == sorted([*range(3000)] * 3)
        return time.thread_time() - start

    many = "".join(SOLID.format(k) for k in range(3000))
    one = many.replace("endsolid x\nsolid x\n", "")
    assert cost(many) < 10 * cost(one)


MANY = 4_000_000_000
BINARY = TRIANGLE["ply"].partition("end_header")[0].replace("ascii", "binary_little_endian")

CLAIMS = {  # in the texts of a triangle: what is replaced by what
    "vertices.ply": ("vertex 3", f"vertex {MANY}"),
    "faces.ply": ("face 1", f"face {MANY}"),
    "corners.ply": ("3 0 1", f"{MANY} 0 1"),
    "vertices.off": ("3 1 0", f"{MANY} 1 0"),
    "faces.off": ("3 1 0", f"3 {MANY} 0"),
    "corners.off": ("3 0 1", f"{MANY} 0 1"),
    "points.shl": ("3 1 1.0", "2000000000 1 1.0"),
    "polygons.shl": ("3 1 1.0", "3 2000000000 1.0"),
    "corners.shl": ("3 1 2", f"{MANY} 1 2"),
    "normals.shl": ("3 1 1.0", "Version: 2\n3 1 2000000000 1.0"),
    "binary.stl": b"\0" * 80 + struct.pack("<I", MANY) + b"\0" * 50,
    "binary.ply": BINARY.replace("face 1", f"face {MANY}").encode() + b"end_header\n" + b"\0" * 99,
}


@pytest.mark.parametrize("name", CLAIMS)
def test_a_size_that_is_only_claimed_takes_no_memory(tmp_path, name):
    path = tmp_path / name
    claim = CLAIMS[name]
    if isinstance(claim, tuple):
        claim = TRIANGLE[path.suffix[1:]].replace(*claim).encode()
    path.write_bytes(claim)
    unit = None if path.suffix == ".shl" else "m"
    tracemalloc.start()
    try:
        if name == "normals.shl":  # such normals are ignored, and reported
            assert len(Shell.from_file(path, unit).elements) == 1
        else:
            with pytest.raises(ShellFileError, match=name):
                Shell.from_file(path, unit)
        assert tracemalloc.get_traced_memory()[1] < 50e6
    finally:
        tracemalloc.stop()
