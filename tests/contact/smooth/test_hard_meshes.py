"""Hard cases: meshes of ill-shaped elements, odd sizes, noise, wrong normals, T-junctions."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from sphshell_pin import Shell
from sphshell_pin.shell.curvature import curved_mesh
from tests import meshes
from tests.contact.helpers import energy, force_sum, shell_of
from tests.contact.smooth.hard_cases import DEPTH, UP, assert_no_jump, fails, find, push
from tests.contact.smooth.surfaces import SURFACES
from tests.oracle.pieces import potential_and_force


def test_needle() -> None:
    """Needle of aspect 1e6 in a plate; as without it, to round-off."""
    corners = [[-1, -1], [1, -1], [1, 1], [-1, 1], [-0.5, 1e-6], [0.5, 1e-6], [0.5, 0]]
    elements = [[4, 6, 5], [0, 1, 6], [0, 6, 4], [1, 2, 5], [1, 5, 6], [2, 3, 4], [2, 4, 5]]
    shell = Shell(np.pad(np.array(corners, float), ((0, 0), (0, 1))), [*elements, [3, 0, 4]])
    assert shell.health.worst_shape == pytest.approx(4e-7, rel=1e-3)
    rng = np.random.default_rng(0)
    for x, y in rng.uniform(-0.7, 0.7, (300, 2)) * rng.choice([1.0, 1e-5], (300, 1)):
        assert push(shell, [x, y, 0.1 * (1 - DEPTH)], 0.1) == pytest.approx(UP, abs=1e-12)


@pytest.mark.parametrize("bulge", [-0.3, 0.3])
def test_closest_points_of_tall_elements_that_bend(bulge: float) -> None:
    """A waist or a barrel of three rows: no point of its elements is nearer than what is found."""
    rows = np.linspace(-1.5, 1.5, 4)
    vertices, triangles = meshes.revolved(np.stack([1 + bulge * np.cos(rows), rows], axis=1), 100)
    z = vertices[:, 2:]
    normals = np.hstack([vertices[:, :2] / (1 + bulge * np.cos(z)), bulge * np.sin(z)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    shell = Shell(vertices, triangles, normals[triangles])
    centers = np.random.default_rng(0).uniform(-2, 2, (1000, 3))
    found = np.abs(shell.closest_points(centers).distances)
    nearest, _ = cKDTree(curved_mesh(shell, 20)[0]).query(centers)
    assert (found - nearest).max() < 1e-9


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
    shell = Shell(vertices, elements, normals=vertices, side=side, faces=False)
    assert_normal_at_the_surface(shell)


@pytest.mark.parametrize("exact", [True, False])
def test_far_from_the_origin(exact: bool) -> None:
    """Surface 2e6 r from the origin; the same force to round-off of the coordinates."""
    vertices, elements, normals = SURFACES["torus inside"].mesh(0.6)
    options = {"normals": normals} if exact else {}
    shift = np.array([1e6, -2e6, 5e5])
    here, there = Shell(vertices, elements, **options), Shell(vertices + shift, elements, **options)
    for center in SURFACES["torus inside"].probes(60, DEPTH)[0]:
        assert push(there, center + shift) == pytest.approx(push(here, center), abs=1e-7)


@pytest.mark.parametrize("noise", [0.001, 0.01, 0.1])
def test_noisy_scan(noise: float) -> None:
    """Vertices off by a share of the depth; the force is off by that share, at most by six."""
    vertices, elements, _ = SURFACES["bowl"].mesh(0.3)
    moved = vertices + noise * DEPTH * np.random.default_rng(0).normal(size=vertices.shape)
    shell = Shell(moved, elements)
    probes = zip(*SURFACES["bowl"].probes(300, DEPTH), strict=True)
    errors = [np.linalg.norm(push(shell, center) - normal) for center, normal in probes]
    assert np.mean(errors) <= 1.7 * noise
    assert np.max(errors) <= 6 * noise


def test_normals_that_point_inward() -> None:
    """Given normals that point inward; turned to their elements' side, and the report says so."""
    vertices, elements, normals = SURFACES["dome"].mesh(0.6)
    right, wrong = (Shell(vertices, elements, normals=sign * normals) for sign in (1, -1))
    assert wrong.health.turned_normals == elements.size
    assert any("turned" in sentence for sentence in wrong.health.repairs)
    for center in SURFACES["dome"].probes(50, DEPTH)[0]:
        assert push(wrong, center) == pytest.approx(push(right, center), abs=1e-12)


@pytest.mark.parametrize("angle", [5.0, 30.0, 60.0, 80.0, 90.0])
def test_normals_that_lean(angle: float) -> None:
    """Given normals that are 5 to 90 degrees off; elements bulge by less than half their side."""
    vertices, elements, normals = SURFACES["dome"].mesh(0.6)
    aside = np.cross(normals, [0.3, 0.5, 0.8])
    aside /= np.linalg.norm(aside, axis=1)[:, None]
    lean = np.radians(angle)
    shell = Shell(vertices, elements, normals=np.cos(lean) * normals + np.sin(lean) * aside)
    sides = np.linalg.norm(vertices[elements] - vertices[np.roll(elements, 1, axis=1)], axis=2)
    bulges = np.linalg.norm(shell.core_for("smooth").control_point_offsets, axis=2)
    assert bulges.max() <= sides.max() / 2
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
def test_crack_of_t_junctions(sign: float) -> None:
    """T-junctions on the curved surface, a crack of two open edges; no jump, and one beyond it."""
    shell = hanging(on_chord=False)
    assert shell.health.t_junctions == 0
    assert shell.health.components == 2
    for center, normal in across_the_joint(sign):
        assert_no_jump(shell, center)
        # Beyond the disc of contact the other part of the surface is not felt.
        if abs(center[1]) > np.sqrt(2 * DEPTH) + 0.02:
            assert push(shell, center) @ normal == pytest.approx(1.0, abs=0.01)


@fails("the parts beside a crack have no side in common: each counts, twice the force in all")
def test_force_over_a_crack() -> None:
    """Over such a crack; the force of one."""
    shell = hanging(on_chord=False)
    for center, normal in across_the_joint(1.0):
        assert push(shell, center) @ normal == pytest.approx(1.0, abs=0.01)
