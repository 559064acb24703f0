"""How far curved elements stand off the flat ones: the report, and who shows it."""

import pickle

import coal
import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.shell.curvature import curved_mesh
from tests import meshes, models

from .surfaces import CUBE, CUBE_QUADS, plate


def ball(rows=8, radius=2.0):
    """A sphere of quads and triangles at its poles, with its own normals."""
    return sp.Shell.from_geometry(coal.Sphere(radius), segments=2 * rows)


def test_what_bends_and_what_does_not_is_counted():
    """A sheet whose last third is rolled up: the elements before it are flat."""
    y, x = (one.ravel() for one in np.meshgrid(np.linspace(0, 3, 4), np.linspace(0, 9, 28)))
    roll = np.maximum(x - 6, 0) / 2
    vertices = np.stack([np.minimum(x, 6) + 2 * np.sin(roll), y, 2 * (1 - np.cos(roll))], axis=1)
    first = np.arange(3) + 4 * np.arange(27)[:, None]
    quads = np.stack([first, first + 4, first + 5, first + 1], axis=-1).reshape(-1, 4)
    report = sp.Shell(vertices, quads).curvature_report()
    ((_, flat),) = report.flat_because
    assert (report.curved, flat) == (27, 54)


def test_largest_distance_on_a_ball():
    shell = ball(8, 2.0)
    report = shell.curvature_report()
    assert (report.elements, report.flat, report.flat_because) == (shell.num_elements, 0, ())
    # The exact ball stands off most over the middle of a triangle's circumscribed circle, if that
    # is inside, else over its longest side; curved elements of this size are near it to 1e-3.
    p = shell.vertices[shell.triangles]
    sides = np.roll(p, -1, axis=1) - p
    a, b, c = np.sort(np.linalg.norm(sides, axis=2), axis=1).T
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    circle = np.where(a * a + b * b > c * c, a * b * c / (4 * area), c / 2)
    expected = (2.0 - np.sqrt(4.0 - circle**2)).max()
    assert report.largest == pytest.approx(expected, rel=0.02)
    assert np.linalg.norm(report.at) == pytest.approx(2.0, rel=1e-3)
    assert report.of_size == pytest.approx(report.largest / shell.size)
    # The triangle there, and its smallest height.
    near = np.argmin(np.linalg.norm(p.mean(axis=1) - report.at, axis=1))
    assert report.of_height == pytest.approx(report.largest / (2 * area[near] / c[near]), rel=1e-6)
    assert not report.problems


def test_the_largest_distance_is_that_of_a_fine_sampling():
    rng = np.random.default_rng(4)
    points, quads = plate(10)
    points[:, :2] += 0.01 * rng.uniform(-1, 1, (len(points), 2))
    x, y, _ = points.T
    points[:, 2] = 0.05 * np.sin(4 * x) * np.cos(3 * y)
    slopes = 0.2 * np.cos(4 * x) * np.cos(3 * y), -0.15 * np.sin(4 * x) * np.sin(3 * y)
    normals = np.stack([-slopes[0], -slopes[1], np.ones(len(x))], axis=1)
    shell = sp.Shell(points, quads, normals / np.linalg.norm(normals, axis=1, keepdims=True))
    fine, _, _ = curved_mesh(shell, 40)
    fine = fine.reshape(len(shell.triangles), -1, 3)
    corners = shell.vertices[shell.triangles]
    upright = np.einsum("tkx,tx->tk", fine - corners[:, :1], shell.triangle_normals)
    report = shell.curvature_report()
    assert report.curved > 0.9 * report.elements
    # No point of an element is nearer than its plane, none farther than where it came from.
    flat = np.einsum("kc,tcx->tkx", weights_of(40), corners)
    assert report.largest >= 0.999 * np.abs(upright).max()
    assert report.largest <= 1.001 * np.linalg.norm(fine - flat, axis=2).max()
    # On this sheet no other element is nearer to the place than its own.
    at = shell.closest_points([report.at], method="facets")
    assert np.abs(at.distances) == pytest.approx([report.largest], rel=1e-6)


def weights_of(divisions):
    """Barycentric weights (k, 3) of the points of `curved_mesh`."""
    grid = [(i, j) for i in range(divisions + 1) for j in range(divisions + 1 - i)]
    u, v = np.array(grid).T / divisions
    return np.stack([1 - u - v, u, v], axis=1)


def test_planes_are_flat():
    report = sp.Shell(*plate(3)).curvature_report()
    assert (report.curved, report.flat, report.largest, report.at) == (0, 9, 0.0, None)
    ((why, count),) = report.flat_because
    assert count == 9
    assert "turns" in why
    flat = sp.Shell.from_geometry(coal.Sphere(2.0), segments=12, crease_angle=0.0)
    for shell in (sp.Shell(CUBE, CUBE_QUADS), flat):
        report = shell.curvature_report()
        assert (report.curved, report.largest) == (0, 0.0)


def tilted_plate(tilt=0.3):
    """A plate with the normals of a bowl."""
    points, quads = plate(6)
    normals = np.column_stack([tilt * (0.5 - points[:, :2]), np.ones(len(points))])
    return sp.Shell(points, quads, normals / np.linalg.norm(normals, axis=1, keepdims=True))


def test_elements_that_bend_more_than_they_turn_are_things_to_look_at():
    shell = tilted_plate()
    assert not shell.health.problems
    report = shell.curvature_report()
    # Beside the border a plate may be bent, for all that is known; a side in the middle is not.
    assert report.large == 14
    assert 0.5 * report.largest < report.large_distance <= report.largest
    assert shell.closest_points([report.large_at]).distances[0] == pytest.approx(0.0, abs=1e-6)
    assert shell.health.curvature is report
    assert shell.health.problems == report.problems
    assert "14 curved elements bend by more than 8 times" in report.problems[0]
    assert "verdict      ok, with 1 thing to look at" in str(shell.health)
    # Another size: the same shares.
    larger = shell.transformed(scale=3.0)
    assert larger.health.curvature is None
    again = larger.curvature_report()
    assert again.largest == pytest.approx(3 * report.largest)
    assert (again.large, again.of_size) == (14, pytest.approx(report.of_size))
    assert pickle.loads(pickle.dumps(shell)).curvature_report() == report


@pytest.mark.parametrize("noise", [0.05, 0.2])
def test_noisy_normals_on_a_fine_mesh_are_things_to_look_at(noise):
    points, triangles = meshes.icosphere(4)
    normals = points + noise * np.random.default_rng(0).normal(size=points.shape)
    shell = sp.Shell(points, triangles, normals / np.linalg.norm(normals, axis=1, keepdims=True))
    report = shell.curvature_report()
    assert "of the given normals are not used" in report.problems[0]
    assert np.linalg.norm(points - report.set_aside_at, axis=1).min() < 1e-12
    assert f"{report.normals_set_aside} given normals" in str(shell.health)


ROUND = {
    "icosahedron": lambda: sp.Shell(
        *meshes.icosphere(0), meshes.icosphere(0)[0], crease_angle=np.deg2rad(60.0)
    ),
    "ball": lambda: ball(20),
    "cone": lambda: sp.Shell.from_geometry(coal.Cone(0.1, 0.3)),
    "cylinder": lambda: sp.Shell.from_geometry(coal.Cylinder(0.1, 0.3)),
    "capsule": lambda: sp.Shell.from_geometry(coal.Capsule(0.1, 0.3), segments=40),
    "long capsule": lambda: sp.Shell.from_geometry(coal.Capsule(0.01, 3.0), segments=24),
    "given normals": lambda: sp.Shell(*meshes.icosphere(3), meshes.icosphere(3)[0]),
    "estimated normals": lambda: sp.Shell(*meshes.icosphere(3)),
}


@pytest.mark.parametrize("name", ROUND)
def test_round_surfaces_are_nothing_to_look_at(name):
    report = ROUND[name]().curvature_report()
    assert report.curved > 0
    assert not report.problems


def test_averaged_normals_on_a_box_are_not_taken_in_silence():
    """Such normals push the walls out by most of the box's width: flat, or something to look at."""
    vertices = (CUBE - 0.5) * [0.1, 0.1, 0.4]
    shell = sp.Shell(vertices, CUBE_QUADS, np.sign(CUBE - 0.5) / 3**0.5)
    report = shell.curvature_report()
    assert report.largest < 1e-3 or report.large == 6
    assert report.problems


def test_explain_shows_the_report():
    model = models.ball(joint=pin.JointModelTranslation())
    for method, shown in (("smooth", True), ("facets", False)):
        scene = sp.Scene(model)
        law = sp.ImpactLaw(1e6, 1.5, 0.0, 1e-3)
        scene.add_contact(sp.Sphere(0.1, frame="ball"), tilted_plate(), law=law, method=method)
        found = scene.explain(np.array([0.0, 0.0, 1.2]), np.zeros(3))
        text = str(found)
        assert ("off the flat ones by up to" in text) == shown
        assert any("14 curved elements bend" in one for one in found.warnings) == shown


def test_needles_along_a_bend_are_nothing_to_look_at():
    """Their bulge is larger than their height, but they turn by little."""
    turn = np.linspace(0, np.pi / 8, 2)
    out = np.c_[np.cos(turn), np.sin(turn), 0 * turn]
    vertices, quads = meshes.ribbon([out + [0, 0, k * 1e-4] for k in range(4)])
    report = sp.Shell(vertices, quads, vertices * [1, 1, 0]).curvature_report()
    assert report.of_height > 1.0
    assert not report.problems
