"""How near the elements of CAD files are to the exact surfaces, judged by OpenCASCADE itself."""

import pickle
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

pytest.importorskip("OCP")

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

from sphshell_pin import Shell
from sphshell_pin.base.arrays import Array
from sphshell_pin.shell.cad import require_kernel, tessellation
from sphshell_pin.shell.cad.face_surface import FaceSurface
from sphshell_pin.shell.curvature import curved_mesh
from tests.oracle.cad import ExactShape, curved_places, deviation
from tests.parts.occ import faces as occ_faces
from tests.shell import cad_shapes as shapes
from tests.shell.surfaces import surface_file

REAL_FILES = (
    *("gmsh_mesh_T106_V3.step", "gmsh_capot.brep", "gmsh_sphere_Rhino3D_default.igs"),
    *("dealii_DTMB-5415_bulbous_bow.iges", "bladex_upper.iges", "occt_hammer.iges"),
    *("occt_screw.step", "trimesh_featuretype.STEP"),
)


@dataclass(frozen=True)
class Known:
    """A surface of which `normals(rng, n)` gives n points [m] and outer unit normals.

    A ball of `radius` [m] on its outer side touches it at one place alone; `make` gives its shape,
    `chord` is a chord error [m] from which on triangles shrink in all directions alike, with every
    `step` by which it is divided.
    """

    make: Callable[[], Any]
    radius: float
    normals: Callable[[np.random.Generator, int], tuple[Array, Array]]
    chord: float = 1e-4
    step: float = 4.0


def _on_ball(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return shapes.BALL * 1e-3 * normal, normal


def _on_ring(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    # The outer half: inside, a ball would touch twice.
    along, round_ = rng.uniform(0, 2 * np.pi, count), rng.uniform(-1.2, 1.2, count)
    out = np.stack([np.cos(along), np.sin(along), np.zeros(count)], axis=1)
    normal = np.cos(round_)[:, None] * out
    normal[:, 2] = np.sin(round_)
    return 1e-3 * (shapes.RING * out + shapes.TUBE * normal), normal


def _on_cylinder(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    angle = rng.uniform(0, 2 * np.pi, count)
    normal = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    point = 5e-3 * normal
    point[:, 2] = rng.uniform(5e-3, 15e-3, count)
    return point, normal


KNOWN = {
    "ball": Known(shapes.ball, 4e-3, _on_ball),
    "ball as splines": Known(lambda: shapes.nurbs(shapes.ball()), 4e-3, _on_ball, 2e-4),
    "ring": Known(shapes.ring, 1e-3, _on_ring, 4e-5, 3.0),
    "cylinder": Known(shapes.cylinder, 2e-3, _on_cylinder, 1e-4, 8.0),
}


def force_errors(shell: Shell, known: Known, count: int = 200) -> Array:
    """Relative errors (n,) of the force k depth^1.5 on n balls.

    They stand so deep in the exact surface that the depth is a tenth of their radius.
    """
    point, normal = known.normals(np.random.default_rng(7), count)
    depth = 0.1 * known.radius
    errors = []
    for center, way in zip(point + (known.radius - depth) * normal, normal, strict=True):
        contacts = shell.contacts(center, known.radius)
        force = (contacts.depth[:, None] ** 1.5 * contacts.normal).sum(axis=0)
        errors.append(np.linalg.norm(force - depth**1.5 * way) / depth**1.5)
    return np.array(errors)


def stated_and_measured(shell: Shell) -> tuple[float, float, bool]:
    """Chord errors [m] that the reader says were asked for and found, and whether it held."""
    (note,) = [note for note in shell.health.notes if note.startswith("chord error")]
    stated, measured = re.findall(r"([\d.e+-]+) m (?:stated|measured)", note)
    return float(stated), float(measured), note.endswith("held")


@pytest.mark.parametrize("make", ["ball", "cone", "ring", "rounded_box", "drilled_plate", "roof"])
def test_elements_are_as_near_as_stated(make, tmp_path):
    shape = getattr(shapes, make)()
    path = shapes.write_brep(tmp_path / "part.brep", shape)
    exact = ExactShape(shape)
    for chord_error in (2e-4, 3e-5):
        shell = Shell.from_file(path, "mm", chord_error=chord_error)
        stated, measured, held = stated_and_measured(shell)
        assert stated == chord_error
        assert held
        found = deviation(shell, exact, 50)
        assert found.flat.max() <= chord_error
        assert found.back.max() <= chord_error
        # What the reader says it measured is what is there, and exact normals bring more.
        assert found.flat.max() <= 1.05 * measured + 1e-12
        assert found.smooth.max() <= max(0.2 * chord_error, 1e-9)


@cache
def real(name):
    """A real file as a shell, and its exact faces."""
    require_kernel("this test")
    from sphshell_pin.shell.cad.reading import read_model

    path = surface_file(name)
    unit = "mm" if path.suffix == ".brep" else None  # others state theirs
    return Shell.from_file(path, unit), ExactShape(read_model(path).shape)


def test_distances_from_a_surface_of_skew_parameters_are_found_in_few_steps():
    """A flat patch whose lines meet at 10 degrees: Newton's step to its plane is exact."""
    lean = np.radians(10.0)
    along, across = np.array([20.0, 0, 0]), 20.0 * np.array([np.cos(lean), np.sin(lean), 0.0])
    surface = FaceSurface(shapes.patch([[0 * along, along], [across, along + across]]))
    rng = np.random.default_rng(0)
    at = rng.uniform(0.2, 0.8, (50, 2))
    points = at @ [across, along] + [0.0, 0.0, 0.3]
    beside = at + rng.uniform(-0.2, 0.2, at.shape)
    assert surface.distances(points, beside, 1e-9) == pytest.approx(0.3, abs=1e-9)


@pytest.mark.parametrize("name", REAL_FILES)
def test_elements_of_real_files_are_as_near_as_they_say(name):
    shell, exact = real(name)
    stated, measured, held = stated_and_measured(shell)
    assert held == (measured <= stated)
    found = deviation(shell, exact, 20)
    assert max(found.flat.max(), found.back.max()) <= 1.05 * measured
    for where, points in curved_places(shell, 40).items():
        if len(points):  # the sphere has no border
            assert exact.distances(points).max() <= stated, where


@pytest.mark.parametrize("turns", [(0.9, 0.9, 0.9, 0.9), (0.9, -0.9, 0.9), (0.9,), (0.5, 0.7)])
@pytest.mark.parametrize("scale", [1.0, 2.5])
def test_long_elements_beside_nearly_tangent_joints(turns, scale, tmp_path):
    """Joints of less than a degree are taken as tangent: the normals there are mean ones.

    A long side that ends there would be bent off its plane, which the straight one is on.
    """
    shape = shapes.bent_bar(turns)
    path = shapes.write_brep(tmp_path / "bar.brep", shape)
    stated = 1e-5
    shell = Shell.from_file(path, "mm", scale, chord_error=stated)
    exact = ExactShape(shape, 1e-3 * scale)
    for where, points in curved_places(shell, 60).items():
        assert exact.distances(points).max() <= stated * scale, where
    (note,) = [note for note in shell.health.notes if note.startswith("curved elements")]
    assert "held" in note.replace("not held", "")
    report = shell.curvature_report()
    assert sum(count for _, count in report.flat_because) == report.flat > 0
    # What was kept straight stays so in a copy.
    again = pickle.loads(pickle.dumps(shell)).transformed(scale=2.0)
    offsets, twice = (one.core_for("smooth").control_point_offsets for one in (shell, again))
    assert twice == pytest.approx(2 * offsets)


def test_curved_elements_do_not_overshoot_at_narrow_bends():
    """This blade has bends of 12 degrees within a millimeter.

    A flat element may end in one and be near all along; curved to the normal there it is not.
    """
    shell, exact = real("bladex_upper.iges")
    corners = shell.vertices[shell.triangles]
    places = curved_mesh(shell, 2)[0].reshape(len(corners), -1, 3)
    off = places - corners[:, :1]
    bulge = np.abs(np.einsum("tkx,tx->tk", off, shell.triangle_normals)).max(axis=1)
    largest = places[np.argsort(-bulge)[:40]].reshape(-1, 3)
    assert exact.distances(largest).max() <= 0.5 * stated_and_measured(shell)[0]


@pytest.mark.parametrize("name", KNOWN)
def test_smooth_forces_are_or_converge_to_those_on_the_exact_surface(name, tmp_path):
    known = KNOWN[name]
    path = shapes.write_brep(tmp_path / "part.brep", known.make())
    found, chords = [], []
    for chord_error in (known.chord, known.chord / known.step):
        shell = Shell.from_file(path, "mm", chord_error=chord_error)
        found.append(force_errors(shell, known))
        chords.append(stated_and_measured(shell)[1])
    if all(face.exact for face in shell.faces) and shell.faces:
        assert np.max(found) < 1e-11
        return
    coarse, fine = (np.sqrt(np.mean(one**2)) for one in found)
    # In the length of the elements, whose square the chord error is.
    assert 2.0 * np.log(coarse / fine) / np.log(chords[0] / chords[1]) >= 2.9
    assert found[1].max() < 4e-4


@pytest.fixture
def laid(monkeypatch):
    """The deflections that OpenCASCADE was asked for."""
    lay, asked = tessellation._lay, []
    monkeypatch.setattr(tessellation, "_lay", lambda *of: (asked.append(of[1]), lay(*of)))
    return asked


def test_a_face_that_gets_no_triangles_is_meshed_more_finely(laid, monkeypatch):
    """OpenCASCADE finds none for some faces of real files until its deflection is smaller."""
    found, count = tuple(occ_faces(shapes.drilled_plate())), tessellation.count_laid
    missed = lambda face: face is found[0] and laid[-1] > 1e-2  # noqa: E731
    monkeypatch.setattr(tessellation, "count_laid", lambda face: 0 if missed(face) else count(face))
    made = tessellation.tessellate(found, 50.0, 5e-2, 1e-3)
    assert None not in made.meshes
    assert laid[-1] < 1e-2
    assert made.error <= 5e-2


def test_a_mesh_that_is_too_far_off_is_made_again_as_much_finer(laid, monkeypatch):
    """Errors may be a multiple of OpenCASCADE's deflection: here 3 times as large."""
    asked, measure = 5e-2, tessellation._measure
    far = lambda *of: replace(measure(*of), interior=3.0 * laid[-1], border=0.0)  # noqa: E731
    monkeypatch.setattr(tessellation, "_measure", far)
    made = tessellation.tessellate(tuple(occ_faces(shapes.rounded_box())), 50.0, asked, 1e-3)
    assert 0.7 * asked <= made.error <= asked
    assert len(laid) == 2


def turned(shape):
    """The shape turned and mirrored."""
    turn, mirror = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(1.0, 2.0, 3.0), gp_Dir(1.0, 2.0, -1.0)), 0.7)
    mirror.SetMirror(gp_Ax2(gp_Pnt(), gp_Dir(0.0, 1.0, 1.0)))
    return BRepBuilderAPI_Transform(shape, turn * mirror).Shape()


@pytest.mark.parametrize("make", ["box", "cylinder", "roof", "bent_bar", "cone", "ring", "ball"])
@pytest.mark.parametrize("change", [turned, shapes.nurbs])
def test_places_on_surfaces_are_those_of_opencascade(make, change):
    """Points and derivatives: simple ones by closed forms, turned and mirrored, and splines."""
    shape = shapes.bent_bar((0.9, 0.9)) if make == "bent_bar" else getattr(shapes, make)()
    for face in occ_faces(change(shape)):
        surface, exact = FaceSurface(face), BRepAdaptor_Surface(face)
        assert surface.has_closed_form == (change is turned and make != "roof")
        shares = np.vstack([np.random.default_rng(0).uniform(0, 1, (20, 2)), [[0, 0], [1, 1]]])
        places = surface.low + shares * (surface.high - surface.low)
        known = gp_Pnt(), gp_Vec(), gp_Vec()
        for place, *found in zip(places, *surface.derivatives(places), strict=True):
            exact.D1(*place.tolist(), *known)
            coordinates = np.array([one.Coord() for one in known])
            assert np.array(found) == pytest.approx(coordinates, rel=1e-11, abs=1e-11)
