"""Hard cases: sheets, folds, tips and vertices."""

import numpy as np
import pytest

from sphshell_pin import Shell
from tests import meshes
from tests.contact.helpers import energy, force_sum
from tests.contact.smooth.hard_cases import DEPTH, UP, assert_no_jump, fails, find, push
from tests.contact.smooth.surfaces import given
from tests.oracle.pieces import potential_and_force


@pytest.mark.parametrize("reach", [0.0, 1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6])
def test_straight_over_an_edge(reach: float) -> None:
    """Straight over the upright edge of a wall on a floor, both in reach; as the definition has."""
    corners = np.array([[0, 0, -0.5], [0, 0, -0.75], [0, -0.25, -0.75], [-0.25, 0, -0.75]])
    shell, rng = Shell(corners, [[1, 2, 0], [1, 3, 2]]), np.random.default_rng(0)
    for center in rng.uniform(-reach, reach, (100, 3)):
        exact = potential_and_force(shell.vertices, shell.triangles, center, 1.0)[0]
        assert energy(find(shell, center)) == pytest.approx(exact, rel=1e-5)


def with_another(mesh: meshes.Mesh, vertices: np.ndarray) -> Shell:
    """A sheet, and the same with other vertices."""
    elements = np.concatenate([mesh[1], mesh[1] + len(vertices)])
    return Shell(np.concatenate([mesh[0], vertices]), elements)


@pytest.mark.parametrize("method", ["smooth", "facets"])
@pytest.mark.parametrize("angles", [(60, 90, 120), (30, 60, 150, 120)])
def test_sheets_that_share_an_edge_touch_there_once(angles, method: str) -> None:
    """Three sheets or four, which all go away from the sphere, on one edge of several pieces."""
    rows, turn = np.linspace(-1.0, 1.0, 4), meshes.random_rotation(3)
    ends = np.stack([np.cos(np.radians(angles)), np.sin(np.radians(angles))], axis=1)
    vertices = np.array([(x, y, z) for y, z in [(0.0, 0.0), *ends] for x in rows])
    cells = [(k, k + 1, at + k + 1, at + k) for at in range(4, len(vertices), 4) for k in range(3)]
    elements = meshes._split(np.array(cells), np.zeros(len(cells), dtype=bool))
    shell = Shell(vertices @ turn.T, elements)
    for x in np.linspace(-0.9, 0.9, 13):
        for y in (-0.05, 0.0, 0.08):
            center = np.array([x, y, -np.sqrt(0.19**2 - y**2)])
            found = shell.contacts(turn @ center, 0.2, method=method)
            assert found.depth == pytest.approx([0.01], abs=1e-12)
            assert found.point[0] @ turn == pytest.approx([x, 0.0, 0.0], abs=1e-12)


def test_parallel_sheets() -> None:
    """Two sheets closer than 2 r; two contacts that push against each other, exact."""
    plate = meshes.random_plate(200, size=6.0, slivers=False)
    shell = with_another(plate, plate[0] + 1.5 * UP)
    for z in np.linspace(0.51, 0.99, 25):
        found = find(shell, [0.1, 0.2, z])
        assert sorted(found.depth) == pytest.approx(sorted([1 - z, z - 0.5]), abs=1e-12)
        exact = (1 - z) ** 1.5 - (z - 0.5) ** 1.5
        assert force_sum(found) == pytest.approx(exact * UP, abs=1e-12)
        assert_no_jump(shell, np.array([0.1, 0.2, z]))


@fails("where the sphere is deep it reaches over the rounded ends: the walls are one component")
def test_flat_tube() -> None:
    """Both walls of a flat tube, one smooth patch, closer than 2 r; each has its contact."""
    turn = 2 * np.pi * np.arange(48) / 48
    across = np.stack([3 * np.cos(turn), 0 * turn, 0.45 * np.sin(turn)], axis=1)
    out = np.stack([0.45 * np.cos(turn), 0 * turn, 3 * np.sin(turn)], axis=1)
    out /= np.linalg.norm(out, axis=1)[:, None]
    rails = [across + [0.0, y, 0.0] for y in np.linspace(-2, 2, 9)]
    vertices, elements = meshes.ribbon(rails, closed=True)
    shell = Shell(vertices, elements, normals=np.tile(-out, (9, 1)), crease_angle=1.5)
    assert shell.num_patches == 1
    for z in np.linspace(-0.3, 0.3, 61):
        found = find(shell, [0.01, 0.03, z])
        exact = [0.55 - z, 0.55 + z]
        assert sorted(found.depth[found.weight > 0]) == pytest.approx(sorted(exact), abs=2e-3)
        size = max(exact) ** 1.5
        force = exact[1] ** 1.5 - exact[0] ** 1.5
        assert force_sum(found)[2] == pytest.approx(force, abs=0.01 * size)


def test_crossing_sheets() -> None:
    """Two sheets that cross without a common edge; the sum of what each does alone."""
    vertices, elements = meshes.grid_plate(3, 3, 4.0)
    lean = np.array([[0.6, 0.0, -0.8], [0.0, 1.0, 0.0], [0.8, 0.0, 0.6]])
    other = vertices @ lean.T + [0.0, 0.013, 0.0]
    alone = [Shell(vertices, elements), Shell(other, elements)]
    both = with_another((vertices, elements), other)
    for center in np.random.default_rng(0).uniform(-1, 1, (300, 3)):
        sums = sum(force_sum(find(shell, center)) for shell in alone)
        assert np.abs(force_sum(find(both, center)) - sums).max() <= 1e-12


@fails("only facets drop what another sheet covers: beside the border the force doubles")
def test_overlapping_sheets() -> None:
    """Two sheets in one plane, one partly over the other; one contact, as with a single plate."""
    plate = meshes.grid_plate(3, 3, 4.0)
    shell = with_another(plate, plate[0] + [1.7, 0.3, 0.0])
    for x in np.linspace(-1.0, 2.7, 75):
        assert push(shell, [x, 0.2, 1 - DEPTH]) == pytest.approx(UP, abs=1e-9)


def test_back_to_back() -> None:
    """Two sheets back to back, joined by folds of 180 degrees; as one sheet."""
    corners = np.array([[-2.0, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]])
    pillow = Shell(corners, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    assert pillow.edge_angle.max() == pytest.approx(np.pi)
    sheet = Shell(corners, [[0, 1, 2], [0, 2, 3]])
    for center in np.random.default_rng(0).uniform(-2.8, 2.8, (500, 3)) * [1.0, 1.0, 0.3]:
        a, b = find(pillow, center), find(sheet, center)
        assert len(a) == len(b)
        assert force_sum(a) == pytest.approx(force_sum(b), abs=1e-12)


def cap(valence: int):
    """`valence` triangles round the pole of a sphere of radius 4; exact normals."""
    vertices, triangles = meshes.revolved([(0.0, 4.0), (4 * np.sin(0.3), 4 * np.cos(0.3))], valence)
    return vertices, triangles[:, ::-1], vertices / 4


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("valence", [3, 100])
def test_smooth_vertex_of_any_valence(valence: int, sign: float) -> None:
    """Smooth vertex of 3 or 100 elements of 1.2 r, from outside and inside; one contact to 2 %."""
    shell, rng = given(cap(valence)), np.random.default_rng(0)
    for reach in (0.0, 1e-9, 1e-5, 1e-2, 0.1):
        for aside in rng.uniform(-reach, reach, (20, 3)):
            normal = (UP + aside) / np.linalg.norm(UP + aside)
            center = (4 + sign * (1 - DEPTH)) * normal
            assert len(find(shell, center)) == 1
            assert push(shell, center) == pytest.approx(sign * normal, abs=0.02)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_fold_of_exactly_the_crease_angle(sign: float) -> None:
    """Fold of two plates by exactly crease_angle; a crease, smooth 1e-12 above, the same force."""
    vertices, elements = meshes.v_groove(0.15, size=8.0, cells=4)
    angle = np.abs(Shell(vertices, elements).edge_angle).max()
    angles = (angle * (1 - 1e-12), angle, angle * (1 + 1e-12))
    shells = [Shell(vertices, elements, crease_angle=limit) for limit in angles]
    assert [bool((shell.edge_class == 1).any()) for shell in shells] == [True, True, False]
    for x, y in np.random.default_rng(0).uniform(-1, 1, (200, 2)):
        center = [x, y, abs(x) * np.tan(0.15) + sign * (1 - DEPTH)]
        forces = [push(shell, center) for shell in shells]
        assert np.ptp(forces, axis=0).max() <= 1e-9
