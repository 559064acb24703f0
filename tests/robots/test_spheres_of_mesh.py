"""Spheres inside a mesh: nowhere beyond it, near it as measured apart, and nearer the more."""

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh

from sphshell_pin import Shell, robots
from sphshell_pin.errors import FrameNotFound, InvalidParameter
from sphshell_pin.robots import mesh_spheres

UPRIGHT = pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.4, 0.5), np.array([0.1, -0.2, 0.3]))
SIZE = np.array([0.1, 0.06, 0.04])


def shell_of(geometry) -> Shell:  # type: ignore[no-untyped-def]
    placed = pin.GeometryObject("part", 0, pin.SE3.Identity(), geometry)
    return Shell.from_geometry(placed, chord_error=2e-4)


SHAPES = {
    "box": coal.Box(*SIZE),
    "cylinder": coal.Cylinder(0.03, 0.1),
    "cone": coal.Cone(0.03, 0.08),
    "capsule": coal.Capsule(0.02, 0.06),
}


def centers_and_radii(found: robots.MeshSpheres) -> tuple[np.ndarray, np.ndarray]:
    balls = np.array([(*one.offset, one.radius) for one in found.spheres])
    return balls[:, :3], balls[:, 3]


@pytest.fixture(scope="module", params=SHAPES)
def found(request):  # type: ignore[no-untyped-def]
    """The spheres of a shape, their centers and radii, and its mesh."""
    shell = shell_of(SHAPES[request.param])
    found = robots.spheres_of_mesh(shell, "link", count=12)
    mesh = trimesh.Trimesh(shell.vertices, shell.triangles, process=False)
    return found, *centers_and_radii(found), mesh


def test_no_sphere_reaches_beyond_the_mesh(found) -> None:  # type: ignore[no-untyped-def]
    # The mesh's signed distance, by trimesh: positive inside. These shapes are convex.
    _, centers, radii, mesh = found
    assert len(centers) == 12
    _, distance, _ = trimesh.proximity.closest_point_naive(mesh, centers)
    assert (radii <= distance * (1 + 1e-9)).all()
    hull = trimesh.convex.convex_hull(mesh)
    heights = np.sum(hull.face_normals * hull.triangles[:, 0], axis=1)
    planes = hull.face_normals @ centers.T - heights[:, None]
    assert (planes.max(axis=0) <= -radii * (1 - 1e-6)).all()


def test_the_distances_are_those_of_other_places(found) -> None:  # type: ignore[no-untyped-def]
    found, centers, radii, mesh = found
    places, _ = trimesh.sample.sample_surface(mesh, 5000, seed=7)
    heights = np.linalg.norm(places[:, None] - centers, axis=2) - radii
    largest = heights.min(axis=1).max()
    assert 0.7 * found.mesh_to_spheres < largest < found.mesh_to_spheres * 1.05
    rng = np.random.default_rng(3)
    unit = rng.normal(size=(500, 3))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    around = (centers[:, None] + radii[:, None, None] * unit).reshape(-1, 3)
    inside_another = np.linalg.norm(around[:, None] - centers, axis=2) < radii - 1e-9
    free = around[~inside_another.any(axis=1)]
    _, distance, _ = trimesh.proximity.closest_point_naive(mesh, free)
    assert 0.7 * found.spheres_to_mesh < distance.max() < found.spheres_to_mesh * 1.1


def test_more_spheres_are_nearer() -> None:
    shell = shell_of(SHAPES["capsule"])
    one, three, nine = (
        robots.spheres_of_mesh(shell, "link", count=count).mesh_to_spheres for count in (1, 3, 9)
    )
    assert one > 4 * three > 16 * nine


def test_a_ball_is_one_sphere_and_a_cube_leaves_its_corners() -> None:
    ball = robots.spheres_of_mesh(shell_of(coal.Sphere(0.05)), "link", count=1)
    assert np.isclose(ball.spheres[0].radius, 0.05, rtol=1e-2)
    assert ball.mesh_to_spheres < 1e-3
    cube = robots.spheres_of_mesh(shell_of(coal.Box(0.1, 0.1, 0.1)), "link", count=1)
    assert np.isclose(cube.spheres[0].radius, 0.05, rtol=5e-2)
    assert np.isclose(cube.mesh_to_spheres, 0.05 * (np.sqrt(3) - 1), rtol=0.15)


def test_the_same_mesh_gives_the_same_spheres_where_it_is_placed() -> None:
    shell = shell_of(SHAPES["box"])
    plain, moved = (
        robots.spheres_of_mesh(shell, "link", placement=placement, count=5)
        for placement in (None, UPRIGHT)
    )
    assert plain == robots.spheres_of_mesh(shell, "link", count=5)
    for a, b in zip(plain.spheres, moved.spheres, strict=True):
        assert a.radius == b.radius
        assert np.allclose(UPRIGHT.act(np.array(a.offset)), b.offset, rtol=0, atol=1e-15)


def test_a_mesh_that_cuts_itself_has_an_inside() -> None:
    # Two boxes in a cross, as one mesh: the walls inside bound the balls, the outside has none.
    boxes = [trimesh.creation.box(size) for size in ((0.1, 0.03, 0.03), (0.03, 0.1, 0.03))]
    cross = trimesh.util.concatenate(boxes)
    shell = Shell(cross.vertices, cross.faces)
    centers, radii = centers_and_radii(robots.spheres_of_mesh(shell, "link", count=8))
    depth = -np.min([np.max(np.abs(centers) - box.extents / 2, axis=1) for box in boxes], axis=0)
    assert (depth > 0).all()
    assert (radii <= depth + 1e-9).all()


def test_an_open_mesh_is_refused() -> None:
    shell = Shell([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(InvalidParameter, match=r"is open, but must be closed, to have an inside"):
        robots.spheres_of_mesh(shell, "link")
    with pytest.raises(InvalidParameter, match="count = 0 must be a whole number, 1 at least"):
        robots.spheres_of_mesh(shell_of(SHAPES["box"]), "link", count=0)


def test_spheres_of_a_link() -> None:
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "hinge")
    frame = model.addFrame(pin.Frame("link", joint, UPRIGHT, pin.FrameType.BODY))
    model.addFrame(pin.Frame("bare", joint, UPRIGHT, pin.FrameType.BODY))
    geometry = pin.GeometryModel()
    here = UPRIGHT * pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.02]))
    for name, shape in (("rod", SHAPES["capsule"]), ("ball", coal.Sphere(0.01))):
        geometry.addGeometryObject(pin.GeometryObject(name, joint, frame, here, shape))
    found = robots.spheres_of_link(model, geometry, "link", count=4)
    assert len(found.spheres) == 5
    assert {one.frame for one in found.spheres} == {"link"}
    centers, radii = centers_and_radii(found)
    assert np.allclose([*centers[-1], radii[-1]], [0.0, 0.0, 0.02, 0.01])
    assert np.allclose(centers[:, :2], 0.0, atol=2e-3)  # on the rod's axis
    with pytest.raises(InvalidParameter, match="link = 'bare' must have geometry"):
        robots.spheres_of_link(model, geometry, "bare")
    with pytest.raises(FrameNotFound, match="'hand'"):
        robots.spheres_of_link(model, geometry, "hand")


def test_each_of_many_balls_that_brings_a_little_is_taken() -> None:
    """Balls without size on the 400 points of a grid: all of them, though one brings below 1 %."""
    grid = np.stack([*np.meshgrid(np.arange(20.0), np.arange(20.0)), np.zeros((20, 20))], axis=2)
    points = grid.reshape(-1, 3)
    chosen = mesh_spheres._choose(points, points, np.zeros(400), 500)
    assert np.array_equal(np.sort(chosen), np.arange(400))


@pytest.mark.parametrize("axis", range(3))
def test_the_distance_of_a_sphere_is_measured_in_every_direction(axis: int) -> None:
    """In a long bar it is the radius, along the bar alone; across it the sphere touches."""
    sides = np.full(3, 0.02)
    sides[axis] = 0.2
    found = robots.spheres_of_mesh(shell_of(coal.Box(*sides)), "link", count=1)
    assert found.spheres_to_mesh == pytest.approx(0.01, rel=6e-2)
