"""CAD files: what is read, what it is called, in which unit, and what is refused."""

import sys

import numpy as np
import pytest

pytest.importorskip("OCP")

from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
from OCP.gp import gp_Pnt

from sphshell_pin import Shell, errors
from tests.parts.occ import area_and_volume
from tests.programs import python
from tests.shell import cad_shapes as shapes


def load(tmp_path, shape, **options):
    return Shell.from_file(shapes.write_brep(tmp_path / "part.brep", shape), "mm", **options)


@pytest.mark.parametrize(
    "make", ["box", "ball", "cylinder", "cone", "ring", "rounded_box", "drilled_plate"]
)
def test_solids_come_closed_with_their_area_and_volume(make, tmp_path):
    shape = getattr(shapes, make)()
    shell = load(tmp_path, shape, chord_error=4e-5)
    area, volume = area_and_volume(shape)
    assert shell.is_closed
    assert shell.health.problems == ()
    assert shell.health.area == pytest.approx(area * 1e-6, rel=5e-3)
    # The solid is off by less than a layer as thick as the chord error.
    assert abs(shell.health.volume - volume * 1e-9) < 4e-5 * shell.health.area
    assert any("chord error 4e-05 m stated" in note for note in shell.health.notes)
    assert any(note.endswith(": held") for note in shell.health.notes)


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


def test_faces_are_known_by_element(tmp_path):
    shell = load(tmp_path, shapes.box())
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
    assert shell.face_names == ("Face 1", "Face 1")
    assert shell.num_patches == 2
    ridge = np.isclose(shell.vertices[:, 0], 0.010)
    assert ridge.sum() >= 2
    assert np.allclose(shell.vertices[ridge, 2], 0.003)


def test_bodies_and_faces_can_be_chosen_by_name(tmp_path):
    path = shapes.write_step(
        tmp_path / "two.step",
        ("plate", shapes.box()),
        ("pin", shapes.cylinder()),
        faces=[(0, "barrel")],
    )
    both = Shell.from_file(path)
    assert both.health.components == 2
    pin = Shell.from_file(path, bodies=["pin"])
    assert np.allclose(pin.box, [[0.095, -0.005, 0], [0.105, 0.005, 0.02]], atol=1e-4)
    assert pin.is_closed
    barrel = Shell.from_file(path, faces=["barrel"])
    assert not barrel.is_closed
    assert barrel.health.area == pytest.approx(2 * np.pi * 0.005 * 0.02, rel=1e-2)
    assert Shell.from_file(path, faces=[7]).health.area == barrel.health.area
    assert set(barrel.face_names) == {"barrel"}
    with pytest.raises(errors.NameNotFound, match=r"no body 'bolt'; two\.step has: plate, pin"):
        Shell.from_file(path, bodies=["bolt"])
    with pytest.raises(errors.NameNotFound, match="barrel, Face 8, Face 9"):
        Shell.from_file(path, bodies=["pin"], faces=["Face 1"])


def test_faces_written_one_by_one_are_joined(tmp_path):
    path = shapes.write_iges(tmp_path / "loose.iges", shapes.rounded_box())
    shell = Shell.from_file(path)
    assert shell.is_closed
    assert any("joined within" in note for note in shell.health.notes)
    loose = Shell.from_file(path, sew=0)
    assert not any("joined within" in note for note in loose.health.notes)


def test_brep_files_need_a_unit(tmp_path):
    path = shapes.write_brep(tmp_path / "box.brep", shapes.box())
    with pytest.raises(errors.UnitMissing, match=r"box.brep measures 37.42 units"):
        Shell.from_file(path)


def test_a_wire_holds_no_surface(tmp_path):
    edge = BRepBuilderAPI_MakeEdge(gp_Pnt(0, 0, 0), gp_Pnt(1, 0, 0)).Edge()
    files = [
        shapes.write_brep(tmp_path / "wire.brep", edge),
        shapes.write_iges(tmp_path / "wire.iges", edge),
        shapes.write_step(tmp_path / "wire.step", ("wire", edge)),
    ]
    for path in files:
        with pytest.raises(errors.ShellFileError, match="holds no surface"):
            Shell.from_file(path, "mm")


@pytest.mark.parametrize("suffix", [".step", ".iges", ".brep"])
def test_damaged_files_are_told_in_a_sentence(suffix, tmp_path, capfd):
    write = {
        ".step": lambda path: shapes.write_step(path, ("box", shapes.box())),
        ".iges": lambda path: shapes.write_iges(path, shapes.box()),
        ".brep": lambda path: shapes.write_brep(path, shapes.box()),
    }[suffix]
    whole = write(tmp_path / f"whole{suffix}").read_bytes()
    capfd.readouterr()
    broken = {
        "empty": (b"", "is empty"),
        "text": (b"this is no CAD file\n", "does not begin as one"),
        "half": (whole[: len(whole) // 2], "is truncated"),
        "noise": (bytes(range(256)) * 20, "does not begin as one"),
    }
    for name, (data, told) in broken.items():
        path = tmp_path / f"{name}{suffix}"
        path.write_bytes(data)
        with pytest.raises(errors.ShellFileError, match=told):
            Shell.from_file(path, "mm")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(("make", "chord_error"), [("ball", 1e-12), ("rounded_box", 1e-9)])
def test_what_would_take_millions_of_triangles_is_refused(make, chord_error, tmp_path):
    """The faces of the box are nearly all flat: a coarse mesh does not grow, the fine one would."""
    told = f"chord_error = {chord_error:g} would take about .* \\[m\\]"
    with pytest.raises(errors.InvalidParameter, match=told):
        load(tmp_path, getattr(shapes, make)(), chord_error=chord_error)


@pytest.mark.parametrize(
    "options", [{"chord_error": 0.0}, {"sew": -1.0}, {"bodies": "pin"}, {"faces": []}]
)
def test_options_out_of_range_are_refused(options, tmp_path):
    with pytest.raises(errors.InvalidParameter, match=next(iter(options))):
        load(tmp_path, shapes.box(), **options)


def test_options_of_cad_are_refused_for_meshes(tmp_path):
    path = tmp_path / "part.stl"
    load(tmp_path, shapes.box()).to_file(path)
    with pytest.raises(errors.InvalidParameter, match="belongs to CAD files"):
        Shell.from_file(path, "m", chord_error=1e-4)


def put_before_the_library(folder, monkeypatch, text):
    """Let processes started from now on find a package of this text in place of OpenCASCADE."""
    (folder / "first" / "OCP").mkdir(parents=True)
    (folder / "first" / "OCP" / "__init__.py").write_text(text)
    monkeypatch.setattr(sys, "path", [str(folder / "first"), *sys.path])


def test_without_the_library_the_extra_is_named(tmp_path, monkeypatch):
    path = shapes.write_brep(tmp_path / "box.brep", shapes.box())
    put_before_the_library(tmp_path, monkeypatch, "")
    with pytest.raises(
        errors.MissingExtra, match=r"reading .brep files needs .*sphshell-pin\[cad\]"
    ):
        Shell.from_file(path, "mm")


@pytest.mark.parametrize(
    ("reason", "told"),
    [
        (
            "libGL.so.1: cannot open shared object file: No such file or directory",
            r"it needs the library libGL\.so\.1, which is absent; .* install libgl1 libx11-6$",
        ),
        ("version 'GLIBC_2.99' not found", r"\(version 'GLIBC_2\.99' not found\)"),
    ],
)
def test_a_library_of_the_system_that_is_absent_is_named(reason, told, tmp_path, monkeypatch):
    path = shapes.write_brep(tmp_path / "box.brep", shapes.box())
    put_before_the_library(tmp_path, monkeypatch, f"raise ImportError({reason!r})")
    with pytest.raises(
        errors.UnusableExtra, match="installed but cannot be loaded: .*" + told
    ) as caught:
        Shell.from_file(path, "mm")
    assert caught.value.reason == reason


def test_the_library_is_never_imported(tmp_path):
    """So does reading a CAD file: another process imports it."""
    path = shapes.write_brep(tmp_path / "box.brep", shapes.box())
    code = f"""
import sys, sphshell_pin
print(len(sphshell_pin.Shell.from_file({str(path)!r}, "mm").face_names))
print(any(m.split(".")[0] == "OCP" for m in sys.modules))
"""
    done = python(code, check=True)
    assert done.stdout.split() == ["6", "False"]
    assert done.stderr == ""


def test_a_scenario_takes_a_body_of_a_cad_file_without_a_unit(tmp_path):
    from sphshell_pin.scenario import build
    from tests.scenario.files import DROP, write

    shapes.write_step(tmp_path / "two.step", ("plate", shapes.box()), ("pin", shapes.cylinder()))
    file = 'file = "two.step"\nchord_error = 1e-5\nbodies = ["pin"]'
    text = DROP.replace('primitive = { type = "box", size = [0.2, 0.2, 0.02] }', file)
    (pair,) = build(write(tmp_path, text)).scene.pairs
    assert pair.side_j.shell.box[0, 0] == pytest.approx(0.095, abs=1e-5)
    assert pair.side_j.shell.is_closed
    with pytest.raises(Exception, match="no body 'nut'"):
        build(write(tmp_path, text.replace('"pin"', '"nut"')))
