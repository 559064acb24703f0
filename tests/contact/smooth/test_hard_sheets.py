"""Hard cases: sheets, folds, tips and vertices."""

import numpy as np
import pytest

from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
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


def test_parallel_sheets() -> None:
    """Two sheets closer than 2 r; two contacts that push against each other, exact."""
    vertices, elements = meshes.random_plate(200, size=6.0, slivers=False)
    both = np.concatenate([vertices, vertices + 1.5 * UP])
    shell = Shell(both, np.concatenate([elements, elements + len(vertices)]))
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
    across = np.stack([3 * np.cos(turn), np.zeros(48), 0.45 * np.sin(turn)], axis=1)
    out = np.stack([0.45 * np.cos(turn), np.zeros(48), 3 * np.sin(turn)], axis=1)
    out /= np.linalg.norm(out, axis=1)[:, None]
    rows = np.array([[0.0, y, 0.0] for y in np.linspace(-2, 2, 9)])
    vertices = (rows[:, None, :] + across).reshape(-1, 3)
    first = (np.arange(8)[:, None] * 48 + np.arange(48)).ravel()
    second = first // 48 * 48 + (first + 1) % 48
    elements = np.stack([first, second, second + 48, first + 48], axis=1)
    shell = Shell(vertices, elements, normals=np.tile(-out, (9, 1)), crease_angle=1.5)
    assert shell.num_patches == 1
    for z in np.linspace(-0.3, 0.3, 61):
        found = find(shell, [0.01, 0.03, z])
        exact = [0.55 - z, 0.55 + z]
        assert sorted(found.depth[found.weight > 0]) == pytest.approx(sorted(exact), abs=2e-3)
        size = max(exact) ** 1.5
        assert force_sum(found)[2] / size == pytest.approx(
            (exact[1] ** 1.5 - exact[0] ** 1.5) / size, abs=0.01
        )


def test_crossing_sheets() -> None:
    """Two sheets that cross without a common edge; the sum of what each does alone."""
    vertices, elements = meshes.grid_plate(3, 3, 4.0)
    lean = np.array([[0.6, 0.0, -0.8], [0.0, 1.0, 0.0], [0.8, 0.0, 0.6]])
    other = vertices @ lean.T + [0.0, 0.013, 0.0]
    alone = [Shell(vertices, elements), Shell(other, elements)]
    both = Shell(
        np.concatenate([vertices, other]), np.concatenate([elements, elements + len(vertices)])
    )
    for center in np.random.default_rng(0).uniform(-1, 1, (300, 3)):
        sums = sum(force_sum(find(shell, center)) for shell in alone)
        assert np.abs(force_sum(find(both, center)) - sums).max() <= 1e-12


@fails("only facets drop what another sheet covers: beside the border the force doubles")
def test_overlapping_sheets() -> None:
    """Two sheets in one plane, one partly over the other; one contact, as with a single plate."""
    vertices, elements = meshes.grid_plate(3, 3, 4.0)
    shell = Shell(
        np.concatenate([vertices, vertices + [1.7, 0.3, 0.0]]),
        np.concatenate([elements, elements + len(vertices)]),
    )
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


def moebius(steps: int = 48) -> Shell:
    """Strip of half-width 1, turned over once along a circle of radius 3."""
    vertices, across = [], np.linspace(-1.0, 1.0, 5)
    for turn in 2 * np.pi * np.arange(steps) / steps:
        middle, along = along_strip(turn)[0], np.array([np.cos(turn), np.sin(turn), 0.0])
        wide = np.cos(turn / 2) * along + np.sin(turn / 2) * UP
        vertices += [middle + s * wide for s in across]
    cells = [[5 * i + j, 5 * i + j + 1, 5 * i + j + 6, 5 * i + j + 5]
             for i in range(steps - 1) for j in range(4)]  # fmt: skip
    last = 5 * (steps - 1)
    cells += [[last + j, last + j + 1, 3 - j, 4 - j] for j in range(4)]
    return Shell(np.array(vertices), cells)


def along_strip(turn: float) -> tuple[Array, Array]:
    """Place on the middle of the strip, and its normal there, that of the other side a turn on."""
    out, along = np.array([np.cos(turn), np.sin(turn), 0.0]), [-np.sin(turn), np.cos(turn), 0.0]
    return 3 * out, np.cross(along, np.cos(turn / 2) * out + np.sin(turn / 2) * UP)


def test_moebius_strip() -> None:
    """Moebius strip, sphere r = 0.3 twice round it; reported, pushed away as by one."""
    shell = moebius()
    assert shell.health.one_sided_components == 1
    for turn in np.linspace(0, 4 * np.pi, 2001):
        place, normal = along_strip(turn)
        found = find(shell, place + 0.25 * normal, 0.3)
        assert len(found)
        assert (found.normal @ normal).min() > 0.999
        assert force_sum(found) @ normal / 0.05**1.5 == pytest.approx(1.0, abs=0.01)
