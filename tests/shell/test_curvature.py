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


def icosahedron():
    """A sphere of 20 triangles, with its own normals."""
    corners, triangles = meshes.icosphere(0)
    return sp.Shell(corners, triangles, corners, crease_angle=np.deg2rad(60.0))


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
    creased = sp.Shell(CUBE, CUBE_QUADS).curvature_report()
    assert (creased.curved, creased.largest) == (0, 0.0)
    exact = ball(6).curvature_report()
    flat = sp.Shell.from_geometry(coal.Sphere(2.0), segments=12, crease_angle=0.0)
    assert exact.largest > 0.0
    assert flat.curvature_report().largest == 0.0


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
    shell.curvature_report()
    assert "of the given normals are not used" in shell.health.problems[0]


ROUND = {
    "icosahedron": icosahedron,
    "ball": lambda: ball(20),
    "cone": lambda: sp.Shell.from_geometry(coal.Cone(0.1, 0.3)),
    "cylinder": lambda: sp.Shell.from_geometry(coal.Cylinder(0.1, 0.3)),
    "capsule": lambda: sp.Shell.from_geometry(coal.Capsule(0.1, 0.3), segments=40),
    "long capsule": lambda: sp.Shell.from_geometry(coal.Capsule(0.01, 3.0), segments=24),
    **{
        f"{kind} icosphere": lambda given=given: sp.Shell(
            *meshes.icosphere(3), meshes.icosphere(3)[0] if given else None
        )
        for kind, given in (("given", True), ("estimated", False))
    },
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


class Core:
    """A compiled surface with codes of its own about how it bends."""

    def __init__(self, core, **codes):
        self._core = core
        self.__dict__.update(codes)

    def __getattr__(self, name):
        return getattr(self._core, name)


def test_reasons_and_normals_set_aside_are_counted_by_element():
    points, quads = plate(3)
    shell = sp.Shell(points, quads, np.tile([0.0, 0.0, 1.0], (len(points), 1)))
    shell._smooth = Core(
        shell.core_for("smooth"),
        # Two triangles to an element: one that is curved makes it curved.
        bending=np.array([1, 1, 2, 2, 2, 2, 0, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1], np.uint8),
        normals_set_aside=np.isin(np.arange(54), (40, 41)).reshape(18, 3),
    )
    report = shell.curvature_report()
    assert (report.elements, report.curved, report.flat) == (9, 1, 8)
    whys, counts = zip(*report.flat_because, strict=True)
    assert counts == (6, 2)
    assert "turns" in whys[0]
    assert "straightened" in whys[1]
    assert report.normals_set_aside == 2
    corner = shell.vertices[shell.triangles.ravel()[40]]
    assert report.set_aside_at == tuple(corner)
    text = str(shell.health)
    assert "2 elements: straightened" in text
    assert "2 given normals" in text


def test_needles_along_a_bend_are_nothing_to_look_at():
    """Their bulge is larger than their height, but they turn by little."""
    angle = np.linspace(0, np.pi / 8, 2)
    z = np.arange(4) * 1e-4
    vertices = np.array([[np.cos(a), np.sin(a), h] for a in angle for h in z])
    quads = [[k, 4 + k, 5 + k, 1 + k] for k in range(3)]
    normals = vertices * [1, 1, 0]
    report = sp.Shell(vertices, quads, normals).curvature_report()
    assert report.of_height > 1.0
    assert not report.problems
