"""Faces recognized in meshes, as `Shell.faces` lists them."""

import pickle
import sysconfig
import time
from dataclasses import replace
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin
import pytest

import sphshell_pin as sp
from sphshell_pin.shell.faces import described, distances_from, not_exact
from tests import meshes
from tests.validation.rattleback import ellipsoid

SEGMENTS = 48


def mesh(geometry, segments=SEGMENTS, **options):
    """Return the elements of a solid without its normals."""
    shell = sp.Shell.from_geometry(geometry, segments=segments)
    return sp.Shell(shell.vertices, shell.elements, **options)


def distances(face, points):
    """Distances (n,) of points from the surface of a face."""
    away = points - face.point
    if face.kind == "sphere":
        return np.linalg.norm(away, axis=1) - face.radius
    along = away @ face.axis
    if face.kind == "plane":
        return along
    across = np.linalg.norm(away - along[:, None] * face.axis, axis=1) - face.radius
    if face.kind == "torus":
        return np.hypot(across, along) - face.minor_radius
    angle = 0.0 if face.half_angle is None else face.half_angle
    return across * np.cos(angle) - along * np.sin(angle)


def torus(radius=0.3, tube=0.1, around=48, across=24):
    angle = 2 * np.pi * np.arange(across) / across
    profile = np.stack([radius + tube * np.cos(angle), tube * np.sin(angle)], axis=1)
    return sp.Shell(*meshes.revolved([*profile, profile[0]], around))


CASES = {
    "cylinder": (lambda: mesh(coal.Cylinder(0.1, 0.3)), ["cylinder", "plane", "plane"]),
    "cone": (lambda: mesh(coal.Cone(0.1, 0.3)), ["cone", "plane"]),
    "sphere": (lambda: mesh(coal.Sphere(0.1)), ["sphere"]),
    "torus": (torus, ["torus"]),
    "box": (lambda: mesh(coal.Box(0.1, 0.2, 0.3)), ["plane"] * 6),
}


def points_on(face, shell):
    """Corners (n, 3) of the elements of a face."""
    corners = shell.elements[face.elements]
    return shell.vertices[corners[corners >= 0]]


@pytest.mark.parametrize("name", CASES)
def test_elements_lie_on_their_faces(name):
    make, kinds = CASES[name]
    shell = make()
    turn = pin.exp3(np.array([0.4, 0.8, -0.3]))
    shell = sp.Shell(shell.vertices @ turn.T + [0.3, -0.2, 0.5], shell.elements)
    assert sorted(face.kind for face in shell.faces) == kinds
    every = np.concatenate([face.elements for face in shell.faces])
    assert len(np.unique(every)) == len(shell.elements)
    for face in shell.faces:
        assert np.abs(distances(face, points_on(face, shell))).max() < 1e-6 * shell.size
        assert face.axis is None or np.linalg.norm(face.axis) == pytest.approx(1.0)
        given = (face.axis, face.radius, face.minor_radius, face.half_angle)
        wanted = {"plane": "1000", "cylinder": "1100", "cone": "1101"}
        wanted |= {"sphere": "0100", "torus": "1110"}
        assert "".join(str(int(one is not None)) for one in given) == wanted[face.kind]
        assert not face.elements.flags.writeable


def test_recognition_can_be_switched_off(tmp_path):
    on, off = (mesh(coal.Cylinder(0.1, 0.3), faces=faces) for faces in (True, False))
    assert len(on.faces) == 3
    assert not off.faces
    off.to_file(tmp_path / "part.stl", "mm")
    for kept in (
        pickle.loads(pickle.dumps(off)),
        off.transformed(scale=2.0),
        sp.Shell.from_file(tmp_path / "part.stl", "mm", faces=False),
    ):
        assert not kept.faces
        assert not kept.finds_faces
    for faces in (True, None):
        shell = sp.Shell.from_file(tmp_path / "part.stl", "mm", faces=faces)
        assert len(shell.faces) == 3
    assert not mesh(coal.Cylinder(0.1, 0.3), crease_angle=0.0).faces


@pytest.mark.parametrize("axes", [(0.2, 0.03, 0.02), (0.05, 0.05, 0.02)])
@pytest.mark.parametrize("cells", [12, 35])
def test_zones_of_an_ellipsoid_are_no_faces(cells, axes):
    """Elements are long where it is flat: a row of them is nearly a cylinder."""
    vertices, elements, normals = ellipsoid(cells, axes)
    assert not sp.Shell(vertices, elements).faces
    assert not sp.Shell(vertices, elements, normals=normals).faces


SOLIDS = {
    "box": (coal.Box(0.1, 0.2, 0.3), ""),
    "ball": (coal.Sphere(0.1), "ball"),
    "cylinder": (coal.Cylinder(0.1, 0.3), "side bottom top"),
    "cone": (coal.Cone(0.1, 0.3), "side bottom"),
    "capsule": (coal.Capsule(0.1, 0.3), "bottom side top"),
    "no rod": (coal.Capsule(0.1, 0.0), "ball"),
    "round ellipsoid": (coal.Ellipsoid(0.1, 0.1, 0.1), "ball"),
    "ellipsoid": (coal.Ellipsoid(0.1, 0.2, 0.3), ""),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_tell_their_faces(name):
    solid, names = SOLIDS[name]
    shell = sp.Shell.from_geometry(solid)
    told = [face for face in shell.faces if face.name]
    assert " ".join(face.name for face in told) == names
    for face in told:
        assert face.exact
        assert distances(face, points_on(face, shell)) == pytest.approx(0.0, abs=1e-15)


def test_words():
    shell = mesh(coal.Cylinder(0.006, 0.03))
    count = len(shell.elements)
    assert described(shell.faces, count) == "2 planes, 1 cylinder of radius 6 mm"
    assert described((), count) == "none recognized; 100 % of the elements on none"
    assert described(torus().faces, len(torus().elements)) == "1 torus of radius 300 and 100 mm"
    assert "2 tori of radius 300 and 100 mm" in described(torus().faces * 2, 9)
    assert "faces" not in repr(mesh(coal.Cylinder(0.006, 0.03)))
    assert "3 faces" in " ".join(repr(shell).split())
    many = [face for k in range(7) for face in mesh(coal.Cylinder(0.006 + 1e-3 * k, 0.03)).faces]
    text = described(many, 8 * count)
    assert "14 planes" in text
    assert text.endswith(", and 3 more; 12.5 % of the elements on none")


def test_faces_that_are_not_exact_are_all_named_with_what_they_cost():
    count, base = 9, coal.Cylinder(0.006, 0.03)
    reasons, faces = ["a vertex is off it by 77 nm", "its border is off it by 0.8 nm"], []
    for k, face in enumerate(face for face in mesh(base).faces for _ in range(3)):
        more = {"reason": reasons[k % 2], "name": f"Face {k}"}
        faces.append(replace(face, curved=face.elements, **more))
    told = not_exact(faces, np.full(count, 0.1), 1e-9 * np.arange(count))
    assert len(told) == 2
    assert told[0].startswith("vertex off by 77 to 77 nm: 50 % of the area; elements stand off by")
    assert all(f"Face {k} (" in told[k % 2] for k in range(count))
    points = np.random.default_rng(0).normal(size=(9, 3))
    solids = (coal.Cylinder(0.1, 0.3), coal.Cone(0.1, 0.3), coal.Sphere(0.1))
    for face in (*torus().faces, *(face for one in solids for face in mesh(one).faces)):
        assert np.allclose(distances_from(face, points), np.abs(distances(face, points)))


def test_the_caps_of_a_fine_sphere_do_not_cost_its_square():
    """At its poles, where triangles are coplanar to rounding, growths over the ball are in vain."""

    def cost(finds: bool) -> float:
        shell = sp.Shell.from_geometry(coal.Sphere(0.1), segments=254)
        shell.finds_faces = finds
        start = time.process_time()
        shell.core_for("smooth")
        return time.process_time() - start

    assert cost(True) < 15 * cost(False)  # measured: 3; 80 without a bound


def test_the_closest_point_of_a_rim_from_far_away():
    """To a circle from up to six of its radii: there the distance bends far more than in a line."""
    shell, rng = mesh(coal.Cylinder(0.1, 0.3), segments=24), np.random.default_rng(0)
    turn, far = rng.uniform(0.0, 2 * np.pi, 200), rng.uniform(0.02, 0.6, 200)
    tilt = rng.uniform(0.2, 1.3, 200)
    around = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    rim = 0.1 * around + [0.0, 0.0, 0.15]
    away = np.cos(tilt)[:, None] * around + np.sin(tilt)[:, None] * [0.0, 0.0, 1.0]
    found = shell.closest_points(rim + far[:, None] * away, method="smooth")
    assert np.abs(found.points - rim).max() < 1e-14
    assert np.abs(np.abs(found.distances) - far).max() < 1e-14


@pytest.mark.parametrize(("step", "bends"), [(1e-6, 4), (4e-6, 0)])
def test_what_rounding_tilts_facets_by_is_no_bend(step: float, bends: int) -> None:
    """Strips of 0.77 mm at round corners lean by 3.75 degrees: 4 um tilt them by a tenth of it.

    Rounded to 3 um all vertices of a corner happen to lie within 0.9 um, as micrometers allow, of a
    cylinder 0.06 mm larger: that is 1.3 um off, where flat elements are 13 um off.
    """
    radius, angle = 5.885e-3, np.linspace(0, np.pi / 2, 13) + np.pi / 2 * np.arange(4)[:, None]
    out = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    middle = np.array([[14.115, 6.115], [-14.115, 6.115], [-14.115, -6.115], [14.115, -6.115]])
    outline = (1e-3 * middle[:, None] + radius * out).reshape(-1, 2)
    rails = [np.c_[outline, np.full(52, z)] for z in (0.0, 0.06)]
    hubs = [np.tile([0.0, 0.0, z], (52, 1)) for z in (0.0, 0.06)]
    points, elements = meshes.ribbon([hubs[0], *rails, hubs[1]], closed=True)
    shell = sp.Shell(np.round(points / step) * step, elements)
    assert [face.kind for face in shell.faces].count("cylinder") == bends


def test_two_triangles_of_a_coarse_bend_are_no_plane():
    """Strips that go on smoothly into others nothing is known of: who knows how they bend."""
    at = np.linspace(0.0, np.pi / 2, 3)
    x, z = np.transpose([(-0.2, 1.0), *np.c_[np.sin(at), np.cos(at)], (1.0, -0.2)])
    vertices, quads = meshes.ribbon([np.c_[x, 0 * x + y, z] for y in (1.5, 0.0)])
    assert not sp.Shell(vertices, quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)).faces


@pytest.mark.parametrize("taper", [0.0, 4.0, 4.2, 8.0])
def test_of_two_kinds_that_fit_the_simpler_one_is_taken(taper):
    """A tube of 6 m in whole millimeters: a taper of four of them is hardly more than rounding."""
    turn = pin.utils.rpyToMatrix(0.3, 0.5, 0.7)
    angles = 2 * np.pi * np.arange(32) / 32
    circle = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    heights = np.linspace(0, 20, 13)
    rails = [(6 + 1e-3 * taper * (z / 20 - 0.5)) * circle + [0, 0, z] for z in heights]
    points, cells = meshes.ribbon(rails, closed=True)
    (face,) = sp.Shell(np.round(points @ turn.T, 3), cells).faces
    assert face.kind == ("cone" if taper > 5 else "cylinder")


def test_a_face_does_not_give_way_to_one_that_shares_half_of_it():
    """A real head, whose flat sides end in bends: its many triangles in one plane are a plane."""
    prefix = Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots"
    path = prefix / "tiago_description/meshes/head/head_1.stl"
    if not path.exists():
        pytest.skip("the meshes of example-robot-data are not installed")
    shell = sp.Shell.from_file(path, "mm")
    corners = shell.vertices[shell.elements[:, :3]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    heights = np.sum(normals * corners[:, 0], axis=1) / shell.size
    places = np.round(np.column_stack([normals, heights]), 3) + 0.0
    _, group, counts = np.unique(places, axis=0, return_inverse=True, return_counts=True)
    wide = [set(np.flatnonzero(group.ravel() == k)) for k in np.flatnonzero(counts >= 8)]
    assert len(wide) == 4
    planes = [set(face.elements) for face in shell.faces if face.kind == "plane"]
    assert all(any(one <= plane for plane in planes) for one in wide)
