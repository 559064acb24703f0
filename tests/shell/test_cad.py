"""CAD files: what is read, what it is called, in which unit, and what is refused."""

import re
import sys

import numpy as np
import pytest

pytest.importorskip("OCP")

from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
from OCP.gp import gp_Pnt

from sphshell_pin import Shell, errors
from sphshell_pin.shell.cad.model import compound, faces_of
from tests.parts import occ
from tests.parts.occ import area_and_volume
from tests.programs import python
from tests.shell import cad_shapes as shapes
from tests.shell.surfaces import expect
from tests.tables import cases_of


def load(tmp_path, shape, **options):
    return Shell.from_file(shapes.write_brep(tmp_path / "part.brep", shape), "mm", **options)


@pytest.mark.parametrize(
    "make", ["box", "ball", "cylinder", "cone", "ring", "rounded_box", "drilled_plate"]
)
def test_solids_come_closed_with_their_area_and_volume(make, tmp_path):
    shape = getattr(shapes, make)()
    health = load(tmp_path, shape, chord_error=4e-5).health
    area, volume = area_and_volume(shape)
    assert health.is_closed
    assert health.problems == ()
    assert health.area == pytest.approx(area * 1e-6, rel=5e-3)
    # The solid is off by less than a layer as thick as the chord error.
    assert abs(health.volume - volume * 1e-9) < 4e-5 * health.area
    expect(health, "chord error 4e-05 m stated", ": held")


def unit(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)


OUT = np.array([1.0, 1.0, 0.0])
NORMALS = {
    "ball": unit,
    "cone": lambda p: unit(unit(p * OUT) * 10.0 + [0, 0, 6.0]),
    "ring": lambda p: unit(p - shapes.RING * 1e-3 * unit(p * OUT)),
    "cylinder": lambda p: unit(p * OUT),
    # Of what lies 2 mm below the surface: a box again.
    "rounded_box": lambda p: unit(p - np.clip(p, 2e-3, np.array([18e-3, 28e-3, 8e-3]))),
}


@pytest.mark.parametrize("make", NORMALS)
def test_normals_are_those_of_the_exact_surface(make, tmp_path):
    """Also at poles, where the surface has none, and at the tip of the cone."""
    shell = load(tmp_path, getattr(shapes, make)())
    points = shell.vertices[shell.triangles]
    exact = NORMALS[make](points)
    chosen = np.full(points.shape[:2], True)
    if make in ("cone", "cylinder"):
        chosen[np.abs(shell.triangle_normals[:, 2]) > 0.9] = False
    if make == "cone":
        tip = np.linalg.norm(points - [0, 0, 0.01], axis=2) < 1e-9
        middle = NORMALS[make](np.repeat(points.mean(axis=1, keepdims=True), 3, axis=1))
        # At the tip the limit depends on the direction: roughly the middle of the triangle.
        assert np.einsum("tx,tx->t", shell.normals[tip], middle[tip]).min() > 0.99
        chosen &= ~tip
    assert np.abs(shell.normals[chosen] - exact[chosen]).max() < 1e-6


def test_faces_are_known_by_element(box):
    shell = Shell.from_file(box, "mm")
    assert shell.face_names == tuple(f"Face {k}" for k in range(1, 7))
    # One plane each: elements of a face share a normal, faces do not.
    normals = shell.triangle_normals[np.searchsorted(shell.triangle_element, np.arange(12))]
    for face in range(6):
        own = normals[shell.element_face == face]
        assert len(own) == 2
        assert np.allclose(own, own[0])
    assert Shell([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).element_face is None


@pytest.mark.parametrize("crease_angle", [np.deg2rad(30), np.deg2rad(5)])
def test_tangent_faces_are_one_patch_and_sharp_ones_are_not(crease_angle, tmp_path):
    """Whatever the crease angle: CAD knows better."""
    assert load(tmp_path, shapes.rounded_box(), crease_angle=crease_angle).num_patches == 1
    assert load(tmp_path, shapes.cylinder(), crease_angle=crease_angle).num_patches == 3


def test_a_kink_inside_a_face_divides_it(tmp_path):
    shell = load(tmp_path, shapes.roof())
    assert (shell.face_names, shell.num_patches) == (("Face 1", "Face 1"), 2)
    ridge = np.isclose(shell.vertices[:, 0], 0.010)
    assert ridge.sum() >= 2
    assert np.allclose(shell.vertices[ridge, 2], 0.003)


@pytest.fixture
def two(tmp_path):
    bodies = ("plate", shapes.box()), ("pin", shapes.cylinder())
    return shapes.write_step(tmp_path / "two.step", *bodies, faces=[(0, "barrel")])


def test_bodies_and_faces_can_be_chosen_by_name(two):
    assert Shell.from_file(two).health.components == 2
    pin = Shell.from_file(two, bodies=["pin"])
    assert np.allclose(pin.box, [[0.095, -0.005, 0], [0.105, 0.005, 0.02]], atol=1e-4)
    assert pin.is_closed
    barrel = Shell.from_file(two, faces=["barrel"])
    area = pytest.approx(2 * np.pi * 0.005 * 0.02, rel=1e-2)
    assert (barrel.is_closed, barrel.health.area) == (False, area)
    assert Shell.from_file(two, faces=[7]).health.area == barrel.health.area
    assert set(barrel.face_names) == {"barrel"}


@pytest.mark.parametrize(("options", "kind", "told"), cases_of("shell_files")["options"])
def test_options_that_cannot_be_are_refused(options, kind, told, two):
    with pytest.raises(getattr(errors, kind), match=told):
        Shell.from_file(two, **options)


def test_faces_written_one_by_one_are_joined(tmp_path):
    path = shapes.write_iges(tmp_path / "loose.iges", shapes.rounded_box())
    expect(Shell.from_file(path).health, "joined within", is_closed=True)
    assert "joined within" not in " ".join(Shell.from_file(path, sew=0).health.notes)


@pytest.mark.parametrize(("solids", "entity"), [(0, 144), (1, 510)])
def test_a_face_that_lost_its_surface_is_told_and_the_others_stay(solids, entity, tmp_path):
    """OpenCASCADE makes an endless face of it, which is not to decide on the size of the part."""
    path = shapes.write_iges(tmp_path / "box.iges", shapes.rounded_box(), solids=solids)
    text, whole = path.read_text(), Shell.from_file(path)
    surface = re.compile(rf"(?<=^{entity},)\d+", re.M)
    path.write_text(surface.sub(lambda number: "0" * len(number[0]), text, count=1))
    rest, faces = Shell.from_file(path), len(surface.findall(text))
    assert (rest.health.missing_faces, rest.health.ok) == (1, False)
    assert "1 face of the file missing" in rest.health.problems[0]
    assert rest.size == pytest.approx(whole.size)
    assert 0.8 < len(rest.triangles) / len(whole.triangles) < 1
    if not solids:
        path.write_text(surface.sub(lambda number: "0" * len(number[0]), text))
        with pytest.raises(errors.ShellFileError, match=f"none of its {faces} faces can be read"):
            Shell.from_file(path)


@pytest.mark.parametrize("size", [1.0, 100.0])
def test_faces_are_joined_over_gaps_of_a_share_of_their_size(size, tmp_path):
    """Two halves of a plate [mm], 4.5e-5 of its diagonal apart."""
    half = faces_of(shapes.box(size, size, size))[0]
    apart = compound([half, occ.moved(half, (0.0, (1 + 1e-4) * size, 0.0))])
    path = shapes.write_brep(tmp_path / "halves.brep", apart)
    for sew, edges in ((None, 6), (0.0, 8)):
        assert Shell.from_file(path, unit="mm", sew=sew).health.boundary_edges == edges


WRITERS = {
    ".step": lambda path, shape: shapes.write_step(path, ("one", shape)),
    ".iges": shapes.write_iges,
    ".brep": shapes.write_brep,
}


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_wire_holds_no_surface(suffix, tmp_path):
    edge = BRepBuilderAPI_MakeEdge(gp_Pnt(0, 0, 0), gp_Pnt(1, 0, 0)).Edge()
    with pytest.raises(errors.ShellFileError, match="holds no surface"):
        Shell.from_file(WRITERS[suffix](tmp_path / f"wire{suffix}", edge), "mm")


@pytest.mark.parametrize("suffix", WRITERS)
def test_damaged_files_are_told_in_a_sentence(suffix, tmp_path, capfd):
    path = tmp_path / f"part{suffix}"
    whole = WRITERS[suffix](path, shapes.box()).read_bytes()
    capfd.readouterr()
    for data, message in (
        (b"", "is empty"),
        (b"this is no CAD file\n", "does not begin as one"),
        (whole[: len(whole) // 2], "is truncated"),
        (bytes(range(256)) * 20, "does not begin as one"),
    ):
        path.write_bytes(data)
        with pytest.raises(errors.ShellFileError, match=message):
            Shell.from_file(path, "mm")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(("library", "kind", "told"), cases_of("shell_files")["libraries"])
def test_a_library_that_is_absent_is_named(library, kind, told, box, monkeypatch):
    """Processes started from now on find a package of this text in place of OpenCASCADE."""
    package = box.parent / "first" / "OCP"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(library)
    monkeypatch.setattr(sys, "path", [str(package.parent), *sys.path])
    with pytest.raises(getattr(errors, kind), match=told) as caught:
        Shell.from_file(box, "mm")
    assert getattr(caught.value, "reason", "") in library


@pytest.mark.parametrize(("make", "chord_error"), [("ball", 1e-12), ("rounded_box", 1e-9)])
def test_what_would_take_millions_of_triangles_is_refused(make, chord_error, tmp_path):
    """The faces of the box are nearly all flat: a coarse mesh does not grow, the fine one would."""
    told = f"chord_error = {chord_error:g} would take about .* \\[m\\]"
    with pytest.raises(errors.InvalidParameter, match=told):
        load(tmp_path, getattr(shapes, make)(), chord_error=chord_error)


def test_the_library_is_never_imported(box):
    """So does reading a CAD file: another process imports it."""
    code = f"""
import sys, sphshell_pin
print(len(sphshell_pin.Shell.from_file({str(box)!r}, "mm").face_names))
print(any(m.split(".")[0] == "OCP" for m in sys.modules))
"""
    done = python(code, check=True)
    assert (done.stdout.split(), done.stderr) == (["6", "False"], "")


def test_a_scenario_takes_a_body_of_a_cad_file_without_a_unit(two):
    from sphshell_pin.scenario import build
    from tests.scenario.files import DROP, write

    file = 'file = "two.step"\nchord_error = 1e-5\nbodies = ["pin"]'
    text = DROP.replace('primitive = { type = "box", size = [0.2, 0.2, 0.02] }', file)
    (pair,) = build(write(two.parent, text)).scene.pairs
    assert pair.side_j.shell.box[0, 0] == pytest.approx(0.095, abs=1e-5)
    assert pair.side_j.shell.is_closed
    with pytest.raises(Exception, match="no body 'nut'"):
        build(write(two.parent, text.replace('"pin"', '"nut"')))


@pytest.fixture
def box(tmp_path):
    return shapes.write_brep(tmp_path / "box.brep", shapes.box())
