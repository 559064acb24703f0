"""Hard cases: what is right about each of them, from first principles.

Each docstring is a row "case; what happens"; `python -m tests.contact.smooth.test_hard_cases`
prints the table. The sphere has radius one unless said otherwise.
"""

from __future__ import annotations

import inspect
import sys
import time

import coal
import numpy as np
import pytest
from numpy.typing import NDArray

from sphshell_pin import Shell
from sphshell_pin.contact.contact_set import Feature
from sphshell_pin.shell.curved import curved_mesh
from tests import meshes
from tests.contact.helpers import energy, force_sum, shell_of
from tests.contact.smooth.surfaces import SURFACES, cylinder_mesh, jittered_grid
from tests.contact.smooth.test_real_surfaces import faults, jump
from tests.contact.smooth.test_true_edges import cone
from tests.oracle.pieces import potential_and_force

Array = NDArray[np.float64]

UP = np.array([0.0, 0.0, 1.0])
DEPTH = 0.04


def fails(why: str):
    """Mark of a test that the present code fails."""
    return pytest.mark.xfail(strict=True, reason=why)


RING = (
    "all round, or all over, is equally near: the potential is that of one contact, but its place "
    "is left to round-off, and so is the direction of the force"
)
SEVERAL = (
    "two minima on one element, and Newton's method does not find the saddle between them: it is "
    "off by 3 %"
)


def find(shell: Shell, center, radius: float = 1.0):
    """Contacts, after a look at what holds of any."""
    found = shell.contacts(center, radius, method="smooth")
    assert not faults(found, np.asarray(center), radius)
    return found


def push(shell: Shell, center, radius: float = 1.0) -> Array:
    """Force in units of that at DEPTH r."""
    return force_sum(find(shell, center, radius)) / (DEPTH * radius) ** 1.5


def stored(shell: Shell, center, depth: float, radius: float = 1.0) -> float:
    """Potential in units of that of one contact of `depth`."""
    return energy(find(shell, center, radius)) / (depth**2.5 / 2.5)


def assert_no_jump(shell: Shell, center, radius: float = 1.0, force: float = 1e-5) -> None:
    """1e-9 r further the potential is the same, and so is the force."""
    rng, here = np.random.default_rng(0), find(shell, center, radius)
    size = here.depth.max() ** 1.5
    for _ in range(20):
        move = rng.normal(size=3)
        move *= 1e-9 * radius / np.linalg.norm(move)
        there = find(shell, center + move, radius)
        assert jump(here, there, move) <= 1e-6
        change = np.linalg.norm(force_sum(there) - force_sum(here))
        assert change <= force * size


def directions(rng: np.random.Generator, count: int) -> Array:
    """Random unit vectors (count, 3)."""
    out = rng.normal(size=(count, 3))
    return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])


def graph(height, slopes, half: float, cells: int):
    """Vertices, elements and normals of z = height(x, y) over a square."""
    x, y, elements = jittered_grid((-half, half), (-half, half), cells, cells, 1)
    along_x, along_y = slopes(x, y)
    normals = np.stack([-along_x, -along_y, np.ones_like(x)], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return np.stack([x, y, height(x, y)], axis=1), elements, normals


def given(mesh, **options) -> Shell:
    """Shell with the normals that came with a mesh."""
    return Shell(mesh[0], mesh[1], normals=mesh[2], **options)


def paraboloid(cells: int = 20, half: float = 1.5) -> Shell:
    """Bowl z = (x^2 + y^2) / 2: curvature radius 1 at the bottom, more further out."""
    return given(graph(lambda x, y: (x * x + y * y) / 2, lambda x, y: (x, y), half, cells))


# From its axis at height 1.4 the parabola z = x^2 / 2 is nearest at x = +-sqrt(0.8).
HEIGHT, WIDE = 1.4, 1.5
FLANK, NEAREST = np.sqrt(0.8), np.sqrt(1.8)


def assert_two_flanks(shell: Shell) -> None:
    """Contacts at x = +-FLANK and the saddle at the origin between them, in closed form."""
    found = find(shell, [0.0, 0.0, HEIGHT], WIDE)
    assert found.weight.tolist() == [1.0, 1.0, -1.0]
    order = np.argsort(found.point[:, 0])
    exact = np.array([[-FLANK, 0.0, 0.4], [0.0, 0.0, 0.0], [FLANK, 0.0, 0.4]])
    # The saddle is the place of a side that is nearest, so only its depth is exact.
    assert np.abs(found.point[order] - exact)[[0, 2]].max() <= 1e-4
    assert np.abs(found.point[order] - exact)[1].max() <= 1e-2
    depths = WIDE - np.array([NEAREST, HEIGHT, NEAREST])
    assert np.abs(found.depth[order] - depths).max() <= 2e-4
    upward = 2 * depths[0] ** 1.5 / NEAREST - depths[1] ** 1.5
    assert np.abs(force_sum(found) - upward * UP).max() <= 5e-3 * upward
    assert_no_jump(shell, np.array([0.01, 0.02, HEIGHT]), WIDE)


def test_trough_narrower_than_the_sphere() -> None:
    """Trough of a curvature radius below r; a contact on each flank, and the pass between them."""
    assert_two_flanks(given(graph(lambda x, y: x * x / 2, lambda x, y: (x, 0 * y), 1.5, 30)))


def test_saddle_narrower_than_the_sphere() -> None:
    """Saddle of a curvature radius below r; a contact on each rising flank, and the pass."""
    height, slopes = lambda x, y: (x * x - y * y) / 2, lambda x, y: (x, -y)
    assert_two_flanks(given(graph(height, slopes, 1.5, 30)))


def test_bowl_narrower_than_the_sphere() -> None:
    """Bowl of a curvature radius below r, touched along a ring; potential of one contact."""
    for cells in (10, 20, 40):
        assert stored(paraboloid(cells), [0.0, 0.0, HEIGHT], WIDE - NEAREST, WIDE) == (
            pytest.approx(1.0, abs=0.02)
        )


@fails(RING)
def test_force_on_a_ring() -> None:
    """Bowl touched along a ring; force along the axis of one contact, across it at most as much."""
    depth = WIDE - NEAREST
    for cells in (10, 20, 40):
        force = force_sum(find(paraboloid(cells), [0.0, 0.0, HEIGHT], WIDE)) / depth**1.5
        assert force[2] == pytest.approx(1.0 / NEAREST, rel=0.02)
        assert np.linalg.norm(force[:2]) <= 1.01 * FLANK / NEAREST


def test_centre_near_the_centre_of_curvature() -> None:
    """Centre near that of the curvature of a bowl, all about equally near; the nearest is found."""
    for cells in (4, 8):
        shell, rng = paraboloid(cells, 0.6), np.random.default_rng(0)
        fine = curved_mesh(shell, 16)[0]
        for center in UP + rng.uniform(-0.05, 0.05, (400, 3)):
            nearest = np.linalg.norm(fine - center, axis=1).min()
            for radius in (1.1, 1.3):
                assert find(shell, center, radius).depth.max(initial=0) >= radius - nearest - 1e-12


@fails(SEVERAL)
def test_element_bent_more_than_the_sphere() -> None:
    """Single bent element, its sides a fifth of r; potential as of its finely divided surface."""
    corners = [[0.85, 0.35, -0.39], [0.75, 0.45, -0.48], [0.75, 0.26, -0.65]]
    normals = [[[0.77, 0.44, -0.46], [0.79, 0.41, -0.46], [0.85, 0.36, -0.38]]]
    shell = Shell(corners, [[2, 1, 0]], normals=normals)
    fine, parts, _ = curved_mesh(shell, 40)
    for center in np.random.default_rng(0).uniform(-0.02, 0.02, (40, 3)):
        exact, _ = potential_and_force(fine, parts, center, 1.0)
        # The division is off by up to 1e-5.
        assert energy(find(shell, center)) == pytest.approx(exact, rel=0.01, abs=1e-9)


def test_bowl_of_the_radius_of_the_sphere() -> None:
    """Spherical bowl of radius r, sphere off its centre; one contact, exact to 1e-4."""
    vertices, elements = meshes.icosphere(3)
    shell, rng = Shell(vertices, elements, normals=vertices), np.random.default_rng(0)
    for depth in (0.2, 0.02, 0.002):
        for aside in directions(rng, 50):
            found = find(shell, depth * aside)
            assert energy(found) == pytest.approx(depth**2.5 / 2.5, rel=1e-2)
            assert found.depth[0] == pytest.approx(depth, abs=2e-6)
            assert np.abs(found.normal[0] + aside).max() <= 1e-3 / np.sqrt(depth)


@fails(RING)
def test_concentric_in_a_bowl() -> None:
    """Sphere of 1.1 R at the centre of a spherical bowl, all equally near; one contact's energy."""
    vertices, elements = meshes.icosphere(3)
    shell = Shell(vertices, elements, normals=vertices)
    for aside in (0.0, 1e-9, 1e-7, 1e-5):
        found = find(shell, [aside, 0.0, 0.0], 1.1)
        assert energy(found) == pytest.approx(0.1**2.5 / 2.5, rel=1e-2)
        assert np.linalg.norm(force_sum(found)) <= 1.01 * 0.1**1.5


def test_cost_of_a_concentric_sphere() -> None:
    """Concentric in a bowl of 20480 elements; costs no more than ten times what it does beside."""
    vertices, elements = meshes.icosphere(5)
    shell = Shell(vertices, elements, normals=vertices)
    shell.contacts(UP, 0.1, method="smooth")
    costs = []
    for aside in (0.0, 0.01):
        times = []
        for _ in range(2):
            start = time.perf_counter()
            shell.contacts([aside, 0.0, 0.0], 1.1, method="smooth")
            times.append(time.perf_counter() - start)
        costs.append(min(times))
    assert costs[0] <= 10 * costs[1]


def tube() -> Shell:
    """Tube of radius one round z."""
    vertices, elements, normals = cylinder_mesh(0.6)
    return Shell(vertices / 3, elements, normals=normals)


def test_tube_of_the_radius_of_the_sphere() -> None:
    """Tube of radius r, sphere off its axis; one contact, exact to 1 %."""
    for depth in (0.2, 0.05, 0.01):
        for turn in np.linspace(0.1, 6.2, 20):
            out = np.array([np.cos(turn), np.sin(turn), 0.0])
            force = force_sum(find(tube(), depth * out)) / depth**1.5
            # The tube bundles normals: what the mesh has them off is divided by the depth.
            assert np.abs(force + out).max() <= 3e-4 / depth
            assert stored(tube(), depth * out, depth) == pytest.approx(1.0, abs=1e-2)


@fails(RING)
def test_concentric_in_a_tube() -> None:
    """Sphere of 1.05 R on the axis of a tube, touched all round; the potential of one contact."""
    for aside in (0.0, 1e-9, 1e-6, 1e-3):
        depth = 0.05 + aside
        assert stored(tube(), [aside, 0.0, 0.03], depth, 1.05) == pytest.approx(1.0, abs=0.01)


def seat(columns: int, rows: int) -> Shell:
    """Countersink: a cone round z that opens upward by 45 degrees."""
    turn, rho = 2 * np.pi * np.arange(columns) / columns, np.linspace(0.3, 2.0, rows + 1)
    out = np.stack([np.cos(turn), np.sin(turn), np.ones(columns)], axis=1)
    vertices = (rho[:, None, None] * out).reshape(-1, 3)
    normals = np.tile(out * [-1.0, -1.0, 1.0] / np.sqrt(2), (rows + 1, 1))
    first = (np.arange(rows)[:, None] * columns + np.arange(columns)).ravel()
    second = first // columns * columns + (first + 1) % columns
    elements = np.stack([first, first + columns, second + columns, second], axis=1)
    return Shell(vertices, meshes._split(elements, np.zeros(len(elements), bool)), normals=normals)


@pytest.mark.parametrize("columns", [32, 64])
def test_ball_in_a_countersink(columns: int) -> None:
    """Ball in a conical seat, touched along a ring; energy, and force along the axis, of one."""
    shell, rng = seat(columns, columns // 5), np.random.default_rng(0)
    for reach in (1e-6, 1e-4, 1e-3, 0.01):
        for aside in rng.normal(size=(20, 3)) * [1.0, 1.0, 0.0] * reach:
            center = aside + (1 - DEPTH) * np.sqrt(2) * UP
            depth = DEPTH + np.linalg.norm(aside) / np.sqrt(2)
            found = find(shell, center)
            assert energy(found) == pytest.approx(depth**2.5 / 2.5, rel=0.2)
            assert force_sum(found)[2] == pytest.approx(depth**1.5 / np.sqrt(2), rel=0.2)


def hole(corners: int, bored: bool) -> Shell:
    """Plate z = 0 with a hole of radius 0.6 round z; `bored`: with the wall of the hole."""
    turn = 2 * np.pi * np.arange(corners) / corners
    out = np.stack([np.cos(turn), np.sin(turn), np.zeros(corners)], axis=1)
    rings = [rho * out for rho in (3.0, 2.0, 1.2, 0.6)]
    rings += [0.6 * out - height * UP for height in (0.5, 1.0)] if bored else []
    elements, normals = [], []
    for k in range(len(rings) - 1):
        i = np.arange(corners)
        a, b = k * corners + i, k * corners + (i + 1) % corners
        elements.append(np.stack([a, b, b + corners, a + corners], axis=1))
        flat = np.tile(UP, (corners, 4, 1))
        ends = np.stack([out, np.roll(out, -1, axis=0)], axis=1)
        normals.append(flat if k < 3 else -ends[:, [0, 1, 1, 0]])
    return Shell(np.concatenate(rings), np.concatenate(elements), normals=np.concatenate(normals))


def test_rim_of_a_hole_in_a_sheet() -> None:
    """Ball on a hole in a flat sheet, whose rim is a polygon; as the definition has it."""
    shell, rng = hole(32, False), np.random.default_rng(0)
    for reach in (1e-6, 1e-3, 0.05):
        for aside in rng.normal(size=(10, 3)) * [1.0, 1.0, 0.0] * reach:
            center = aside + 0.75 * UP
            exact, force = potential_and_force(shell.vertices, shell.triangles, center, 1.0)
            assert energy(find(shell, center)) == pytest.approx(exact, rel=1e-4)
            assert force_sum(find(shell, center)) == pytest.approx(force, rel=1e-4, abs=1e-7)


@pytest.mark.parametrize("aside", [0.0, 1e-9, 1e-6, 1e-3, 0.05])
def test_rim_of_a_bored_hole(aside: float) -> None:
    """Ball on a bored hole, touched along its rim; the potential of one contact."""
    distance = np.hypot(0.6 - aside, 0.75)
    for corners in (32, 64):
        center = np.array([0.6 * aside, 0.8 * aside, 0.75])
        assert stored(hole(corners, True), center, 1 - distance) == pytest.approx(1.0, abs=0.02)


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


@fails("where the sphere is deep, the walls count as one piece")
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


def test_duplicate_elements() -> None:
    """Elements given twice, or turned over; dropped, the force is the same."""
    vertices, elements, normals = SURFACES["wavy above"].mesh(0.6)
    once = Shell(vertices, elements, normals=normals)
    twice = Shell(vertices, np.concatenate([elements, elements[::2, ::-1]]), normals=normals)
    assert twice.health.duplicate_elements == len(elements[::2])
    for center in SURFACES["wavy above"].probes(50, DEPTH)[0]:
        assert push(once, center) == pytest.approx(push(twice, center), abs=1e-12)


def cap(valence: int):
    """`valence` triangles round the pole of a sphere of radius 4; exact normals."""
    turn = 2 * np.pi * np.arange(valence) / valence
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(valence)], axis=1)
    normals = np.concatenate([[UP], np.sin(0.3) * ring + np.cos(0.3) * UP])
    i = np.arange(valence)
    elements = np.stack([0 * i, 1 + i, 1 + (i + 1) % valence], axis=1)
    return 4 * normals, elements, normals


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


@pytest.mark.parametrize("valence", [3, 100])
def test_tip_of_any_valence(valence: int) -> None:
    """Tip of 3 or 100 facets; over it a contact with the vertex, exact."""
    shell, rng = Shell(*cone(valence, 1.0)), np.random.default_rng(0)
    for lean in rng.uniform(-0.4, 0.4, (100, 3)) * [1.0, 1.0, 0.0]:
        normal = (UP + lean) / np.linalg.norm(UP + lean)
        found = find(shell, (1 - DEPTH) * normal)
        assert found.feature.tolist() == [Feature.VERTEX]
        assert push(shell, (1 - DEPTH) * normal) == pytest.approx(normal, abs=1e-9)


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


@pytest.mark.parametrize("closed", [True, False])
def test_cone(closed: bool) -> None:
    """Closed and open cone; exact over its tip, and over its rim to the polygon that this is."""
    shell = Shell.from_geometry(coal.Cone(2.0, 4.0), segments=96)
    if not closed:
        base = np.abs(shell.vertices[shell.triangles][:, :, 2] + 2).max(axis=1) < 1e-9
        shell = Shell(shell.vertices, shell.triangles[~base], normals=shell.normals[~base])
    assert shell.is_closed is closed
    rng = np.random.default_rng(0)
    for turn in rng.uniform(0, 2 * np.pi, 60):
        out = np.array([np.cos(turn), np.sin(turn), 0.0])
        lean = rng.uniform(0, 0.35)
        over = np.cos(lean) * UP + np.sin(lean) * out
        assert push(shell, 2 * UP + (1 - DEPTH) * over) == pytest.approx(over, abs=1e-6)
        lean = rng.uniform(-0.3, 0.0)
        beyond = np.cos(lean) * out + np.sin(lean) * UP
        center = 2 * out - 2 * UP + (1 - DEPTH) * beyond
        assert push(shell, center) == pytest.approx(beyond, abs=0.02)


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
    """Moebius strip, sphere r = 0.3 twice round it; reported, pushed away from it everywhere."""
    shell = moebius()
    assert shell.health.one_sided_components == 1
    for turn in np.linspace(0, 4 * np.pi, 2001):
        place, normal = along_strip(turn)
        found = find(shell, place + 0.25 * normal, 0.3)
        assert len(found)
        assert (found.normal @ normal).min() > 0.999


def test_force_on_a_moebius_strip() -> None:
    """Moebius strip; one contact everywhere, on the seam and straight over vertices as well."""
    shell = moebius()
    for turn in np.linspace(0, 4 * np.pi, 2001):
        place, normal = along_strip(turn)
        force = force_sum(find(shell, place + 0.25 * normal, 0.3)) / 0.05**1.5
        assert force @ normal == pytest.approx(1.0, abs=0.01)


def test_needle() -> None:
    """Needle of aspect 1e6 in a plate; as without it, to round-off."""
    corners = [[-1, -1], [1, -1], [1, 1], [-1, 1], [-0.5, 1e-6], [0.5, 1e-6], [0.5, 0]]
    elements = [[4, 6, 5], [0, 1, 6], [0, 6, 4], [1, 2, 5], [1, 5, 6], [2, 3, 4], [2, 4, 5]]
    shell = Shell(np.pad(np.array(corners, float), ((0, 0), (0, 1))), [*elements, [3, 0, 4]])
    assert shell.health.worst_shape == pytest.approx(4e-7, rel=1e-3)
    rng = np.random.default_rng(0)
    for x, y in rng.uniform(-0.7, 0.7, (300, 2)) * rng.choice([1.0, 1e-5], (300, 1)):
        assert push(shell, [x, y, 0.1 * (1 - DEPTH)], 0.1) == pytest.approx(UP, abs=1e-12)


def test_folded_needles() -> None:
    """Strip of needles of aspect 1e6, folded at every edge; potential as the definition has it."""
    vertices, elements = meshes.needles(aspect=1e6)
    shell, rng = Shell(vertices, elements, crease_angle=0.0), np.random.default_rng(0)
    for radius in (0.4, 0.1, 3e-6):
        for _ in range(60):
            place = rng.dirichlet([1.0, 1.0, 1.0]) @ vertices[rng.choice(elements)]
            over = rng.normal(size=3)
            center = place + 0.95 * radius * over / np.linalg.norm(over)
            exact = potential_and_force(vertices, elements, center, radius)[0]
            assert energy(find(shell, center, radius)) == pytest.approx(exact, rel=1e-4)


def test_element_beside_tiny_ones() -> None:
    """Elements a million times larger than their neighbours, in a plate; exact on both."""
    square = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    around = [[k, k + 4, (k + 1) % 4 + 4, (k + 1) % 4] for k in range(4)]
    shell = Shell(np.concatenate([5e-4 * square, 5e2 * square]), [[0, 1, 2, 3], *around])
    rng = np.random.default_rng(0)
    assert shell.health.boundary_edges == 4
    for radius in (1e-4, 1e-2, 1.0, 30.0):
        for x, y in rng.uniform(-1, 1, (100, 2)) * 10.0 ** rng.uniform(-4, 1, (100, 1)):
            center = [x, y, radius * (1 - DEPTH)]
            assert push(shell, center, radius) == pytest.approx(UP, abs=1e-10)


def assert_normal_at_the_surface(shell: Shell) -> None:
    """With the centre on it: depth r, and a unit normal along that of an element there."""
    fine = curved_mesh(shell, 4)[0].reshape(len(shell.triangles), -1, 3)
    for points, normal in zip(fine, shell.triangle_normals, strict=True):
        for point in points[::4]:
            found = shell.contacts(point, 0.1, method="smooth")
            assert len(found) == 1
            assert found.depth[0] == pytest.approx(0.1, abs=1e-14)
            assert np.linalg.norm(found.normal[0]) == pytest.approx(1.0)
            # At an edge or a corner of a cube, of any of its faces.
            normals = shell.triangle_normals if len(fine) == 12 else normal
            assert np.abs(normals @ found.normal[0]).max() >= 0.98
            if shell.side != "both":
                sign = 1.0 if shell.side == "outside" else -1.0
                assert sign * found.normal[0] @ normal >= -1e-12


SIDES = ("both", "outside", "inside")


@pytest.mark.parametrize("side", SIDES)
def test_centre_on_a_flat_surface(side: str) -> None:
    """Centre on a face, an edge or a vertex of a cube; depth r, along the normal of a face."""
    assert_normal_at_the_surface(shell_of(meshes.cube(), side=side))


ON_IT = "a one-sided shell takes the pseudo-normal of the flat feature there"


@pytest.mark.parametrize(
    "side", ["both", *(pytest.param(side, marks=fails(ON_IT)) for side in SIDES[1:])]
)
def test_centre_on_a_curved_surface(side: str) -> None:
    """Centre on a curved element; depth r, along the normal of the surface."""
    vertices, elements = meshes.icosphere(3)
    assert_normal_at_the_surface(Shell(vertices, elements, normals=vertices, side=side))


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_sphere_of_another_size_than_the_elements(size: float) -> None:
    """Sphere 1e-3 and 1e3 times the elements, on a plate and outside a ball; one contact."""
    rng = np.random.default_rng(0)
    # Both have elements of about 0.05 m.
    plate, radius = shell_of(meshes.random_plate(800, slivers=False)), 0.05 * size
    for x, y in rng.uniform(-0.4, 0.4, (100, 2)):
        assert push(plate, [x, y, radius * (1 - DEPTH)], radius) == pytest.approx(UP, abs=1e-9)
    vertices, elements = meshes.icosphere(4)
    ball = Shell(0.7 * vertices, elements, normals=vertices)
    for out in directions(rng, 100):
        foot = ball.contacts(0.8 * out, 0.2, method="smooth").point[0]
        center = foot + (1 - DEPTH) * radius * out
        assert len(find(ball, center, radius)) == 1
        assert push(ball, center, radius) == pytest.approx(out, abs=2e-3)


@pytest.mark.parametrize("exact", [True, False])
def test_far_from_the_origin(exact: bool) -> None:
    """Surface 2e6 r from the origin; the same force to round-off of the coordinates."""
    vertices, elements, normals = SURFACES["torus inside"].mesh(0.6)
    options = {"normals": normals} if exact else {}
    shift = np.array([1e6, -2e6, 5e5])
    here, there = Shell(vertices, elements, **options), Shell(vertices + shift, elements, **options)
    for center in SURFACES["torus inside"].probes(60, DEPTH)[0]:
        assert push(there, center + shift) == pytest.approx(push(here, center), abs=1e-7)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_any_unit(scale: float) -> None:
    """Everything 1e-6 or 1e6 times as large; the same force to round-off."""
    vertices, elements, normals = SURFACES["wavy above"].mesh(0.6)
    here = Shell(vertices, elements, normals=normals)
    there = Shell(scale * vertices, elements, normals=normals)
    for center in SURFACES["wavy above"].probes(60, DEPTH)[0]:
        assert push(there, scale * center, scale) == pytest.approx(push(here, center), abs=1e-11)


@pytest.mark.parametrize("noise", [0.001, 0.01, 0.1])
def test_noisy_scan(noise: float) -> None:
    """Vertices off by a share of the depth; the force is off by that share, at most by six."""
    vertices, elements, _ = SURFACES["bowl"].mesh(0.3)
    moved = vertices + noise * DEPTH * np.random.default_rng(0).normal(size=vertices.shape)
    shell = Shell(moved, elements)
    errors = [
        np.linalg.norm(push(shell, center) - normal)
        for center, normal in zip(*SURFACES["bowl"].probes(300, DEPTH), strict=True)
    ]
    assert np.mean(errors) <= 1.5 * noise
    assert np.max(errors) <= 6 * noise


def test_normals_that_point_inward() -> None:
    """Given normals that point inward; turned to their elements' side, and the report says so."""
    vertices, elements, normals = SURFACES["dome"].mesh(0.6)
    right, wrong = (Shell(vertices, elements, normals=sign * normals) for sign in (1, -1))
    assert wrong.health.turned_normals == elements.size
    assert any("turned" in sentence for sentence in wrong.health.repairs)
    for center in SURFACES["dome"].probes(50, DEPTH)[0]:
        assert push(wrong, center) == pytest.approx(push(right, center), abs=1e-12)


def leaning(angle: float) -> tuple[Shell, float]:
    """Dome whose given normals all lean by `angle` [deg], and its longest side."""
    vertices, elements, normals = SURFACES["dome"].mesh(0.6)
    aside = np.cross(normals, [0.3, 0.5, 0.8])
    aside /= np.linalg.norm(aside, axis=1)[:, None]
    lean = np.radians(angle)
    shell = Shell(vertices, elements, normals=np.cos(lean) * normals + np.sin(lean) * aside)
    sides = vertices[elements] - vertices[np.roll(elements, 1, axis=1)]
    return shell, float(np.linalg.norm(sides, axis=2).max())


@pytest.mark.parametrize("angle", [5.0, 30.0, 60.0, 80.0, 90.0])
def test_normals_that_lean(angle: float) -> None:
    """Given normals that are 5 to 90 degrees off; elements bulge by less than half their side."""
    shell, side = leaning(angle)
    shell.core_for("smooth")
    assert np.linalg.norm(shell.core.lifts, axis=2).max() <= side / 2
    for center in SURFACES["dome"].probes(100, DEPTH)[0]:
        assert np.isfinite(push(shell, center)).all()


def test_normals_more_than_90_degrees_off() -> None:
    """Single given normals that point the other way; the report says so, the answer is finite."""
    vertices, elements, normals = SURFACES["dome"].mesh(0.6)
    wrong = np.where(np.arange(len(normals))[:, None] % 5 == 0, -normals, normals)
    shell = Shell(vertices, elements, normals=wrong)
    assert any("more than 90 degrees" in sentence for sentence in shell.health.problems)
    for center in SURFACES["dome"].probes(100, DEPTH)[0]:
        assert np.isfinite(push(shell, center)).all()


def hanging(on_chord: bool) -> Shell:
    """Trough of radius 4, coarse for y < 0 and fine for y > 0: hanging vertices along y = 0."""
    coarse, fine = np.linspace(-0.6, 0.6, 9), np.linspace(-0.6, 0.6, 17)
    parts, count = [], 0
    for angles, rows in ((coarse, (-2.0, -1.0, 0.0)), (fine, (0.0, 1.0, 2.0))):
        turn, y = np.meshgrid(angles, rows, indexing="ij")
        normal = np.stack([-np.sin(turn), 0 * turn, np.cos(turn)], axis=-1)
        point = np.stack([4 * np.sin(turn), y, 4 - 4 * np.cos(turn)], axis=-1)
        if on_chord and rows[0] == 0.0:
            point[1::2, 0] = (point[:-1:2, 0] + point[2::2, 0]) / 2
        parts.append((point, meshes._cells(len(angles) - 1, 2) + count, normal))
        count += point.shape[0] * 3
    vertices, elements, normals = (
        np.concatenate([part[i].reshape(-1, part[i].shape[-1]) for part in parts]) for i in range(3)
    )
    return Shell(vertices, meshes._split(elements, np.zeros(len(elements), bool)), normals=normals)


def across_the_joint(sign: float):
    """Centres over the trough of radius 4 beside y = 0, and the normal of the contact."""
    normal = sign * np.array([-np.sin(0.0937), 0.0, np.cos(0.0937)])
    foot = np.array([4 * np.sin(0.0937), 0.0, 4 - 4 * np.cos(0.0937)])
    for y in np.linspace(-0.5, 0.5, 101):
        yield foot + y * np.array([0.0, 1.0, 0.0]) + (1 - DEPTH) * normal, normal


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_t_junctions_on_chords(sign: float) -> None:
    """T-junctions on the chords of curved edges; mended, off by what the vertices lie too deep."""
    shell = hanging(on_chord=True)
    assert shell.health.t_junctions == 8
    # The vertex on the chord, and its neighbours' bend, are off by the sagitta.
    sagitta = 4 * (1 - np.cos(0.075))
    for center, normal in across_the_joint(sign):
        found = find(shell, center)
        assert abs(found.depth[0] - DEPTH) <= 1.2 * sagitta
        assert force_sum(found) @ normal <= (1.2 * sagitta + DEPTH) ** 1.5
        assert_no_jump(shell, center)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_t_junctions_off_chords(sign: float) -> None:
    """T-junctions on the curved surface; a crack of two open edges, up to twice the force."""
    shell = hanging(on_chord=False)
    assert shell.health.t_junctions == 0
    assert shell.health.components == 2
    for center, normal in across_the_joint(sign):
        force = push(shell, center) @ normal
        assert 0.99 <= force <= 2.01
        # Beyond the disc of contact the other part of the surface is not felt.
        if abs(center[1]) > np.sqrt(2 * DEPTH) + 0.02:
            assert force == pytest.approx(1.0, abs=0.01)
        assert_no_jump(shell, center)


def table() -> list[tuple[str, str]]:
    """Case and what happens, of all tests here."""
    here = inspect.getmembers(sys.modules[__name__], inspect.isfunction)
    tests = sorted(
        (f for name, f in here if name.startswith("test_") and f.__module__ == __name__),
        key=lambda f: f.__code__.co_firstlineno,
    )
    rows = [tuple((inspect.getdoc(f) or "").rstrip(".").split("; ")) for f in tests]
    assert all(len(row) == 2 for row in rows), [row for row in rows if len(row) != 2]
    return rows  # type: ignore[return-value]


if __name__ == "__main__":
    print("\n".join(f"| {case} | {happens} |" for case, happens in table()))
