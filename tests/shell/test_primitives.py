"""Solids become closed shells, within the chord error, with their exact normals."""

import coal
import numpy as np
import pinocchio as pin
import pytest

from sphshell_pin.errors import InvalidParameter
from sphshell_pin.shell import Shell
from tests import urdf

from .surfaces import expect, tetrahedron

ROUND = {
    "sphere": coal.Sphere(0.3),
    "cylinder": coal.Cylinder(0.2, 0.7),
    "capsule": coal.Capsule(0.1, 0.4),
    "thin capsule": coal.Capsule(0.001, 1.0),
    "cone": coal.Cone(0.2, 0.5),
    "ellipsoid": coal.Ellipsoid(0.1, 0.2, 0.35),
}


def depth_inside(name, p):
    """Return how deep points lie in the solid [m]; for the ellipsoid to first order."""
    rho, z = np.hypot(p[:, 0], p[:, 1]), p[:, 2]
    if name == "sphere":
        return 0.3 - np.hypot(rho, z)
    if name == "cylinder":
        return np.minimum(0.2 - rho, 0.35 - np.abs(z))
    if name.endswith("capsule"):
        r, half = (0.1, 0.2) if name == "capsule" else (0.001, 0.5)
        return r - np.hypot(rho, z - np.clip(z, -half, half))
    if name == "cone":
        slant = np.hypot(0.2, 0.5)
        return np.minimum((0.25 - z) * 0.2 / slant - rho * 0.5 / slant, z + 0.25)
    radii = np.array([0.1, 0.2, 0.35])
    level = np.linalg.norm(p / radii, axis=1)
    return (1 - level) * level / np.linalg.norm(p / radii**2, axis=1)


@pytest.mark.parametrize(
    ("name", "share", "segments"),
    [(name, share, None) for name in ROUND for share in (None, 1e-2)]
    + [(name, None, 7) for name in ROUND]
    + [("cylinder", 1e-5, None)],
)
def test_round_solids(name, share, segments):
    shape = ROUND[name]
    diameter = 2 * float(np.max(getattr(shape, "radius", getattr(shape, "radii", 0.0))))
    option = {"segments": segments} if segments else {}
    if share is not None:
        option["chord_error"] = share * diameter
    shell = Shell.from_geometry(shape, **option)
    expect(shell.health, ok=True, is_closed=True, euler_number=2, opposing_normals=0)
    assert not shell.health.repairs
    assert np.linalg.norm(shell.normals, axis=2) == pytest.approx(1.0, abs=1e-15)
    weights = np.random.default_rng(0).dirichlet([1, 1, 1], 40)
    points = np.einsum("nk,tkx->tnx", weights, shell.vertices[shell.triangles])
    inside = depth_inside(name, points.reshape(-1, 3))
    assert inside.min() > -1e-12 * diameter
    if not segments:
        assert inside.max() <= (share or 1e-3) * diameter * 1.001
    at = depth_inside(name, shell.vertices)
    assert np.abs(at).max() < 1e-12 * max(shell.size, diameter)


@pytest.mark.parametrize("name", ["sphere", "capsule", "thin capsule", "ellipsoid"])
def test_corner_normals_of_smooth_solids(name):
    shell = Shell.from_geometry(ROUND[name], segments=24)
    # Half as many rows from pole to pole as round it, and one along the side of a capsule.
    assert len(shell.triangles) == 2 * 24 * (12 if name.endswith("capsule") else 11)
    points, normals = shell.vertices[shell.triangles].reshape(-1, 3), shell.normals.reshape(-1, 3)
    # Only along the true normal does the depth change by as much as the step.
    step = 1e-7
    change = depth_inside(name, points - step * normals) - depth_inside(name, points)
    assert change == pytest.approx(step, rel=1e-3)


@pytest.mark.parametrize(("name", "slope"), [("cylinder", 0.0), ("cone", 0.4)])
def test_corner_normals_of_solids_with_a_rim(name, slope):
    shell = Shell.from_geometry(ROUND[name], segments=24)
    points, normals = shell.vertices[shell.triangles], shell.normals
    up = shell.triangle_normals[:, 2]
    flat = np.abs(up) > 0.999
    assert flat.sum() == (44 if name == "cylinder" else 22)
    assert normals[flat, :, 2] == pytest.approx(np.repeat(np.sign(up[flat, None]), 3, axis=1))
    points, normals = points[~flat].reshape(-1, 3), normals[~flat].reshape(-1, 3)
    length = np.hypot(1.0, slope)
    assert normals[:, 2] == pytest.approx(slope / length)
    rim = np.hypot(points[:, 0], points[:, 1]) > 0.1
    assert normals[rim, :2] * 0.2 * length == pytest.approx(points[rim, :2])


def test_box():
    shell = Shell.from_geometry(coal.Box(1.0, 2.0, 3.0), name="crate")
    expect(shell.health, quads=6, elements=6, volume=6.0)
    assert shell.box == pytest.approx(np.array([[-0.5, -1, -1.5], [0.5, 1, 1.5]]))
    assert shell.name == "crate"
    assert shell.health.largest_normal_angle == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("kind", [coal.Halfspace, coal.Plane])
def test_half_space_is_a_square_sheet(kind):
    normal = np.array([1.0, 2.0, 2.0]) / 3.0
    shell = Shell.from_geometry(kind(normal, 0.4), extent=3.0)
    expect(shell.health, "stands for the endless", elements=1, area=9.0)
    assert shell.vertices @ normal == pytest.approx(0.4)
    assert shell.normals == pytest.approx(np.broadcast_to(normal, (2, 3, 3)))


def test_triangle():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0]])
    shell = Shell.from_geometry(coal.TriangleP(*points))
    assert shell.vertices.tolist() == points.tolist()
    assert shell.normals[0].tolist() == [[0, 0, 1]] * 3


@pytest.mark.parametrize("kind", [coal.BVHModelOBBRSS, coal.BVHModelOBB])
def test_mesh_is_taken_as_it_is(kind):
    ball = Shell.from_geometry(coal.Sphere(0.5), segments=12)
    model = kind()
    model.beginModel(len(ball.triangles), len(ball.vertices))
    model.addVertices(np.array(ball.vertices))
    model.addTriangles(np.array(ball.triangles))
    model.endModel()
    back = Shell.from_geometry(model)
    assert back.vertices == pytest.approx(ball.vertices)
    assert back.triangles.tolist() == ball.triangles.tolist()


def test_convex():
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    corners, elements = tetrahedron()
    points.extend(list(corners))
    triangles.extend([coal.Triangle(*one) for one in elements.tolist()])
    shell = Shell.from_geometry(coal.Convex(points, triangles))
    expect(shell.health, is_closed=True, volume=1 / 6)


SWOLLEN = coal.Box(1.0, 1.0, 1.0)
SWOLLEN.setSweptSphereRadius(0.1)


def test_geometry_object_gives_name_and_own_frame():
    placement = pin.SE3.Random()
    held = pin.GeometryObject("lid", 0, 0, placement, coal.Box(1.0, 1.0, 1.0))
    held.meshScale = np.array([2.0, 2.0, 2.0])
    shell = Shell.from_geometry(held)
    assert shell.name == "lid"
    assert shell.box == pytest.approx(np.array([[-0.5] * 3, [0.5] * 3]))


def test_mesh_scale_of_a_urdf_is_applied_once(tmp_path):
    Shell.from_geometry(coal.Box(1.0, 1.0, 1.0)).to_file(tmp_path / "box.stl")
    mesh = f'<mesh filename="{tmp_path}/box.stl" scale="2 3 4"/>'
    part = urdf.link("base", urdf.shape("collision", mesh))
    file = str(urdf.write(tmp_path / "robot.urdf", part))
    model = pin.buildModelFromUrdf(file)
    geometry = pin.buildGeomFromUrdf(model, file, pin.GeometryType.COLLISION)
    held = geometry.geometryObjects[0]
    assert held.meshScale.tolist() == [2, 3, 4]
    shell = Shell.from_geometry(held)
    assert shell.box == pytest.approx(np.array([[-1, -1.5, -2], [1, 1.5, 2]]))


@pytest.mark.parametrize(
    ("shape", "options", "said"),
    [
        ("sphere", {}, "Capsule, Cone, Ellipsoid"),
        (coal.HeightFieldAABB(1.0, 1.0, np.zeros((3, 3)), -1.0), {}, "Box"),
        (coal.Sphere(1.0), {"chord_error": 0.0}, "chord_error"),
        (coal.Sphere(1.0), {"chord_error": np.nan}, "chord_error"),
        (coal.Sphere(1.0), {"segments": 2}, "segments"),
        (coal.Halfspace(np.array([0, 0, 1.0]), 0.0), {"extent": -1.0}, "extent"),
        (SWOLLEN, {}, "swept-sphere"),
    ],
)
def test_faults(shape, options, said):
    with pytest.raises(InvalidParameter, match=said):
        Shell.from_geometry(shape, **options)
