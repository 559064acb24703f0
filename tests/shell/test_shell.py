"""The Shell object: its arguments, its arrays, and that nothing can change it from outside."""

import copy
import pickle

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import Shell
from sphshell_pin.errors import InvalidParameter, InvalidShell
from tests import meshes
from tests.contact.helpers import force_sum

from .surfaces import CUBE, CUBE_QUADS, expect, joined, plate

ARRAYS = [
    *("vertices", "elements", "triangles", "triangle_element", "source_element"),
    *("box", "normals"),
]


@pytest.fixture
def shell():
    return Shell(CUBE, CUBE_QUADS, normals=CUBE - 0.5, name="crate", side="outside")


def test_arrays_are_read_only_copies_also_in_copies(shell):
    for other in (shell, copy.copy(shell), copy.deepcopy(shell), pickle.loads(pickle.dumps(shell))):
        for name in ARRAYS:
            array = getattr(other, name)
            assert array.tolist() == getattr(shell, name).tolist(), name
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0
        assert other.health == shell.health
        assert (repr(other), other.crease_angle) == (repr(shell), shell.crease_angle)
    # The arguments are left as they were, and may change afterwards.
    given = [CUBE.copy(), np.array(CUBE_QUADS), 3.0 * (CUBE - 0.5)]
    given[1][0] = given[1][0][::-1]
    before = [array.tolist() for array in given]
    kept = Shell(*given)
    assert [array.tolist() for array in given] == before
    for array in given:
        array[:] = 0
    assert kept.box.tolist() == [[0, 0, 0], [1, 1, 1]]
    assert kept.elements.max() == 7


def test_attributes(shell):
    shapes = [array.shape for array in (shell.elements, shell.triangles, shell.normals)]
    assert shapes == [(6, 4), (12, 3), (12, 3, 3)]
    assert shell.size == pytest.approx(np.sqrt(3.0))
    assert shell.is_closed
    assert (shell.name, shell.side, shell.unit, shell.source) == ("crate", "outside", None, None)
    assert shell.crease_angle == pytest.approx(np.deg2rad(30.0))
    assert repr(shell) == (
        "<Shell 'crate': 6 elements, 8 vertices, surface closed, size 1.732 m, side outside>"
    )


def test_health_is_a_readable_table(shell):
    lines = [" ".join(line.split()) for line in str(shell.health).splitlines()]
    assert (lines[0], lines[-1]) == ("surface crate", "verdict ok")
    for part in ("6 (0 triangles, 6 quads), given 6", "1 closed", "1.73205 m"):
        assert part in " ".join(lines)
    assert shell.health.summary().startswith("crate: 6 elements")
    with pytest.raises(AttributeError):
        shell.health.elements = 5
    assert shell.health.to_dict()["quads"] == 6


def test_transformed(shell):
    placement = pin.SE3.Random()
    moved = shell.transformed(placement, scale=2.0)
    wanted = np.array([placement.act(2.0 * v) for v in shell.vertices])
    assert moved.vertices == pytest.approx(wanted)
    assert moved.normals == pytest.approx(shell.normals @ placement.rotation.T)
    assert moved.elements.tolist() == shell.elements.tolist()
    expect(moved.health, volume=8.0, area=24.0)
    assert (moved.name, moved.side) == (shell.name, shell.side)
    smaller = shell.transformed(0.1)
    assert smaller.size == smaller.health.size == pytest.approx(0.1 * shell.size)


# The search tree is in single precision.
TOO_LARGE = (-46, -45, -38, -20, -13, 15, 20, 38, 39, 100)
WRONG = [
    ({"vertices": CUBE[:, :2]}, r"\(8, 2\)"),
    ({"vertices": CUBE[:2]}, "at least 3 vertices"),
    ({"vertices": "cube"}, "numbers"),
    ({"vertices": np.where(np.arange(8)[:, None] == 5, np.nan, CUBE)}, "vertex 5 is not fin"),
    ({"vertices": np.where(np.arange(8)[:, None] > 5, np.inf, CUBE)}, "2 such vertices"),
    ({"elements": np.zeros((0, 3), int)}, "at least one element"),
    ({"elements": []}, "at least one element"),
    ({"elements": [[0, 1, 2], [0, 1, 8]]}, "element 1 uses vertex 8"),
    ({"elements": [[0, 1, 2], [0, 1, -2]]}, "element 1 uses vertex -2"),
    ({"elements": [[0, 1, 2], [0, 1, 2, -5]]}, "element 1 uses vertex -5"),
    ({"elements": [[0, 1, 10**12]]}, "vertex 1000000000000"),
    ({"elements": [[0.0, 1.0, 2.5]]}, "integer"),
    ({"elements": [[0, 1, 2], [0, 1]]}, "element 1"),
    ({"elements": [[0, -1, 2, 3]]}, "only at the end"),
    ({"elements": [[0, 1, -1]]}, "three corners"),
    ({"elements": np.zeros((3, 2), int)}, r"\(3, 2\)"),
    ({"elements": 7}, "list of lists"),
    ({"elements": [[0, 0, 1]], "clean": False}, "no area"),
    ({"elements": [[0, 1, 3, 7, 6]], "clean": False}, "5 corners"),
    ({"normals": np.zeros((7, 3))}, r"\(7, 3\)"),
    ({"normals": "up"}, "numbers"),
    ({"side": "top"}, "both, outside, inside"),
    *(({"vertices": 10.0**k * CUBE}, "m: it must be between 1e-12") for k in TOO_LARGE),
    *(({"crease_angle": angle}, "crease_angle") for angle in (-0.1, 4.0, np.nan, "thirty")),
]


@pytest.mark.parametrize(("change", "say"), WRONG)
def test_wrong_arguments(change, say):
    arguments = {"vertices": CUBE, "elements": CUBE_QUADS, **change}
    kind = InvalidParameter if {"side", "crease_angle"} & {*change} else InvalidShell
    with pytest.raises(kind, match=say):
        Shell(**arguments)


@pytest.mark.parametrize(
    ("call", "say"),
    [
        *((lambda s, k=k: s.transformed(scale=k), "scale") for k in (0.0, -1.0, np.nan)),
        (lambda s: s.transformed("left"), "SE3"),
        (lambda s: s.contacts_batch(np.zeros((3, 3)), [1.0, 0.0, 1.0]), r"radii\[1\]"),
        (lambda s: s.closest_points([[0, 0, np.inf]]), r"points\[0\]"),
    ],
)
def test_wrong_calls_name_what_is_wrong(shell, call, say):
    with pytest.raises(InvalidParameter, match=say):
        call(shell)


def test_unclean_takes_elements_as_they_are():
    vertices, quads = joined((CUBE, CUBE_QUADS), (CUBE + np.array([1.0, 0, 0]), CUBE_QUADS))
    quads = [q[::-1] for q in quads]
    shell = Shell(vertices, quads, clean=False)
    assert [list(e) for e in shell.elements] == quads
    expect(shell.health, vertices=16, cleaned=False, is_closed=True)
    assert not shell.health.repairs
    assert "none given; taken as it came, not cleaned" in str(shell.health)


def test_edges_and_patches_come_from_the_core(shell):
    assert (shell.num_edges, len(shell.edge_vertices), shell.num_patches) == (12, 12, 6)
    assert shell.edge_class.tolist() == [1] * 12
    assert shell.edge_angle == pytest.approx(np.pi / 2)
    assert not shell.edge_vertices.flags.writeable
    flat = Shell(*plate(2))
    assert np.bincount(flat.edge_class).tolist() == [4, 0, 8]
    assert flat.num_patches == 1


def wavy(scale: float) -> Shell:
    vertices, elements = meshes.grid_plate(11, 11, size=2.0, quads=True)
    x, y, _ = vertices.T
    vertices[:, 2] = 0.2 * np.sin(3 * x) * np.cos(2 * y)
    along_x, along_y = 0.6 * np.cos(3 * x) * np.cos(2 * y), -0.4 * np.sin(3 * x) * np.sin(2 * y)
    normals = np.stack([-along_x, -along_y, np.ones_like(x)], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return Shell(scale * vertices, elements, normals=normals)


@pytest.mark.parametrize("exponent", [-12, -9, -3, 3, 9, 14])
def test_sizes_within_range_find_the_same(exponent: int) -> None:
    """The contacts are those of the surface of one meter, in its units."""
    scale, rng = 10.0**exponent, np.random.default_rng(0)
    here, there, touched = wavy(1.0), wavy(scale), 0
    for _ in range(300):
        center, radius = rng.uniform(-1, 1, 3), rng.uniform(0.05, 1.2)
        a, b = here.contacts(center, radius), there.contacts(scale * center, scale * radius)
        assert force_sum(b) / scale**1.5 == pytest.approx(force_sum(a), rel=1e-6, abs=1e-8)
        touched += len(a)
    assert touched > 100


@pytest.mark.parametrize("method", ["facets", "smooth"])
def test_distances_are_negative_inside(method):
    points = np.array([[0.5, 0.5, 1.2], [0.5, 0.5, 0.9], [1.3, 1.4, 0.5], [0.2, 0.5, 0.6]])
    found = Shell(CUBE, CUBE_QUADS).closest_points(points, method=method)
    np.testing.assert_allclose(found.distances, [0.2, -0.1, 0.5, -0.2], atol=1e-15)
