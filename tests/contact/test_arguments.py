"""Wrong arguments are named, and nothing else happens."""

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import ImpactLaw, Shell, contact_wrench
from sphshell_pin.errors import InvalidParameter, InvalidShell, SphshellError
from tests import meshes
from tests.contact.helpers import shell_of


def test_method() -> None:
    with pytest.raises(SphshellError, match=r"magic.*facets"):
        shell_of(meshes.cube()).contacts([0, 0, 1], 0.1, method="magic")


def test_batch_shapes() -> None:
    shell = shell_of(meshes.cube())
    with pytest.raises(InvalidParameter):
        shell.contacts_batch(np.zeros((3, 2)), np.ones(3))
    with pytest.raises(InvalidParameter):
        shell.contacts_batch(np.zeros((3, 3)), np.ones(2))
    for threads in (-1, 0, 1.5, True, "all", np.nan):
        with pytest.raises(InvalidParameter, match="threads"):
            shell.contacts_batch(np.zeros((3, 3)), np.ones(3), threads=threads)
    for radii in ("1", [True] * 3, 1j, [1.0, np.nan, 1.0], [1.0, 0.0, 1.0]):
        with pytest.raises(InvalidParameter, match="radi"):
            shell.contacts_batch(np.zeros((3, 3)), radii)


@pytest.mark.parametrize("depth", [0.01, -0.01])
@pytest.mark.parametrize(
    "wrong",
    [
        {"motion_i": np.zeros(6)},
        {"motion_j": np.zeros(6)},
        {"law": 5},
        {"law": ImpactLaw},
        {"friction": 0.3},
    ],
)
def test_contact_wrench(wrong, depth) -> None:
    right = {"motion_i": pin.Motion.Zero(), "motion_j": pin.Motion.Zero(), "law": ImpactLaw(1e5)}
    with pytest.raises(InvalidParameter, match=next(iter(wrong))):
        contact_wrench([0, 0, 0], [0, 0, 1], depth, **{**right, **wrong})


def test_surfaces_of_other_than_real_numbers() -> None:
    vertices, elements = np.eye(3), [[0, 1, 2]]
    for wrong in (vertices.astype(complex), vertices.astype(str), vertices.astype(bool)):
        with pytest.raises(InvalidShell, match="vertices"):
            Shell(wrong, elements)
        with pytest.raises(InvalidShell, match="normals"):
            Shell(vertices, elements, normals=wrong)


def test_path_of_a_surface_file(tmp_path) -> None:
    for wrong in (None, 3):
        with pytest.raises(InvalidParameter, match="path"):
            Shell.from_file(wrong)
    path = tmp_path / "deg.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
    with pytest.raises(InvalidShell, match=r"deg\.obj: no element is left"):
        Shell.from_file(path, "mm")


def test_nothing_in_reach() -> None:
    contacts = shell_of(meshes.cube()).contacts([5, 0, 0], 0.1, method="facets")
    assert len(contacts) == 0
    assert contacts.point.shape == contacts.normal.shape == (0, 3)
    assert contacts.depth.shape == contacts.element.shape == contacts.feature.shape == (0,)


ODD = {
    "array": np.full(7, 1e308),
    "empty": np.zeros(0),
    "masked": np.ma.masked_all(7),
    "huge": [10**400] * 7,
    "list": [float("inf")] * 7,
}


@pytest.mark.parametrize("odd", ODD)
def test_arrays_where_none_belong(odd: str) -> None:
    value = ODD[odd]
    cube = shell_of(meshes.cube())
    calls = {
        "method": lambda: cube.contacts([0, 0, 1], 0.1, method=value),
        "method of a batch": lambda: cube.contacts_batch([[0, 0, 1]], 0.1, method=value),
        "side": lambda: Shell(cube.vertices, cube.triangles, side=value),
        "path": lambda: cube.to_file(value),
        "vertices": lambda: Shell(value, [[0, 1, 2]]),
        "normals": lambda: Shell(cube.vertices, cube.triangles, normals=value),
        "crease_angle": lambda: Shell(cube.vertices, cube.triangles, crease_angle=value),
        "radii": lambda: cube.contacts_batch(np.zeros((2, 3)), value),
    }
    for call in calls.values():
        with pytest.raises(SphshellError):
            call()


def test_a_flag_that_is_an_array() -> None:
    cube = shell_of(meshes.cube())
    with pytest.raises(InvalidParameter, match="clean"):
        Shell(cube.vertices, cube.triangles, clean=np.ones(2))
    with pytest.raises(InvalidParameter, match="gradient"):
        cube.contacts([0, 0, 1], 0.1, gradient=np.ones(2))
