"""CAD faces say what is smooth: a coarse fillet stays one patch, a crease between faces is one."""

import pickle
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin import Shell
from sphshell_pin.shell.cleaning import clean_surface
from sphshell_pin.shell.raw import raw_surface
from sphshell_pin.shell.tangent_joints import settle_joints

SMOOTH, CREASE = 0, 1
SLACK = 0.005  # [rad] by which the tangent plane misses the round's normal


def bent_sheet(crease_angle: float = np.deg2rad(10.0)) -> Shell:
    """Return a quarter round of radius 1 in strips of 30 degrees, with two planes.

    One plane is tangent to it, but for SLACK, the other meets it at a right angle.
    """
    angles = np.linspace(0.0, np.pi / 2, 4)
    outline = np.array([[2, 0], *np.c_[np.cos(angles), np.sin(angles)], [-1, 1]])
    ends = np.stack([outline[:-1], outline[1:]], axis=1)
    normals = ends.copy()
    normals[0], normals[-1] = (0.0, 1.0), (np.sin(SLACK), np.cos(SLACK))
    around = [0, 1, 1, 0]
    vertices = np.dstack([ends[:, around], np.tile([0.0, 0.0, 1.0, 1.0], (5, 1))])
    normals = np.dstack([normals[:, around], np.zeros((5, 4))])
    raw = raw_surface(vertices.reshape(-1, 3), np.arange(20).reshape(5, 4), normals)
    face, names = np.array([2, 0, 0, 0, 1], np.int32), ("round", "tangent", "other")
    surface = clean_surface(replace(raw, faces=face, face_names=names))
    return Shell.from_surface(surface, crease_angle, name="bent")


def kind_of(shell: Shell, x: float, y: float) -> int:
    """Class of the edge that stands upright at (x, y)."""
    ends = shell.vertices[shell.edge_vertices]
    here = np.abs(ends[:, :, :2] - [x, y]).max(axis=(1, 2)) < 1e-9
    (found,) = np.flatnonzero(here)
    return int(shell.edge_class[found])


def test_joints_are_smooth_where_faces_are_tangent_and_nowhere_else() -> None:
    shell = bent_sheet()
    for angle in (np.pi / 6, np.pi / 3):
        assert kind_of(shell, np.cos(angle), np.sin(angle)) == SMOOTH  # 30 degrees, within a face
    assert kind_of(shell, 0.0, 1.0) == SMOOTH
    assert kind_of(shell, 1.0, 0.0) == CREASE
    patch = dict(zip(shell.element_face, shell.element_patch, strict=True))
    assert patch[0] == patch[1] != patch[2]
    assert shell.face_names == ("round", "tangent", "other")


def test_tangent_faces_share_their_normals_and_others_keep_theirs() -> None:
    shell = bent_sheet()
    places = shell.vertices[shell.triangles]
    joint, crease = (
        shell.normals[np.abs(places - place).max(axis=2) < 1e-9] for place in ([0, 1, 0], [1, 0, 0])
    )
    assert np.ptp(joint, axis=0).max() == 0.0
    # Midway between both.
    np.testing.assert_allclose(joint[0], [np.sin(SLACK / 2), np.cos(SLACK / 2), 0.0], atol=1e-9)
    assert np.ptp(crease, axis=0) == pytest.approx([1.0, 1.0, 0.0])


def test_planes_keep_their_normals_at_joints_off_tangent() -> None:
    """What is beside them leans, or keeps its own where that is a plane, too."""
    lean = np.array([[0.0, 0.0, 1.0], [0.0, np.sin(0.01), np.cos(0.01)]])
    normals, triangles = np.repeat(lean[:, None], 3, axis=1), np.array([[0, 1, 2], [2, 1, 3]])
    for plane in ([True, False], [False, True], [True, True]):
        settled = settle_joints(normals, triangles, np.array([0, 1]), np.array(plane))
        for own, (flat, shared) in enumerate(zip(plane, ([1, 2], [0, 1]), strict=True)):
            if flat:
                assert np.array_equal(settled[own], normals[own])
            else:
                assert (settled[own, shared] == lean[1 - own]).all()


def test_faces_go_with_a_shell_that_is_moved_or_stored() -> None:
    shell = bent_sheet()
    place = pin.SE3(pin.utils.rpyToMatrix(0.1, 0.2, 0.3), np.array([1.0, 2.0, 3.0]))
    for other in (shell.transformed(place, 2.0), pickle.loads(pickle.dumps(shell))):
        np.testing.assert_array_equal(other.element_face, shell.element_face)
        np.testing.assert_array_equal(other.edge_class, shell.edge_class)
        assert other.face_names == shell.face_names


def test_curved_without_smooth_edges_is_flat():
    sharp = bent_sheet(crease_angle=0.0)
    assert (sharp.num_patches, sharp.curvature_report().curved) == (5, 0)
    center = sharp.vertices.mean(axis=0) + [0.0, 0.0, 0.1]
    flat, smooth = (sharp.contacts(center, 0.3, method=m) for m in ("facets", "smooth"))
    assert np.array_equal(np.sort(flat.depth), np.sort(smooth.depth))
    assert len(flat) > 0
