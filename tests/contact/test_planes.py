"""A plane under a shell: lowest points against brute force, closed forms and what lies level."""

import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.study.report.surfaces import torus
from sphshell_pin.testing import assert_derivatives
from tests.meshes import crumpled, cube, grid_plate, icosphere, soup
from tests.models import add_body, empty, free_q, linear_law
from tests.validation.rattleback import ellipsoid

AXES = np.array([0.2, 0.03, 0.02])


def scene_of(shell, law=None, friction=None, method=None, inertia=None, **plane):
    """`shell` on a free body, over a plane of the world."""
    model, law = empty(), law or linear_law(1e4)
    add_body(model, "body", pin.JointModelFreeFlyer(), inertia=inertia)
    scene = sp.Scene(model)
    scene.add_contact(sp.Plane("universe", **plane), shell, "body", None, law, friction, method)
    return scene


def pose(rotation: np.ndarray, height: float) -> np.ndarray:
    turned = pin.Quaternion(rotation).coeffs()
    return np.concatenate(([0.3, -0.2, height], turned))


def rotations(count: int, seed: int = 0) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [pin.Quaternion(*(q / np.linalg.norm(q))).matrix() for q in rng.normal(size=(count, 4))]


def egg(cells: int = 12, axes: np.ndarray = AXES) -> sp.Shell:
    """An ellipsoid with its own normals."""
    vertices, elements, normals = ellipsoid(cells, tuple(axes))
    return sp.Shell(vertices, elements, normals=normals, side="outside")


def lowest_vertices(shell: sp.Shell, heights: np.ndarray) -> list[int]:
    """Vertices below 0 that no neighbor is below."""
    triangles = np.asarray(shell.triangles)
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    sides = np.concatenate([sides, sides[:, ::-1]])
    lower = np.full(len(heights), np.inf)
    np.minimum.at(lower, sides[:, 0], heights[sides[:, 1]])
    used = np.unique(triangles)
    return [k for k in used if heights[k] < 0 and heights[k] < lower[k]]


@pytest.mark.parametrize("mesh", [icosphere(2), crumpled(6, 1), soup(40, 2), cube(quads=True)])
def test_flat_elements_touch_at_every_lowest_vertex(mesh) -> None:
    """All local minima below the plane, at many orientations, by brute force."""
    shell = sp.Shell(*mesh, crease_angle=0.0)
    scene = scene_of(shell)
    rng = np.random.default_rng(3)
    several = 0
    for rotation in rotations(150):
        z = np.asarray(shell.vertices) @ rotation[2]
        q = pose(rotation, -rng.uniform(-0.05, 1.0) * np.ptp(z) - z.min())
        world = np.asarray(shell.vertices) @ rotation.T + q[:3]
        expected = lowest_vertices(shell, world[:, 2])
        found = scene.contacts(q)
        minima = found.normal_force > 0  # not of saddles
        depth = found.depth[minima]
        assert len(depth) == len(expected)
        several += len(expected) > 1
        assert np.sort(depth) == pytest.approx(np.sort(-world[expected, 2]), abs=1e-14)
        order = np.argsort(depth), np.argsort(-world[expected, 2])
        points = world[expected][order[1]] * [1, 1, 0]  # in the plane, over the lowest points
        assert found.point_world[minima][order[0]] == pytest.approx(points, abs=1e-13)
        assert found.normal_world == pytest.approx(np.tile([0, 0, -1.0], (len(found.depth), 1)))
    assert (several > 20) == (len(shell.elements) not in (6, 320))  # two of them are convex


def support(axes: np.ndarray, rotation: np.ndarray) -> float:
    """How far an ellipsoid reaches below its center."""
    return float(np.linalg.norm(axes * rotation[2]))


def lowest_of(shell: sp.Shell, rotation: np.ndarray, axes: np.ndarray) -> float:
    """How far the curved surface itself reaches below the center of its ellipsoid.

    From the definition: the closest point of ever farther points below moves to the lowest one.
    """
    down, point = -rotation[2], -(axes**2) * rotation[2] / support(axes, rotation)
    for _ in range(40):
        point = shell.closest_points((point + 5.0 * down)[None], method="smooth").points[0]
    return float(down @ point)


def test_ellipsoid_by_its_support_function_and_by_its_own_surface() -> None:
    """The depth of a curved shell is that of its own surface, which is off by order four."""
    errors, axes = [], np.array([0.06, 0.04, 0.03])
    shells = [egg(cells, axes) for cells in (8, 16)]
    for shell in shells:
        scene, worst = scene_of(shell), 0.0
        for rotation in rotations(20, 1):
            reach = support(axes, rotation)
            found = scene.contacts(pose(rotation, reach - 1e-4))
            assert len(found.depth) == 1
            worst = max(worst, abs(found.depth[0] - 1e-4))
            below = lowest_of(shell, rotation, axes) - reach
            assert found.depth[0] == pytest.approx(1e-4 + below, abs=2e-13)
        errors.append(worst)
    assert errors[1] < 0.12 * errors[0]


def test_no_lowest_point_of_coarse_elements_is_lost() -> None:
    """They turn by a right angle: the slopes' bounds are all that says where it may be."""
    shell = egg(5)
    scene = scene_of(shell)
    for rotation in rotations(100):
        reach = lowest_of(shell, rotation, AXES)
        found = scene.contacts(pose(rotation, reach - 1e-3))
        assert found.depth.max() > 1e-3 - 1e-12


def test_spheres_and_tori_are_exact() -> None:
    coal = pytest.importorskip("coal")
    shell = sp.Shell.from_geometry(coal.Sphere(0.04), segments=24)
    scene = scene_of(shell)
    for rotation in rotations(30, 2):
        found = scene.contacts(pose(rotation, 0.039))
        assert found.depth == pytest.approx([0.001], abs=1e-14)
        assert found.point_world[0] == pytest.approx([0.3, -0.2, 0.0], abs=1e-9)
    mesh = torus(0.06, 0.02, 0.01)
    scene = scene_of(sp.Shell(mesh.vertices, mesh.triangles, normals=mesh.normals))
    for rotation in rotations(10, 3):
        low = 0.06 * np.hypot(*rotation[2, :2]) + 0.02
        q = pose(rotation, low - 0.001)
        assert scene.contacts(q).depth == pytest.approx([0.001], abs=1e-14)
        assert_derivatives(scene, q, np.array([0.1, -0.2, -0.1, 1.0, 2.0, -3.0]), tolerance=1e-5)


def test_two_feet_have_a_saddle_between_them() -> None:
    """A wavy sheet on a plane: minima in its valleys, saddles once the ridges are below, too."""
    vertices, quads = grid_plate(40, 40, 0.1, quads=True)
    u, v, _ = vertices.T
    vertices[:, 2] = 0.002 * np.cos(2 * np.pi * u / 0.05) + 0.5 * v**2
    scene = scene_of(sp.Shell(vertices, quads))
    above = scene.contacts(pose(np.eye(3), 0.0015))
    assert len(above.depth) == 2
    assert (above.normal_force > 0).all()
    below = scene.contacts(pose(np.eye(3), -0.0025))
    assert np.sort(np.sign(below.normal_force)).tolist() == [-1, 1, 1]


def test_normal_and_offset_place_the_plane() -> None:
    shell = egg()
    up = np.array([0.3, -0.2, 0.9])
    scene = scene_of(shell, offset=(0.1, 0.2, 0.05), normal=tuple(up))
    up /= np.linalg.norm(up)
    reach = float(np.linalg.norm(AXES * up))
    q = free_q(np.array([0.1, 0.2, 0.05]) + (reach - 1e-4) * up)
    found = scene.contacts(q)
    assert found.depth == pytest.approx([1e-4], abs=1e-5)
    assert found.normal_world[0] == pytest.approx(-up)
