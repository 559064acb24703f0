"""The Shell object: its arguments, its arrays, and that nothing can change it from outside."""

import copy
import pickle

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin.errors import InvalidParameter, InvalidShell, SphshellError
from sphshell_pin.shell import Shell

from .surfaces import CUBE, CUBE_QUADS, joined, plate

ARRAYS = ["vertices", "elements", "triangles", "triangle_element", "source_element", "box"]


@pytest.fixture
def shell():
    return Shell(CUBE, CUBE_QUADS, normals=CUBE - 0.5, name="crate", side="outside")


def test_arrays_are_read_only_copies(shell):
    for name in [*ARRAYS, "normals"]:
        array = getattr(shell, name)
        assert not array.flags.writeable, name
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
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
    assert shell.elements.shape == (6, 4)
    assert shell.triangles.shape == (12, 3)
    assert shell.normals.shape == (12, 3, 3)
    assert shell.size == pytest.approx(np.sqrt(3.0))
    assert shell.is_closed
    assert (shell.name, shell.side, shell.unit, shell.source) == ("crate", "outside", None, None)
    assert shell.crease_angle == pytest.approx(np.deg2rad(30.0))
    assert repr(shell) == (
        "<Shell 'crate': 6 elements, 8 vertices, surface closed, size 1.732 m, side outside>"
    )


def test_health_is_a_readable_table(shell):
    text = str(shell.health)
    assert text.splitlines()[0].split() == ["surface", "crate"]
    for part in ("6 (0 triangles, 6 quads), given 6", "1 closed", "1.73205 m", "rescaled" * 0):
        assert part in text
    assert text.splitlines()[-1].split() == ["verdict", "ok"]
    assert shell.health.summary().startswith("crate: 6 elements")
    with pytest.raises(AttributeError):
        shell.health.elements = 5
    assert shell.health.to_dict()["quads"] == 6


@pytest.mark.parametrize(
    "remake", [copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))]
)
def test_copies_are_equal_and_not_cleaned_again(shell, remake):
    other = remake(shell)
    for name in [*ARRAYS, "normals"]:
        assert getattr(other, name).tolist() == getattr(shell, name).tolist(), name
        assert not getattr(other, name).flags.writeable
    assert other.health == shell.health
    assert repr(other) == repr(shell)
    assert other.crease_angle == shell.crease_angle


def test_transformed(shell):
    placement = pin.SE3.Random()
    moved = shell.transformed(placement, scale=2.0)
    wanted = np.array([placement.act(2.0 * v) for v in shell.vertices])
    assert moved.vertices == pytest.approx(wanted)
    assert moved.normals == pytest.approx(shell.normals @ placement.rotation.T)
    assert moved.elements.tolist() == shell.elements.tolist()
    assert moved.health.volume == pytest.approx(8.0)
    assert moved.health.area == pytest.approx(24.0)
    assert (moved.name, moved.side) == (shell.name, shell.side)
    assert shell.transformed(0.1).size == pytest.approx(0.1 * shell.size)
    assert shell.transformed(0.1).health.size == pytest.approx(0.1 * shell.size)
    for wrong in (0.0, -1.0, np.nan):
        with pytest.raises(InvalidParameter, match="scale"):
            shell.transformed(scale=wrong)
    with pytest.raises(InvalidParameter, match="SE3"):
        shell.transformed("left")


@pytest.mark.parametrize(
    ("change", "say"),
    [
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
        ({"normals": np.zeros((7, 3))}, r"\(7, 3\)"),
        ({"normals": "up"}, "numbers"),
    ],
)
def test_wrong_arrays(change, say):
    arguments = {"vertices": CUBE, "elements": CUBE_QUADS, **change}
    with pytest.raises(InvalidShell, match=say) as caught:
        Shell(**arguments)
    assert isinstance(caught.value, SphshellError)


def test_wrong_options():
    with pytest.raises(InvalidParameter, match="both, outside, inside"):
        Shell(CUBE, CUBE_QUADS, side="top")
    for angle in (-0.1, 4.0, np.nan, "thirty"):
        with pytest.raises(InvalidParameter, match="crease_angle"):
            Shell(CUBE, CUBE_QUADS, crease_angle=angle)


def test_unclean_takes_elements_as_they_are():
    vertices, quads = joined((CUBE, CUBE_QUADS), (CUBE + np.array([1.0, 0, 0]), CUBE_QUADS))
    quads = [q[::-1] for q in quads]
    shell = Shell(vertices, quads, clean=False)
    assert len(shell.vertices) == 16
    assert [list(e) for e in shell.elements] == quads
    assert not shell.health.cleaned
    assert not shell.health.repairs
    assert shell.is_closed
    with pytest.raises(InvalidShell, match="no area"):
        Shell(vertices, [*quads, [0, 0, 1]], clean=False)
    with pytest.raises(InvalidShell, match="5 corners"):
        Shell(vertices, [[0, 1, 3, 7, 6]], clean=False)


def test_queries_name_the_wrong_row(shell):
    with pytest.raises(InvalidParameter, match=r"radii\[1\]"):
        shell.contacts_batch(np.zeros((3, 3)), [1.0, 0.0, 1.0])
    with pytest.raises(InvalidParameter, match=r"points\[0\]"):
        shell.closest_points([[0, 0, np.inf]])


def test_edges_and_patches_come_from_the_core(shell):
    assert shell.num_edges == len(shell.edge_vertices) == 12
    assert shell.num_patches == 6
    assert shell.edge_class.tolist() == [1] * 12
    assert shell.edge_angle == pytest.approx(np.pi / 2)
    assert not shell.edge_vertices.flags.writeable
    vertices, quads = plate(2)
    flat = Shell(vertices, quads)
    assert np.bincount(flat.edge_class).tolist() == [4, 0, 8]
    assert flat.num_patches == 1
