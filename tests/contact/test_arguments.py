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
